"""Reported touch: what was last told of a touch, and which of its frames tell something new.

A touch begins with one event and ends with another. Between them one is due where the level or the place has changed
by a step since the last, where the place became certain or ceased to be, and once where a line was found.
"""

from __future__ import annotations

import math

from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import Frame

from .events import TouchBegan, TouchEnded, TouchMoved
from .frame.settings import DetectorSettings
from .frame.touch_reading import TouchReading

__all__ = ["ReportedTouch"]

_FULL_TURN = 2.0 * math.pi


class ReportedTouch:
    """The touches of one sensor as its events tell them.

    Args:
        sensor: the sensor.
        settings: by how much a touch has to change.
    """

    __slots__ = ("_doubt", "_extended", "_far", "_level", "_phi", "_placed", "_radius", "_sensor", "_step", "_u")

    def __init__(self, sensor: Sensor, settings: DetectorSettings) -> None:
        self._sensor = sensor
        self._radius = max(sensor.frustum.radius1, sensor.frustum.radius2)
        self._step, self._far = settings.level_step, settings.move_distance
        self._level = self._u = self._phi = 0.0
        self._placed = self._extended = False
        self._doubt = ""

    def begin(self, touch: TouchReading) -> TouchBegan:
        """Return the event with which a touch begins.

        Args:
            touch: the frame that confirms it.
        """
        self._placed = self._extended = False
        time, level, u, phi, valid, doubt, clock, sequence = touch[:8]
        self._remember(level, u, phi, doubt)
        return TouchBegan(self._sensor.name, time, clock, sequence, level, u, phi, valid, doubt, *touch[8:])

    def move(self, touch: TouchReading) -> TouchMoved | None:
        """Return the event that a frame of a touch makes due; None where it tells nothing new.

        Args:
            touch: the frame, above the release threshold.
        """
        valid, step = touch.location_valid, touch.level - self._level
        shape = None if valid else touch.elongation
        if (
            valid is not (not self._doubt)
            or not -self._step <= step <= self._step
            or (valid and self._distance(touch.u, touch.phi) > self._far)
            or (shape is not None and not self._extended)
        ):
            time, level, u, phi, valid, doubt, clock, sequence = touch[:8]
            self._extended = self._extended or shape is not None
            certain = (self._u, self._phi) if self._placed and not valid else (u, phi)
            if shape is None:
                u, phi = certain  # the last place that was certain is the better guess; a line has its own
            self._remember(level, *certain, doubt)
            return TouchMoved(self._sensor.name, time, clock, sequence, level, u, phi, valid, doubt, *touch[8:])
        return None

    def end(self, frame: Frame, now: float, level: float) -> TouchEnded:
        """Return the event with which a touch ends, at the last place that was told.

        Args:
            frame: the one that confirms the end.
            now: host clock when it arrived [s].
            level: its level, the drift taken off.
        """
        where = self._u, self._phi, self._placed
        return TouchEnded(self._sensor.name, now, frame.clock_us, frame.sequence, level, *where)

    def _distance(self, u: float, phi: float) -> float:
        """Return the distance of a place from the last that was reported [m], never too small."""
        around = abs(phi - self._phi)
        return math.hypot(u - self._u, self._radius * (around if around < math.pi else _FULL_TURN - around))

    def _remember(self, level: float, u: float, phi: float, doubt: str) -> None:
        self._level, self._u, self._phi, self._doubt = level, u, phi, doubt
        self._placed = self._placed or not doubt
