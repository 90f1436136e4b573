"""State of an arm as its controller measures it."""

from __future__ import annotations

from typing import NamedTuple

from coneskin.robot.arm.model import Joints

__all__ = ["ControllerState"]


class ControllerState(NamedTuple):
    """One sample of the controller.

    Attributes:
        time: host time at which it was read [s].
        controller_time: the controller's own clock [s].
        q: measured joint positions [rad].
        qd: measured joint speeds [rad/s].
        powered: the arm is powered and its brakes are released.
        stopped_by_safety: the controller's own safety system holds the arm: a protective stop or worse.
        program_running: a program runs on the controller.
        current: measured motor currents [A]; None where the controller does not send them.
        target_current: those that the controller expects of this motion [A]; None likewise.
    """

    time: float
    controller_time: float
    q: Joints
    qd: Joints
    powered: bool
    stopped_by_safety: bool
    program_running: bool
    current: Joints | None = None
    target_current: Joints | None = None

    @property
    def speed(self) -> float:
        """Largest joint speed [rad/s], without sign."""
        return max(map(abs, self.qd))
