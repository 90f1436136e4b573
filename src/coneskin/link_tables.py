"""The tables of links and sensors in a scene file: [[link]] and [[link.sensor]]."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .scene import LinkScene, PlacedSensor
from .schema import Key, check
from .sensor_table import build_sensor, with_file

__all__ = ["LINK_KEYS", "count_sensors", "read_links", "write_out"]

LINK_KEYS = (
    Key("name", str),
    Key("frame", str, "mesh", choices=("mesh", "urdf", "dh")),
    Key("mesh", str, None),
    Key("sensor", dict, ()),
)


def write_out(tables: dict[str, Any], folder: Path, problems: list[str]) -> str:
    """Put the keys of the files that sensors name into the sensors' tables.

    Args:
        tables: of the whole file; they are changed.
        folder: where the paths start.
        problems: every mistake is added here.

    Returns:
        the text of the scene with those keys in it; empty where no sensor names a file.
    """
    any_file = False
    for link, table in _link_tables(tables):
        for number, (sensor, item) in enumerate(_sensor_tables(link, table)):
            any_file = any_file or "file" in item
            table["sensor"][number] = with_file(item, sensor, folder, problems)
    if not any_file:
        return ""
    import tomli_w

    return tomli_w.dumps(tables)


def _link_tables(tables: Mapping[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    """The tables of the links, each with what to call it."""
    return _called("link", "name", tables.get("link"))


def _sensor_tables(link: str, table: Mapping[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    """The tables of a link's sensors, each with what to call it."""
    return _called(f"{link}, sensor", "id", table.get("sensor"))


def _called(what: str, key: str, tables: Any) -> list[tuple[str, dict[str, Any]]]:
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        return []  # ``check`` says so
    named = []
    for number, table in enumerate(tables, 1):
        name = table.get(key, "")
        short = isinstance(name, str | int) and name != "" and (isinstance(name, str) or abs(name) < 1_000_000)
        named.append((f"{what} {name if short else number}", table))
    return named


def read_links(tables: Mapping[str, Any], folder: Path | None, problems: list[str]) -> tuple[LinkScene, ...]:
    """The links and their sensors.

    Args:
        tables: of the whole file, after ``write_out``.
        folder: where the path of a mesh starts; None where its file need not be there.
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
    except OSError:  # a name that is too long, a folder that may not be searched
        return False


def count_sensors(tables: Mapping[str, Any]) -> int:
    """Sensors that the file has, with or without mistakes."""
    return sum(len(_sensor_tables(link, table)) for link, table in _link_tables(tables))
