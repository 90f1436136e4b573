"""A movement away from a touch, under way: through the owner of ur_rtde, or as a program of its own. Pure.

The owner gets a new target in every second control cycle. A program has the whole way in it (``retreat_program``); the
guard follows the measured arm on it and ends it early where that is needed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from .commands import ArmState, ContactOnLink, Done, RetreatProgram
from .movement import Movement
from .outputs import Outputs, tell
from .owner_messages import Speed
from .state_reader import ControllerState

__all__ = ["Leaving"]

_STREAM_EVERY = 0.004  # s between two targets of a retreat: every second controller cycle, so that none queues
_PROGRAM_LATE = 0.5  # s that a program may need besides its own time: starting it, and braking


class Leaving:
    """See the module.

    Args:
        movement: what to do.
        now: host time [s].
        program: that makes the movement; None where the owner does.
        out: takes what comes of it.
    """

    def __init__(self, movement: Movement, now: float, program: RetreatProgram | None, out: Outputs) -> None:
        self._movement = movement
        self._streams = program is None
        self._sent = -math.inf
        self._end = math.inf
        if program is not None:
            out.append(program)
            self._end = now + program.duration + _PROGRAM_LATE
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
        if state.time >= self._end:
            return Done("its program is over", step.progress)
        if self._streams and state.time - self._sent >= _STREAM_EVERY - 1e-9:
            out.append(Speed(step.qd, step.acceleration))
            if step.clipped_by and self._sent == -math.inf:
                tell(out, "clipped", state.time, by=list(step.clipped_by))
            self._sent = state.time
        return None
