"""Command ``coneskin sim-skin``: a virtual skin as a program of its own, on a pseudo-terminal or into a file.

example:
  coneskin sim-skin --radius1-mm 54 --height-mm 434 --touch 1.0:1.5:200:90 --touch 3:4:100:180:10
  Print the path of a serial port. Once a program opens it, the skin sends 1000 frames a second. It is touched from
  1.0 s to 1.5 s at u = 200 mm, phi = 90 deg with 5 N, and from 3 s to 4 s at another place with 10 N.

  coneskin sim-skin --touch grip:1:2:200:90 --touch seam:3:4:200:15 --frame-length 40
  A hand closes around the link; a palm presses on both sides of the seam, 15 deg from each edge.

  coneskin sim-skin --touch 1:3:100..300:90
  A finger slides along the link within two seconds, from u = 100 mm to u = 300 mm.

  coneskin sim-skin --sensors 4 --touch 1:2:200:90@2 --script touches.txt
  Four sensors on one port; the third is touched, and whoever a line of touches.txt names, such as grip:3:4:200:90@1.

  coneskin sim-skin --specimen film --flaw slope=0.05 --flaw mains_volts=0.02 --seed 3
  A skin as it is built: film sheets whose resistance grows by 5 % along them (a standard deviation), hum on the guides.

  coneskin sim-skin --fault drop_every=50 --fault wiring=open-A --fault wiring_after=3000
  Lose one frame in 50, and break the wire of A after 3000 frames.

  coneskin sim-skin --link /tmp/skin --rate-hz 200 --fault wiring=short-A-B --fault wiring_after=0
  A skin to try doctor, monitor and guard with, here with a short from the start. Its scene has kind = "serial" and
  port = "/tmp/skin" in [source], and a sensor with radius1_mm = 54, radius2_mm = 54 and height_mm = 434. Touches of a
  script begin when the port is opened and wait for no prompt; with --simulated, doctor and calibrate touch as they ask.

Ctrl-C ends it. Exit code: 0 ended, or the file of --output is written; 1 an option is not possible; 2 wrong usage.
"""

from __future__ import annotations

import argparse
import errno
import json
import math
import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, BinaryIO

from coneskin.core.errors import SensorError, SkinConnectionError
from coneskin.core.files import explain_os_error, read_text
from coneskin.geometry.frustum import Frustum
from coneskin.skin.sensor import Sensor
from coneskin.skin.tolerance import IDEAL_SHEETS, SHEET_CLASSES
from coneskin.skin.wire import FRAME_LENGTH, FRAME_LENGTHS

from .circuit import ContactModel, ConverterInputs, WiringFaults
from .fault_injection import FaultInjection
from .imperfections import Imperfections
from .scripted_touch import TOUCH_SHAPES, ScriptedTouch
from .skin import MODELS, VirtualSkin

