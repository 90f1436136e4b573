"""Readers of [[link]] and [[link.sensor]] of a scene, and of the sensor file that ``coneskin design`` writes.

Each adds every mistake to ``problems``. Its messages begin with ``where``, the name of the table.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import ConeSkinError, GeometryError, SensorError
from coneskin.core.files import read_file
from coneskin.core.keys import Key, check
from coneskin.core.toml_text import parse_toml
from coneskin.scene.values.scene import LinkScene, PlacedSensor

from .keys import LINK_KEYS, MAX_SIZE
from .sensor_keys import CALIBRATION_KEYS, CONE_KEYS, SENSOR_KEYS

if TYPE_CHECKING:
    from coneskin.geometry.frustum import Frustum
    from coneskin.geometry.placed_frustum import PlacedFrustum
    from coneskin.geometry.pose import Pose
    from coneskin.skin.calibration import ForceTable, PlaceMap
    from coneskin.skin.electronics import Thresholds
    from coneskin.skin.sensor import Sensor

_NEEDS_CALIBRATION = "touch_force_n"
_CALIBRATION_NAMES = ("calibration", *(key.name for key in CALIBRATION_KEYS))


def merge_sensor_file(table: Mapping[str, Any], where: str, folder: Path | None, problems: list[str]) -> dict[str, Any]:
    """Return a sensor's table with the keys of its ``file`` added; its own keys take precedence.

    Args:
        folder: folder to which a relative ``file`` refers; None where no file may be opened.
    """
    own = dict(table)
    if "file" not in own:
        return own
    (name,) = check({"file": own.pop("file")}, (Key("file", str, None),), where, problems).values()
    if folder is None:
        problems.append(f"{where}.file: a recording carries the keys of its sensor files and names none, got {name}")
    elif name is not None:
        found = read_toml(folder / name, MAX_SIZE, f"{where}.file", problems)
        problems += [
            f"{where}: {key.name} = {own[key.name]} is far from {found[key.name]:.6g}, for which the sheet of file was "
            "cut: leave it out"
            for key in CONE_KEYS
            if _are_far_apart(own.get(key.name), found.get(key.name))
        ]
        return {**found, **own}
    return own


_TRIMMED = 0.1  # of a length or an angle by which a person may have cut a sheet otherwise


def _are_far_apart(own: Any, cut: Any) -> bool:
    """Tell whether a value of a scene cannot be that of a sheet which was trimmed by hand."""
    return all(isinstance(value, int | float) for value in (own, cut)) and abs(own - cut) > _TRIMMED * abs(cut)


def _drop_calibration(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return a sensor's table without its calibration, the keys that stand for one, and those that need one."""
    return {key: value for key, value in table.items() if key not in (*_CALIBRATION_NAMES, _NEEDS_CALIBRATION)}


def _apply_calibration(
    table: Mapping[str, Any], where: str, folder: Path | None, simulated: bool, problems: list[str]
) -> dict[str, Any]:
    """Return a sensor's table with the keys that its ``calibration`` stands for, in place of it."""
    plain = _drop_calibration(table)
    (name,) = check({"calibration": table["calibration"]}, (Key("calibration", str, None),), where, problems).values()
    if folder is None:
        problems.append(f"{where}.calibration: a recording carries the numbers of its calibrations and names no file")
    elif both := sorted(key for key in _CALIBRATION_NAMES[1:] if key in table):
        problems.append(f"{where}: {', '.join(both)} cannot stand beside calibration, which gives them: leave one out")
    # what is wrong with the sensor is reported when the table itself is read
    elif name is not None and (built := build_sensor(plain, where, [])) is not None:
        from coneskin.scene.values.calibration_file import calibration_keys

        try:
            needed = {key: table[key] for key in (_NEEDS_CALIBRATION,) if key in table}
            return {**plain, **needed, **calibration_keys(folder / name, built[0], simulated)}
        except ValueError as exc:
            problems.append(f"{where}.calibration: {exc}")
    return plain


