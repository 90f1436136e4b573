"""Reader of the tables of links and sensors in a scene file: [[link]] and [[link.sensor]]."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from coneskin.scene.values.scene import LinkScene, PlacedSensor

from .schema import Key, check
from .sensor_table import apply_calibration, build_sensor, drop_calibration, merge_sensor_file

__all__ = [
    "LINK_KEYS",
    "count_sensors",
    "inline_sensor_files",
    "named_calibrations",
    "read_links",
    "sensor_files",
    "sensor_tables",
]

LINK_KEYS = (
    Key("name", str),
    Key("frame", str, "mesh", choices=("mesh", "urdf", "dh")),
    Key("mesh", str, None),
    Key("sensor", dict, ()),
)


def inline_sensor_files(
    tables: dict[str, Any], folder: Path | None, problems: list[str], calibrated: bool = True, changed: bool = False
) -> str:
    """Copy the keys of sensor files and calibrations into the sensors' tables.

    Args:
        tables: of the whole scene file; they are changed.
        folder: folder to which paths are relative; None where no file may be opened.
        problems: every mistake is added here.
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
                any_file, merged = True, drop_calibration(merged)
            elif "calibration" in merged:
                any_file, merged = True, apply_calibration(merged, sensor, folder, _is_simulated(tables), problems)
            table["sensor"][number] = merged
    if not any_file:
        return ""
    import tomli_w

    return tomli_w.dumps(tables)


def named_calibrations(tables: dict[str, Any], folder: Path) -> list[Path | None]:
    """Return the places that the sensors of a scene name for their calibrations, in the order of the file.

    Args:
        tables: of a scene file without mistakes.
        folder: folder to which paths are relative.
    """
    merged = [merge_sensor_file(item, "", folder, []) for item in sensor_tables(tables)]
    return [folder / str(table["calibration"]) if "calibration" in table else None for table in merged]


def sensor_files(tables: dict[str, Any], folder: Path) -> list[Path | None]:
    """Return the file of each sensor of a scene, where it names one; arguments as of ``named_calibrations``."""
    return [folder / str(table["file"]) if "file" in table else None for table in sensor_tables(tables)]


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
    """Read the links and their sensors.

    Args:
        tables: of the whole file, after ``inline_sensor_files``.
        folder: folder to which the paths of meshes are relative; None if the files need not exist.
        problems: every mistake is added here.
    """
    check({"link": tables.get("link", [])}, (Key("link", dict, ()),), "scene", problems)
    links: list[LinkScene] = []
    for number, (where, table) in enumerate(_link_tables(tables), 1):
        values = check(table, LINK_KEYS, where, problems)
        built = [build_sensor(item, name, problems) for name, item in _sensor_tables(where, table)]
        sensors = tuple(PlacedSensor(*item) for item in built if item is not None)
        mesh = None if values["mesh"] is None else (folder or Path()) / values["mesh"]
        if mesh is not None and folder is not None and not _is_file(mesh):
            problems.append(f"{where}.mesh: there is no file {mesh}")
        links.append(LinkScene(values.get("name", str(number)), values["frame"], mesh, sensors))
    return tuple(links)


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a name that is too long, a folder without permission
        return False


def sensor_tables(tables: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the tables of all sensors in the file."""
    return [item for link, table in _link_tables(tables) for _, item in _sensor_tables(link, table)]


def count_sensors(tables: Mapping[str, Any]) -> int:
    """Return the number of sensors in the file, with or without mistakes."""
    return len(sensor_tables(tables))
