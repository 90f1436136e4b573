"""Procedure of a commissioning: readings and time go in, notices for the person and results come out. Pure."""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from coneskin.scene.commissioning_record import MarkResult

from .marks import Mark, plan_marks
from .misreadings import RIGHT, Place, explain, misfit, tolerance
from .sensor_marks import SensorMarks

if TYPE_CHECKING:
    from coneskin.skin.detection.frame.touch_reading import TouchReading

__all__ = ["Notice", "Procedure"]

_HOLD = 0.3  # s for which a touch must rest at a certain place
_STILL = 0.008  # m; a place that moves farther does not rest
_QUIET = 0.1  # s without a touch before the next mark
_UNCERTAIN = 2.0  # s of touch without a certain place, after which the person is told
_ATTEMPTS = 2  # at a mark; once the sensor has failed at one, 1
_SYSTEMATIC = 0.5  # tolerances; an offset that all marks have together may not be larger


class Notice(NamedTuple):
    """What the person is told.

    Attributes:
        kind: "mark" (touch this), "again" (the same once more), "passed", "failed", "remark", "sensor" (it is over).
        text: for people.
        details: for programs.
    """

    kind: str
    text: str
    details: Mapping[str, Any] = MappingProxyType({})


class _Sample(NamedTuple):
    time: float
    u: float
    phi: float
    level: float


