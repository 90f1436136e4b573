"""Touches of a calibration, each read once it rests and its mean is known well, and presses with known forces. Pure.

Touches that miss what most others say are asked for again. The level of a press is read once it rests. The error of the
table that is fitted to presses is that at a place where nobody pressed.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise, product
from typing import NamedTuple

from coneskin.commissioning.misreadings import Place, miss
from coneskin.commissioning.touching import Doubt, Held, Mark, Notice, TouchJudge
from coneskin.core.errors import SensorError, SkinError
from coneskin.skin.calibration import ForceTable
from coneskin.skin.detection.frame.reading import TouchReading
from coneskin.skin.sensor import Sensor

from .fit import MIN_TOUCHES, KnownTouch, agreeing

_HOLD_TIME = 0.3  # s for which a touch must rest at a certain place
_MEAN_TIME = 1.0  # s of readings, at most, that make a mean
_REST_RANGE = 0.004  # m; a place that moves farther does not rest
_MEAN_ERROR = 0.05e-3  # m; standard error of the mean, and half the change from the first half of it to the second
_DOUBT_TIME = 3.0  # s of touch without a result, after which the person is told why


@dataclass
class SensorTouches:
    """Marks of one sensor, and the touches of them."""

    sensor: Sensor  #: the sensor
    marks: Sequence[Mark]  #: to touch
    touches: list[KnownTouch] = field(default_factory=list)  #: in their order
    repeated: set[int] = field(default_factory=set)  #: places in ``touches`` that a later one of the same mark replaces

    @property
    def valid(self) -> list[int]:
        """Places in ``touches`` of those that no later one replaces."""
        return [number for number in range(len(self.touches)) if number not in self.repeated]


class TouchSequence(TouchJudge["TouchReading"]):
    """Sequence over the sensors of a scene, one mark after the other.

    Args:
        sensors: with their marks.
        mark_error: standard deviation with which marks are placed and found, at least [m].
    """

    too_short = "that was too short: touch the mark, and hold it until it is read"

    def __init__(self, sensors: Sequence[SensorTouches], mark_error: float) -> None:
        super().__init__(_MEAN_TIME)
        self.sensors = tuple(sensors)
        self._mark_error = mark_error
        self._number = self._done = 0
        self._queue = list(self.sensors[0].marks)
        self._total = sum(len(item.marks) for item in self.sensors)
        self._again = False

    @property
    def current(self) -> SensorTouches:
        """Sensor that is touched now."""
        return self.sensors[min(self._number, len(self.sensors) - 1)]

    def ask(self) -> Notice:
        """Ask for the next mark."""
        self.mark = self._queue[0]
        return self.mark.request(self.current.sensor, self._done + 1, self._total, self._again)

    def hold(self, touch: Held[TouchReading]) -> list[Notice] | Doubt:
        """Read the mean place of a touch once it is good."""
        touched = [name for name, reading in touch.readings.items() if reading is not None]
        reading = touch.readings.get(self.current.sensor.name)
        why = "the place does not rest: hold it still, with something narrow and blunt"
        if len(touched) > 1 or reading is None:
            self.samples.clear()
            why = f"touched now: {', '.join(touched)}; touch {self.current.sensor.name} only, at one place"
        elif not reading.location_valid:
            self.samples.clear()
            doubt = f": {reading.doubt}" if reading.doubt else ""
            why = f"the place is not certain{doubt}; touch it firmly at one place"
        else:
            self.samples.feed(reading.time, reading.u, reading.phi)
            if self._is_good():
                return self._read()
        return Doubt(why, _DOUBT_TIME)

    def refuse(self) -> list[Notice]:
        """Leave out the mark, unless too few are left."""
        left = self._queue[1:]
        if len({touch.mark for touch in self.current.touches} | {mark.place for mark in left}) < MIN_TOUCHES:
            name = self.current.sensor.name
            self.incomplete = f"{name}: fewer than {MIN_TOUCHES} marks are left, too few for a calibration"
            return [Notice("failed", self.incomplete)]
        return self._next()

    def _is_good(self) -> bool:
        """Tell whether the place rests, and its mean is known well enough."""
        samples = self.samples
        if samples.duration < _HOLD_TIME or len(samples) < 4:
            return False
        along, around = samples.values(0), samples.values(1)
        radius = self.current.sensor.frustum.radius_at(along[-1])
        half = len(samples) // 2
        for values in (along, [radius * phi for phi in around]):
            drift = abs(statistics.fmean(values[:half]) - statistics.fmean(values[half:]))
            error = statistics.stdev(values) / math.sqrt(len(values))
            moved = max(values) - min(values)
            if moved > _REST_RANGE or error > _MEAN_ERROR or drift > 2.0 * _MEAN_ERROR + 4.0 * error:
                return False
        return True

    def _read(self) -> list[Notice]:
        item, mark = self.current, self.mark
        assert mark is not None
        read = Place(statistics.fmean(self.samples.values(0)), statistics.fmean(self.samples.values(1)))
        if self._again:
            item.repeated |= {number for number in item.valid if item.touches[number].mark == mark.place}
        item.touches.append(KnownTouch(mark.place, read))
        along, around = miss(item.sensor, mark.place, read)
        distance = 1e3 * math.hypot(along, around)
        off = f"{1e3 * along:+.2f} mm along and {1e3 * around:+.2f} mm around, {distance:.2f} mm"
        details = {"sensor": item.sensor.name, "read_u_mm": round(1e3 * read.u, 3)}
        details |= {"read_phi_deg": round(math.degrees(read.phi), 4), "distance_mm": round(distance, 3)}
        return [Notice("read", f"it reads {off} from the mark", details), *self._next()]

    def _next(self) -> list[Notice]:
        """Go on to the next mark, to those that have to be touched again, or to the next sensor."""
        self._queue.pop(0)
        self._done += 1
        self.mark = None
        notices: list[Notice] = []
        item = self.current
        if not self._queue and not self._again and (wrong := self._find_wrong(item)):
            self._again = True
            self._queue = wrong
            self._total += len(wrong)
            said = f"{len(wrong)} of its touches miss what the others say, and are asked for once more"
            notices.append(Notice("remark", f"{item.sensor.name}: {said}"))
        if not self._queue:
            self._again = False
            self._number += 1
            self.over = self._number == len(self.sensors)
            self._queue = [] if self.over else list(self.current.marks)
        return notices

    def _find_wrong(self, item: SensorTouches) -> list[Mark]:
        touches = [item.touches[number] for number in item.valid]
        if len(touches) < MIN_TOUCHES:
            return []
        agrees = agreeing(item.sensor, touches, self._mark_error)
        wrong = {touch.mark for touch, good in zip(touches, agrees, strict=True) if not good}
        return [mark for mark in item.marks if mark.place in wrong]


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
_PRESS_TIME = 0.4  # s for which the level of a press must rest
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
        super().__init__(2.0 * _PRESS_TIME)
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
        if len(levels) < 8 or self.samples.duration < _PRESS_TIME:
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