_MAX_SCRIPT = 1 << 20  # bytes of a script
_FAULT_KINDS = {f.name: type(f.default) for f in fields(FaultInjection)}  # int where it may be None
# of the electronics, and of time
_ELECTRIC_FLAWS = frozenset({"current_gain", "current_offset", "offset_counts", "mains_volts", "warming"})
_FLAW_NAMES = ("slope", "patches", "skew", "lead", "line", "peeled", *sorted(_ELECTRIC_FLAWS))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    add = parser.add_argument
    many: dict[str, Any] = {"action": "append", "default": []}
    add("--radius1-mm", type=float, default=54.0, help="radius of the link at end 1 (default 54)")
    add("--radius2-mm", type=float, help="radius at end 2 (default: radius 1, a cylinder)")
    add("--height-mm", type=float, default=434.0, help="distance of the ends along the axis (default 434)")
    add("--wrap-deg", type=float, default=360.0, help="angle about the axis that is covered (default 360)")
    add("--device", type=int, default=0, help="number of the device in its frames (default 0)")
    add("--sensor", type=int, default=0, help="number of the sensor in its frames (default 0)")
    help_text = "send N such sensors, numbered from --sensor on (default 1)"
    add("--sensors", type=int, default=1, metavar="N", help=help_text)
    add("--rate-hz", type=float, default=1000.0, help="frames per second of the sensor (default 1000)")
    help_text = (
        "add a touch to the script; may be repeated (force: 5 N by default, on each side of a grip). Shapes: "
        f"{', '.join(TOUCH_SHAPES)}; without one, finger. seam presses on both sides of it, PHI_DEG from each edge. "
        "U_MM and PHI_DEG may be FROM..TO: the touch slides there, evenly from its start to its end. "
        "@SENSOR is the number of the sensor touched; without it, the first"
    )
    form = "[SHAPE:]START_S:END_S:U_MM:PHI_DEG[:FORCE_N][@SENSOR]"
    add("--touch", type=_argument(_parse_press), metavar=form, help=help_text, **many)
    help_text = "read touches from a file, one a line as --touch has them; # comments"
    add("--script", type=Path, metavar="FILE", help=help_text)
    help_text = (
        f"inject a fault; may be repeated. Names: {', '.join(_FAULT_KINDS)}. *_every, *_after and *_frames count "
        "frames, from 0; without its *_after a fault never comes. Values: wiring open-A, short-A-B or short-A-ground "
        f"(also -supply, -rail); stuck_channel {', '.join(ConverterInputs._fields)}, supply or all; gain_of A, B, C, "
        "D, current, supply or touch, whose readings gain (0 to 10) multiplies; saturate_count 0 to 65535; "
        "clock_jump_us microseconds; status a number, whose bits are in docs/look-up/wire-format.md (1: supply)"
    )
    add("--fault", type=_argument(_parse_fault), metavar="NAME=VALUE", help=help_text, **many)
    help_text = "the sheets: exact field, or ideal resistors (default field)"
    add("--model", choices=MODELS, default="field", help=help_text)
    help_text = (
        "sheets as they are built, drawn by --seed from what their class is like: film is a good specimen, coated "
        "a bad one (default ideal)"
    )
    add("--specimen", choices=tuple(SHEET_CLASSES), default="ideal", help=help_text)
    help_text = (
        f"set one flaw of the specimen; may be repeated. Names: {', '.join(_FLAW_NAMES)}. Of sheets, leads and "
        "lines it is a standard deviation; peeled is the part of electrode B that is not bonded, warming the growth "
        "of the upper sheet's resistance [1/s]"
    )
    add("--flaw", type=_argument(_parse_flaw), metavar="NAME=VALUE", help=help_text, **many)
    add("--noise-counts", type=float, default=0.7, help="standard deviation of each reading [counts] (default 0.7)")
    add("--leak-drift", type=float, default=0.0, help="growth of the leak between the layers [S/s] (default 0)")
    add("--seed", type=int, default=0, help="seed of the noise; the same seed gives the same bytes (default 0)")
    add("--duration-s", type=float, default=math.inf, help="end the stream after this time (default: never)")
    add("--output", metavar="FILE", help="write the bytes to this file as fast as possible; - is standard output")
    help_text = (
        "bytes of a frame: 36 with one supply, 40 with that of each phase, 52 with the driven electrodes' own "
        "potentials too (default 36)"
    )
    add("--frame-length", type=int, choices=FRAME_LENGTHS, default=FRAME_LENGTH, help=help_text)
    add("--link", metavar="PATH", help="make this path a link to the port, and remove it at the end")
    add("--now", action="store_true", help="start the script at once, not when the port is opened")
    add("--json", action="store_true", help="report in JSON, one object per line")