def build_sensor(table: Mapping[str, Any], where: str, problems: list[str]) -> tuple[Sensor, PlacedFrustum] | None:
    """Build the sensor that a table with the keys of SENSOR_KEYS describes, and its place; None if it has a mistake."""
    before = len(problems)
    values = check(table, SENSOR_KEYS, where, problems)
    if len(problems) > before:
        return None
    from coneskin.geometry.frustum import Frustum
    from coneskin.geometry.pose import Pose
    from coneskin.skin.electronics import GivenElectronics, LeadOhms, Polarity, match_electronics
    from coneskin.skin.sensor import Sensor, sheet_resistances
    from coneskin.skin.tolerance import SHEET_CLASSES

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
                    current_zero=values["current_zero"],
                ),
            ),
            polarity=Polarity(values["radial_positive"], values["angular_positive"]),
            thresholds=_thresholds(table, values, forces),
            upper_sheet_ohms=values["upper_sheet"],
            lower_sheet_ohms=values["lower_sheet"],
            place_map=_place_map(frustum, values),
            force_table=forces,
            tolerance=replace(SHEET_CLASSES[values["sheet_class"]], map_error=values["map_error"]),
            known_ohms=tuple(values["map_sheet"] or ()),
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
    from coneskin.geometry.developable import Developable

    if len(wraps) != len(turns):
        raise GeometryError(
            f"bend_wrap_deg and bend_turn_deg must have a number each for every bend, got {len(wraps)} and {len(turns)}"
        )
    placed = Developable(frustum, pose, tuple(Bend(*bend) for bend in zip(wraps, turns, strict=True)), lift)
    placed.check_closed()
    return placed


def _place_map(frustum: Frustum, values: Mapping[str, Any]) -> PlaceMap | None:
    along, around = values["map_along"], values["map_around"]
    if along is None and around is None:
        return None
    from coneskin.skin.calibration import PlaceMap

    return PlaceMap(frustum, along or (0.0,) * 6, around or (0.0,) * 6, values["map_note"])


def _force_table(values: Mapping[str, Any]) -> ForceTable | None:
    forces, levels = values["forces"], values["force_levels"]
    if not forces and not levels:
        return None
    from coneskin.skin.calibration import ForceTable

    return ForceTable(tuple(forces or ()), tuple(levels or ()), values["force_error"])


def _thresholds(table: Mapping[str, Any], values: Mapping[str, Any], forces: ForceTable | None) -> Thresholds:
    from coneskin.skin.electronics import Thresholds

    force, location = values["touch_force"], values["location_level"]
    if force is None:
        return Thresholds(float(values["touch_level"]), values["release_level"], location)
    if "touch_level" in table:
        raise SensorError("touch_force_n and touch_level are two thresholds of one touch: leave one out")
    if forces is None:
        raise SensorError(
            f"touch_force_n = {force:g} needs a calibration with known forces: "
            "coneskin calibrate SCENE --forces 1,2,5,10, and calibration in this table"
        )
    touch = forces.level(force)
    return Thresholds(touch, values["release_level"], location if "location_level" in table else max(location, touch))


def read_toml(path: Path, limit: int, where: str, problems: list[str]) -> dict[str, Any]:
    """Return the tables of a file that a scene names, of at most so many bytes; none where it has a mistake."""
    try:
        return parse_toml(read_file(path, limit).decode("utf-8-sig"))
    except OSError as exc:
        problems.append(f"{where}: {path} cannot be read: {exc.strerror or exc}")
    except ValueError as exc:  # not TOML, or not UTF-8
        problems.append(f"{where}: {path} is not TOML: {exc}")
    return {}


_KEY_NAMES = {
    "electronics.supply_volts": "supply_v",
    "adc_volts": "adc_v",
    "electronics.adc_bits": "adc_bits",
    "electronics.input_ohms": "input_ohm",
    "pulldown_ohms": "pulldown_ohm",
    "electronics.lead_ohms": "lead_ohm",
    "electronics.current_full_scale": "current_full_scale_ma",
    "electronics.current_zero": "current_zero_ma",
}


