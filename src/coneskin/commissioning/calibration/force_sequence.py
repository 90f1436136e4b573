"""Sequence of presses with known forces: readings and time go in, notices and mean levels come out. Pure."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from coneskin.commissioning.acceptance.procedure import Notice

from .force_fit import KnownPress

if TYPE_CHECKING:
    from coneskin.commissioning.acceptance.marks import Mark
    from coneskin.skin.detection.frame.touch_reading import TouchReading
    from coneskin.skin.sensor import Sensor

__all__ = ["ForceSequence", "SensorPresses"]

_GRAVITY = 9.80665  # m/s2
_HOLD = 0.4  # s for which a level must rest
_STEADY = 0.004  # of the level; the change from the first half of them to the second, and four times its noise
_QUIET = 0.1  # s without a touch before the next press


@dataclass
class SensorPresses:
    """Presses of one sensor with known forces.

    Attributes:
        sensor: the sensor.
        marks: to press.
        presses: made so far.
    """

    sensor: Sensor
    marks: Sequence[Mark]
    presses: list[KnownPress] = field(default_factory=list)


class ForceSequence:
    """Sequence over the sensors, at each mark all forces, the lightest first.

    Args:
        sensors: with their marks.
        forces: known ones [N].

    Attributes:
        over: there is nothing more to press.
        incomplete: why it cannot be carried out; empty where it can.
        mark: to be pressed now; None between two presses.
        force: with which [N].
    """

    def __init__(self, sensors: Sequence[SensorPresses], forces: Sequence[float]) -> None:
        self.over = False
        self.incomplete = ""
        self.mark: Mark | None = None
        self.force = 0.0
        self._queue = [
            (item, place, force) for item in sensors for place in range(len(item.marks)) for force in sorted(forces)
        ]
        self._total = len(self._queue)
        self._quiet_since: float | None = None
        self._levels: list[tuple[float, float]] = []

    @property
    def current(self) -> SensorPresses:
        """Sensor that is pressed now."""
        return self._queue[0][0]

    def look(self, now: float, readings: Mapping[str, TouchReading | None]) -> list[Notice]:
        """Take what the sensors read now; arguments as of ``TouchSequence.look``."""
        if self.over:
            return []
        touched = any(reading is not None for reading in readings.values())
        if self.mark is None:
            self._quiet_since = None if touched else now if self._quiet_since is None else self._quiet_since
            return [] if touched or now - (self._quiet_since or now) < _QUIET else self._name()
        reading = readings.get(self.current.sensor.name)
        if reading is None:
            self._levels = []
            return []
        if not self._levels or reading.time > self._levels[-1][0]:
            self._levels.append((reading.time, reading.level))
        self._levels = [(time, level) for time, level in self._levels if time >= reading.time - 2.0 * _HOLD]
        return self._take() if self._rests() else []

    def refuse(self) -> list[Notice]:
        """End it: a press that cannot be made leaves no table."""
        self.incomplete = "a press with a known force was left out; calibrate without --forces, or with others"
        return [Notice("failed", self.incomplete)]

    def _name(self) -> list[Notice]:
        item, place, force = self._queue[0]
        self.mark, self.force, self._levels = item.marks[place], force, []
        number = self._total - len(self._queue) + 1
        details = {"number": number, "of": self._total, "sensor": item.sensor.name, "force_n": force}
        text = (
            f"{number} of {self._total}: press {item.sensor.name} with {force:g} N (the weight of "
            f"{1e3 * force / _GRAVITY:.0f} g), {self.mark.where}"
        )
        return [Notice("press", text, details)]

    def _rests(self) -> bool:
        levels = [level for _, level in self._levels]
        if len(levels) < 8 or self._levels[-1][0] - self._levels[0][0] < _HOLD:
            return False
        half = len(levels) // 2
        drift = abs(statistics.fmean(levels[:half]) - statistics.fmean(levels[half:]))
        return drift < _STEADY and statistics.stdev(levels) < _STEADY

    def _take(self) -> list[Notice]:
        item, place, force = self._queue.pop(0)
        level = statistics.fmean(level for _, level in self._levels)
        item.presses.append(KnownPress(force, place, level))
        self.mark, self._quiet_since, self.over = None, None, not self._queue
        return [Notice("read", f"level {level:.3f}", {"sensor": item.sensor.name, "level": round(level, 4)})]
