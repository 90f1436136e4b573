"""State reader: the measured state of the arm, 500 times a second, over RTDE and without the ur_rtde wheel.

The wheel's receive interface needs a thread, keeps the interpreter's lock while it connects and goes on returning old
values for 2.5 s when the controller freezes. This reader is one socket in the guard's own loop, and each state carries
the time at which it was read.
"""

from __future__ import annotations

import math
from typing import Self

from coneskin.core.errors import RobotConnectionError
from coneskin.robot.driver.values import ControllerState

from . import rtde_codec as rtde
from .rtde_connection import RtdeConnection

__all__ = ["RECIPE", "StateReader", "decode_state"]

_STATE_NAMES = ("timestamp", "actual_q", "actual_qd", "robot_mode", "safety_status_bits", "runtime_state")
_CURRENT_NAMES = ("actual_current", "target_current")
#: the variables that the reader asks for
RECIPE = rtde.Recipe((*_STATE_NAMES, *_CURRENT_NAMES))
_WITHOUT_CURRENTS = rtde.Recipe(_STATE_NAMES)  # of recordings made before the reader asked for them
_SAFETY_STOPS = 0b11111111100  # bits 2 to 10: protective, recovery, safeguard, emergency, violation, fault, stopped
_PROGRAM_RUNNING = 2  # value of runtime_state
_ARM_RUNNING = 7  # value of robot_mode: powered, brakes released


def decode_state(time: float, payload: bytes) -> ControllerState:
    """Return the state in the payload of an RTDE data packet of this reader's recipe.

    Args:
        time: host time [s].
        payload: recipe id and values.

    Raises:
        RobotConnectionError: the payload has another length, or its time, a position, a speed or a current is not
            finite.
    """
    recipe = _WITHOUT_CURRENTS if len(payload) == _WITHOUT_CURRENTS.size else RECIPE
    values = recipe.unpack_flat(payload)
    controller_time, q, qd, currents = values[0], values[1:7], values[7:13], values[16:]
    robot_mode, safety_bits, runtime_state = values[13:16]
    state = ControllerState(
        time,
        controller_time,
        q,
        qd,
        robot_mode == _ARM_RUNNING,
        safety_bits & _SAFETY_STOPS != 0,
        runtime_state == _PROGRAM_RUNNING,
        *((currents[:6], currents[6:]) if currents else ()),
    )
    if not math.isfinite(controller_time + sum(q) + sum(qd)):
        raise RobotConnectionError(
            f"its time, joint positions or speeds are not finite: {state.controller_time} s, {state.q} rad, "
            f"{state.qd} rad/s"
        )
    if not math.isfinite(sum(currents)):
        raise RobotConnectionError(f"its motor currents are not finite: {currents} A")
    return state


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
        return decode_state(self._clock(), self.wait_data(timeout))

    def _ask_for(self) -> None:
        """Ask for the variables before the data flows."""
        self.ask_outputs(RECIPE.names)
