"""First scene for a design: what `coneskin init` writes, so that nobody has to write a scene by hand."""

from __future__ import annotations

import json
import math
import os
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from pathlib import Path, PurePath
from typing import Any

from coneskin.core.errors import GeometryError, KinematicsError
from coneskin.core.files import read_file
from coneskin.core.text import read_json
from coneskin.geometry.frustum import Frustum
from coneskin.robot.arm.kinematics import LINK_INDEX, TUBE_LENGTHS, link_index
from coneskin.robot.arm.models import arm_model
from coneskin.scene.tables.sensor_tables import build_sensor
from coneskin.skin.firmware.board_circuit import BoardCircuit, toml_lines
from coneskin.skin.sensor import Sensor

from .folder import DESIGN_FILE

_MAX_BYTES = 4 << 20  # of design.json
_FILE_HEAD = """\
# Written by `coneskin init`; every key is described in docs/look-up/scene.md.
"""
_MOTION_TEXT = """\
# What a simulation needs from here on; take it out for real hardware.
[motion]
waypoints_deg = [[-40, -90, 90, -90, -90, 0], [60, -80, 80, -90, -90, 0]]
speed_deg_s = 30
acceleration_deg_s2 = 90
"""
_MONITORING_TEXT = """\
[monitoring]                  # a pseudo-terminal on a busy computer can stall for longer than 50 ms"""
_STALL_MS = 250  # ms
_LINE_RATE = 600  # frames a second: a pseudo-terminal holds 4096 bytes, as many as these leave in a stall of 190 ms
_SENSOR_RATE = 100  # frames a second that the guard wants of each sensor
_TOUCH_START = 2.5  # s after the skin's start: the arm moves at full speed until about 3.4 s
_TOUCH_END = 2.8  # s


@dataclass(frozen=True, slots=True)
class ArmAddress:
    """Arm of a scene that is still to be written.

    Attributes:
        model: such as "UR5e".
        host: of its controller.
    """

    model: str
    host: str


@dataclass(frozen=True, slots=True)
class DesignFolder:
    """What a scene takes from the folder of a design.

    Attributes:
        sensor_files: one for each sheet, in order.
        sensors: with the electronics that match them, in the same order.
        link: the arm's link that the design was made for; None where its name is that of no link.
        frame: "mesh" or "urdf", to which the poses of the sensors refer; None where the design was made from dimensions
            and has no place on a link.
        thickness: of a sheet with all its layers [m]; None where the design does not say it.
        name: of the link, as the design has it.
        cables: to the box with the boards at the foot of a robot, in words, in the order of the sensors; empty of a
            link that was designed alone.
    """

    sensor_files: tuple[Path, ...]
    sensors: tuple[Sensor, ...]
    link: str | None
    frame: str | None
    thickness: float | None = None
    name: str = ""
    cables: tuple[str, ...] = ()


def read_designs(folder: Path) -> tuple[DesignFolder, ...]:
    """Read what `coneskin design` has written: the design of a link, or of all links of a robot.

    Raises:
        GeometryError: the folder is no design.
    """
    try:
        data = read_json(read_file(folder / DESIGN_FILE, _MAX_BYTES))
        names = [str(name) for name in data.get("links", ())]
        cables = [_cable_words(cable) for cable in data["cables"]["cables"]] if names else []
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        names, cables = [], []
    designs, first = [], 0
    for name in names:
        design = _read_design(folder / name)
        end = first + len(design.sensors)
        designs.append(replace(design, cables=tuple(cables[first:end])))
        first = end
    return tuple(designs) or (_read_design(folder),)


def _cable_words(cable: Any) -> str:
    """Return the words on a cable of a robot's design.json."""
    joints = [str(section["joint"]) for section in cable["sections"] if "joint" in section]
    if not cable["sections"]:
        return "its cable is yours to lay"
    past = f" past {', '.join(joints)}" if joints else ""
    return f"cable of {1e-3 * float(cable['length_mm']):.2f} m{past} to the box at the foot"


