"""Phases of a guard, and the supervision of its arm as one value with one table of transitions. Pure.

Everything that is decided about an arm under guard is in a ``Supervision``: which phase it is in, for which stop, and
whether a motion of ours may follow. Sensors of the arm (``StopMonitor``, ``StandstillWatch``, ``StateAge``) only say
what they measure. A stop counts when measured joint speed says so, and is not given up before. An arm that other
programs may move is latched only at the end of a watch in which none did. Only a manual reset leaves LATCHED for good.

docs/images/guard-phases.svg is drawn from ``TRANSITIONS`` (scripts/draw_guard_phases.py).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final


class Phase(Enum):
    """Phase of a guard."""

    STARTING = "starting"
    ACTIVE = "active"
    SLOWED = "slowed"
    STOPPING = "stopping"  #: it brakes
    PLACING = "placing"  #: it stands, and waits for the place of a touch
    RETREATING = "retreating"
    HALTING = "halting"  #: it brakes after a motion away
    STANDING = "standing"  #: it stands, and is watched until it may be called latched
    LATCHED = "latched"

    watched: bool  #: a fault has to stop the arm now
    brakes: bool  #: a stop is under way, and the arm is not measured standing yet
    stands: bool  #: the arm has to stand where it is, and is stopped again where it does not
    stopping: bool  #: a stop is under way: from its cause until the arm is latched, or moves away


for _phase in Phase:  # kept, because each look at a member takes Python 3.11 0.2 us, and every input asks for these
    _phase.watched = _phase in (Phase.ACTIVE, Phase.SLOWED, Phase.RETREATING)
    _phase.brakes = _phase in (Phase.STOPPING, Phase.HALTING)
    _phase.stands = _phase in (Phase.LATCHED, Phase.STANDING, Phase.PLACING)
    _phase.stopping = _phase.brakes or _phase in (Phase.STANDING, Phase.PLACING)


class Cue(Enum):
    """What makes a supervision change."""

    ACTIVATED = "reset, and released"
    SLOWED = "touch: slow"
    FREED = "nothing touches"
    TOUCHED = "touch"
    FAULTED = "fault"
    WAITS = "stands, place uncertain"
    MOVES_AWAY = "may move away"
    STAYS = "stands"
    OVER = "made, or resisted"
    ABANDONED = "not supervised"
    LATCHES = "stood for long enough"
    MOVED = "moved, or silent"


class Act(Enum):
    """What follows from a transition, beside the new phase."""

    NONE = "none"
    ACTIVATE = "activate"
    STOP = "stop"  #: whatever moves the arm
    HALT = "halt"  #: the motion of ours
    LATCH = "latch"


_P, _C = Phase, Cue
#: phase and cue -> next phase, and what follows. Where there is no row, the cue changes nothing.
TRANSITIONS: Final[Mapping[tuple[Phase, Cue], tuple[Phase, Act]]] = {
    (_P.STARTING, _C.ACTIVATED): (_P.ACTIVE, Act.ACTIVATE),
    (_P.ACTIVE, _C.SLOWED): (_P.SLOWED, Act.NONE),
    (_P.ACTIVE, _C.TOUCHED): (_P.STOPPING, Act.STOP),
    (_P.ACTIVE, _C.FAULTED): (_P.STOPPING, Act.STOP),
    (_P.SLOWED, _C.FREED): (_P.ACTIVE, Act.NONE),
    (_P.SLOWED, _C.TOUCHED): (_P.STOPPING, Act.STOP),
    (_P.SLOWED, _C.FAULTED): (_P.STOPPING, Act.STOP),
    (_P.STOPPING, _C.WAITS): (_P.PLACING, Act.NONE),
    (_P.STOPPING, _C.MOVES_AWAY): (_P.RETREATING, Act.NONE),
    (_P.STOPPING, _C.STAYS): (_P.STANDING, Act.NONE),
    (_P.STOPPING, _C.FAULTED): (_P.STOPPING, Act.NONE),
    (_P.PLACING, _C.MOVES_AWAY): (_P.RETREATING, Act.NONE),
    (_P.PLACING, _C.STAYS): (_P.STANDING, Act.NONE),
    (_P.PLACING, _C.MOVED): (_P.STOPPING, Act.STOP),
    (_P.PLACING, _C.FAULTED): (_P.PLACING, Act.NONE),
    (_P.RETREATING, _C.OVER): (_P.HALTING, Act.HALT),
    (_P.RETREATING, _C.ABANDONED): (_P.HALTING, Act.HALT),
    (_P.RETREATING, _C.TOUCHED): (_P.HALTING, Act.HALT),
    (_P.RETREATING, _C.FAULTED): (_P.HALTING, Act.HALT),
    (_P.HALTING, _C.STAYS): (_P.STANDING, Act.NONE),
    (_P.HALTING, _C.FAULTED): (_P.HALTING, Act.NONE),
    (_P.STANDING, _C.LATCHES): (_P.LATCHED, Act.LATCH),
    (_P.STANDING, _C.MOVED): (_P.STOPPING, Act.STOP),
    (_P.STANDING, _C.FAULTED): (_P.STANDING, Act.NONE),
    (_P.LATCHED, _C.MOVED): (_P.STOPPING, Act.STOP),
    (_P.LATCHED, _C.ACTIVATED): (_P.ACTIVE, Act.ACTIVATE),
}


@dataclass(frozen=True, slots=True)
class Supervision:
    """All that is decided about an arm under guard."""

    phase: Phase = Phase.STARTING
    stop: int = 0  #: number of the newest stop, counted from 1. A motion away and its end belong to the stop before.
    why: str = ""  #: cause of that stop, and what came of it
    may_move: bool = False  #: what stopped the arm lets it move away
    barred: str = ""  #: why nothing of ours moves the arm before the next stop. Empty where something may.
    decide_by: float = 0.0  #: host time until which an arm that stands waits for the place of a touch [s]
    ending: bool = False  #: the guard ends

    def again(self, what: str) -> str:
        """Return why an arm is stopped, once there is another reason: the first, which is the cause, and the newest."""
        return f"{self.why.partition('; then ')[0]}; then {what}"


def transition(state: Supervision, cue: Cue, what: str = "", decide_by: float = 0.0) -> tuple[Supervision, Act]:
    """Return what a supervision becomes, and what follows. The same one where the cue changes nothing.

    Args:
        cue: what has happened.
        what: cause of a stop, or what came of it, in words.
        decide_by: of ``WAITS`` [s].
    """
    row = TRANSITIONS.get((state.phase, cue))
    if row is None:
        return state, Act.NONE
    phase, act = row
    if act is Act.STOP:
        why = state.again(what) if cue is Cue.MOVED else what
        may_move = cue is Cue.TOUCHED
        return Supervision(phase, state.stop + 1, why, may_move, ending=state.ending), act
    may_move = state.may_move and cue is not Cue.FAULTED and act is not Act.HALT  # one motion away for each stop
    why = state.why
    if cue is Cue.FAULTED or cue is Cue.TOUCHED:
        why = what if act is Act.HALT else state.again(what)
    elif what:
        why = f"{why}; {what}"
    return replace(state, phase=phase, why=why, may_move=may_move, decide_by=decide_by), act
