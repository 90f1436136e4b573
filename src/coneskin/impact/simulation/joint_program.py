"""Programs that move the joints of a simulated arm until something stops it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

from coneskin.robot.arm.model import Joints

__all__ = ["ConstantSpeed", "JointProgram", "Waypoints"]

_CYCLE = 0.002  # s
_ARRIVED = 1e-4  # rad from a waypoint


class JointProgram(Protocol):
    """Program that moves the arm."""

    def target(self, time: float, q: Sequence[float]) -> tuple[list[float], float] | None:
        """Return joint speeds [rad/s] to go to and the acceleration of the leading joint; None at its end.

        Args:
            time: since it began [s].
            q: commanded joint positions [rad].
        """


class ConstantSpeed:
    """Program that turns the joints at constant speeds.

    Args:
        qd: joint speeds [rad/s].
        acceleration: of the leading joint until then [rad/s^2].
    """

    def __init__(self, qd: Joints, acceleration: float = 20.0) -> None:
        self._qd, self._acceleration = list(qd), acceleration

    def target(self, time: float, q: Sequence[float]) -> tuple[list[float], float] | None:  # noqa: ARG002
        """Return the speeds; see `JointProgram`."""
        return self._qd, self._acceleration


class Waypoints:
    """Program that goes through waypoints along straight lines in joint space, with a stop at each.

    Args:
        points: joint positions [rad].
        speed: of the leading joint [rad/s].
        acceleration: of the leading joint [rad/s^2].
    """

    def __init__(self, points: Sequence[Sequence[float]], speed: float, acceleration: float) -> None:
        self._points = [list(point) for point in points]
        self._speed, self._acceleration = speed, acceleration

    def target(self, time: float, q: Sequence[float]) -> tuple[list[float], float] | None:  # noqa: ARG002
        """Return the speeds towards the next waypoint; see `JointProgram`."""
        while self._points:
            way = [goal - at for goal, at in zip(self._points[0], q, strict=True)]
            left = max(map(abs, way))
            if left > _ARRIVED:
                braking = math.sqrt(2.0 * 0.8 * self._acceleration * left)  # it sees a cycle late that it must brake
                speed = min(self._speed, braking, left / _CYCLE)
                return [speed * value / left for value in way], self._acceleration
            self._points.pop(0)
        return None
