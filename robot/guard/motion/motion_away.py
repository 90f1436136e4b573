"""Motion away from a touch, as the supervisor of the arm sees it: whether there is to be one, and the one under way.

Pure. Without a planner no reaction of the scene moves the arm, and nothing that plans is loaded.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from coneskin.robot.driver.values import ControllerState
from coneskin.robot.guard.signals.contact import TouchRecord
from coneskin.robot.guard.signals.journal import Outputs
from coneskin.robot.reaction.types import ArmState, ContactOnLink, Done, Reaction

if TYPE_CHECKING:  # a reaction that only stops loads it not
    from .setpoint_stream import MotionStream, ReactionPlanner


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
    """

    def __init__(self, planner: ReactionPlanner | None) -> None:
        self._planner = planner
        self._stream: MotionStream | None = None
        self._at_touch: ArmState | None = None

    @property
    def yields(self) -> bool:
        """True while it gives way to a push: touches are what that follows."""
        return self._stream is not None and self._stream.how == "push"

    @property
    def progress(self) -> float:
        """How far it has got [m]."""
        return 0.0 if self._stream is None else self._stream.progress

    def feed(self, state: ControllerState, untouched: bool) -> None:
        """Take a measured state. ``untouched`` while nothing touches and the arm is free."""
        if self._planner is not None:
            self._planner.torque.feed(state, untouched)

    def prepare(self, state: ControllerState | None) -> None:
        """Begin with a new stop, from the state in which its cause was seen."""
        self._at_touch = None if state is None else ArmState(state.time, state.q, state.qd)

    def decide(
        self,
        state: ControllerState,
        reaction: Reaction,
        permitted: bool,
        bar: str,
        decide_by: float,
        touches: TouchRecord,
        out: Outputs,
    ) -> _Decision:
        """Decide whether a standing arm moves away, and begin that. The place of a touch may need a while.

        Args:
            state: as measured.
            reaction: the one that is under way.
            permitted: what stopped the arm lets it move away.
            bar: why nothing of ours moves the arm. Empty where something may.
            decide_by: host time until which the place of a touch may become certain [s].
            touches: what it reacts to.
            out: takes commands and events.
        """
        wanted = permitted and bool(touches.placed)
        if wanted:
            reaction = touches.hardest()  # how firm it was shows by now
        wanted = wanted and reaction.kind not in ("stop", "slow")
        if wanted and not bar and not touches.all_placed and state.time < decide_by:
            return _Decision(reaction, waits=True)
        if not wanted:
            return _Decision(reaction)
        if bar:
            return _Decision(reaction, refusal=f"no retreat: {bar}")
        assert self._planner is not None
        here = ArmState(state.time, state.q, state.qd)
        stream = self._planner.begin(reaction, self._at_touch or here, here, touches.placed, out)
        if isinstance(stream, str):
            return _Decision(reaction, refusal=f"no retreat: {stream}")
        self._stream = stream
        return _Decision(reaction, begun=True)

    def update(self, state: ControllerState, contacts: Sequence[ContactOnLink], out: Outputs) -> Done | None:
        """Go on from a measured state, or return Done where the motion is over."""
        return None if self._stream is None else self._stream.update(state, contacts, out)

    def resisted(self, state: ControllerState, now: float, contacts: Sequence[ContactOnLink]) -> Done | None:
        """Return Done where the newest frames, of a host time [s], show that the motion must end."""
        return None if self._stream is None else self._stream.resisted(now, state.q, contacts)

    def end(self, out: Outputs) -> MotionStream | None:
        """Void the setpoints, after a stop has been sent. Return the motion that was under way."""
        stream, self._stream = self._stream, None
        if stream is not None:
            stream.end(out)
        return stream