class Procedure:
    """Procedure over the sensors of a scene, one mark after the other.

    Args:
        sensors: with the places that can be described; in the order in which they are touched.

    Attributes:
        mark: the mark that is waited for; None once it is over.
        over: there is nothing more to touch.
        incomplete: why it cannot be carried out; empty where it can.
    """

    def __init__(self, sensors: Sequence[SensorMarks]) -> None:
        self.sensors = tuple(sensors)
        self.mark: Mark | None = None
        self.over = False
        self.incomplete = ""
        self._number = 0
        self._quiet_since: float | None = None
        self._touched_since: float | None = None
        self._wait_clear, self._told, self._attempts = True, False, 0
        self._samples: list[_Sample] = []
        self._wrong_sensor = ""
        for item in self.sensors:
            self._plan(item)

    @property
    def passed(self) -> bool:
        """True where it is over and every sensor has passed."""
        return self.over and not self.incomplete and all(not item.cause for item in self.sensors)

    @property
    def cause(self) -> str:
        """Why it has not passed, for people."""
        return "; ".join(f"{item.sensor.name}: {item.cause}" for item in self.sensors if item.cause)

    @property
    def current(self) -> SensorMarks:
        """Sensor whose marks are touched now."""
        return self.sensors[min(self._number, len(self.sensors) - 1)]

    def look(self, now: float, readings: Mapping[str, TouchReading | None]) -> list[Notice]:
        """Take what the sensors read now.

        Args:
            now: [s], monotonic.
            readings: sensor's name -> its reading; None where it is not touched.
        """
        if self.over or self.incomplete:
            return []
        touched = {name: reading for name, reading in readings.items() if reading is not None}
        if self._wait_clear:
            return self._await_clear(now, bool(touched))
        if not touched:
            return self._released(now)
        self._quiet_since = None
        if self._touched_since is None:
            self._touched_since = now
        return self._held(now, touched)

    def refuse(self) -> list[Notice]:
        """Take the mark that is waited for as one that the person cannot reach; another is offered."""
        if self.mark is None or self.over or self.incomplete:
            return []
        item = self.current
        item.refused.append(self.mark)
        self._plan(item)
        if self.incomplete:
            return [Notice("failed", self.incomplete)]
        return self._next()

    # ---- one mark

    def _await_clear(self, now: float, touched: bool) -> list[Notice]:
        if touched:
            self._quiet_since = None
        elif self._quiet_since is None:
            self._quiet_since = now
        elif now - self._quiet_since >= _QUIET:
            self._wait_clear = False
            return self._next()
        return []

    def _next(self) -> list[Notice]:
        item, done = self.current, len(self.current.results)
        again = self.mark is not None and self._attempts > 0
        self.mark = item.plan[done]
        self._samples, self._touched_since, self._told, self._wrong_sensor = [], None, False, ""
        total = sum(len(other.plan) for other in self.sensors)
        number = 1 + sum(len(other.results) for other in self.sensors)
        text = f"{number} of {total}: touch {item.sensor.name} {self.mark.where}"
        u_mm, phi_deg = _in_file_units(self.mark.place)
        details = {
            "number": number,
            "of": total,
            "sensor": item.sensor.name,
            "where": self.mark.where,
            "u_mm": u_mm,
            "phi_deg": phi_deg,
        }
        return [Notice("again", f"once more, {text}", details) if again else Notice("mark", text, details)]

    def _released(self, now: float) -> list[Notice]:
        if self._touched_since is None:
            return []
        short = now - self._touched_since
        self._samples, self._touched_since, self._told, self._wrong_sensor = [], None, False, ""
        return [Notice("remark", f"{short:.1f} s is too short, or the place was not certain: touch it and hold it")]

    def _held(self, now: float, touched: Mapping[str, TouchReading]) -> list[Notice]:
        assert self._touched_since is not None
        name = self.current.sensor.name
        reading = touched.get(name)
        others = [other for other in touched if other != name]
        if reading is None or others:
            self._samples = []
            if now - self._touched_since < _HOLD + _QUIET or self._told:
                return []
            if reading is not None:
                self._told = True
                return [Notice("remark", f"{', '.join(touched)} are touched at once: touch one place only")]
            return self._judge_other(others[0])
        if reading.location_valid:
            self._samples.append(_Sample(now, reading.u, reading.phi, reading.level))
        else:
            self._samples = []
        self._samples = [sample for sample in self._samples if now - sample.time <= _HOLD + 1e-9]
        if self._rests(now):
            return self._judge()
        if now - self._touched_since >= _UNCERTAIN and not self._told and not reading.location_valid:
            self._told = True
            why = f": {reading.doubt}" if reading.doubt else ""
            return [Notice("remark", f"the place is not certain{why}; touch it firmly with one finger")]
        return []

    def _rests(self, now: float) -> bool:
        samples = self._samples
        if not samples or now - samples[0].time < 0.9 * _HOLD:
            return False
        radius = self.current.sensor.frustum.radius_at(samples[0].u)
        along = max(s.u for s in samples) - min(s.u for s in samples)
        around = radius * (max(s.phi for s in samples) - min(s.phi for s in samples))
        return math.hypot(along, around) <= _STILL

    def _judge(self) -> list[Notice]:
        item, mark = self.current, self.mark
        assert mark is not None
        read = Place(
            statistics.median(sample.u for sample in self._samples),
            statistics.median(sample.phi for sample in self._samples),
        )
        level = statistics.median(sample.level for sample in self._samples)
        passed = misfit(item.sensor, RIGHT, [mark.place], [read]).largest <= 1.0
        return self._note(read, level, passed, "")

    def _judge_other(self, other: str) -> list[Notice]:
        wrong = f"{other} reads this touch: their id are exchanged, or the wrong sheet was touched"
        return self._note(Place(math.nan, math.nan), 0.0, False, wrong)

    def _note(self, read: Place, level: float, passed: bool, wrong: str) -> list[Notice]:
        item, mark = self.current, self.mark
        assert mark is not None
        self._attempts += 1
        self._wait_clear, self._quiet_since = True, None
        cone = item.sensor.frustum
        around = cone.radius_at(mark.u) * math.remainder(read.phi - mark.phi, 2.0 * math.pi) if not wrong else math.nan
        distance = 1e3 * math.hypot(read.u - mark.u, around)
        said = wrong or f"it reads {_text(read)}, {distance:.0f} mm from the mark at {_text(mark.place)}"
        if not passed and self._attempts < _ATTEMPTS and not item.failed:
            return [Notice("remark", f"{said}; touch the same mark once more")]
        u_mm, phi_deg = _in_file_units(mark.place)
        read_u, read_phi = (0.0, 0.0) if wrong else _in_file_units(read)
        result = MarkResult(
            item.sensor.name,
            mark.where,
            u_mm,
            phi_deg,
            read_u,
            read_phi,
            0.0 if wrong else round(distance, 1),
            round(level, 3),
            self._attempts,
            passed,
        )
        item.results.append(result)
        item.read.append(read)
        self._attempts = 0
        marks = [place.place for place in item.plan[: len(item.results)]]
        if wrong:
            item.cause = wrong
        elif not passed and not item.cause.endswith("was touched"):
            clean = [(place, seen) for place, seen in zip(marks, item.read, strict=True) if not math.isnan(seen.u)]
            item.cause = explain(item.sensor, [place for place, _ in clean], [seen for _, seen in clean])
        text = said if passed else f"{said}: {item.cause}"
        details = {"sensor": item.sensor.name, "passed": passed, "read_u_mm": read_u, "read_phi_deg": read_phi}
        details |= {"distance_mm": result.distance_mm, "level": result.level, "cause": "" if passed else item.cause}
        notices = [Notice("passed" if passed else "failed", text, details)]
        if len(item.results) == len(item.plan):
            notices.append(self._finish(item, marks))
        return notices

    def _finish(self, item: SensorMarks, marks: list[Place]) -> Notice:
        """Judge a sensor whose marks were all touched, and go on to the next one."""
        seen = [(place, read) for place, read in zip(marks, item.read, strict=True) if not math.isnan(read.u)]
        if not item.failed:
            allowed = tolerance(item.sensor)
            fit = misfit(item.sensor, RIGHT, marks, item.read)
            if abs(fit.u) > _SYSTEMATIC * allowed.u or abs(fit.phi) > _SYSTEMATIC * allowed.phi:
                item.cause = explain(item.sensor, marks, item.read)
        elif len(seen) == len(item.read):
            item.cause = explain(item.sensor, marks, item.read)
        self._number += 1
        self.over = self._number == len(self.sensors)
        self.mark = None
        details = {"sensor": item.sensor.name, "passed": not item.cause, "cause": item.cause}
        if item.cause:
            return Notice("sensor", f"{item.sensor.name} has NOT passed: {item.cause}", details)
        return Notice("sensor", f"{item.sensor.name} has passed", details)

    def _plan(self, item: SensorMarks) -> None:
        taken = item.plan[: len(item.results)]
        plan = plan_marks(item.sensor, item.offered, taken, item.refused)
        if plan is None:
            self.incomplete = (
                f"{item.sensor.name}: the {len(item.offered) - len(item.refused)} places that are left cannot show "
                "every wrong wiring and mounting; put the arm where more of the sheet can be reached, and begin again"
            )
        else:
            item.plan = plan


def _in_file_units(place: Place) -> tuple[float, float]:
    return round(1e3 * place.u, 1), round(math.degrees(place.phi), 1)


def _text(place: Place) -> str:
    return f"u = {1e3 * place.u:.0f} mm, phi = {math.degrees(place.phi):.0f} deg"