def run(args: argparse.Namespace) -> int:
    """Run the command and return its exit code."""
    radius2_mm = args.radius1_mm if args.radius2_mm is None else args.radius2_mm
    frustum = Frustum(args.radius1_mm * 1e-3, radius2_mm * 1e-3, args.height_mm * 1e-3, math.radians(args.wrap_deg))
    if args.sensors < 1:
        raise SensorError(f"--sensors must be at least 1, got {args.sensors}")
    sensors = [Sensor(frustum, args.sensor + number, device_id=args.device) for number in range(args.sensors)]
    flaws = dict(args.flaw)
    own, peeled = {name: flaws[name] for name in _ELECTRIC_FLAWS & flaws.keys()}, flaws.pop("peeled", 0.0)
    tolerance = replace(SHEET_CLASSES[args.specimen], **{k: v for k, v in flaws.items() if k not in own})
    model: ContactModel | str = args.model
    if tolerance != IDEAL_SHEETS or peeled:
        from .built_sheets import build_specimen

        sensors, model = build_specimen(sensors, tolerance, args.seed, args.model, peeled)
    names = {str(sensor.sensor_id): sensor.name for sensor in sensors}
    presses: list[tuple[str, ScriptedTouch]] = [*args.touch, *(_read_script(args.script) if args.script else ())]
    touches = []
    for shape, press in presses:
        if press.sensor and press.sensor not in names:
            raise SensorError(f"the sensor of a touch must be one of {', '.join(names)}, got @{press.sensor}")
        touches += TOUCH_SHAPES[shape](frustum, replace(press, sensor=names.get(press.sensor, "")))
    skin = VirtualSkin(
        sensors,
        touches,
        rate_hz=args.rate_hz,
        seed=args.seed,
        imperfections=Imperfections(
            noise_counts=args.noise_counts,
            leak_drift=args.leak_drift,
            warming=(own.pop("warming", 0.0), 0.0),
            **own,
        ),
        faults=FaultInjection(**dict(args.fault)),
        model=model,
        duration=args.duration_s,
        frame_length=args.frame_length,
    )
    return _play_skin(skin, args.output, args.link, args.now, args.json)


def _play_skin(skin: VirtualSkin, output: str | None, link: str | None, at_once: bool, as_json: bool) -> int:
    """Play a virtual skin until it ends or the program is told to stop, and return the exit code."""
    if output is not None:
        return _write_file(skin, output, as_json)
    from .pseudo_terminal import Pacing, drain, open_raw_terminal, play, wait_for_reader, write_all

    def wait(duration: float) -> bool:
        time.sleep(duration)
        return False

    master, slave, path = open_raw_terminal()
    pacing = Pacing()
    reader: int | None = None if not at_once else slave
    try:
        with _linked(path, link), _stoppable():
            names = ", ".join(sensor.name for sensor in skin.sensors)
            facts = {"port": path, "link": link, "rate_hz": skin.rate_hz, "sensors": names}
            _say(as_json, facts, f"port: {link or path}")
            if not at_once:
                os.close(slave)
                reader = wait_for_reader(master, path, wait)
            play(skin, lambda data: write_all(master, data), wait=wait, pacing=pacing)
            drain(reader, wait)
    except KeyboardInterrupt:
        pass  # the way to stop it
    finally:
        for descriptor in (reader, master):
            if descriptor is not None:
                os.close(descriptor)
    worst_ms = round(pacing.worst_late * 1e3, 3)
    summary = {"packets": pacing.packets, "overruns": pacing.overruns, "worst_late_ms": worst_ms}
    _say(as_json, summary, f"sent {pacing.packets} packets, {pacing.overruns} lost, at worst {worst_ms} ms late")
    return 0


def _argument(parse: Any) -> Any:
    """Make the parser one for argparse, which prints only its own kind of error."""

    def parsed(text: str) -> Any:
        try:
            return parse(text)
        except SensorError as error:
            raise argparse.ArgumentTypeError(str(error)) from error

    return parsed


def _write_file(skin: VirtualSkin, output: str, as_json: bool) -> int:
    if not (math.isfinite(skin.duration) or skin.faults.unplug_after is not None):
        raise SensorError("--output needs a stream that ends: give --duration-s")
    with explain_os_error(SkinConnectionError, f"{output} cannot be written"):
        if output == "-":
            count = _write_packets(skin, sys.stdout.buffer)
            sys.stdout.buffer.flush()
        else:
            with _open_output(Path(output)) as file:
                count = _write_packets(skin, file)
    if output != "-":
        _say(as_json, {"output": output, "bytes": count}, f"wrote {count} bytes to {output}")
    return 0


