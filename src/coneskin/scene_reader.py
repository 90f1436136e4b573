"""From the text of a scene file to a Scene, with every mistake reported at once. The keys: docs/scene.md."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from . import scene as s
from .errors import ConeSkinError, SceneError
from .schema import Key, check
from .sensor_table import build_sensor

__all__ = ["parse_scene", "read_scene"]

_TOP = ("arm", "link", "source", "reaction", "watch", "recording", "motion")
_ARM = (
    Key("model", str),
    Key("host", str),
    Key("watchdog_hz", float, 4.0, low=1.0, high=100.0),
)
_LINK = (
    Key("name", str),
    Key("frame", str, "mesh", choices=("mesh", "dh")),
    Key("mesh", str, None),
    Key("sensor", dict, ()),
)
_SOURCE = (
    Key("kind", str, choices=("serial", "virtual")),
    Key("port", str, ""),
    Key("baud", int, 921600, low=1200, high=12_000_000),
    Key("rate_hz", float, 1000.0, low=1.0, high=10_000.0),
    Key("seed", int, 0, low=0, high=2**31),
    Key("touch", dict, ()),
)
_TOUCH = (
    Key("sensor", int, low=0, high=255),
    Key("start_s", low=0.0),
    Key("end_s", low=0.0),
    Key("u_mm", low=0.0, high=10_000.0),
    Key("phi_deg", low=0.0, high=360.0),
    Key("level", float, 0.8, low=0.0, high=0.99, above=True),
)
_REACTION = (
    Key("kind", str, choices=("stop", "retreat")),
    Key("deceleration_rad_s2", float, 10.0, low=0.5, high=40.0),
    Key("distance_mm", float, 0.05, low=0.0, high=500.0, above=True),
    Key("speed_mm_s", float, 0.1, low=1.0, high=1000.0),
    Key("acceleration_rad_s2", float, 2.0, low=0.1, high=40.0),
    Key("time_s", float, 2.0, low=0.05, high=30.0),
)
_WATCH = (
    Key("skin_silence_ms", float, 0.05, low=2.0, high=1000.0),
    Key("arm_silence_ms", float, 0.05, low=4.0, high=1000.0),
    Key("escalate_ms", float, 0.025, low=4.0, high=500.0),
    Key("standstill_rad_s", float, 0.01, low=1e-4, high=0.1),
)
_RECORDING = (Key("folder", str),)
_MOTION = (
    Key("waypoints_deg", dict, ...),
    Key("speed_deg_s", float, low=0.1, high=360.0),
    Key("acceleration_deg_s2", float, low=1.0, high=2000.0),
    Key("rounds", int, 0, low=0),
)
_WAYPOINT = (Key("q_deg", list, low=-363.0, high=363.0, length=6),)


def read_scene(path: Path) -> s.Scene:
    """Read a scene from a file.

    Raises:
        SceneError: the file cannot be read, or has mistakes.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as exc:
        why = getattr(exc, "strerror", None) or exc
        raise SceneError([f"the file cannot be read: {why}"], str(path)) from exc
    return parse_scene(text, path.name, path.parent)


def parse_scene(text: str, name: str = "scene", folder: Path = Path()) -> s.Scene:
    """Read a scene from its text.

    Args:
        text: TOML.
        name: for the messages.
        folder: where relative paths start.

    Raises:
        SceneError: with every mistake.
    """
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as exc:
        raise SceneError([f"not TOML: {exc}"], name) from exc
    problems: list[str] = []
    problems += [f"unknown table [{t}]; known: {', '.join(_TOP)}" for t in tables if t not in _TOP]
    for table in ("arm", "source", "reaction", "watch", "recording", "motion"):
        if table in tables and not isinstance(tables[table], dict):
            problems.append(f"{table} must be a table: write [{table}]")
            del tables[table]
    scene = s.Scene(
        name=name,
        text=text,
        folder=folder,
        arm=_arm(tables, problems),
        links=_links(tables, folder, problems),
        source=_source(tables, problems),
        reaction=_section(s.ReactionScene, _REACTION, tables, "reaction", problems),
        watch=_section(s.WatchScene, _WATCH, tables, "watch", problems) or s.WatchScene(),
        recording=_recording(tables, folder, problems),
        motion=_motion(tables, problems),
    )
    _check_together(scene, tables, problems)
    if problems:
        raise SceneError(problems, name)
    return scene


def _section(kind: Any, keys: tuple[Key, ...], tables: Mapping[str, Any], name: str, problems: list[str]) -> Any:
    """A dataclass from a table of the same keys; None where the table is missing or a required key is."""
    if name not in tables:
        return None
    values = check(tables[name], keys, name, problems)
    return kind(**values) if len(values) == len(keys) else None


def _arm(tables: Mapping[str, Any], problems: list[str]) -> s.ArmScene | None:
    if "arm" not in tables:
        return None
    values = check(tables["arm"], _ARM, "arm", problems)
    if "model" in values:
        from .robot.ur_models import model

        try:
            values["model"] = model(values["model"]).name
        except ConeSkinError as exc:
            problems.append(f"arm.model: {exc}")
    if not values.get("host", "?").strip():
        problems.append("arm.host must name the controller, got an empty text")
    return s.ArmScene(values["model"], values["host"], values["watchdog"]) if len(values) == len(_ARM) else None


