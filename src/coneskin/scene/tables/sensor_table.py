"""Table of one sensor, in a scene or in the sensor.toml that ``coneskin design`` writes."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.core.bounded_file import read_file
from coneskin.core.errors import ConeSkinError, GeometryError, SensorError

from .cone_keys import CONE_KEYS
from .schema import MAX_SIZE, Key, check
from .sensor_keys import CALIBRATION_KEYS, SENSOR_KEYS

if TYPE_CHECKING:
    from coneskin.geometry.frustum import Frustum
    from coneskin.geometry.placed_frustum import PlacedFrustum
    from coneskin.geometry.pose import Pose
    from coneskin.skin.calibration import ForceTable, PlaceMap
    from coneskin.skin.electronics import Thresholds
    from coneskin.skin.sensor import Sensor

__all__ = [
    "apply_calibration",
    "build_sensor",
    "drop_calibration",
    "merge_sensor_file",
    "with_key_names",
]

_NEEDS_CALIBRATION = "touch_force_n"
_CALIBRATED = ("calibration", *(key.name for key in CALIBRATION_KEYS))


def merge_sensor_file(table: Mapping[str, Any], where: str, folder: Path | None, problems: list[str]) -> dict[str, Any]:
    """Return a sensor's table with the keys of its ``file`` added; its own keys take precedence.

    Args:
        table: of the scene.
        where: name of the table, for messages.
        folder: folder to which a relative ``file`` refers; None where no file may be opened.
        problems: every mistake is added here.
    """
    own = dict(table)
    if "file" not in own:
        return own
    (name,) = check({"file": own.pop("file")}, (Key("file", str, None),), where, problems).values()
    if folder is None:
        problems.append(f"{where}.file: a recording carries the keys of its sensor files and names none, got {name}")
    elif name is not None:
        return {**_from_file(folder / name, where, problems), **own}
    return own


def drop_calibration(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return a sensor's table without its calibration, the keys that stand for one, and those that need one."""
    return {key: value for key, value in table.items() if key not in (*_CALIBRATED, _NEEDS_CALIBRATION)}


def apply_calibration(
    table: Mapping[str, Any], where: str, folder: Path | None, simulated: bool, problems: list[str]
) -> dict[str, Any]:
    """Return a sensor's table with the keys that its ``calibration`` stands for, in place of it.

    Args:
        table: of the scene, its ``file`` merged.
        where: name of the table, for messages.
        folder: folder to which a relative path refers; None where no file may be opened.
        simulated: the sensor is a virtual one.
        problems: every mistake is added here.
    """
    plain = drop_calibration(table)
    (name,) = check({"calibration": table["calibration"]}, (Key("calibration", str, None),), where, problems).values()
    if folder is None:
        problems.append(f"{where}.calibration: a recording carries the numbers of its calibrations and names no file")
    elif both := sorted(key for key in _CALIBRATED[1:] if key in table):
        problems.append(f"{where}: {', '.join(both)} cannot stand beside calibration, which gives them: leave one out")
    elif name is not None:
        built = build_sensor(plain, where, [])  # what is wrong with it is reported when the table itself is read
        if built is not None:
            from coneskin.scene.values.calibration_file import calibration_keys

            try:
                needed = {key: table[key] for key in (_NEEDS_CALIBRATION,) if key in table}
                return {**plain, **needed, **calibration_keys(folder / name, built[0], simulated)}
            except ValueError as exc:
                problems.append(f"{where}.calibration: {exc}")
    return plain


def build_sensor(table: Mapping[str, Any], where: str, problems: list[str]) -> tuple[Sensor, PlacedFrustum] | None:
    """Build the sensor that a table describes, with its place.

    Args:
        table: with the keys of SENSOR_KEYS.
        where: name of the table, for messages.
        problems: every mistake is added here.

    Returns:
        the sensor and its placed frustum; None if the table has a mistake.
    """
    before = len(problems)
    values = check(table, SENSOR_KEYS, where, problems)
    if len(problems) > before:
        return None
    from coneskin.geometry.frustum import Frustum
    from coneskin.geometry.pose import Pose
    from coneskin.skin.electronics import GivenElectronics, LeadOhms, Polarity, match_electronics
    from coneskin.skin.sensor import Sensor, sheet_resistances

    try:
        frustum = Frustum(**{key.plain: values[key.plain] for key in CONE_KEYS})
        forces = _force_table(values)
        sensor = Sensor(
            frustum=frustum,
            sensor_id=values["id"],
            device_id=values["device"],
            name=values["name"],
            electronics=match_electronics(
                *sheet_resistances(frustum, values["upper_sheet"], values["lower_sheet"]),
                GivenElectronics(
                    supply_volts=values["supply"],
                    adc_volts=values["adc"],
                    adc_bits=values["adc_bits"],
                    pulldown_ohms=values["pulldown"],
                    input_ohms=values["input"],
                    lead_ohms=LeadOhms(*values["lead"]),
                    current_full_scale=values["current_full_scale"],
                ),
            ),
            polarity=Polarity(values["radial_positive"], values["angular_positive"]),
            thresholds=_thresholds(table, values, forces),
            upper_sheet_ohms=values["upper_sheet"],
            lower_sheet_ohms=values["lower_sheet"],
            place_map=_place_map(frustum, values),
            force_table=forces,
        )
        pose = Pose.from_xyz_rpy(values["xyz"], values["rpy"])
        return sensor, _place(frustum, pose, values["bend_wrap"], values["bend_turn"], values["bend_lift"])
    except ConeSkinError as exc:
        turn = math.degrees(values["wrap"])
        hint = f"; wrap_deg = {turn:g} looks like radians: then write {math.degrees(turn):.4g}" if turn < 6.3 else ""
        problems.append(f"{where}: {with_key_names(str(exc))}{hint}")
        return None


