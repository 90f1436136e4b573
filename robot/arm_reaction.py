"""What the guard does with the arm: stop it, see it stand, retreat, and latch. Pure: states and time in, commands out.

    ARMED --stop--> STOPPING --standing--> RETREATING --made, or over--> HALTING --standing--> LATCHED
                        |                                                                       ^
                        +-- standing, and no retreat is wanted or possible ---------------------+

A stop counts when measured joint speed says so. Nothing but a person's reset leaves LATCHED.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import Enum
from typing import Any, Protocol

from .commands import ArmState, ContactOnLink, Done, Reaction
from .journal import GuardEvent
from .owner_messages import Clear, Halt, Speed, Stop
from .reaction import react
from .retreat import RetreatPlan, retreat_step
from .state_reader import ControllerState
from .stop_watch import StopWatch, Way
from .ur_models import ArmModel
from .watch import Watch

__all__ = ["ArmReaction", "Command", "Output", "Outputs", "Phase"]

Command = Stop | Speed | Halt | Clear | Way
Output = Command | GuardEvent


class Outputs(Protocol):
    """Takes what comes out, in order: a list, or something that sends a command as soon as it is there."""

    def append(self, output: Output, /) -> None:
        """Take one."""


_STREAM_EVERY = 0.004  # s between two targets of a retreat: every second controller cycle, so that none queues
_SLACK = 4.0  # of the patience: what a stop may take besides v / a before every way is used


class Phase(Enum):
    """Where the guard is."""

    STARTING = "starting"
    ARMED = "armed"
    STOPPING = "stopping"
    RETREATING = "retreating"
    HALTING = "halting"
    LATCHED = "latched"


class ArmReaction:
    """One arm under guard.

    Args:
        model: the arm.
        reaction: what it does when it is touched.
        watch: the limits.
        ways: the ways to stop that there are; the first is used for every stop, the others where it does not work.

    Attributes:
        phase: where it is.
        state: newest measured state, or None before the first.
        owner_ready: whether ur_rtde is ready.
    """

    def __init__(self, model: ArmModel, reaction: Reaction, watch: Watch, ways: tuple[Way, ...]) -> None:
        self.phase = Phase.STARTING
        self.state: ControllerState | None = None
        self.owner_ready = False
        self._model = model
        self._reaction = reaction
        self._watch = watch
        self._ways = ways
        self._stop: StopWatch | None = None
        self._touch_state: ArmState | None = None
        self._touch_contacts: Sequence[ContactOnLink] = ()
        self._may_retreat = False
        self._plan: RetreatPlan | None = None
        self._sent = -math.inf
        self._why = ""

    def arm(self, out: Outputs) -> None:
        """Let the program move the arm, and react from now on."""
        self.phase = Phase.ARMED
        out.append(Clear())

    def reset(self) -> None:
        """Leave LATCHED, because a person says so."""
        self.phase = Phase.STARTING

    def react(self, now: float, why: str, fault: bool, out: Outputs) -> None:
        """Stop; a retreat follows a touch, not a fault.

        Does nothing where the arm is already stopped or stopping, save that a fault takes the retreat away.
        """
        if self.phase is Phase.ARMED:
            self._begin(now, Phase.STOPPING, Stop(self._reaction.deceleration), out)
            self._why, self._may_retreat = why, not fault
            self._touch_contacts, self._touch_state = (), _measured(self.state)
            _tell(out, "stopping", now, why=why)
        elif self.phase is Phase.RETREATING:
            self._begin(now, Phase.HALTING, Halt(self._reaction.deceleration), out)
            self._why = why
            _tell(out, "stopping", now, why=why)
        elif self.phase is Phase.STOPPING and fault:
            self._why, self._may_retreat = why, False

    def locate(self, contacts: Sequence[ContactOnLink]) -> None:
        """Say where the touches are, while the arm stops."""
        if self.phase is Phase.STOPPING:
            self._touch_contacts = contacts

    def hurry(self, now: float) -> None:
        """The way that is in use is known to be broken: take the next one at once."""
        if self._stop is not None:
            self._stop.hurry(now)

    def sample(self, state: ControllerState, out: Outputs) -> None:
        """Take a measured state."""
        self.state = state
        if self._stop is not None:
            self._follow(self._stop, state, out)
        elif self.phase is Phase.RETREATING:
            self._retreat(state, out)

    def look(self, now: float, out: Outputs) -> None:
        """What only the passing of time shows."""
        if self._stop is None:
            return
        for way in self._stop.next_ways(now):
            out.append(way)
            _tell(out, "escalated", now, way=way.value)

    def silent(self, now: float) -> bool:
        """Whether the controller's newest state is too old."""
        return self.state is None or now - self.state.time > self._watch.arm_silence

    def unsound(self, now: float) -> list[str]:
        """Why the arm must not be armed, one line each."""
        wrong = []
        if Way.OWNER in self._ways and not self.owner_ready:
            wrong.append("ur_rtde is not ready")
        state = self.state
        if state is None or self.silent(now):
            return [*wrong, "the controller is silent"]
        if state.stopped_by_safety:
            wrong.append("the controller's own safety system holds the arm: see its screen")
        if not state.running:
            wrong.append("the arm is not powered, or its brakes are not released")
        for number, (q, low, high) in enumerate(
            zip(state.q, self._model.joint_lower, self._model.joint_upper, strict=True), 1
        ):
            if not low <= q <= high:
                wrong.append(f"joint {number} must be within {low:.3f} to {high:.3f} rad, it is at {q:.3f} rad")
        return wrong

    def _begin(self, now: float, phase: Phase, command: Stop | Halt, out: Outputs) -> None:
        first = self._ways[0]
        out.append(command if first is Way.OWNER else first)
        state, watch = self.state, self._watch
        speed = None if state is None or self.silent(now) else state.speed
        budget = (speed or 0.0) / self._reaction.deceleration + _SLACK * watch.escalate
        self._stop = StopWatch(now, speed, self._ways, watch.escalate, budget, watch.standstill)
        self.phase = phase

    def _follow(self, stop: StopWatch, state: ControllerState, out: Outputs) -> None:
        before = stop.slowed_at
        stop.sample(state.time, state.speed)
        if before is None and stop.slowed_at is not None:
            _tell(out, "slower", state.time, speed=state.speed)
        if stop.standing_at is None:
            return
        _tell(out, "standstill", state.time, speed=state.speed, ways=[way.value for way in stop.used])
        self._stop = None
        if self.phase is Phase.HALTING or not (self._may_retreat and self._touch_contacts):
            self._latch(state.time, self._why, out)
        elif not stop.by_owner_alone:
            self._latch(state.time, f"{self._why}; no retreat: ur_rtde did not stop the arm", out)
        else:
            self._begin_retreat(state, out)

    def _begin_retreat(self, state: ControllerState, out: Outputs) -> None:
        at_touch = self._touch_state or _measured(state)
        assert at_touch is not None
        decision = react(self._model, at_touch, self._touch_contacts, self._reaction)
        assert decision is not None  # there are contacts
        stop, self._plan = decision
        if self._plan is None:
            self._latch(state.time, stop.reason, out)
            return
        self._sent, self.phase = -math.inf, Phase.RETREATING
        _tell(out, "retreating", state.time)
        self._retreat(state, out)

    def _retreat(self, state: ControllerState, out: Outputs) -> None:
        assert self._plan is not None
        step = retreat_step(self._plan, ArmState(state.time, state.q, state.qd))
        if isinstance(step, Done):
            self._why += f"; retreat {1e3 * step.progress:.1f} mm: {step.reason}"
            self._begin(state.time, Phase.HALTING, Halt(self._reaction.deceleration), out)
            _tell(out, "retreated", state.time, progress=step.progress, complete=step.complete, why=step.reason)
        elif state.time - self._sent >= _STREAM_EVERY - 1e-9:
            out.append(Speed(step.qd, step.acceleration))
            if step.clipped_by and self._sent == -math.inf:
                _tell(out, "clipped", state.time, by=list(step.clipped_by))
            self._sent = state.time

    def _latch(self, now: float, why: str, out: Outputs) -> None:
        self.phase, self._plan, self._touch_contacts = Phase.LATCHED, None, ()
        _tell(out, "latched", now, why=why)


def _measured(state: ControllerState | None) -> ArmState | None:
    return None if state is None else ArmState(state.time, state.q, state.qd)


def _tell(out: Outputs, name: str, time: float, **details: Any) -> None:
    out.append(GuardEvent(name, time, details))
