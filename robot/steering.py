"""The reader of the controller's state, whose connection carries joint speeds to a follower program as well.

Opened instead of the plain reader where a scene lets the guard move an arm that another program moves. RTDE gives each
register to one client, so the guard refuses to start where another has taken them.
"""

from __future__ import annotations

from coneskin.errors import RobotRefused

from . import rtde_codec as rtde
from .commands import STILL
from .follower import REGISTERS, Steer
from .state_reader import StateReader

__all__ = ["Steering"]


class Steering(StateReader):
    """See the module; open it in a ``with``.

    Raises:
        RobotRefused: on entering, where another client owns one of the registers.
    """

    _in = rtde.Recipe(REGISTERS)

    def __enter__(self) -> Steering:
        super().__enter__()
        self.steer(Steer(0, STILL, 0.0))  # what a guard before this one has left is nobody's now
        return self

    def steer(self, steer: Steer) -> bool:
        """Send speeds without waiting; whether the system took the bytes."""
        return self.send(self._in, steer.values)

    def _ask_for(self) -> None:
        super()._ask_for()
        try:
            self._in = self.ask_inputs(REGISTERS)
        except RobotRefused as exc:
            raise RobotRefused(
                f"to move an arm that another program moves, the guard needs registers of {self.host}: {exc}; "
                "let that client use others, or let the arm only stop (reaction.kind)"
            ) from exc
