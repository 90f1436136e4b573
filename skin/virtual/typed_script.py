"""Touches and faults of a virtual skin as they are typed, and a script of them in a file."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path

from coneskin.core.errors import SensorError
from coneskin.core.files import read_file
from coneskin.geometry.frustum import Frustum

from .circuit import WiringFaults
from .fault_injection import FaultInjection
from .scripted_touch import ScriptedTouch, fingers, grip, palm_over_seam

_MAX_SCRIPT = 1 << 20  # bytes of a script
_PALM_RADIUS = 0.03  # m; radius of its face
_FINGER_OFFSETS = ((-0.02, 0.0), (0.0, 0.0), (0.02, 0.0))  # m; three, 20 mm apart along the link
#: Shape of a touch, as it is typed -> what makes its contacts of the first one.
TOUCH_SHAPES: dict[str, Callable[[Frustum, ScriptedTouch], list[ScriptedTouch]]] = {
    "finger": lambda _, touch: [touch],
    "palm": lambda _, touch: [replace(touch, radius=_PALM_RADIUS)],
    "fingers": lambda cone, touch: fingers(cone, touch, _FINGER_OFFSETS),
    "grip": grip,
    "seam": lambda cone, touch: palm_over_seam(cone, touch, touch.phi),
}
#: Faults that can be typed.
FAULT_NAMES = tuple(f.name for f in fields(FaultInjection))
#: of the electronics, and of time
ELECTRIC_FLAWS = frozenset({"current_gain", "current_offset", "offset_counts", "mains_volts", "warming"})
FLAW_NAMES = ("slope", "patches", "skew", "lead", "line", *sorted(ELECTRIC_FLAWS))


def read_script(path: Path) -> list[tuple[str, ScriptedTouch]]:
    """Read a file of touches, one a line; empty lines and what follows a # mean nothing.

    Raises:
        SensorError: a line is no touch, or the file cannot be read; the message names the line.
    """
    try:
        lines = read_file(path, _MAX_SCRIPT).decode("utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise SensorError(f"{path}: cannot be read as a script of touches ({error})") from error
    presses = []
    for number, line in enumerate(lines, 1):
        if text := line.partition("#")[0].strip():
            try:
                presses.append(parse_press(text))
            except SensorError as error:
                raise SensorError(f"{path}, line {number}: {error}") from error
    return presses


def parse_press(text: str) -> tuple[str, ScriptedTouch]:
    """Read [SHAPE:]START_S:END_S:U_MM:PHI_DEG[:FORCE_N][@SENSOR]: the shape, and its first touch.

    U_MM and PHI_DEG may each be FROM..TO, between which the touch slides. The touch names the sensor by its number.

    Raises:
        SensorError: it is something else.
    """
    text, _, sensor = text.partition("@")
    shape, separator, rest = text.partition(":")
    if not (separator and shape in TOUCH_SHAPES):
        if shape[:1].isalpha():
            raise SensorError(f"the shape of a touch must be one of {', '.join(TOUCH_SHAPES)}, got {shape!r}")
        shape, rest = "finger", text
    return shape, replace(_parse_touch(rest), sensor=sensor.strip())


def _parse_touch(text: str) -> ScriptedTouch:
    """Read START_S:END_S:U_MM:PHI_DEG[:FORCE_N], U_MM and PHI_DEG each as one number or as FROM..TO.

    Raises:
        SensorError: it is something else.
    """
    try:
        start, end, u_mm, phi_deg, *force = text.split(":")
        if len(force) > 1:
            raise ValueError
        times, forces = (float(start), float(end)), [float(part) for part in force]
        (u, to_u), (phi, to_phi) = _parse_way(u_mm), _parse_way(phi_deg)
    except ValueError:
        raise SensorError(
            f"a touch must be START_S:END_S:U_MM:PHI_DEG[:FORCE_N], got {text!r}; where it slides, U_MM or PHI_DEG is "
            "FROM..TO"
        ) from None
    slide_u, slide_phi = (to_u - u) * 1e-3, math.radians(to_phi - phi)
    touch = ScriptedTouch(*times, u * 1e-3, math.radians(phi), slide_u=slide_u, slide_phi=slide_phi)
    return replace(touch, force=forces[0]) if forces else touch


def _parse_way(text: str) -> tuple[float, float]:
    first, separator, last = text.partition("..")
    if last.startswith("."):
        raise ValueError  # a third point would make another place of it
    return float(first), float(last if separator else first)


def parse_fault(text: str) -> tuple[str, int | str | WiringFaults]:
    """Read NAME=VALUE of one fault.

    Raises:
        SensorError: no fault has that name, or the value does not suit it.
    """
    name, _, value = text.partition("=")
    if name not in FAULT_NAMES:
        raise SensorError(f"a fault must be one of {', '.join(FAULT_NAMES)}, got {name!r}")
    if name == "stuck_channel":
        return name, value
    if name == "wiring":
        kind, *electrodes = value.split("-")
        if kind == "open" and electrodes:
            return name, WiringFaults(opened=tuple(electrodes))
        if kind == "short" and len(electrodes) == 2:
            return name, WiringFaults(shorts=((electrodes[0], electrodes[1]),))
        raise SensorError(f"wiring must be open-A or short-A-ground (or -supply, -rail, -B), got {value!r}")
    try:
        return name, int(value, 0)
    except ValueError:
        raise SensorError(f"fault {name} must be a whole number such as {name}=50, got {value!r}") from None


def parse_flaw(text: str) -> tuple[str, float]:
    """Read NAME=VALUE of one flaw of a specimen.

    Raises:
        SensorError: no flaw has that name, or the value is no number.
    """
    name, _, value = text.partition("=")
    if name not in FLAW_NAMES:
        raise SensorError(f"a flaw must be one of {', '.join(FLAW_NAMES)}, got {name!r}")
    try:
        return name, float(value)
    except ValueError:
        raise SensorError(f"flaw {name} must be a number such as {name}=0.05, got {value!r}") from None
