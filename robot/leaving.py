"""A movement away from a touch, under way: in every second control cycle a new target goes out. Pure.

To the owner of ur_rtde; or, for an arm that another program moves, to a program of ours in the controller.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from .commands import ArmState, ContactOnLink, Done, JointVelocity
from .follower import FollowerProgram, Steer
from .movement import Movement
from .outputs import Outputs, tell
from .owner_messages import Speed
from .state_reader import ControllerState
from .ur_models import Joints

__all__ = ["Leaving"]

_STREAM_EVERY = 0.004  # s between two targets of a retreat: every second controller cycle, so that none queues
_STARTING = 0.5  # s after which a program that does not run will not start any more
_OTHER = 0.1  # rad/s by which a joint's speed may differ from what it is told, or a part of that
_ASTRAY = 0.25  # s for which it may differ by more, besides the time in which the arm takes up its speed


class Leaving:
    """See the module.

    Args:
        movement: what to do.
        now: host time [s].
        program: that follows; None where the owner does.
        out: takes what comes of it.
    """

    def __init__(self, movement: Movement, now: float, program: FollowerProgram | None, out: Outputs) -> None:
        self._movement = movement
        self._program = program
        self._began = now
        self._sent = -math.inf
        self._told: JointVelocity | None = None
        self._as_told = now
        tell(out, "retreating", now, **({"how": movement.how} if movement.how else {}))

    def step(self, state: ControllerState, contacts: Sequence[ContactOnLink], out: Outputs) -> Done | None:
        """Go on; Done where it is over.

        Args:
            state: as measured.
            contacts: the touches there are now.
            out: takes what comes of it.
        """
        step = self._movement.step(ArmState(state.time, state.q, state.qd), contacts)
        if isinstance(step, Done):
            return step
        program, first = self._program, self._sent == -math.inf
        astray = self._astray(state)
        if program is not None and not state.playing and (astray or state.time - self._began >= _STARTING):
            return Done("its program does not run on the controller", step.progress)
        if astray:
            return Done("the arm does not move as it is told: something else moves it", step.progress)
        if state.time - self._sent >= _STREAM_EVERY - 1e-9:
            if program is None:
                out.append(Speed(step.qd, step.acceleration))
            else:
                out.append(Steer(program.token, step.qd, step.acceleration))
                if first:
                    out.append(program)
            if step.clipped_by and first:
                tell(out, "clipped", state.time, by=list(step.clipped_by))
            self._sent, self._told = state.time, step
        return None

    def _astray(self, state: ControllerState) -> bool:
        """Whether the arm moves in another way than it is told; slower is none, as the speed slider makes it."""
        told = self._told
        if told is None or _difference(state.qd, told.qd) <= _OTHER:
            self._as_told = state.time
            return False
        return state.time - self._as_told > _ASTRAY + max(map(abs, told.qd)) / told.acceleration


def _difference(qd: Joints, told: Joints) -> float:
    """Largest difference of a joint's speed from the part of what it is told that fits best [rad/s]."""
    square = sum(b * b for b in told)
    part = min(1.0, max(0.0, sum(a * b for a, b in zip(qd, told, strict=True)) / square)) if square else 0.0
    return max(abs(a - part * b) for a, b in zip(qd, told, strict=True))
