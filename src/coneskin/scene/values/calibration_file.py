"""Calibration file of one device: the calibrations of its sensors, oldest first, none of them ever taken out.

A scene names it, or its folder, with ``calibration``; the newest calibration of a sensor applies. It holds for the
sensor as the scene describes it: after a change of geometry, wiring or electronics it is void.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import Any

from coneskin.core.errors import ConeSkinError, SceneError
from coneskin.core.files import read_file, write_whole
from coneskin.core.text import read_json
from coneskin.skin.sensor import Sensor

from .scene import facts_digest, sensor_facts

_MAX_BYTES = 1 << 20  # of a file, about 250 calibrations
_FIELD_KINDS = {"float": float, "int": int, "str": str, "bool": bool}  # of a record's fields that are one value each
_HOW_TO = "see `coneskin calibrate`"


@dataclass(frozen=True, slots=True)
class TouchResult:
    """Result of one touch of a calibration."""

    u_mm: float  #: slant distance of the mark from end 1 [mm]
    phi_deg: float  #: azimuth of the mark [deg]
    read_u_mm: float  #: as the sensor decoded it, without a map [mm]
    read_phi_deg: float  #: as the sensor decoded it, without a map [deg]
    used: bool  #: False where it misses what most others say


@dataclass(frozen=True, slots=True)
class CalibrationRecord:
    """Record of one calibration of one sensor.

    Attributes:
        sensor: its number on the wire.
        name: what people call it.
        date: when it ended, UTC, as ISO 8601 has it.
        coneskin: the version.
        by: who has touched; empty where nobody said so.
        simulated: the sensor was a virtual one.
        fingerprint: of the sensor as its scene describes it; see ``sensor_fingerprint``.
        map_along: numbers of the place map, as ``PlaceMap.along``.
        map_around: as ``PlaceMap.around``.
        fitted_along: what was fitted, in words.
        fitted_around: what was fitted, in words.
        before_rms_mm: root mean square distance of what was read from the marks, without a map [mm].
        before_largest_mm: largest of these distances [mm].
        after_rms_mm: the same with a map, cross-validated [mm].
        after_largest_mm: largest of these distances [mm].
        map_error_mm: standard deviation of a place that was not touched, along and around each [mm].
        extra_ohm: unknown leads and joints of A, B, C and D, if it is those [ohm].
        sheet_ohm: what its untouched sheets have per square, upper and lower, as their currents say [ohm].
        touches: in the order in which they were made.
        forces_n: known forces, rising [N]; empty where none was pressed.
        force_levels: that they gave.
        force_error: standard deviation of a force that is read, of itself, cross-validated.
    """

    sensor: int
    name: str
    date: str
    coneskin: str
    by: str
    simulated: bool
    fingerprint: str
    map_along: tuple[float, ...]
    map_around: tuple[float, ...]
    fitted_along: str
    fitted_around: str
    before_rms_mm: float
    before_largest_mm: float
    after_rms_mm: float
    after_largest_mm: float
    map_error_mm: float
    extra_ohm: tuple[float, ...]
    sheet_ohm: tuple[float, ...]
    touches: tuple[TouchResult, ...]
    forces_n: tuple[float, ...] = ()
    force_levels: tuple[float, ...] = ()
    force_error: float = 0.0

    @property
    def day(self) -> str:
        """Day on which it ended, UTC."""
        return self.date[:10]


def sensor_fingerprint(sensor: Sensor) -> str:
    """Return a hash of all that the places that a sensor decodes depend on; see ``sensor_facts``."""
    return facts_digest(sensor_facts(sensor))


def calibration_path(place: Path, device_id: int) -> Path:
    """Return the file of a device: what a scene names, or where that is no .json file, a file in that folder."""
    return place if place.suffix.lower() == ".json" else place / f"device-{device_id}.json"


def _read_calibrations(path: Path, device_id: int) -> tuple[CalibrationRecord, ...]:
    """Read all calibrations of a device, oldest first.

    Raises:
        FileNotFoundError: there is no file.
        ValueError: it cannot be read, is no calibration file, or is that of another device; the message says why.
    """
    try:
        table = read_json(read_file(path, _MAX_BYTES))
        device, rows = table["device"], table["calibrations"]
        records = tuple(_record(row) for row in rows)
    except FileNotFoundError:
        raise
    except OSError as exc:
        raise ValueError(f"{path} cannot be read: {exc.strerror or exc}") from exc
    except (ValueError, TypeError, AttributeError, KeyError) as exc:
        raise ValueError(f"{path} is no calibration file: {exc}") from exc
    if device != device_id:
        raise ValueError(f"{path} has the calibrations of device {device}, and not of device {device_id}")
    return records


def _record(row: dict[str, Any]) -> CalibrationRecord:
    lists: dict[str, Any] = {
        name: tuple(row.pop(name, ()))
        for name in ("map_along", "map_around", "extra_ohm", "sheet_ohm", "forces_n", "force_levels")
    }
    touches = tuple(TouchResult(**touch) for touch in row.pop("touches"))
    record = CalibrationRecord(**row, **lists, touches=touches)
    datetime.fromisoformat(record.date)
    fitted = [*(value for values in lists.values() for value in values), record.force_error]
    numbers = list(fitted)
    parts: list[CalibrationRecord | TouchResult] = [record, *touches]
    for item in parts:
        for field in fields(item):
            value, kind = getattr(item, field.name), _FIELD_KINDS.get(str(field.type))
            if kind is float:
                numbers.append(value)
            elif kind is not None and type(value) is not kind:
                raise ValueError(f"the calibration of {record.date} has {field.name} = {value!r}, no {field.type}")
    if not all(isinstance(value, int | float) and not isinstance(value, bool) for value in numbers):
        raise ValueError(f"the calibration of {record.date} has something else where a number should be")
    if not all(map(math.isfinite, fitted)) or record.force_error < 0.0:
        raise ValueError(f"the calibration of {record.date} has a number that cannot be")
    return record


def add_calibration(path: Path, device_id: int, record: CalibrationRecord) -> None:
    """Add a calibration to the file of its device, whole or not at all.

    A file that would become too long is kept beside it under the name of the day, and a new one is begun.

    Raises:
        SceneError: the file cannot be written, or what is there is no calibration file of this device and stays.
    """
    try:
        try:
            records: Sequence[CalibrationRecord] = _read_calibrations(path, device_id)
        except FileNotFoundError:
            records = ()
            path.parent.mkdir(parents=True, exist_ok=True)
        text = _text(device_id, [*records, record])
        if len(text.encode()) > _MAX_BYTES:
            write_whole(_old_path(path, record.day), _text(device_id, records))
            newest = {(old.sensor, old.simulated): old for old in records}
            text = _text(device_id, [*newest.values(), record])
        write_whole(path, text)
    except ValueError as exc:
        raise SceneError([f"the calibration was not written: {exc}; move that file away"], path.name) from exc
    except OSError as exc:
        raise SceneError([f"the calibration {path} cannot be written: {exc.strerror or exc}"], path.name) from exc


def _text(device_id: int, records: Sequence[CalibrationRecord]) -> str:
    return json.dumps({"device": device_id, "calibrations": [asdict(record) for record in records]}, indent=1) + "\n"


def _old_path(path: Path, day: str) -> Path:
    names = (f"{path.stem}.until-{day}{f'-{number}' if number > 1 else ''}.json" for number in count(1))
    return next(old for name in names if not (old := path.with_name(name)).exists())


def _find_calibration(path: Path, sensor: Sensor, simulated: bool) -> CalibrationRecord:
    """Return the calibration that applies to a sensor.

    Raises:
        ValueError: none applies; the message says why.
    """
    try:
        records = _read_calibrations(path, sensor.device_id)
    except FileNotFoundError as exc:
        raise ValueError(f"there is no calibration {path}: {_HOW_TO}") from exc
    kind = "virtual" if simulated else "real"
    own = [item for item in records if item.sensor == sensor.sensor_id and item.simulated is simulated]
    if not own:
        raise ValueError(f"{path} has no calibration of the {kind} sensor {sensor.sensor_id}: {_HOW_TO}")
    if own[-1].fingerprint != sensor_fingerprint(sensor):
        raise ValueError(
            f"the calibration of sensor {sensor.sensor_id} of {own[-1].day} in {path} was made with another geometry, "
            f"wiring or electronics than the scene has now: calibrate again, {_HOW_TO}"
        )
    return own[-1]


def calibration_keys(place: Path, sensor: Sensor, simulated: bool) -> dict[str, Any]:
    """Return the keys of a sensor's table that its calibration stands for.

    Args:
        place: what the scene names, a file or a folder.
        sensor: without a map.

    Raises:
        ValueError: no calibration applies, or its map is none; the message says why.
    """
    path = calibration_path(place, sensor.device_id)
    record = _find_calibration(path, sensor, simulated)
    from coneskin.skin.calibration import PlaceMap

    try:
        PlaceMap(sensor.frustum, record.map_along, record.map_around)
    except ConeSkinError as exc:
        raise ValueError(f"the calibration of {record.day} in {path} is of no use: {exc}") from exc
    note = (
        f"{path.name} of {record.day}, {len(record.touches)} touches, {record.before_rms_mm:.2f} mm became "
        f"{record.after_rms_mm:.2f} mm (rms, cross-validated)"
    )
    keys: dict[str, Any] = {
        "map_along": list(record.map_along),
        "map_around": list(record.map_around),
        "map_error_mm": record.map_error_mm,
        "map_note": note,
        "map_sheet_ohm": list(record.sheet_ohm),
    }
    if record.forces_n:
        keys |= {"forces_n": list(record.forces_n), "force_levels": list(record.force_levels)}
        keys["force_error"] = record.force_error
    return keys
