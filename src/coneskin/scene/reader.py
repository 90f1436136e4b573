"""Reader of scene files, which reports every mistake at once. The keys are described in docs/look-up/scene.md."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import KinematicsError, SceneError
from coneskin.core.files import read_text
from coneskin.core.keys import check
from coneskin.core.text import suggest
from coneskin.core.toml_text import parse_toml

from .tables.arm_tables import read_arm_tables
from .tables.keys import COMMISSIONING_KEYS, MAX_SIZE, RECORDING_KEYS
from .tables.sensor_tables import inline_sensor_files, read_links, sensor_tables
from .tables.source_tables import read_source
from .values import scene as s

if TYPE_CHECKING:
    from coneskin.robot.arm.model import ArmModel

#: that a scene may have
TABLES = (
    *("arm", "link", "source", "reaction", "monitoring", "recording"),
    *("motion", "commissioning", "body", "padding", "speed_limit"),
)
#: tomllib's time for a dotted key grows with the cube of its parts: a key of 20 kB takes minutes
_MAX_PARTS = 64
_DOTTED_PART = re.compile(r"[\w\"'-][ \t]*\.")
_PIECE_END = re.compile(r"[=,{\n]")


def load_scene(path: Path | str, *, calibrated: bool = True) -> s.Scene:
    """Read a scene from a TOML file (docs/look-up/scene.md).

    Args:
        calibrated: False to leave the calibrations of its sensors out.

    Raises:
        SceneError: the file cannot be read, or has mistakes; all of them are listed.
    """
    path = Path(path)
    text = read_text(path, MAX_SIZE, "a TOML text", lambda why: SceneError([why], str(path)))
    return parse_scene(text, path.name, path.parent, calibrated=calibrated)


def parse_scene(
    text: str,
    name: str = "scene",
    folder: Path = Path(),
    *,
    recorded: bool = False,
    calibrated: bool = True,
    commissioning: s.Commissioning | None = None,
) -> s.Scene:
    """Read a scene from its text.

    Args:
        folder: where relative paths start.
        recorded: the text comes from a recording: no file that it names is looked for or opened.
        calibrated: False to leave the calibrations of its sensors out.
        commissioning: what is known of it already; None: the record beside the file says so when a guard starts.

    Raises:
        SceneError: with every mistake.
    """
    if len(text) > MAX_SIZE:
        raise SceneError([f"a scene has at most {MAX_SIZE} characters, got {len(text)}: is it the right file?"], name)
    if any(len(_DOTTED_PART.findall(piece)) > _MAX_PARTS for piece in _PIECE_END.split(text)):
        raise SceneError([f"not TOML: a key must have at most {_MAX_PARTS} parts with dots between them"], name)
    try:
        tables = parse_toml(text)
    except ValueError as exc:
        raise SceneError([f"not TOML: {exc}"], name) from exc
    named = frozenset(tables)
    problems = [f"unknown table [{t}]; {suggest(t, TABLES)}" for t in tables if t not in TABLES]
    for table in (name for name in TABLES if name not in ("link", "body")):
        found = tables.get(table, {})
        several = table == "source" and isinstance(found, list) and found and all(isinstance(t, dict) for t in found)
        if not isinstance(found, dict) and not several:
            problems.append(f"{table} must be one table: write [{table}], once, got {type(found).__name__}")
            del tables[table]
    opened, limited = None if recorded else folder, False
    if "speed_limit_from" in text:
        from .tables.speed_limit_tables import inline_speed_limit

        limited = inline_speed_limit(tables, opened, problems)
    text = inline_sensor_files(tables, opened, problems, calibrated, limited) or text
    commissioned = check(tables.get("commissioning", {}), COMMISSIONING_KEYS, "commissioning", problems)
    scene = s.Scene(
        name=name,
        text=text,
        folder=folder,
        **read_arm_tables(tables, problems),
        links=read_links(tables, opened, problems),
        recording=_recording(tables, folder, problems),
        commissioning_max_age=commissioned.get("max_age"),
        commissioning=commissioning,
    )
    if "source" in tables:
        built = [item.sensor for item in scene.sensors]
        sensors = [*built, *[None] * (len(sensor_tables(tables)) - len(built))]
        scene = replace(scene, source=read_source(tables["source"], sensors, problems))
    _check_together(scene, named, tables, problems)
    if "speed_limit" in tables:
        from .tables.speed_limit_tables import with_speed_limit

        scene = with_speed_limit(scene, tables["speed_limit"], recorded, problems)
    if problems:
        raise SceneError(problems, name)
    return scene


def _recording(tables: Mapping[str, Any], folder: Path, problems: list[str]) -> s.RecordingScene | None:
    if "recording" not in tables:
        return None
    values = check(tables["recording"], RECORDING_KEYS, "recording", problems)
    size, keep = values["max"], values["keep"]
    if keep is not None and size is None:
        problems.append("recording.keep counts files, and without recording.max_mb there is only one: set both")
    if "folder" not in values:
        return None
    return s.RecordingScene(folder / values["folder"], None if size is None else round(size), keep)


def _check_together(scene: s.Scene, named: frozenset[str], tables: Mapping[str, Any], problems: list[str]) -> None:
    """Add the mistakes that only the tables together show."""
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
    if "arm" not in named:
        needed = {
            "reaction": "[reaction] needs an [arm] that can react",
            "body": "[[body]] needs an [arm] that can run into it",
            "motion": "[motion] needs an [arm] that can move",
        }
        problems += [line for table, line in needed.items() if table in named]
    external = scene.arm is not None and scene.arm.control == "external"
    if external and "motion" in named:
        problems.append(
            "[motion] needs control = internal in [arm]: with control = external another program makes the motion"
        )
    if "source" in named and isinstance(tables.get("link", []), list) and not sensor_tables(tables):
        problems.append("[source] needs a [[link]] with a [[link.sensor]] that its bytes come from")
    if "arm" in named:
        _check_links(scene, problems)


def _check_links(scene: s.Scene, problems: list[str]) -> None:
    """Add to problems a link that no arm has, a sensor longer than its link, a joint beyond its limit.

    Lengths and limits need a known arm.
    """
    from coneskin.robot.arm.kinematics import LINK_INDEX, TUBE_LENGTHS, link_index, link_name
    from coneskin.robot.arm.models import is_ur

    arm = None if scene.arm is None else scene.arm.arm_model
    own = arm is None or is_ur(arm)
    last = len(LINK_INDEX) - 1 if arm is None else arm.joints
    listed = ", ".join(LINK_INDEX) if own else f"base, link_1 to link_{last}"
    for link in scene.links:
        try:
            index = link_index(link.name)  # "upperarm" and "upper_arm_link" are the same link
        except KinematicsError:
            index = last + 1
        if index > last:
            problems.append(f"link {link.name}: an arm has no such link; it has {listed}")
        elif arm is not None and not own and (link.frame != "dh" or link.mesh):
            problems.append(f'link {link.name}: meshes and URDF of the {arm.name} are not known: use frame = "dh"')
        elif arm is not None and own and (name := link_name(index)) in TUBE_LENGTHS:
            _check_length(link, abs(arm.a[TUBE_LENGTHS[name]]), arm.name, problems)
    for number, rule in enumerate(scene.rules, 1):
        if rule.link is not None and rule.link > last:
            problems.append(f"reaction.rule {number}: the arm has no link_{rule.link}; it has {listed}")
    if arm is not None and scene.motion is not None:
        _check_limits(scene.motion, arm, problems)


def _check_limits(motion: s.MotionScene, arm: ArmModel, problems: list[str]) -> None:
    for number, point in enumerate(motion.waypoints, 1):
        for joint, (q, low, high) in enumerate(zip(point, arm.joint_lower, arm.joint_upper, strict=False), 1):
            if not low <= q <= high:
                problems.append(
                    f"motion.waypoints_deg[{number}]: joint {joint} of the {arm.name} must be from "
                    f"{math.degrees(low):g} to {math.degrees(high):g} deg, got {math.degrees(q):g} deg"
                )


def _check_length(link: s.LinkScene, length: float, arm: str, problems: list[str]) -> None:
    for item in link.sensors:
        height = item.sensor.frustum.height
        if height > length:
            problems.append(
                f"link {link.name}, {item.sensor.name}: height_mm must be at most {1e3 * length:g} mm, the distance "
                f"between the joints of the {arm}'s {link.name}, got {1e3 * height:g} mm"
            )
