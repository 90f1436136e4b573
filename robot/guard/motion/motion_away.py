"""Motion away from a touch, as the supervisor of the arm sees it: whether there is to be one, and the one under way.

Pure. Without a planner no reaction of the scene moves the arm, and nothing that plans is loaded.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from coneskin.robot.driver.values import ControllerState
from coneskin.robot.guard.signals.contact import TouchRecord
from coneskin.robot.guard.signals.journal import Outputs
from coneskin.robot.reaction.types import ArmState, ContactOnLink, Done, Reaction

if TYPE_CHECKING:  # a reaction that only stops loads it not
    from .setpoint_stream import MotionStream, ReactionPlanner

__all__ = ["MotionAway"]

_PLACE_TIME = 0.3  # s that a standing arm waits for the place of a touch; at 12 bits it takes 10 to 60 frames


class _Decision(NamedTuple):
    """Decision about an arm that stands.

    Attributes:
        reaction: to all touches, each as firm as it has been.
        begun: a motion has begun.
        waits: not decided yet: the place of a touch may become certain.
        refusal: why there is none though one was wanted. Empty where none was.
    """

    reaction: Reaction
    begun: bool = False
    waits: bool = False
    refusal: str = ""


class MotionAway:
    """Motion away of one arm, from stop to stop.

    Args:
        planner: of motions away from a touch. None where no reaction moves the arm.
        internal_control: the driver process moves the arm.

    Attributes:
        permitted: what stopped the arm lets it move away.
    """

    def __init__(self, planner: ReactionPlanner | None, internal_control: bool) -> None:
        self.permitted = False
        self._planner = planner
        self._mover = "the driver" if internal_control else "a program"
        self._stream: MotionStream | None = None
        self._newest: MotionStream | None = None
        self._resisted: MotionStream | None = None  # that has ended because something was in its way
        self._at_touch: ArmState | None = None
        self._barred = ""  # why nothing of ours moves the arm any more
        self._decide_by = -math.inf  # host time until which a standing arm waits for the place of a touch

    @property
    def under_way(self) -> bool:
        """True while the arm moves away."""
        return self._stream is not None

    @property
    def yields(self) -> bool:
        """True while it gives way to a push: touches are what that follows."""
        return self._stream is not None and self._stream.how == "push"

    @property
    def undecided(self) -> bool:
        """True while a standing arm waits for the place of a touch."""
        return self._decide_by > -math.inf

    def feed(self, measured_at: float, state: ControllerState) -> None:
        """Take a measured state, and the host time of its measurement [s]."""
        if state.stopped_by_safety or not state.powered:
            self._barred = "the controller has stopped the arm itself"  # nothing of ours moves it then
        if self._planner is not None:
            self._planner.feed(measured_at, state.q)

    def bar(self, why: str) -> None:
        """Let no motion begin before the next stop."""
        self._barred = self._barred or why

    def prepare(self, state: ControllerState | None, permitted: bool) -> None:
        """Begin with a new stop, from the state in which its cause was seen."""
        self.permitted, self._barred = permitted, ""
        self._at_touch = None if state is None else ArmState(state.time, state.q, state.qd)

    def await_place(self, now: float) -> None:
        """Let the arm, which stands since this host time [s], wait for the place of a touch."""
        self._decide_by = now + _PLACE_TIME

    def abandoned(self, why: str) -> Done:
        """Return the end of the motion under way, before it was made."""
        return Done(why, 0.0 if self._stream is None else self._stream.progress)

    def decide(
        self,
        state: ControllerState,
        reaction: Reaction,
        stopping: bool,
        first_was_enough: bool,
        touches: TouchRecord,
        out: Outputs,
    ) -> _Decision:
        """Decide whether a standing arm moves away, and begin that. The place of a touch may need a while.

        Args:
            state: as measured.
            reaction: the one that is under way.
            stopping: a touch or a fault has stopped the arm. False where a motion away has ended.
            first_was_enough: the arm stands by the first stop path alone.
            touches: what it reacts to.
            out: takes commands and events.
        """
        resisted = self._resisted
        wanted = self.permitted and (resisted.answered if resisted else stopping) and bool(touches.placed)
        if wanted:
            hardest = touches.hardest()  # how firm it was shows by now
            if not resisted or hardest.kind == "stop":
                reaction = hardest
        wanted = wanted and reaction.kind not in ("stop", "slow")
        bar = self._barred or ("" if first_was_enough else f"{self._mover} did not stop the arm")
        if wanted and not bar and not touches.all_placed and state.time < self._decide_by:
            return _Decision(reaction, waits=True)
        self._resisted, self._decide_by = None, -math.inf
        if not wanted:
            return _Decision(reaction)
        if bar:
            return _Decision(reaction, refusal=f"no retreat: {bar}")
        refusal = self._begin(state, reaction, touches, resisted, out)
        return _Decision(reaction, begun=not refusal, refusal=refusal)

    def _begin(
        self,
        state: ControllerState,
        reaction: Reaction,
        touches: TouchRecord,
        resisted: MotionStream | None,
        out: Outputs,
    ) -> str:
        assert self._planner is not None
        here = ArmState(state.time, state.q, state.qd)
        if resisted:
            what, stream = "way back", self._planner.go_back(reaction, here, touches.contacts, resisted.began, out)
        else:
            at_touch = self._at_touch or here
            what, stream = "retreat", self._planner.begin(reaction, at_touch, here, touches.placed, out)
        if isinstance(stream, str):
            return f"no {what}: {stream}"
        self._stream = self._newest = stream
        return ""

    def update(self, state: ControllerState, contacts: Sequence[ContactOnLink], out: Outputs) -> Done | None:
        """Go on from a measured state, or return Done where the motion is over."""
        if self._stream is None or self._barred:
            return None  # the core ends a barred motion: it names the fault
        return self._stream.update(state, contacts, out)

    def resisted(self, state: ControllerState, now: float, contacts: Sequence[ContactOnLink]) -> Done | None:
        """Return Done where the newest frames, of a host time [s], show that the motion must end."""
        return None if self._stream is None else self._stream.resisted(now, state.q, contacts)

    def oppose(self) -> None:
        """Note that something is in the way of the motion: another may follow it."""
        self._resisted = self._stream

    def report(self, now: float, over: Done, out: Outputs) -> str:
        """Report the end of the newest motion at a host time [s], after its stop was sent, and return it in words."""
        assert self._newest is not None
        self._resisted = self._newest if over.resisted else None
        return self._newest.report(now, over, out)

    def end(self, out: Outputs) -> None:
        """Void the setpoints, after a stop has been sent."""
        if self._stream is not None:
            self._stream.end(out)
        self._stream = None