def _links(tables: Mapping[str, Any], folder: Path, problems: list[str]) -> tuple[s.LinkScene, ...]:
    listed = check({"link": tables.get("link", [])}, (Key("link", dict, ()),), "scene", problems)["link"]
    links: list[s.LinkScene] = []
    for number, table in enumerate(listed, 1):
        where = f"link {table.get('name', number)}"
        values = check(table, _LINK, where, problems)
        sensors = []
        for index, item in enumerate(values["sensor"], 1):
            built = build_sensor(item, f"{where}, sensor {item.get('id', index)}", folder, problems)
            if built is not None:
                sensors.append(s.PlacedSensor(*built))
        mesh = folder / values["mesh"] if values["mesh"] else None
        if mesh is not None and not mesh.is_file():
            problems.append(f"{where}.mesh: there is no file {mesh}")
        links.append(s.LinkScene(values.get("name", str(number)), values["frame"], mesh, tuple(sensors)))
    return tuple(links)


def _source(tables: Mapping[str, Any], problems: list[str]) -> s.SourceScene | None:
    if "source" not in tables:
        return None
    values = check(tables["source"], _SOURCE, "source", problems)
    touches = []
    for number, table in enumerate(values["touch"], 1):
        touch = check(table, _TOUCH, f"source.touch {number}", problems)
        if len(touch) == len(_TOUCH):
            touches.append(s.TouchScene(**touch))
            if not touch["start"] < touch["end"]:
                problems.append(f"source.touch {number}: start_s must be before end_s")
    kind = values.get("kind")
    if kind == "serial" and not values["port"]:
        problems.append("source.port is missing: a device such as /dev/ttyUSB0, COM3 or hwgrep://0403:6001")
    for key in ("rate_hz", "seed", "touch") if kind == "serial" else ("port", "baud"):
        if kind and key in tables["source"]:
            problems.append(f"source.{key} means nothing to a {kind} source: remove it")
    if kind is None:
        return None
    return s.SourceScene(kind, values["port"], values["baud"], values["rate"], values["seed"], tuple(touches))


def _recording(tables: Mapping[str, Any], folder: Path, problems: list[str]) -> s.RecordingScene | None:
    if "recording" not in tables:
        return None
    values = check(tables["recording"], _RECORDING, "recording", problems)
    return s.RecordingScene(folder / values["folder"]) if values else None


def _motion(tables: Mapping[str, Any], problems: list[str]) -> s.MotionScene | None:
    if "motion" not in tables:
        return None
    rows = tables["motion"].get("waypoints_deg")
    points = []
    if isinstance(rows, list):
        for number, row in enumerate(rows, 1):
            point = check({"q_deg": row}, _WAYPOINT, f"motion.waypoints_deg {number}", problems)
            points.append(point.get("q", ()))
        if len(rows) < 2:
            problems.append(f"motion.waypoints_deg needs at least 2 waypoints, got {len(rows)}")
    table = {key: value for key, value in tables["motion"].items() if key != "waypoints_deg"}
    values = check(table, _MOTION[1:], "motion", problems)
    if not isinstance(rows, list):
        problems.append("motion.waypoints_deg must be a list of lists of 6 joint positions [deg]")
    return s.MotionScene(tuple(points), **values) if len(values) == len(_MOTION) - 1 else None


def _check_together(scene: s.Scene, tables: Mapping[str, Any], problems: list[str]) -> None:
    """What only the tables together can show."""
    seen: dict[tuple[int, int], str] = {}
    for link in scene.links:
        for item in link.sensors:
            ident = (item.sensor.device_id, item.sensor.sensor_id)
            if ident in seen:
                problems.append(
                    f"link {link.name}: sensor {ident[1]} of device {ident[0]} is already on link {seen[ident]}"
                )
            seen[ident] = link.name
    if "reaction" in tables and "arm" not in tables:
        problems.append("[reaction] needs an [arm] that can react")
    if "motion" in tables and "arm" not in tables:
        problems.append("[motion] needs an [arm] that can move")
    if "source" in tables and not tables.get("link"):
        problems.append("[source] needs a [[link]] with a [[link.sensor]] that its bytes come from")
    for number, touch in enumerate(scene.source.touches if scene.source else (), 1):
        cone = next((p.sensor.frustum for p in scene.sensors if p.sensor.sensor_id == touch.sensor), None)
        if cone is None:
            problems.append(f"source.touch {number}: there is no sensor {touch.sensor}")
        elif touch.u > cone.slant or touch.phi > cone.wrap + 1e-9:
            problems.append(
                f"source.touch {number} is off sensor {touch.sensor}, which is {1e3 * cone.slant:g} mm long: "
                f"u_mm = {1e3 * touch.u:g}"
            )
    if scene.arm is not None:
        from .link_check import check_links

        check_links(scene, problems)
