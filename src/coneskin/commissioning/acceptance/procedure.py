"""Procedure of a commissioning: marks are touched on each sensor in turn, and each must be read where it is. Pure."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass, field

from coneskin.commissioning.misreadings import RIGHT, Place, explain, misfit, miss, tolerance
from coneskin.commissioning.touching import Doubt, Held, Mark, Notice, TouchJudge
from coneskin.scene.commissioning_record import MarkResult
from coneskin.skin.detection.frame.reading import TouchReading
from coneskin.skin.sensor import Sensor

from .marks import plan_marks

_HOLD_TIME = 0.3  # s for which a touch must rest at a certain place
_REST_RADIUS = 0.008  # m; a place that moves farther does not rest
_OTHER_TIME = 0.4  # s of a touch elsewhere, after which it counts
_DOUBT_TIME = 2.0  # s of touch without a certain place, after which the person is told
_MAX_ATTEMPTS = 2  # at a mark; once the sensor has failed at one, 1
_SYSTEMATIC_PART = 0.5  # tolerances; an offset that all marks have together may not be larger


@dataclass
class SensorMarks:
    """Marks of one sensor, and what has become of them."""

    sensor: Sensor  #: the sensor
    offered: Sequence[Mark]  #: all places that can be described
    plan: tuple[Mark, ...] = ()  #: places to touch, those touched already first
    refused: list[Mark] = field(default_factory=list)  #: places that a person cannot reach
    results: list[MarkResult] = field(default_factory=list)  #: of those touched
    read: list[Place] = field(default_factory=list)  #: places that it read there
    cause: str = ""  #: why it has failed; empty where it has not

    @property
    def failed(self) -> bool:
        """True once a mark was not read where it is."""
        return any(not result.passed for result in self.results)

    @property
    def located(self) -> tuple[list[Place], list[Place]]:
        """Marks that were read at some place of this sensor, and these places."""
        pairs = [(mark.place, read) for mark, read in zip(self.plan, self.read, strict=False) if not math.isnan(read.u)]
        return [mark for mark, _ in pairs], [read for _, read in pairs]


class Procedure(TouchJudge["TouchReading"]):
    """Procedure over the sensors of a scene, one mark after the other.

    Args:
        sensors: with the places that can be described; in the order in which they are touched.
    """

    too_short = "{} s is too short, or the place was not certain: touch it and hold it"

    def __init__(self, sensors: Sequence[SensorMarks]) -> None:
        super().__init__(_HOLD_TIME + 1e-9)
        self.sensors = tuple(sensors)
        self._number = self._attempts = 0
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

    def ask(self) -> Notice:
        """Ask for the next mark, or once more for the same."""
        item = self.current
        self.mark = item.plan[len(item.results)]
        total = sum(len(other.plan) for other in self.sensors)
        number = 1 + sum(len(other.results) for other in self.sensors)
        return self.mark.request(item.sensor, number, total, again=self._attempts > 0)

    def hold(self, touch: Held[TouchReading]) -> list[Notice] | Doubt:
        """Judge the place of a touch once it rests; a touch of another sheet counts as a miss."""
        name = self.current.sensor.name
        touched = [one for one, seen in touch.readings.items() if seen is not None]
        reading, others = touch.readings.get(name), [one for one in touched if one != name]
        if reading is None or not reading.location_valid or others:
            self.samples.clear()
        if reading is not None and others:
            return Doubt(f"{', '.join(touched)} are touched at once: touch one place only", _OTHER_TIME)
        if reading is None:
            wrong = f"{others[0]} reads this touch: their id are exchanged, or the wrong sheet was touched"
            nowhere = Place(math.nan, math.nan)
            return [] if touch.told or touch.duration < _OTHER_TIME else self._judge(nowhere, 0.0, False, wrong)
        if not reading.location_valid:
            why = f": {reading.doubt}" if reading.doubt else ""
            return Doubt(f"the place is not certain{why}; touch it firmly with one finger", _DOUBT_TIME)
        self.samples.feed(touch.now, reading.u, reading.phi, reading.level)
        if not self._rests():
            return []
        read = Place(statistics.median(self.samples.values(0)), statistics.median(self.samples.values(1)))
        assert self.mark is not None
        passed = misfit(self.current.sensor, RIGHT, [self.mark.place], [read]).largest <= 1.0
        return self._judge(read, statistics.median(self.samples.values(2)), passed, "")

    def refuse(self) -> list[Notice]:
        """Leave out the mark; another one is offered."""
        assert self.mark is not None
        self.current.refused.append(self.mark)
        self._plan(self.current)
        return [Notice("failed", self.incomplete)] if self.incomplete else []

    # ---- one mark

    def _rests(self) -> bool:
        if self.samples.duration < 0.9 * _HOLD_TIME:
            return False
        along, around = self.samples.values(0), self.samples.values(1)
        radius = self.current.sensor.frustum.radius_at(along[0])
        return math.hypot(max(along) - min(along), radius * (max(around) - min(around))) <= _REST_RADIUS

    def _judge(self, read: Place, level: float, passed: bool, wrong: str) -> list[Notice]:
        item, mark = self.current, self.mark
        assert mark is not None
        self._attempts += 1
        distance = 0.0 if wrong else 1e3 * math.hypot(*miss(item.sensor, mark.place, read))
        said = wrong or f"it reads {_text(read)}, {distance:.0f} mm from the mark at {_text(mark.place)}"
        if not passed and self._attempts < _MAX_ATTEMPTS and not item.failed:
            return [Notice("remark", f"{said}; touch the same mark once more")]
        u_mm, phi_deg = _in_file_units(mark.place)
        read_u, read_phi = (0.0, 0.0) if wrong else _in_file_units(read)
        place = item.sensor.name, mark.where, u_mm, phi_deg, read_u, read_phi
        result = MarkResult(*place, round(distance, 1), round(level, 3), self._attempts, passed)
        item.results.append(result)
        item.read.append(read)
        self._attempts, self.mark = 0, None
        if wrong:
            item.cause = wrong
        elif not passed and not item.cause.endswith("was touched"):
            item.cause = explain(item.sensor, *item.located)
        text = said if passed else f"{said}: {item.cause}"
        details = {"sensor": item.sensor.name, "passed": passed, "read_u_mm": read_u, "read_phi_deg": read_phi}
        details |= {"distance_mm": result.distance_mm, "level": result.level, "cause": "" if passed else item.cause}
        notices = [Notice("passed" if passed else "failed", text, details)]
        if len(item.results) == len(item.plan):
            notices.append(self._finish(item))
        return notices

    def _finish(self, item: SensorMarks) -> Notice:
        """Judge a sensor whose marks were all touched, and go on to the next one."""
        marks, read = item.located
        if len(read) == len(item.read):  # else the cause is an exchange of sheets, and stays
            allowed, fit = tolerance(item.sensor), misfit(item.sensor, RIGHT, marks, read)
            off = abs(fit.u) > _SYSTEMATIC_PART * allowed.u or abs(fit.phi) > _SYSTEMATIC_PART * allowed.phi
            if item.failed or off:
                item.cause = explain(item.sensor, marks, read)
        self._number += 1
        self.over = self._number == len(self.sensors)
        details = {"sensor": item.sensor.name, "passed": not item.cause, "cause": item.cause}
        said = f"has NOT passed: {item.cause}" if item.cause else "has passed"
        return Notice("sensor", f"{item.sensor.name} {said}", details)

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
