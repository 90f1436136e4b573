"""Touch sequence of a calibration: readings and time go in, notices for the person and mean places come out. Pure.

A touch is read once it rests and its mean is known well; touches that miss what most others say are asked for again.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from coneskin.commissioning.acceptance.misreadings import Place
from coneskin.commissioning.acceptance.procedure import Notice

from .fit import agreeing
from .refusals import LEAST_TOUCHES, KnownTouch

if TYPE_CHECKING:
    from coneskin.commissioning.acceptance.marks import Mark
    from coneskin.skin.detection.frame.touch_reading import TouchReading
    from coneskin.skin.sensor import Sensor

__all__ = ["SensorTouches", "TouchSequence"]

_HOLD = 0.3  # s for which a touch must rest at a certain place
_LONGEST = 1.0  # s of readings that make a mean
_STILL = 0.004  # m; a place that moves farther does not rest
_GOOD = 0.05e-3  # m; standard error of the mean, and half the change from the first half of the readings to the second
_QUIET = 0.1  # s without a touch before the next mark
_IMPATIENT = 3.0  # s of touch without a result, after which the person is told why


@dataclass
class SensorTouches:
    """Marks of one sensor, and the touches of them.

    Attributes:
        sensor: the sensor.
        marks: to touch.
        touches: in the order in which they were made; one that was asked for again is in it twice.
        repeated: places in ``touches`` that a later touch of the same mark replaces.
    """

    sensor: Sensor
    marks: Sequence[Mark]
    touches: list[KnownTouch] = field(default_factory=list)
    repeated: set[int] = field(default_factory=set)

    @property
    def valid(self) -> list[int]:
        """Places in ``touches`` of those that no later one replaces."""
        return [number for number in range(len(self.touches)) if number not in self.repeated]


class _Sample(NamedTuple):
    time: float
    u: float
    phi: float


class TouchSequence:
    """Sequence over the sensors of a scene, one mark after the other.

    Args:
        sensors: with their marks.
        mark_error: standard deviation with which marks are placed and found, at least [m].

    Attributes:
        mark: the mark that is waited for; None once it is over.
        over: there is nothing more to touch.
        incomplete: why it cannot be carried out; empty where it can.
    """

    def __init__(self, sensors: Sequence[SensorTouches], mark_error: float) -> None:
        self.sensors = tuple(sensors)
        self.mark: Mark | None = None
        self.over = False
        self.incomplete = ""
        self._mark_error = mark_error
        self._number = self._done = 0
        self._queue = list(self.sensors[0].marks)
        self._total = sum(len(item.marks) for item in self.sensors)
        self._again = False
        self._wait_clear, self._told = True, False
        self._quiet_since: float | None = None
        self._touched_since: float | None = None
        self._samples: list[_Sample] = []

    @property
    def current(self) -> SensorTouches:
        """Sensor that is touched now."""
        return self.sensors[min(self._number, len(self.sensors) - 1)]

    def look(self, now: float, readings: Mapping[str, TouchReading | None]) -> list[Notice]:
        """Take what the sensors read now.

        Args:
            now: [s], monotonic.
            readings: sensor's name -> its reading; None where it is not touched.
        """
        if self.over or self.incomplete:
            return []
        touched = [name for name, reading in readings.items() if reading is not None]
        if self._wait_clear:
            return self._await_clear(now, bool(touched))
        if not touched:
            early = self._touched_since is not None
            self._start_mark()
            return (
                [Notice("remark", "that was too short: touch the mark, and hold it until it is read")] if early else []
            )
        if self._touched_since is None:
            self._touched_since = now
        return self._held(now, touched, readings.get(self.current.sensor.name))

    def refuse(self) -> list[Notice]:
        """Take the mark that is waited for as one that the person cannot reach; it is left out."""
        if self.mark is None or self.over or self.incomplete:
            return []
        left = self._queue[1:]
        if len({touch.mark for touch in self.current.touches} | {mark.place for mark in left}) < LEAST_TOUCHES:
            name = self.current.sensor.name
            self.incomplete = f"{name}: fewer than {LEAST_TOUCHES} marks are left, too few for a calibration"
            return [Notice("failed", self.incomplete)]
        return self._advance()

    def _await_clear(self, now: float, touched: bool) -> list[Notice]:
        if touched:
            self._quiet_since = None
        elif self._quiet_since is None:
            self._quiet_since = now
        elif now - self._quiet_since >= _QUIET:
            self._wait_clear = False
            return self._name_mark()
        return []

    def _start_mark(self) -> None:
        self._samples, self._touched_since, self._told = [], None, False

    def _name_mark(self) -> list[Notice]:
        self._start_mark()
        self.mark = mark = self._queue[0]
        sensor = self.current.sensor.name
        details = {"number": self._done + 1, "of": self._total, "sensor": sensor, "where": mark.where}
        details |= {"u_mm": round(1e3 * mark.u, 1), "phi_deg": round(math.degrees(mark.phi), 1)}
        text = f"{self._done + 1} of {self._total}: touch {sensor} {mark.where}"
        return [Notice("again", f"once more, {text}", details) if self._again else Notice("mark", text, details)]

    def _held(self, now: float, touched: Sequence[str], reading: TouchReading | None) -> list[Notice]:
        assert self._touched_since is not None
        why = "the place does not rest: hold it still, with something narrow and blunt"
        if len(touched) > 1 or reading is None:
            self._samples = []
            why = f"touched now: {', '.join(touched)}; touch {self.current.sensor.name} only, at one place"
        elif not reading.location_valid:
            self._samples = []
            why = (
                f"the place is not certain{f': {reading.doubt}' if reading.doubt else ''}; touch it firmly at one place"
            )
        else:
            if not self._samples or reading.time > self._samples[-1].time:
                self._samples.append(_Sample(reading.time, reading.u, reading.phi))
            oldest = self._samples[-1].time - _LONGEST
            self._samples = [sample for sample in self._samples if sample.time >= oldest]
            if self._is_good():
                return self._take()
        if now - self._touched_since >= _IMPATIENT and not self._told:
            self._told = True
            return [Notice("remark", why)]
        return []

    def _is_good(self) -> bool:
        """Tell whether the place rests, and its mean is known well enough."""
        samples = self._samples
        if samples[-1].time - samples[0].time < _HOLD or len(samples) < 4:
            return False
        radius = self.current.sensor.frustum.radius_at(samples[-1].u)
        half = len(samples) // 2
        for values in ([s.u for s in samples], [radius * s.phi for s in samples]):
            spread = statistics.stdev(values)
            drift = abs(statistics.fmean(values[:half]) - statistics.fmean(values[half:]))
            error = spread / math.sqrt(len(values))
            if max(values) - min(values) > _STILL or error > _GOOD or drift > 2.0 * _GOOD + 4.0 * error:
                return False
        return True

    def _take(self) -> list[Notice]:
        item, mark = self.current, self.mark
        assert mark is not None
        read = Place(statistics.fmean(s.u for s in self._samples), statistics.fmean(s.phi for s in self._samples))
        if self._again:
            item.repeated |= {number for number in item.valid if item.touches[number].mark == mark.place}
        item.touches.append(KnownTouch(mark.place, read))
        around = item.sensor.frustum.radius_at(mark.u) * math.remainder(read.phi - mark.phi, 2.0 * math.pi)
        off = 1e3 * math.hypot(read.u - mark.u, around)
        text = f"{1e3 * (read.u - mark.u):+.2f} mm along and {1e3 * around:+.2f} mm around, {off:.2f} mm from the mark"
        details = {"sensor": item.sensor.name, "read_u_mm": round(1e3 * read.u, 3)}
        details |= {"read_phi_deg": round(math.degrees(read.phi), 4), "distance_mm": round(off, 3)}
        self._wait_clear, self._quiet_since = True, None
        return [Notice("read", f"it reads {text}", details), *self._advance(told=True)]

    def _advance(self, told: bool = False) -> list[Notice]:
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
        return notices if told or self.over else [*notices, *self._name_mark()]

    def _find_wrong(self, item: SensorTouches) -> list[Mark]:
        touches = [item.touches[number] for number in item.valid]
        if len(touches) < LEAST_TOUCHES:
            return []
        wrong = {
            touch.mark
            for touch, agrees in zip(touches, agreeing(item.sensor, touches, self._mark_error), strict=True)
            if not agrees
        }
        return [mark for mark in item.marks if mark.place in wrong]
