"""State reader: the measured state of the arm, 500 times a second, over RTDE and without the ur_rtde wheel.

The wheel's receive interface needs a thread, keeps the interpreter's lock while it connects and goes on returning old
values for 2.5 s when the controller freezes. This reader is one socket in the guard's own loop, and each state carries
the time at which it was read.
"""

from __future__ import annotations

from typing import Self

from coneskin.robot.driver.values import ControllerState

from . import rtde_codec as rtde
from .rtde_connection import RtdeConnection


class StateReader(RtdeConnection):
    """Reader of the controller's state; open it in a ``with``.

    Args:
        host: the controller.
        timeout: how long connecting and each reply may take [s].
        clock: monotonic seconds.

    Raises:
        RobotConnectionError: on entering, where the controller cannot be reached or refuses.
        RobotTimeout: on entering, where it does not answer.
    """

    def __enter__(self) -> Self:
        super().__enter__()
        self._ask_for()
        self.start()
        return self

    def wait(self, timeout: float) -> ControllerState:
        """Wait for the next state, for scripts and set-up; the guard's loop uses ``fileno`` and ``read``.

        Raises:
            RobotTimeout: none came within the timeout [s].
            RobotConnectionError: the controller is gone.
        """
        return rtde.decode_state(self._clock(), self.wait_data(timeout))

    def _ask_for(self) -> None:
        """Ask for the variables before the data flows."""
        self.ask_outputs(rtde.STATE_RECIPE.names)
