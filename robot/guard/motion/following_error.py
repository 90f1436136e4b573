"""Following-error monitor: it compares the measured motion with the commanded one during a reaction. Pure."""

from __future__ import annotations

from coneskin.robot.arm.model import Joints
from coneskin.robot.driver.state import ControllerState
from coneskin.robot.reaction.types import JointVelocity
from coneskin.robot.stop.stop_monitor import STANDSTILL_SAMPLES

__all__ = ["FollowingErrorMonitor"]

_SPEED_TOLERANCE = 0.03  # rad/s; absolute part of the tolerance of a joint's speed
_RELATIVE_TOLERANCE = 0.3  # ratio; its relative part, to the leading joint's commanded speed
_MAX_DEVIATION_TIME = 0.25  # s for which a joint may be out of tolerance
_MAX_RAMP_TIME = 0.25  # s; longest time that is allowed in addition for taking up the commanded speed
_MAX_OVERSPEED = 0.1  # rad/s above every commanded speed; such a motion ends it at once
_MAX_APPROACH = 0.005  # m that a touched point may come nearer to what touched it; more ends it at once


class FollowingErrorMonitor:
    """Monitor of one reaction motion.

    Args:
        now: host time at which it begins [s].
    """

    def __init__(self, now: float) -> None:
        self._commanded: JointVelocity | None = None
        self._in_tolerance_at = now
        self._top_speed = 0.0  # of all commands [rad/s]
        self._fast = 0  # samples in a row above it
        self._least_progress = 0.0  # below which the motion has gone backwards [m]

    def command(self, step: JointVelocity) -> None:
        """Take what the arm is commanded now."""
        if self._commanded is None:
            self._least_progress = step.progress - _MAX_APPROACH
        self._commanded = step
        self._top_speed = max(self._top_speed, *map(abs, step.qd))

    def exceeded(self, state: ControllerState, progress: float) -> bool:
        """Take a measured state and tell whether the arm moves otherwise than commanded.

        A slower motion in the same direction is within tolerance: the controller's speed slider makes it so.

        Args:
            state: as measured.
            progress: of the motion [m].
        """
        commanded = self._commanded
        if commanded is None:
            return False
        self._fast = self._fast + 1 if state.speed > self._top_speed + _MAX_OVERSPEED else 0
        if self._fast >= STANDSTILL_SAMPLES or progress < self._least_progress:
            return True
        leading = max(map(abs, commanded.qd))
        if _difference(state.qd, commanded.qd) <= _SPEED_TOLERANCE + _RELATIVE_TOLERANCE * leading:
            self._in_tolerance_at = state.time
            return False
        allowed = _MAX_DEVIATION_TIME + min(_MAX_RAMP_TIME, leading / commanded.acceleration)
        return state.time - self._in_tolerance_at > allowed


def _difference(qd: Joints, commanded: Joints) -> float:
    """Return the largest difference of a joint's speed from the best-fitting part of what is commanded [rad/s]."""
    square = sum(b * b for b in commanded)
    dot = sum(a * b for a, b in zip(qd, commanded, strict=True))
    part = min(1.0, max(0.0, dot / square)) if square else 0.0
    return max(abs(a - part * b) for a, b in zip(qd, commanded, strict=True))