def _read_design(folder: Path) -> DesignFolder:
    """Read the design of a link.

    Raises:
        GeometryError: the folder is no design.
    """
    try:
        data = read_json(read_file(folder / DESIGN_FILE, _MAX_BYTES))
        frame, source, count = str(data["frame"]), str(data["link"]), len(data["sheets"])
        if not count:
            raise ValueError("it has no sheet")
        thickness = data["sheets"][0].get("thickness_mm")
        if thickness is not None and not 0.1 <= float(thickness) <= 100.0:
            raise ValueError(f"its sheets are {thickness!r} mm thick, not 0.1 to 100 mm")
        files = (
            [folder / "sensor.toml"] if count == 1 else [folder / f"sheet-{n + 1}/sensor.toml" for n in range(count)]
        )
        tables = [tomllib.loads(read_file(path, _MAX_BYTES).decode()) for path in files]
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as exc:
        why = (exc.strerror or exc) if isinstance(exc, OSError) else exc
        raise GeometryError(f"{folder} is no design: {why}; make one with `coneskin design LINK -o {folder}`") from exc
    problems: list[str] = []
    built = [build_sensor(table, str(path), problems) for path, table in zip(files, tables, strict=True)]
    if problems:
        raise GeometryError(f"{folder} is no design that a scene can take: {'; '.join(problems)}")
    sensors = tuple(item[0] for item in built if item is not None)
    path, _, name = source.partition("#")
    kinds = {"the mesh's coordinates": "mesh", "the URDF link": "urdf", "mesh": "mesh"}
    kind = next((kind for words, kind in kinds.items() if frame.startswith(words)), None)
    return DesignFolder(
        tuple(files),
        sensors,
        arm_link(name or PurePath(path).stem),
        kind,
        None if thickness is None else 1e-3 * float(thickness),
        name or PurePath(path).stem,
    )


def arm_link(name: str) -> str | None:
    """Return the arm's link that a mesh or a URDF's link is named after; None if it is no link's name."""
    try:
        index = link_index(name)
    except KinematicsError:
        return None
    return next(link for link, number in LINK_INDEX.items() if number == index)


