"""Capture of one touch from raw frames: what a sensor reads there, however its wires are exchanged. Pure.

The detector of the guard cannot be asked: with wires exchanged between the sheets its sensor is never ready. So a touch
is whatever moves a reading away from where it rested, and stays.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from .wire_order import TouchReadings

if TYPE_CHECKING:
    from coneskin.skin.sensor import Sensor
    from coneskin.skin.wire import Frame

__all__ = ["TouchCapture", "normalize"]

_REST = 0.3  # s of quiet frames from which the resting readings are taken
_HOLD = 0.3  # s that a touch must rest
_CHANGE = 0.04  # of the supply or the full scale, by which a touch moves a reading
_STILL = 0.03  # likewise, by which a touch that rests may move


def normalize(sensor: Sensor, frame: Frame) -> TouchReadings:
    """Return the readings of a frame over its supplies and over the full scale; all 0 without a supply."""
    full = sensor.electronics.full_count
    supplies = {"touch": frame.touch_supply, "radial": frame.radial_supply, "angular": frame.angular_supply}
    return TouchReadings._make(
        getattr(frame, name) / (full if name.endswith("current") else supplies[name.partition("_")[0]] or full)
        for name in TouchReadings._fields
    )


class TouchCapture:
    """Capture of the next touch of one sensor.

    Args:
        sensor: the sensor.
        rest: resting readings where they are known; else they are learned before the touch.

    Attributes:
        rest: resting readings; None until they are known.
        resting: the sensor has read them last, for as long as a touch must rest.
    """

    def __init__(self, sensor: Sensor, rest: TouchReadings | None = None) -> None:
        self.rest = rest
        self._sensor = sensor
        self.resting = False
        self._recent: deque[tuple[float, TouchReadings]] = deque()

    def take(self, time: float, frame: Frame) -> TouchReadings | None:
        """Take a frame; return the mean readings once a touch has rested.

        Args:
            time: [s], monotonic.
            frame: of the sensor.
        """
        recent, read = self._recent, normalize(self._sensor, frame)
        recent.append((time, read))
        window = _REST if self.rest is None else _HOLD
        if recent[-1][0] - recent[0][0] < window:
            return None
        while len(recent) > 2 and recent[-1][0] - recent[1][0] >= window:
            recent.popleft()
        columns = list(zip(*(values for _, values in recent), strict=True))
        if any(max(column) - min(column) > _STILL for column in columns):
            return None
        mean = TouchReadings._make(sum(column) / len(column) for column in columns)
        if self.rest is None:
            self.rest = mean
        self.resting = all(abs(a - b) <= _CHANGE for a, b in zip(mean, self.rest, strict=True))
        return None if self.resting else mean
