"""Level of an untouched sensor: the slow drift that is taken off, and how far it may go."""

from __future__ import annotations

import math
from collections.abc import Sequence

from coneskin.skin.detection.frame.settings import DetectorSettings

__all__ = ["UntouchedLevel"]


class UntouchedLevel:
    """The level that a sensor has while nothing touches it.

    Args:
        settings: how fast it may drift, and how far.
        release: level below which nothing touches the sensor.

    Attributes:
        value: what is taken off each level.
    """

    __slots__ = ("_drifted", "_limit", "_rate", "_release", "_settle_frames", "value")

    def __init__(self, settings: DetectorSettings, release: float) -> None:
        self._rate, self._limit, self._settle_frames = settings.drift_rate, settings.drift_limit, settings.settle_frames
        self._release = release
        self.value = 0.0
        self._drifted = 0

    def exhausted(self, whole: float) -> bool:
        """Tell whether a frame's whole level rests above the threshold though all was taken off that may be.

        A touch passes this range; a growing leak rests in it.
        """
        if abs(self.value) >= self._limit and whole > self._release:
            self._drifted += 1
            return self._drifted >= self._settle_frames
        self._drifted = 0
        return False

    def follow(self, level: float, period: float) -> None:
        """Follow the drift.

        Args:
            level: of a frame in which nothing shows, less ``value``.
            period: time from frame to frame [s].
        """
        most = self._rate * period
        self.value += most if level > most else -most if level < -most else level
        if not -self._limit <= self.value <= self._limit:
            self.value = math.copysign(self._limit, self.value)

    def learn(self, levels: Sequence[float], periods: Sequence[float]) -> int:
        """Follow the drift through frames in a row; return in how many of them that is all that happens.

        Args:
            levels: whole levels.
            periods: times from frame to frame [s].
        """
        value, release, limit, rate, count = self.value, self._release, self._limit, self._rate, 0
        for count, (whole, period) in enumerate(zip(levels, periods, strict=False), 1):
            level = whole - value
            if level >= release:
                count -= 1
                break
            most = rate * period
            value += most if level > most else -most if level < -most else level
            if not -limit <= value <= limit:
                value = math.copysign(limit, value)
        self.value, self._drifted = value, 0
        return count
