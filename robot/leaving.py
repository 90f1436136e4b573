"""A movement away from a touch, under way: in every second control cycle a new target goes out. Pure.

To the owner of ur_rtde; or, for an arm that another program moves, to a program of ours in the controller.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from .commands import STILL, ArmState, ContactOnLink, Done
from .follower import FollowerProgram, Steer
from .movement import Movement
from .obedience import Obedience
from .outputs import Outputs, tell
from .owner_messages import Speed
from .state_reader import ControllerState

__all__ = ["Leaving"]

_STREAM_EVERY = 0.004  # s between two targets of a retreat: every second controller cycle, so that none queues
_STARTING = 0.5  # s after which a program that does not run will not start any more


class Leaving:
    """See the module.

    Args:
        movement: what to do.
        now: host time [s].
        program: that follows; None where the owner does.
        out: takes what comes of it.

    Attributes:
        how: as of the movement.
    """

    def __init__(self, movement: Movement, now: float, program: FollowerProgram | None, out: Outputs) -> None:
        self._movement = movement
        self.how = movement.how
        self._program = program
        self._began = now
        self._sent = -math.inf
        self._obedience = Obedience(now)
        tell(out, "retreating", now, **self.details)

    @property
    def details(self) -> dict[str, str]:
        """What the events of this movement say of how the arm leaves."""
        return {"how": self.how} if self.how else {}

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
        astray = self._obedience.strays(state, step.progress)
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
            self._sent = state.time
            self._obedience.tell(step)
        return None

    def end(self, out: Outputs) -> None:
        """Let what was told count no more, after a stop has been sent."""
        if self._program is not None:
            out.append(Steer(0, STILL, 0.0))
