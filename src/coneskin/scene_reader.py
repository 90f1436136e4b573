"""From the text of a scene file to a Scene, with every mistake reported at once. The keys: docs/scene.md."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import scene as s
from .errors import ConeSkinError, SceneError
from .link_tables import count_sensors, read_links, write_out
from .reaction_table import read_reaction
from .schema import Key, check

if TYPE_CHECKING:
    from .robot.watch import Watch
    from .skin.scripted_touch import ScriptedTouch
    from .skin.sensor import Sensor

__all__ = ["parse_scene", "read_scene"]

_TOP = ("arm", "link", "source", "reaction", "watch", "recording", "motion")
_ARM = (
    Key("model", str),
    Key("host", str),
    Key("watchdog_hz", float, 4.0, low=1.0, high=100.0),
    Key("control", str, "owner", choices=("owner", "foreign")),
    Key("table_z_mm", float, None, low=-5000.0, high=5000.0),
)
_SOURCE = (
    Key("kind", str, choices=("serial", "virtual")),
    Key("port", str, ""),
    Key("baud", int, 921600, low=1200, high=12_000_000),
    Key("rate_hz", float, 1000.0, low=1.0, high=10_000.0),
    Key("seed", int, 0, low=0, high=2**31),
    Key("model", str, "field", choices=("field", "ladder")),
    Key("touch", dict, ()),
)
_TOUCH = (
    Key("sensor", int, None, low=0, high=255),
    Key("start_s", low=0.0),
    Key("end_s", low=0.0),
    Key("u_mm", low=0.0, high=10_000.0),
    Key("phi_deg", low=0.0, high=360.0),
    Key("force_n", float, 5.0, low=0.0, high=1000.0),
    Key("radius_mm", float, 0.0, low=0.0, high=500.0),
)
_WATCH = (
    Key("skin_silence_ms", low=2.0, high=1000.0),
    Key("skin_late_ms", low=2.0, high=1000.0),
    Key("stuck_frames", int, low=0, high=1_000_000),
    Key("arm_silence_ms", low=4.0, high=1000.0),
    Key("escalate_ms", low=4.0, high=500.0),
    Key("standstill_rad_s", low=1e-4, high=0.1),
    Key("settle_ms", low=10.0, high=10_000.0),
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
        text = path.read_text(encoding="utf-8-sig")  # some editors put a mark in front
    except UnicodeDecodeError as exc:
        raise SceneError(
            [f"this is not a TOML text: byte {exc.start} cannot stand in UTF-8; save the scene as UTF-8 text"],
            str(path),
        ) from exc
    except (OSError, ValueError) as exc:
        why = getattr(exc, "strerror", None) or exc
        raise SceneError([f"the file cannot be read: {why}"], str(path)) from exc
    return parse_scene(text, path.name, path.parent)


def parse_scene(text: str, name: str = "scene", folder: Path = Path(), *, recorded: bool = False) -> s.Scene:
    """Read a scene from its text.

    Args:
        text: TOML.
        name: for the messages.
        folder: where relative paths start.
        recorded: the text comes from a recording, so that the files it names need not be there any more.

    Raises:
        SceneError: with every mistake.
    """
    try:
        tables = tomllib.loads(text)
    except (ValueError, RecursionError) as exc:  # a whole number of 5000 digits is a plain ValueError
        raise SceneError([f"not TOML: {exc}"], name) from exc
    named = frozenset(tables)
    problems = [f"unknown table [{t}]; known: {', '.join(_TOP)}" for t in tables if t not in _TOP]
    for table in ("arm", "source", "reaction", "watch", "recording", "motion"):
        if table in tables and not isinstance(tables[table], dict):
            problems.append(f"{table} must be one table: write [{table}], once, got {type(tables[table]).__name__}")
            del tables[table]
    text = write_out(tables, folder, problems) or text
    reaction, rules = read_reaction(tables["reaction"], problems) if "reaction" in tables else (None, ())
    scene = s.Scene(
        name=name,
        text=text,
        folder=folder,
        arm=_arm(tables, problems),
        links=read_links(tables, None if recorded else folder, problems),
        source=None,
        reaction=reaction,
        rules=rules,
        watch=_watch(tables, problems),
        recording=_recording(tables, folder, problems),
        motion=_motion(tables, problems),
    )
    scene = replace(scene, source=_source(scene, tables, problems))
    _check_together(scene, named, tables, problems)
    if problems:
        raise SceneError(problems, name)
    return scene


def _settings(keys: tuple[Key, ...], tables: Mapping[str, Any], name: str, problems: list[str]) -> dict[str, Any]:
    """The values of a table whose missing keys take the defaults of the dataclass that they are for."""
    required = {key.name for key in keys if key.kind is str}
    optional = tuple(key if key.name in required else replace(key, default=None) for key in keys)
    values = check(tables[name], optional, name, problems)
    return {key: value for key, value in values.items() if value is not None}


def _watch(tables: Mapping[str, Any], problems: list[str]) -> Watch | None:
    if "watch" not in tables:
        return None
    from .robot.watch import Watch

    return Watch(**_settings(_WATCH, tables, "watch", problems))


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
            del values["model"]
    if not values.get("host", "?").strip():
        problems.append("arm.host must name the controller, got an empty text")
    if len(values) < len(_ARM):
        return None
    return s.ArmScene(values["model"], values["host"], values["watchdog"], values["control"], values["table_z"])


def _source(scene: s.Scene, tables: Mapping[str, Any], problems: list[str]) -> s.SourceScene | None:
    if "source" not in tables:
        return None
    values = check(tables["source"], _SOURCE, "source", problems)
    kind = values.get("kind")
    built = [item.sensor for item in scene.sensors]
    sensors = [*built, *[None] * (count_sensors(tables) - len(built))]
    if kind == "serial" and not values["port"]:
        problems.append("source.port is missing: a device such as /dev/ttyUSB0, COM3 or hwgrep://0403:6001")
    for key in ("rate_hz", "seed", "model", "touch") if kind == "serial" else ("port", "baud"):
        if kind and key in tables["source"]:
            problems.append(f"source.{key} means nothing to a {kind} source: remove it")
    touches = [
        touch
        for number, table in enumerate(values["touch"], 1)
        if (touch := _touch(sensors, table, f"source.touch {number}", problems)) is not None
    ]
    if kind is None:
        return None
    rate, model = values["rate"], values["model"]
    return s.SourceScene(kind, values["port"], values["baud"], rate, values["seed"], model, tuple(touches))


def _touch(
    sensors: Sequence[Sensor | None], table: Mapping[str, Any], where: str, problems: list[str]
) -> ScriptedTouch | None:
    """A touch of the script; None stands among the sensors for each that has a mistake."""
    from .skin.scripted_touch import ScriptedTouch

    before = len(problems)
    values = check(table, _TOUCH, where, problems)
    start, end = values.get("start", -math.inf), values.get("end", math.inf)
    if not start < end:
        problems.append(f"{where}: start_s must be before end_s, got {start:g} s and {end:g} s")
    wanted = values.pop("sensor")
    known = () if wanted is None and None in sensors else sensors  # the first of them may be one with a mistake
    sensor = next((one for one in known if one is not None and wanted in (None, one.sensor_id)), None)
    if sensor is None:
        if None not in sensors:  # otherwise it may be that one
            problems.append(f"{where}: there is no sensor {'to touch' if wanted is None else f'with the id {wanted}'}")
        return None
    cone = sensor.frustum
    u, phi = values.get("u", 0.0), values.get("phi", 0.0)
    if u > cone.slant or phi > cone.wrap:
        problems.append(
            f"{where} is off {sensor.name}, whose u_mm ends at {1e3 * cone.slant:g} and phi_deg at "
            f"{math.degrees(cone.wrap):g}: got {1e3 * u:g} mm and {math.degrees(phi):g} deg"
        )
    return ScriptedTouch(**values, sensor=sensor.name) if len(problems) == before else None


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
            where = f"motion.waypoints_deg[{number}]"
            lines: list[str] = []
            points.append(check({"q_deg": row}, _WAYPOINT, where, lines).get("q", ()))
            problems += [line.replace(f"{where}.q_deg", where) for line in lines]
        if len(rows) < 2:
            problems.append(f"motion.waypoints_deg needs at least 2 waypoints, got {len(rows)}")
    table = {key: value for key, value in tables["motion"].items() if key != "waypoints_deg"}
    values = check(table, _MOTION[1:], "motion", problems)
    if not isinstance(rows, list):
        problems.append("motion.waypoints_deg must be a list of lists of 6 joint positions [deg]")
    return s.MotionScene(tuple(points), **values) if len(values) == len(_MOTION) - 1 else None


def _check_together(scene: s.Scene, named: frozenset[str], tables: Mapping[str, Any], problems: list[str]) -> None:
    """What only the tables together can show."""
    seen: dict[tuple[int, int] | str, str] = {}
    for link in scene.links:
        for item in link.sensors:
            sensor = item.sensor
            ident = (sensor.device_id, sensor.sensor_id)
            if ident in seen:
                problems.append(
                    f"link {link.name}: sensor {ident[1]} of device {ident[0]} is already on link {seen[ident]}; give "
                    "each sensor its own id"
                )
            elif sensor.name in seen:
                problems.append(f"link {link.name}: the name {sensor.name} is already on link {seen[sensor.name]}")
            seen[ident] = seen[sensor.name] = link.name
    if "reaction" in named and "arm" not in named:
        problems.append("[reaction] needs an [arm] that can react")
    if "motion" in named and "arm" not in named:
        problems.append("[motion] needs an [arm] that can move")
    foreign = scene.arm is not None and scene.arm.control == "foreign"
    if foreign and "motion" in named:
        problems.append("[motion] needs arm.control = owner: in a foreign arm another program makes the motion")
    if "source" in named and isinstance(tables.get("link", []), list) and not count_sensors(tables):
        problems.append("[source] needs a [[link]] with a [[link.sensor]] that its bytes come from")
    if "arm" in named:
        from .link_check import check_links

        check_links(scene, problems)