def first_scene(
    designs: Sequence[DesignFolder],
    target: Path,
    arm: ArmAddress | None,
    ports: Sequence[str],
    link: str | None = None,
    boards: Sequence[BoardCircuit] = (),
) -> str:
    """Return the text of a scene for the designs of one link or more: the arm stops when it is touched.

    Args:
        designs: as ``read_designs`` returns them.
        target: the scene's file; the paths in it are relative to its folder.
        arm: that carries the sensors; None to watch the skin alone.
        ports: of the skin; empty for a virtual skin, which is touched while the arm moves.
        link: of the arm; by default the one that the design was made for.
        boards: one for each sensor, whose own values the scene says; none by default.

    Raises:
        GeometryError: the link, or the place of the sensors on it, is not known.
        KinematicsError: there is no such arm or link.
    """
    named = arm is not None or len(designs) == 1  # links of a robot without an arm in the scene keep their own names
    names = [link or (design.link if named else None) for design in designs]
    if arm is not None and None in names:
        raise GeometryError(
            f"which link of the arm was it designed for? Add --link, one of {', '.join(LINK_INDEX)}, or --skin-only "
            "where the arm is not one of UR's"
        )
    if arm is not None:
        indices = [link_index(name or "") for name in names]
        names = [next(known for known, number in LINK_INDEX.items() if number == index) for index in indices]
    lines = [_FILE_HEAD]
    if arm is not None:
        lines.append(f'[arm]\nmodel = "{arm_model(arm.model).name}"\nhost = {json.dumps(arm.host)}\n')
    number = 0
    for design, name in zip(designs, names, strict=True):
        title = name or (design.name if len(designs) > 1 else "link")
        lines.append(f'[[link]]\nname = {json.dumps(title)}\nframe = "{design.frame or "mesh"}"\n')
        for path, sensor, cable in zip_longest(design.sensor_files, design.sensors, design.cables):
            file = os.path.relpath(path, target.parent).replace(os.sep, "/")
            lines.append(
                f"[[link.sensor]]\nfile = {json.dumps(file)}     # its dimensions, pose on the link and electronics"
            )
            if len(designs) > 1:
                lines.append(f"name = {json.dumps(f'{title} {sensor.name}')}")
            if cable:
                lines.append(f"# sensor {number}: {cable}")
            if design.frame is None and arm is not None:
                lines.append(_middle_of_tube(sensor.frustum, name or "", arm.model))
            if boards:
                lines.append(f"# as the board has it ({boards[number].facts.title}):")
                lines += toml_lines(boards[number].keys)
            lines.append("")
            number += 1
    if arm is not None and designs[0].thickness is not None:
        lines.append(_padding(designs[0].thickness))
    lines += _sources(ports, boards) if ports else [_virtual(designs[0], number)]
    if arm is not None:
        lines.append('[reaction]\nkind = "stop"               # retreat and comply need `coneskin commission`\n')
    lines.append('[recording]\nfolder = "runs"\n')
    limits: dict[str, float] = dict(boards[0].monitoring) if boards else {}
    if not ports:
        limits["skin_silence_ms"] = max(limits.get("skin_silence_ms", 0), _STALL_MS)
        if arm is not None:
            lines.append(_MOTION_TEXT)
            limits["arm_silence_ms"] = _STALL_MS
    if limits:
        lines.append("[monitoring]" if ports else _MONITORING_TEXT)
        lines += [*toml_lines(limits), ""]
    return "\n".join(lines)


def _sources(ports: Sequence[str], boards: Sequence[BoardCircuit]) -> list[str]:
    """Return the tables of the ports."""
    head = "[source]" if len(ports) == 1 else "[[source]]"
    baud = f"\nbaud = {boards[0].board.baud}" if boards else ""
    return [f'{head}\nkind = "serial"\nport = {json.dumps(port)}{baud}\n' for port in ports]


def _padding(thickness: float) -> str:
    """Return the table of the padding of sheets of a thickness [m]."""
    from coneskin.skin.materials import Padding

    assumed = Padding(thickness)
    return (
        "[padding]                      # all layers together; the stiffness is assumed: press yours on a scale\n"
        f"thickness_mm = {1e3 * thickness:g}\nstiffness_n_per_mm = {1e-3 * assumed.stiffness:g}\n"
    )


def _middle_of_tube(cone: Frustum, link: str, model: str) -> str:
    """Return the pose of a sensor that was designed from dimensions: the middle of the tube, until it is measured."""
    if link not in TUBE_LENGTHS:
        raise GeometryError(
            f"the design was made from dimensions, so where it is on the {link} is not known; design it from the "
            f"link's mesh, or choose --link {' or '.join(TUBE_LENGTHS)}"
        )
    start = 0.5e3 * (abs(arm_model(model).a[TUBE_LENGTHS[link]]) - cone.height)
    return f"xyz_mm = [0, 0, {start:.1f}]       # MEASURE: where the active area begins, from the joint along the link"


def _virtual(design: DesignFolder, count: int) -> str:
    cone = design.sensors[0].frustum
    rate = f"rate_hz = {max(_LINE_RATE // count, _SENSOR_RATE)}    # of each: one line carries them all\n"
    return (
        f'[source]\nkind = "virtual"\n{rate if count > 3 else ""}\n'
        f"[[source.touch]]\nstart_s = {_TOUCH_START:g}\nend_s = {_TOUCH_END:g}\n"
        f"u_mm = {0.5e3 * cone.slant:.1f}\nphi_deg = {math.degrees(0.5 * cone.wrap):.1f}\n"
    )
