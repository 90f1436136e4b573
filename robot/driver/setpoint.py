"""Joint velocity setpoints for an arm that another program moves, and the program that follows them."""

from __future__ import annotations

from typing import NamedTuple

from coneskin.robot.arm.model import Joints

__all__ = ["JointVelocitySetpoint", "SetSpeedSlider", "SetpointProgram"]


class JointVelocitySetpoint(NamedTuple):
    """Speeds for the setpoint program with this token.

    Attributes:
        token: of the motion; 0 belongs to none.
        qd: joint speeds [rad/s].
        acceleration: of the leading joint [rad/s2].
    """

    token: int
    qd: Joints
    acceleration: float


class SetpointProgram(NamedTuple):
    """Command to start the program that follows setpoints, after the first of them was sent.

    Attributes:
        token: of the motion, above 0; the program ends where a setpoint carries another one.
        deceleration: of the leading joint at the end [rad/s2].
        watchdog_hz: setpoints that come less often than this end the program.
    """

    token: int
    deceleration: float
    watchdog_hz: float


class SetSpeedSlider(NamedTuple):
    """Command to set the controller's speed slider.

    Attributes:
        fraction: from 0 to 1.
    """

    fraction: float
