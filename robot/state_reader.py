"""A small RTDE reader of our own: what the arm really does, 500 times a second, without the wheel.

The wheel's receive interface needs a thread, keeps the interpreter's lock while it connects and goes on returning old
values for 2.5 s when the controller freezes. This reader is one socket in the guard's own loop; whoever holds its
newest state also knows how old it is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from coneskin.errors import RobotConnectionError

from . import rtde_codec as rtde
from .rtde_connection import RtdeConnection
from .ur_models import Joints

__all__ = ["RECIPE", "ControllerState", "StateReader", "decode_state"]

_NAMES = ("timestamp", "actual_q", "actual_qd", "robot_mode", "safety_status_bits", "runtime_state")
#: what the reader asks for
RECIPE = rtde.Recipe(_NAMES)
_SAFETY_STOPS = 0b11111111100  # protective, recovery, safeguard, emergency, violation, fault, stopped: bits 2 to 10
_PLAYING = 2
_ROBOT_RUNNING = 7


class ControllerState(NamedTuple):
    """One sample of the controller.

    Attributes:
        time: host time at which it was read [s].
        controller_time: the controller's own clock [s].
        q: measured joint positions [rad].
        qd: measured joint speeds [rad/s].
        robot_mode: 7 where the arm is powered and its brakes are released.
        safety_bits: RTDE safety_status_bits; bit 0 normal, bit 2 protective stop, bit 7 emergency stop.
        runtime_state: 2 while a program plays.
    """

    time: float
    controller_time: float
    q: Joints
    qd: Joints
    robot_mode: int
    safety_bits: int
    runtime_state: int

    @property
    def speed(self) -> float:
        """Largest joint speed [rad/s], without sign."""
        return max(map(abs, self.qd))

    @property
    def stopped_by_safety(self) -> bool:
        """Whether the controller's own safety system holds the arm: a protective stop or worse."""
        return bool(self.safety_bits & _SAFETY_STOPS)

    @property
    def running(self) -> bool:
        """Whether the arm is powered with its brakes released."""
        return self.robot_mode == _ROBOT_RUNNING

    @property
    def playing(self) -> bool:
        """Whether a program plays on the controller."""
        return self.runtime_state == _PLAYING


def decode_state(time: float, payload: bytes) -> ControllerState:
    """The state in the payload of an RTDE data packet of this reader's recipe.

    Args:
        time: host time [s].
        payload: recipe id and values.

    Raises:
        RobotConnectionError: the payload has another length, or its time, a position or a speed is not finite.
    """
    state = ControllerState(time, *RECIPE.unpack(payload))  # type: ignore[arg-type]
    if not math.isfinite(state.controller_time + sum(state.q) + sum(state.qd)):
        raise RobotConnectionError(
            f"its time, joint positions or speeds are not finite: {state.controller_time} s, {state.q} rad, "
            f"{state.qd} rad/s"
        )
    return state


class StateReader(RtdeConnection):
    """Reads the controller's state; open it in a ``with``.

    Args:
        host: the controller.
        timeout: how long connecting and each reply may take [s].
        clock: monotonic seconds.

    Raises:
        RobotConnectionError: on entering, where the controller cannot be reached or refuses.
        RobotTimeout: on entering, where it does not answer.
    """

    def __enter__(self) -> StateReader:
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
        """What there is to ask before the data flows."""
        self.ask_outputs(_NAMES)