def _open_output(path: Path) -> BinaryIO:
    """Open a file to write bytes; a named pipe only if it is read, because opening it would wait for a reader."""
    if not path.is_fifo():
        return path.open("wb")
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_NONBLOCK)
    except OSError as error:
        why = "nobody reads this pipe: start its reader first" if error.errno == errno.ENXIO else error.strerror
        raise SkinConnectionError(f"{path}: {why}") from error
    os.set_blocking(descriptor, True)
    return os.fdopen(descriptor, "wb")


def _write_packets(skin: VirtualSkin, file: BinaryIO) -> int:
    count = 0
    with suppress(SkinConnectionError):  # unplugged, on purpose
        for _, data in skin.packets():
            count += file.write(data)
    return count


def _say(as_json: bool, facts: dict[str, Any], line: str) -> None:
    print(json.dumps(facts) if as_json else line, flush=True)


@contextmanager
def _linked(path: str, link: str | None) -> Iterator[None]:
    """Link a stable name to the port while it lasts."""
    if link is None:
        yield
        return
    place = Path(link)
    with explain_os_error(SkinConnectionError, f"{link} cannot be made a link to {path}"):
        if place.is_symlink():
            place.unlink()
        place.symlink_to(path)
    try:
        yield
    finally:
        place.unlink(missing_ok=True)


@contextmanager
def _stoppable() -> Iterator[None]:
    """Let SIGTERM end the program as Ctrl-C does, so that nothing is left behind."""
    try:
        before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    except ValueError:  # not in the main thread, which handles the signals
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _read_script(path: Path) -> list[tuple[str, ScriptedTouch]]:
    """Read a file of touches, one a line; empty lines and what follows a # mean nothing.

    Raises:
        SensorError: a line is no touch, or the file cannot be read; the message names the line.
    """
    script = read_text(path, _MAX_SCRIPT, "a script of touches", lambda why: SensorError(f"{path}: {why}"))
    presses = []
    for number, line in enumerate(script.splitlines(), 1):
        if text := line.partition("#")[0].strip():
            try:
                presses.append(_parse_press(text))
            except SensorError as error:
                raise SensorError(f"{path}, line {number}: {error}") from error
    return presses


def _parse_press(text: str) -> tuple[str, ScriptedTouch]:
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


def _parse_fault(text: str) -> tuple[str, float | str | WiringFaults]:
    """Read NAME=VALUE of one fault.

    Raises:
        SensorError: no fault has that name, or the value does not suit it.
    """
    name, _, value = text.partition("=")
    if name not in _FAULT_KINDS:
        raise SensorError(f"a fault must be one of {', '.join(_FAULT_KINDS)}, got {name!r}")
    if _FAULT_KINDS[name] is str:
        return name, value
    if name == "wiring":
        kind, *electrodes = value.split("-")
        if kind == "open" and electrodes:
            return name, WiringFaults(opened=tuple(electrodes))
        if kind == "short" and len(electrodes) == 2:
            return name, WiringFaults(shorts=((electrodes[0], electrodes[1]),))
        raise SensorError(f"wiring must be open-A or short-A-ground (or -supply, -rail, -B), got {value!r}")
    try:
        return name, float(value) if _FAULT_KINDS[name] is float else int(value, 0)
    except ValueError:
        raise SensorError(f"fault {name} must be a number such as {name}=5, got {value!r}") from None


def _parse_flaw(text: str) -> tuple[str, float]:
    """Read NAME=VALUE of one flaw of a specimen.

    Raises:
        SensorError: no flaw has that name, or the value is no number.
    """
    name, _, value = text.partition("=")
    if name not in _FLAW_NAMES:
        raise SensorError(f"a flaw must be one of {', '.join(_FLAW_NAMES)}, got {name!r}")
    try:
        return name, float(value)
    except ValueError:
        raise SensorError(f"flaw {name} must be a number such as {name}=0.05, got {value!r}") from None
