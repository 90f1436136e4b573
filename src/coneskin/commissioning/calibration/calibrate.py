"""Run of a calibration: its marks, skin and touch sequence together, then the fit and its record."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from coneskin.commissioning.misreadings import Place
from coneskin.commissioning.skin_watch import SkinWatch, TouchSession
from coneskin.commissioning.touching import Mark
from coneskin.core.errors import SceneError, SkinError
from coneskin.core.files import read_file
from coneskin.core.text import read_json
from coneskin.core.version import __version__
from coneskin.geometry.drawing.touch_marks import mark_parts
from coneskin.scene.tables.sensor_keys import CONE_KEYS
from coneskin.scene.values.calibration_file import CalibrationRecord, TouchResult, sensor_fingerprint
from coneskin.skin.sensor import Sensor

from .fit import CalibrationFit, fit_map
from .touches import ForceSequence, SensorPresses, SensorTouches, TouchSequence, fit_forces


def _calibration_marks(sensor: Sensor, count: int = 9) -> tuple[Mark, ...]:
    """Return the marks of a sensor, row by row from end 1, each row from the end of the one before.

    Around, the words have parts and no lengths: the face that is touched is farther out than the layers that are read.

    Args:
        count: their number: 4, 9 or 16, as many along as around.
    """
    cone = sensor.frustum
    places = (Place(along * cone.slant, around * cone.wrap) for along, around in mark_parts(math.isqrt(count)))
    return tuple(Mark(*place, _place_words(sensor, place)) for place in places)


def _place_words(sensor: Sensor, place: Place) -> str:
    """Return how a person finds a place."""
    along, around = place.u / sensor.frustum.slant, place.phi / sensor.frustum.wrap
    return (
        f"{1e3 * place.u:.1f} mm from electrode B (end 1) along the side, which is {100.0 * along:.0f} % of the way "
        f"to A, and {100.0 * around:.0f} % of the way around from electrode D to C (between their inner edges)"
    )


_DESIGN_FILE = "design.json"
_SHEET_FOLDER = re.compile(r"sheet-([1-9][0-9]?)")
_MAX_BYTES = 10_000_000
_SIZE_TOLERANCE = 1e-3  # mm or deg; design.json is rounded


def _printed_marks(sensor: Sensor, sheet: Mapping[str, Any]) -> tuple[Mark, ...]:
    """Return the marks that are printed on the cover of a sensor; none where its sheet in design.json is another."""
    cone, drawn = sensor.frustum, sheet.get("active_cone", {})
    sizes = ((drawn.get(key.name, math.inf), key.in_file_unit(getattr(cone, key.plain))) for key in CONE_KEYS)
    if any(abs(size - own) > _SIZE_TOLERANCE for size, own in sizes):
        return ()
    marks = []
    for row in sheet.get("touch_marks", ()):
        place = Place(1e-3 * row["u_mm"], math.radians(row["phi_deg"]))
        words = f"at the cross with number {row['number']}, {_place_words(sensor, place)}"
        marks.append(Mark(*place, words))
    return tuple(marks)


def _find_design(sensor_file: Path) -> Mapping[str, Any] | None:
    """Return the table of the sheet that a sensor file was written with; None where there is no design beside it.

    Raises:
        SceneError: there is one, and it cannot be read.
    """
    folder = sensor_file.parent
    own = _SHEET_FOLDER.fullmatch(folder.name)
    places = [(folder, 0), *([(folder.parent, int(own[1]) - 1)] if own else [])]
    for place, number in places:
        path = place / _DESIGN_FILE
        if path.is_file():
            try:
                return dict(read_json(read_file(path, _MAX_BYTES))["sheets"][number])
            except (OSError, ValueError, TypeError, LookupError) as exc:
                raise SceneError([f"the marks of {path} cannot be read: {exc}"], path.name) from exc
    return None


_VIRTUAL_DURATION = 1.5  # s of a touch of a virtual skin; it ends by itself
_VIRTUAL_PRESS = 4.0  # s of a press with a known force, likewise


@dataclass(frozen=True, slots=True)
class CalibrationResult:
    """Result for one sensor."""

    touches: SensorTouches  #: of its marks
    fit: CalibrationFit | None = None  #: None where the sensor was refused
    record: CalibrationRecord | None = None  #: to be added to the file of its device; None where it was refused
    refusal: str = ""  #: why it cannot be calibrated; empty where it can


class Calibrator:
    """One calibration of all sensors of a scene.

    Args:
        session: with the skin of the scene, which was read without calibrations.
        marks: on each sensor: 4, 9 or 16; 0: those that its design has printed, else 9.
        mark_error: standard deviation with which marks are placed and found, at least [m].
        forces: known ones to press with after the marks [N]; none: no table of forces.
        files: sensor file of each sensor, whose design may have printed marks; none where it has none.
    """

    def __init__(
        self,
        session: TouchSession,
        marks: int = 0,
        mark_error: float = 0.3e-3,
        forces: Sequence[float] = (),
        files: Sequence[Path | None] = (),
    ) -> None:
        self._session = session
        self._mark_error = mark_error
        pairs = itertools.zip_longest(session.scene.sensors, files)
        self.sensors = [SensorTouches(item.sensor, _marks(item.sensor, marks, file)) for item, file in pairs]
        self._forces = tuple(forces)
        self._pressed = [SensorPresses(item.sensor, _pressed_marks(item.marks)) for item in self.sensors]

    def run(self, by: str = "") -> list[CalibrationResult]:
        """Carry it out, with the name of who touches.

        Returns:
            the result of each sensor; no file is written.

        Raises:
            SkinError: the skin has a fault, cannot be read, or too few marks can be reached.
        """
        with self._session.watch() as watch:
            ohms = watch.untouched_ohms()
            self._touch(TouchSequence(self.sensors, self._mark_error), watch, _VIRTUAL_DURATION)
            if self._forces:
                self._touch(ForceSequence(self._pressed, self._forces), watch, _VIRTUAL_PRESS)
        wrong = [watch.contradiction(item.sensor.name) for item in self.sensors]
        return [self._result(*of_sensor, by) for of_sensor in zip(self.sensors, ohms.values(), wrong, strict=True)]

    def _touch(self, sequence: TouchSequence | ForceSequence, watch: SkinWatch, duration: float) -> None:
        self._session.carry_out(sequence, watch, duration)
        if sequence.incomplete:
            raise SkinError(sequence.incomplete)

    def _result(self, item: SensorTouches, ohms: tuple[float, float], contradiction: str, by: str) -> CalibrationResult:
        sensor, valid = item.sensor, item.valid
        try:
            fit = fit_map(sensor, [item.touches[number] for number in valid], self._mark_error, ohms)
            presses = self._pressed[self.sensors.index(item)].presses
            forces = fit_forces(presses) if presses else None
            if contradiction:  # the fit names other mistakes first
                raise SkinError(f"{sensor.name} cannot be calibrated: {contradiction}")
        except SkinError as exc:
            return CalibrationResult(item, refusal=str(exc))
        used = dict(zip(valid, fit.used, strict=True))
        touches = tuple(
            TouchResult(*_in_file_units(mark), *_in_file_units(read), used.get(number, False))
            for number, (mark, read) in enumerate(item.touches)
        )
        record = CalibrationRecord(
            sensor=sensor.sensor_id,
            name=sensor.name,
            date=datetime.now(UTC).isoformat(timespec="seconds"),
            coneskin=__version__,
            by=by,
            simulated=self._session.simulated,
            fingerprint=sensor_fingerprint(sensor),
            map_along=fit.place_map.along,
            map_around=fit.place_map.around,
            fitted_along=fit.along,
            fitted_around=fit.around,
            before_rms_mm=_in_mm(fit.before.rms),
            before_largest_mm=_in_mm(fit.before.largest),
            after_rms_mm=_in_mm(fit.after.rms),
            after_largest_mm=_in_mm(fit.after.largest),
            map_error_mm=_in_mm(fit.map_error),
            extra_ohm=tuple(round(value, 1) for value in fit.extra_ohms),
            sheet_ohm=tuple(round(value, 1) for value in ohms),
            touches=touches,
            forces_n=forces.forces if forces else (),
            force_levels=forces.levels if forces else (),
            force_error=forces.error if forces else 0.0,
        )
        return CalibrationResult(item, fit, record)


def _in_mm(metres: float) -> float:
    return round(1e3 * metres, 3)


def _in_file_units(place: Place) -> tuple[float, float]:
    return _in_mm(place.u), round(math.degrees(place.phi), 4)


def _pressed_marks(marks: Sequence[Mark]) -> tuple[Mark, ...]:
    """Return the marks that are pressed with known forces: the first, the middle and the last."""
    return tuple(dict.fromkeys((marks[0], marks[len(marks) // 2], marks[-1])))


def _marks(sensor: Sensor, count: int, file: Path | None) -> tuple[Mark, ...]:
    """Return the marks of a sensor: as many as are asked for, or those that its design has printed on it."""
    sheet = None if count or file is None else _find_design(file)
    printed = () if sheet is None else _printed_marks(sensor, sheet)
    return printed or _calibration_marks(sensor, count or 9)
