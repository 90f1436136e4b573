"""State reader whose connection also carries joint velocity setpoints to the controller's registers.

It is opened instead of the plain reader where a scene lets the guard move an arm that another program moves. RTDE gives
each register to one client, so the guard refuses to start where another has taken them.
"""

from __future__ import annotations

from coneskin.core.errors import RobotRefused
from coneskin.robot.arm.model import ZERO_VELOCITY
from coneskin.robot.driver.setpoint import JointVelocitySetpoint

from . import rtde_codec as rtde
from .setpoint_program import SETPOINT_INPUTS, _register_values
from .state_reader import StateReader

__all__ = ["RegisterWriter"]


class RegisterWriter(StateReader):
    """Reader of states and writer of setpoints; open it in a ``with``.

    Raises:
        RobotRefused: on entering, where another client has taken one of the registers.
    """

    _in = rtde.Recipe(SETPOINT_INPUTS)

    def __enter__(self) -> RegisterWriter:
        super().__enter__()
        self.write(JointVelocitySetpoint(0, ZERO_VELOCITY, 0.0))  # voids what an earlier guard has left
        return self

    def write(self, setpoint: JointVelocitySetpoint) -> bool:
        """Send a setpoint without waiting; return whether the system took the bytes."""
        return self.send(self._in, _register_values(setpoint))

    def _ask_for(self) -> None:
        super()._ask_for()
        try:
            self._in = self.ask_inputs(SETPOINT_INPUTS)
        except RobotRefused as exc:
            raise RobotRefused(
                f"to move an arm that another program moves, the guard needs registers of {self.host}: {exc}; "
                "let that client use others, or let the arm only stop (reaction.kind)"
            ) from exc
