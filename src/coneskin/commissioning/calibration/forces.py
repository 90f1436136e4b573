"""Known forces: the presses that a person makes with them, and the table that is fitted to the levels. Pure.

The level of each press is read once it rests. The error of the table is that at a place where nobody pressed.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise, product
from typing import TYPE_CHECKING, NamedTuple

from coneskin.commissioning.touching import Held, Mark, Notice, TouchJudge
from coneskin.core.errors import SensorError, SkinError
from coneskin.skin.calibration import ForceTable

if TYPE_CHECKING:
    from coneskin.skin.detection.frame.reading import TouchReading
    from coneskin.skin.sensor import Sensor

_MIN_RISE = 2.0  # standard errors by which the next force must raise the level
_MODEL_ERROR = 0.02  # of the force; no interpolation is better


class _KnownPress(NamedTuple):
    """A press with a known force."""

    force: float  #: [N]
    place: int  #: number of the place
    level: float  #: mean while it rested


def fit_forces(presses: Sequence[_KnownPress]) -> ForceTable:
    """Return the table that presses make, with the error that they have at a place that had no part in it.

    Args:
        presses: with two forces or more, each at two places or more.

    Raises:
        SkinError: the level does not rise with the force; the message says from which on.
    """
    table, logs = _table(presses), _logs(presses)
    spread = math.sqrt(statistics.fmean([statistics.pvariance(values) for values in logs.values()]))
    for low, high in pairwise(logs):
        rise = statistics.fmean(logs[high]) - statistics.fmean(logs[low])
        if rise < _MIN_RISE * spread * math.sqrt(2.0 / len(logs[high])):
            raise SkinError(
                f"{high:g} N hardly give a higher level than {low:g} N, from place to place it differs more: "
                f"leave out the forces from {high:g} N on"
            )
    missed = []
    for place in sorted({press.place for press in presses}):
        rest = _table([press for press in presses if press.place != place])
        for press in [press for press in presses if press.place == place]:
            read = rest.force(min(max(press.level, rest.levels[0]), rest.levels[-1]))
            assert read is not None
            missed.append(math.log(read[0] / press.force))
    error = math.hypot(_MODEL_ERROR, math.sqrt(statistics.fmean([value * value for value in missed])))
    return ForceTable(table.forces, table.levels, round(min(error, 0.99), 4))


def _table(presses: Sequence[_KnownPress]) -> ForceTable:
    logs = _logs(presses)
    strengths = [math.exp(statistics.fmean(values)) for values in logs.values()]
    try:
        return ForceTable(tuple(logs), tuple(round(s / (1.0 + s), 5) for s in strengths), 0.0)
    except SensorError as exc:
        raise SkinError(f"the level does not rise with the force: {exc}") from exc


def _logs(presses: Sequence[_KnownPress]) -> dict[float, list[float]]:
    """Return force [N], rising -> the logarithm of level / (1 - level) of each press with it."""
    forces = sorted({press.force for press in presses})
    return {f: [math.log(p.level / (1.0 - p.level)) for p in presses if p.force == f] for f in forces}


_STANDARD_GRAVITY = 9.80665  # m/s2
_HOLD_TIME = 0.4  # s for which a level must rest
_LEVEL_CHANGE = 0.004  # of the level; the change from the first half of them to the second, and its noise


@dataclass
class SensorPresses:
    """Presses of one sensor with known forces."""

    sensor: Sensor
    marks: Sequence[Mark]  #: to press
    presses: list[_KnownPress] = field(default_factory=list)  #: made so far


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
        rows = ((item, range(len(item.marks)), sorted(forces)) for item in sensors)
        self._queue = [(item, *row) for item, places, rising in rows for row in product(places, rising)]
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
            f"{1e3 * force / _STANDARD_GRAVITY:.0f} g), {self.mark.where}"
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
        item.presses.append(_KnownPress(force, place, level))
        self.mark, self.over = None, not self._queue
        return [Notice("read", f"level {level:.3f}", {"sensor": item.sensor.name, "level": round(level, 4)})]

    def refuse(self) -> list[Notice]:
        """End it: a press that cannot be made leaves no table."""
        self.incomplete = "a press with a known force was left out; calibrate without --forces, or with others"
        return [Notice("failed", self.incomplete)]
