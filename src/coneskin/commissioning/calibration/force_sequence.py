"""Presses with known forces: the level of each is read once it rests. Pure."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from coneskin.commissioning.touching import Held, Mark, Notice, TouchJudge

from .force_fit import KnownPress

if TYPE_CHECKING:
    from coneskin.skin.detection.frame.reading import TouchReading
    from coneskin.skin.sensor import Sensor

__all__ = ["ForceSequence", "SensorPresses"]

_GRAVITY = 9.80665  # m/s2
_HOLD_TIME = 0.4  # s for which a level must rest
_LEVEL_CHANGE = 0.004  # of the level; the change from the first half of them to the second, and its noise


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


class ForceSequence(TouchJudge["TouchReading"]):
    """Sequence over the sensors, at each mark all forces, the lightest first.

    Args:
        sensors: with their marks.
        forces: known ones [N].

    Attributes:
        force: with which the mark is pressed now [N].
    """

    def __init__(self, sensors: Sequence[SensorPresses], forces: Sequence[float]) -> None:
        super().__init__(2.0 * _HOLD_TIME)
        self.force = 0.0
        self._queue = [
            (item, place, force) for item in sensors for place in range(len(item.marks)) for force in sorted(forces)
        ]
        self._total = len(self._queue)

    @property
    def current(self) -> SensorPresses:
        """Sensor that is pressed now."""
        return self._queue[0][0]

    def ask(self) -> Notice:
        """Ask for the next press."""
        item, place, self.force = self._queue[0]
        self.mark = item.marks[place]
        number, force = self._total - len(self._queue) + 1, self.force
        details = {"number": number, "of": self._total, "sensor": item.sensor.name, "force_n": force}
        text = (
            f"{number} of {self._total}: press {item.sensor.name} with {force:g} N (the weight of "
            f"{1e3 * force / _GRAVITY:.0f} g), {self.mark.where}"
        )
        return Notice("press", text, details)

    def hold(self, touch: Held[TouchReading]) -> list[Notice]:
        """Read the mean level of a press once it rests."""
        reading = touch.readings.get(self.current.sensor.name)
        if reading is None:
            self.samples.clear()
            return []
        self.samples.feed(reading.time, reading.level)
        levels = self.samples.values(0)
        if len(levels) < 8 or self.samples.duration < _HOLD_TIME:
            return []
        half = len(levels) // 2
        drift = abs(statistics.fmean(levels[:half]) - statistics.fmean(levels[half:]))
        if drift >= _LEVEL_CHANGE or statistics.stdev(levels) >= _LEVEL_CHANGE:
            return []
        item, place, force = self._queue.pop(0)
        level = statistics.fmean(levels)
        item.presses.append(KnownPress(force, place, level))
        self.mark, self.over = None, not self._queue
        return [Notice("read", f"level {level:.3f}", {"sensor": item.sensor.name, "level": round(level, 4)})]

    def refuse(self) -> list[Notice]:
        """End it: a press that cannot be made leaves no table."""
        self.incomplete = "a press with a known force was left out; calibrate without --forces, or with others"
        return [Notice("failed", self.incomplete)]