def with_key_names(message: str) -> str:
    """Return a message of the sensor's classes with the names of the keys in the file."""
    for attribute, key in _KEY_NAMES.items():
        message = message.replace(attribute, key)
    return message


def inline_sensor_files(
    tables: dict[str, Any], folder: Path | None, problems: list[str], calibrated: bool = True, changed: bool = False
) -> str:
    """Copy the keys of sensor files and calibrations into the sensors' tables.

    Args:
        folder: folder to which paths are relative; None where no file may be opened.
        calibrated: False to leave calibrations out.
        changed: True where the tables are others than the text's already.

    Returns:
        the text of the scene with those keys; empty where no sensor has a file, and nothing is changed.
    """
    any_file = changed
    for link, table in _link_tables(tables):
        for number, (sensor, item) in enumerate(_sensor_tables(link, table)):
            any_file = any_file or "file" in item
            merged = merge_sensor_file(item, sensor, folder, problems)
            if not calibrated:
                any_file, merged = True, _drop_calibration(merged)
            elif "calibration" in merged:
                any_file, merged = True, _apply_calibration(merged, sensor, folder, _is_simulated(tables), problems)
            table["sensor"][number] = merged
    if not any_file:
        return ""
    import tomli_w

    return tomli_w.dumps(tables)


def named_files(tables: dict[str, Any], folder: Path, key: str) -> list[Path | None]:
    """Return what the sensors, or their files, name under "file" or "calibration", relative to a folder, in order."""
    merged = [{**merge_sensor_file(item, "", folder, []), **item} for item in sensor_tables(tables)]
    return [folder / str(table[key]) if key in table else None for table in merged]


def _is_simulated(tables: Mapping[str, Any]) -> bool:
    """Tell whether the source of a scene is a virtual skin."""
    from coneskin.skin.sources.kinds import is_simulated

    source = tables.get("source")
    if isinstance(source, list) and len(source) == 1:
        source = source[0]
    return isinstance(source, dict) and is_simulated(str(source.get("kind")))


def _link_tables(tables: Mapping[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    """Return the tables of the links, each with its name for messages."""
    return _named_tables("link", "name", tables.get("link"))


def _sensor_tables(link: str, table: Mapping[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    """Return the tables of a link's sensors, each with its name for messages."""
    return _named_tables(f"{link}, sensor", "id", table.get("sensor"))


def _named_tables(what: str, key: str, tables: Any) -> list[tuple[str, dict[str, Any]]]:
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        return []  # ``check`` reports it
    named = []
    for number, table in enumerate(tables, 1):
        name = table.get(key, "")
        short = isinstance(name, str | int) and name != "" and (isinstance(name, str) or abs(name) < 1_000_000)
        named.append((f"{what} {name if short else number}", table))
    return named


def read_links(tables: Mapping[str, Any], folder: Path | None, problems: list[str]) -> tuple[LinkScene, ...]:
    """Read the links and their sensors, from the tables that ``inline_sensor_files`` has completed.

    Args:
        folder: folder to which the paths of meshes are relative; None if the files need not exist.
    """
    check({"link": tables.get("link", [])}, (Key("link", dict, ()),), "scene", problems)
    links: list[LinkScene] = []
    for number, (where, table) in enumerate(_link_tables(tables), 1):
        values = check(table, LINK_KEYS, where, problems)
        built = [
            build_sensor(item, name, problems)
            for name, item in _sensor_tables(where, table)
            if not any(line.startswith(f"{name}.file: ") for line in problems)  # without it all of its keys are missing
        ]
        sensors = tuple(PlacedSensor(*item) for item in built if item is not None)
        mesh = None if values["mesh"] is None else (folder or Path()) / values["mesh"]
        if mesh is not None and folder is not None and not os.path.isfile(mesh):
            problems.append(f"{where}.mesh: there is no regular file {mesh}")
        links.append(LinkScene(values.get("name", str(number)), values["frame"], mesh, sensors))
    return tuple(links)


def sensor_tables(tables: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the tables of all sensors in the file."""
    return [item for link, table in _link_tables(tables) for _, item in _sensor_tables(link, table)]
