"""World of the processes: program, guard, driver process or two guard watchdogs, and the controller.

A model of its own that shares no code with them, only their limits. Each process may crash, freeze and go on, each beat
may be lost, the network may be cut, the skin may be touched. What each does about it is written down here as the pages
have it (docs/safety.md, P39 to P54). So this shows that the limits fit together, and that no silence is left alone.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

from coneskin.robot.driver.liveness import GUARD_SILENCE, HOLD_UP_LIMIT, SETPOINT_SILENCE, UNGUARDED_TIME
from coneskin.robot.stop.limits import MonitoringLimits

_TICK = 0.05  # s; no limit is finer
_MOST_LOST = 2  # beats of one line in a row that may be lost while nobody needs to stop
_STOP_TICKS = 1  # in which an arm that was told to has stopped


_LONGEST = 30  # ticks; longer than every limit


@cache
def _ticks(seconds: float) -> int:
    return _LONGEST if seconds == math.inf else math.ceil(seconds / _TICK - 1e-9)


def _aged(age: int, limit: int, moves: bool) -> int:
    """Return the next age: no larger than it matters, and only whether it is too large where nothing moves."""
    return min(age + 1, limit + 1) if moves else limit + 1


@dataclass(frozen=True)
class Parts:
    """What there is to miss each other; one taken away shows what it is for.

    Attributes:
        program_silence: for which a program may be suspended [s]; infinite where nobody looks.
        process_silence: of the helper [s]; infinite where nobody listens.
        hold_up: the same, where this computer lets it wait for a processor [s].
        guard_silence: of the guard, as its helper hears it [s].
        second_silence: the same, as the second watchdog hears it, with external control [s].
        setpoint: after its decision, for which one that was held up moves the arm [s].
        forbids: the driver process takes none after it has stopped the arm for the guard's silence.
        watchdog: after which the controller ends a program that hears nothing [s]: with internal control that of the
            driver process, with external control one with the lines of ``coneskin heartbeat``.
        watchdog_period: 1 / ``watchdog_hz`` of the scene, which that is meant to be [s].
    """

    program_silence: float = MonitoringLimits().program_silence
    process_silence: float = MonitoringLimits().process_silence
    guard_silence: float = GUARD_SILENCE
    hold_up: float = HOLD_UP_LIMIT
    second_silence: float = UNGUARDED_TIME
    setpoint: float = SETPOINT_SILENCE
    forbids: bool = True
    watchdog: float = 0.25
    watchdog_period: float = 0.25


#: what the parts are where the controller waits for as long as a scene may let it
PATIENT_CONTROLLER = {"watchdog": 1.0, "watchdog_period": 1.0}
#: what they are where no program on the controller heeds a heartbeat, as with external control none has to
HEEDLESS_PROGRAM = {"watchdog": math.inf}
#: name -> what has to hold
PROCESS_INVARIANTS = {
    "touched": "A touch under a guard that lives stops the arm in the same tick.",
    "unguarded": "An arm without a guard that lives moves no longer than the first who misses it needs.",
    "frozen": "An arm whose program, driver process or watchdog is gone moves no longer than its limit.",
    "held up": "A helper that waits for a processor for a short while stops nothing.",
    "cut": "An arm behind a cut network moves no longer than the controller's watchdog, where its program heeds that.",
    "patient": "Up to two beats in a row that are lost stop nothing.",
    "released": "An arm moves again only after a reset, while guard and helper live.",
    "back to active": "From every state a person who starts again what is gone gets back to active.",
}

_ALIVE, _FROZEN, _DEAD, _HELD_UP = "alive", "frozen", "dead", "held up"


class _State(NamedTuple):  # a tuple, since it is compared and hashed a million times
    """All of it. Ages are in ticks since the last beat was heard; what is not listened to has the age 0."""

    program: str = _ALIVE
    guard: str = _ALIVE
    helper: str = _ALIVE
    second: str = _ALIVE  # of the watchdogs; with internal control it is not there, and nothing happens to it
    cut: bool = False
    moves: bool = True
    latched: bool = False
    touched: bool = False
    program_age: int = 0  # as the guard hears it
    helper_age: int = 0  # of the helper, or of the second watchdog, whichever it has not heard for longest
    guard_age: int = 0  # as the helper hears it
    second_age: int = 0  # as the second watchdog hears the guard
    kick_age: int = 0  # as the controller hears the driver process, or the guard's count
    holder: str = ""  # who was frozen or held up with a setpoint that it had not sent, or not read
    decided: int = 0  # ticks since the decision on that one
    wrong_for: int = 0  # ticks that the arm has moved since the newest thing went wrong
    lost: int = 0  # beats in a row that were lost


_FIRST = _State()


class ProcessWorld:
    """The world.

    Args:
        control: "internal" or "external".
        parts: who listens to whom, and for how long.
        most_wrong: processes or lines at once, beside lost beats.
        without: first words of actions that do not happen.
    """

    def __init__(
        self,
        control: str,
        parts: Parts = Parts(),
        most_wrong: int = 2,
        without: tuple[str, ...] = (),
        state: _State = _FIRST,
    ) -> None:
        self.control, self.parts, self.state = control, parts, state
        self.most_wrong, self.without = most_wrong, without

    def save(self) -> _State:
        return self.state

    def restore(self, saved: _State) -> None:
        self.state = saved

    def key(self) -> Hashable:
        return self.state

    @property
    def wanted(self) -> bool:
        state = self.state
        return state.moves and not state.latched and not self._wrong()

    def helps(self, action: str) -> bool:
        return action in ("tick", "reset", "free", "mend the network") or action.startswith(("thaw", "restart"))

    @property
    def _names(self) -> tuple[str, ...]:
        return (
            ("program", "guard", "helper") if self.control == "internal" else ("program", "guard", "helper", "second")
        )

    def _wrong(self) -> int:
        state = self.state
        return sum(one != _ALIVE for one in (state.program, state.guard, state.helper, state.second)) + state.cut

    def actions(self) -> Sequence[str]:
        state, found = self.state, ["tick"]
        more = self._wrong() < self.most_wrong
        for name in self._names:
            how = getattr(state, name)
            found += [f"thaw {name}"] if how in (_FROZEN, _HELD_UP) else []
            found += [f"freeze {name}", f"kill {name}"] if how == _ALIVE and more else []
        found += ["hold helper"] if state.helper == _ALIVE and more else []
        found += ["restart"] if _DEAD in (state.program, state.guard, state.helper, state.second) else []
        found += ["mend the network"] if state.cut else ["cut the network"] if more else []
        found += ["free"] if state.touched else ["touch"]
        found += ["reset"] if state.latched else []
        found += ["lose a beat"] if state.lost < _MOST_LOST and state.moves and not self._wrong() else []
        return [action for action in found if not action.startswith(self.without)]

    def act(self, action: str) -> list[str]:
        before, broken = self.state, list[str]()
        match action.split():
            case ["freeze" | "hold" as how, name]:
                away = self.control == "internal" and before.moves and not before.latched
                holds = away and name in ("guard", "helper") and before.guard == before.helper == _ALIVE
                setpoint = {"holder": name, "decided": 0} if holds else {}
                self.state = before._replace(
                    **{name: _FROZEN if how == "freeze" else _HELD_UP}, **setpoint, wrong_for=0
                )
            case ["kill", name]:
                self.state = before._replace(**{name: _DEAD}, wrong_for=0)
            case ["thaw", name]:
                self.state = before._replace(**{name: _ALIVE}, wrong_for=0)
                broken = self._hand_on() if name == before.holder else []
            case ["restart"]:  # the program ends, its processes with it, and a new one begins with a guard that waits
                self.state = _State(moves=False, latched=True, cut=before.cut, touched=before.touched)
            case ["cut", *_] | ["mend", *_]:
                self.state = before._replace(cut=not before.cut, wrong_for=0)
            case ["touch"] | ["free"]:
                self.state = before._replace(touched=action == "touch")
            case ["reset"]:
                self._reset()
            case ["tick"] | ["lose", *_]:
                broken = self._tick(lost=action != "tick")
        return broken

    def _hand_on(self) -> list[str]:
        """Let who holds a setpoint go on: the guard sends it, the helper follows it, one that ended does nothing."""
        state = self.state
        if state.holder == "guard" and state.helper in (_FROZEN, _HELD_UP):
            self.state = state._replace(holder="helper")
            return []
        heard = state.program != _DEAD and state.helper == _ALIVE and not state.cut
        heard &= state.kick_age <= _ticks(self.parts.watchdog)  # else the controller has ended the program that follows
        follows = heard and state.decided <= _ticks(self.parts.setpoint)
        self.state = state._replace(holder="", decided=0, moves=state.moves or follows)
        return ["released: a setpoint that was held up moves the arm"] if follows and not state.moves else []

    def _reset(self) -> None:
        """Forgive a stop: the guard lives, nothing stands against it, and the helper acknowledges."""
        state = self.state
        parts, heard = self.parts, not state.cut
        fine = state.program_age <= _ticks(parts.program_silence) and state.helper_age <= _ticks(parts.process_silence)
        lives = state.program == state.guard == state.helper == state.second == _ALIVE
        if lives and fine and heard and not state.touched:
            self.state = state._replace(latched=False, moves=True, wrong_for=0, kick_age=0)  # its program starts again

    def _tick(self, lost: bool) -> list[str]:
        """Let a tick pass: beats, what each notices, and what comes of it."""
        state, parts, internal = self.state, self.parts, self.control == "internal"
        guard, helper, second = state.guard == _ALIVE, state.helper == _ALIVE, state.second == _ALIVE
        # whoever waits for a processor is runnable, which the guard sees
        waits = state.helper == _HELD_UP and (internal or second)
        process_silence = max(parts.process_silence, parts.hold_up) if waits else parts.process_silence
        hears = {
            "program_age": (state.program != _FROZEN and guard, parts.program_silence),  # looked at: no beat is lost
            "helper_age": (
                helper and (internal or second) and guard and not lost,
                max(parts.process_silence, parts.hold_up),
            ),
            "guard_age": (guard and helper and not lost, parts.guard_silence),
            "second_age": ((guard and second and not lost) or internal, parts.second_silence),
            "kick_age": ((helper if internal else guard) and not state.cut, parts.watchdog),
        }
        age = {
            name: 0 if hears_it else _aged(getattr(state, name), _ticks(limit), state.moves)
            for name, (hears_it, limit) in hears.items()
        }
        # one that was frozen reads what has waited before it judges: its own time was nobody's silence
        stop = latch = False
        reaches = not state.cut
        if guard:
            silent = age["program_age"] > _ticks(parts.program_silence)
            silent |= age["helper_age"] > _ticks(process_silence)
            gone = _DEAD in (state.program, state.helper, state.second)  # their channels have ended
            states_silent = state.cut
            if state.touched or silent or gone or states_silent:
                stop, latch = reaches, True
        forbidden = helper and age["guard_age"] > _ticks(parts.guard_silence)
        if helper:
            if forbidden or (state.guard == _DEAD and parts.guard_silence < math.inf):
                stop = stop or reaches
            stop |= reaches and internal and state.program == _DEAD
        if second and not internal:
            ended = state.guard == _DEAD and parts.second_silence < math.inf
            stop |= reaches and (ended or age["second_age"] > _ticks(parts.second_silence))
        if age["kick_age"] > _ticks(parts.watchdog):
            stop = True
        moves = state.moves and not stop
        # internal: a driver process that is gone can start nothing, but what runs goes on until the watchdog ends it
        wrong = self._wrong() > 0
        wrong_for = min(_LONGEST, state.wrong_for + 1) if wrong and moves else 0
        self.state = state._replace(
            **age,  # type: ignore[arg-type]
            moves=moves,
            latched=state.latched or latch or (state.moves and not moves),
            wrong_for=wrong_for,
            lost=state.lost + 1 if lost and moves else 0,
            decided=_aged(state.decided, _ticks(parts.setpoint), True) if state.holder else 0,
            # what the helper has not read is overtaken by the guard's stop, and after one for the guard's silence it
            # takes none
            holder="" if (latch and state.holder == "helper") or (parts.forbids and forbidden) else state.holder,
        )
        return self._judge(state, lost)

    @property
    def _heeds(self) -> bool:
        """True where the program on the controller is meant to end by itself."""
        return self.control == "internal" or self.parts.watchdog < math.inf

    def _judge(self, before: _State, lost: bool) -> list[str]:
        state, internal, broken = self.state, self.control == "internal", []
        alive = {name for name in self._names if getattr(state, name) == _ALIVE}
        if state.moves and state.touched and "guard" in alive and not state.cut:
            broken.append("touched: it moves on")
        if state.moves and before.latched and not before.moves:
            broken.append("released: it moves without a reset")
        longest = state.wrong_for
        period = self.parts.watchdog_period
        if state.cut and self._heeds and longest > _ticks(period) + _STOP_TICKS:
            broken.append(f"cut: it moves for {longest * _TICK:.2f} s")
        elif state.cut:
            pass  # nothing reaches the controller, and its program does not heed that: said in docs/safety.md
        elif "guard" not in alive:
            limits = [0.5] if "helper" in alive else []
            limits += [1.0] if "second" in alive and not internal else []
            if self.parts.watchdog < math.inf and (not internal or "helper" not in alive):
                limits.append(period)  # the controller's own
            if limits and longest > _ticks(min(limits)) + _STOP_TICKS:
                broken.append(f"unguarded: it moves for {longest * _TICK:.2f} s with {sorted(alive)} alive")
        elif state.helper == _HELD_UP and alive == {*self._names} - {"helper"}:
            if longest > _ticks(0.5) + _STOP_TICKS:
                broken.append(f"frozen: it moves for {longest * _TICK:.2f} s beside a helper that is held up")
        elif alive != {*self._names} and longest > _ticks(0.2) + _STOP_TICKS:
            broken.append(f"frozen: it moves for {longest * _TICK:.2f} s with {sorted(alive)} alive")
        early = state.helper == _HELD_UP and self._wrong() == 1 and state.helper_age <= _ticks(0.5)
        early &= not (before.latched or state.touched) and state.program_age == state.second_age == 0
        early &= not internal or self.parts.watchdog > 0.5  # else the controller ends the program first
        if before.moves and not state.moves and early:
            broken.append("held up: it is stopped although its helper only waits for a processor")
        if before.moves and not state.moves and not (self._wrong() or state.touched or _were_wrong(before)):
            broken.append("patient: it is stopped although nothing is wrong")
        return broken


def _were_wrong(state: _State) -> bool:
    """Tell whether an age tells of something that was wrong a moment ago."""
    return max(state.program_age, state.helper_age, state.guard_age, state.second_age, state.kick_age) > _MOST_LOST