def _place(frustum: Frustum, pose: Pose, wraps: Sequence[float], turns: Sequence[float], lift: float) -> PlacedFrustum:
    """Return the place of a sensor: on a cone, or on a general cylinder or cone where bends are given."""
    from coneskin.geometry.placed_frustum import PlacedFrustum

    if not wraps and not turns:
        if lift:
            raise GeometryError(f"bend_lift_mm = {1e3 * lift:g} needs bend_wrap_deg and bend_turn_deg: a cone has none")
        return PlacedFrustum(frustum, pose)
    from coneskin.geometry.bend import Bend
    from coneskin.geometry.placed_developable import PlacedDevelopable

    if len(wraps) != len(turns):
        raise GeometryError(
            f"bend_wrap_deg and bend_turn_deg must have a number each for every bend, got {len(wraps)} and {len(turns)}"
        )
    placed = PlacedDevelopable(frustum, pose, tuple(Bend(*bend) for bend in zip(wraps, turns, strict=True)), lift)
    placed.side.check_closed()
    return placed


def _place_map(frustum: Frustum, values: Mapping[str, Any]) -> PlaceMap | None:
    along, around = values["map_along"], values["map_around"]
    if along is None and around is None:
        return None
    from coneskin.skin.calibration import PlaceMap

    return PlaceMap(frustum, along or (0.0,) * 5, around or (0.0,) * 5, values["map_note"])


def _force_table(values: Mapping[str, Any]) -> ForceTable | None:
    forces, levels = values["forces"], values["force_levels"]
    if not forces and not levels:
        return None
    from coneskin.skin.calibration import ForceTable

    return ForceTable(tuple(forces or ()), tuple(levels or ()), values["force_error"])


def _thresholds(table: Mapping[str, Any], values: Mapping[str, Any], forces: ForceTable | None) -> Thresholds:
    from coneskin.skin.electronics import Thresholds

    touch, location = _touch_level(table, values, forces), values["location_level"]
    if values["touch_force"] is not None and "location_level" not in table:
        location = max(location, touch)
    return Thresholds(touch, values["release_level"], location)


def _touch_level(table: Mapping[str, Any], values: Mapping[str, Any], forces: ForceTable | None) -> float:
    """Return the level of the touch threshold, which may be given as a force."""
    force = values["touch_force"]
    if force is None:
        return float(values["touch_level"])
    if "touch_level" in table:
        raise SensorError("touch_force_n and touch_level are two thresholds of one touch: leave one out")
    if forces is None:
        raise SensorError(
            f"touch_force_n = {force:g} needs a calibration with known forces: "
            "coneskin calibrate SCENE --forces 1,2,5,10, and calibration in this table"
        )
    return forces.level(force)


def _from_file(path: Path, where: str, problems: list[str]) -> dict[str, Any]:
    try:
        return tomllib.loads(read_file(path, MAX_SIZE).decode("utf-8-sig"))
    except OSError as exc:
        problems.append(f"{where}.file: {path} cannot be read: {exc.strerror or exc}")
    except (ValueError, RecursionError) as exc:  # not TOML, not UTF-8, or an integer of 5000 digits
        problems.append(f"{where}.file: {path} is not TOML: {exc}")
    return {}


_KEY_NAMES = {
    "electronics.supply_volts": "supply_v",
    "adc_volts": "adc_v",
    "electronics.adc_bits": "adc_bits",
    "electronics.input_ohms": "input_ohm",
    "pulldown_ohms": "pulldown_ohm",
    "electronics.lead_ohms": "lead_ohm",
    "electronics.current_full_scale": "current_full_scale_ma",
}


def with_key_names(message: str) -> str:
    """Return a message of the sensor's classes with the names of the keys in the file."""
    for attribute, key in _KEY_NAMES.items():
        message = message.replace(attribute, key)
    return message
