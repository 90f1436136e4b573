"""Whether an arm does as it is told while the guard moves it, or something else moves it. Pure."""

from __future__ import annotations

from .commands import JointVelocity
from .state_reader import ControllerState
from .stop_watch import STEADY
from .ur_models import Joints

__all__ = ["Obedience"]

_OTHER = 0.03  # rad/s by which a joint's speed may differ from what it is told, or from a part of that,
_PART = 0.3  # ... and this part of the leading joint's
_ASTRAY = 0.25  # s for which it may differ by more, besides the time in which the arm takes up its speed,
_TAKING_UP = 0.25  # ... which is no longer than this
_FASTER = 0.1  # rad/s above every speed that it was told: that is not waited for
_TOWARDS = 0.005  # m that a touched point may come nearer to what touched it; nor is that


class Obedience:
    """Follows one movement.

    Args:
        now: host time at which it begins [s].
    """

    def __init__(self, now: float) -> None:
        self._told: JointVelocity | None = None
        self._as_told = now
        self._most = 0.0
        self._fast = 0
        self._farthest = 0.0  # back, of all progress

    def tell(self, step: JointVelocity) -> None:
        """Take what the arm is told now."""
        if self._told is None:
            self._farthest = step.progress - _TOWARDS
        self._told = step
        self._most = max(self._most, *map(abs, step.qd))

    def strays(self, state: ControllerState, progress: float) -> bool:
        """Take a measured state; whether the arm moves in another way than it was told.

        Slower is no other way: the controller's speed slider makes it so.

        Args:
            state: as measured.
            progress: of the movement [m].
        """
        told = self._told
        if told is None:
            return False
        self._fast = self._fast + 1 if state.speed > self._most + _FASTER else 0
        if self._fast >= STEADY or progress < self._farthest:
            return True
        leading = max(map(abs, told.qd))
        if _difference(state.qd, told.qd) <= _OTHER + _PART * leading:
            self._as_told = state.time
            return False
        return state.time - self._as_told > _ASTRAY + min(_TAKING_UP, leading / told.acceleration)


def _difference(qd: Joints, told: Joints) -> float:
    """Largest difference of a joint's speed from the part of what it is told that fits best [rad/s]."""
    square = sum(b * b for b in told)
    part = min(1.0, max(0.0, sum(a * b for a, b in zip(qd, told, strict=True)) / square)) if square else 0.0
    return max(abs(a - part * b) for a, b in zip(qd, told, strict=True))
