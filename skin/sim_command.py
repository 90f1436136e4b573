"""``coneskin sim-skin``: a virtual skin as a program of its own, on a pseudo-terminal or into a file."""

from __future__ import annotations

import argparse
import json
import math
import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from typing import Any, BinaryIO

from coneskin.errors import SensorError, SkinConnectionError
from coneskin.geometry.frustum import Frustum

from .circuit import Wiring
from .faults import Faults
from .imperfections import Imperfections
from .scripted_touch import ScriptedTouch
from .sensor import Sensor
from .virtual import MODELS, VirtualSkin

__all__ = ["EXAMPLE", "HELP", "add_arguments", "parse_fault", "parse_touch", "play_skin", "run"]

HELP = "run a virtual skin that sends the very bytes of a real one"
EXAMPLE = """\
example:
  coneskin sim-skin --radius1-mm 54 --height-mm 434 --touch 1.0:1.5:200:90 --touch 3:4:100:180:10
  prints the path of a serial port; once a program opens it, frames come 1000 times a second, and the skin is touched
  from 1.0 s to 1.5 s at u = 200 mm, phi = 90 deg with 5 N, and from 3 s to 4 s elsewhere with 10 N.

  coneskin sim-skin --fault drop_every=50 --fault wiring=open-A --fault wiring_after=3000
  a worse line, and a wire that breaks after 3000 frames.
"""
_FAULT_NAMES = tuple(f.name for f in fields(Faults))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.epilog = EXAMPLE
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    add = parser.add_argument
    add("--radius1-mm", type=float, default=54.0, help="radius of the link at end 1 (default 54)")
    add("--radius2-mm", type=float, help="radius at end 2 (default: radius 1, a cylinder)")
    add("--height-mm", type=float, default=434.0, help="distance of the ends along the axis (default 434)")
    add("--wrap-deg", type=float, default=360.0, help="angle about the axis that is covered (default 360)")
    add("--device", type=int, default=0, help="device number on the wire (default 0)")
    add("--sensor", type=int, default=0, help="sensor number on the wire (default 0)")
    add("--rate-hz", type=float, default=1000.0, help="frames per second (default 1000)")
    add(
        "--touch",
        action="append",
        type=_argument(parse_touch),
        default=[],
        metavar="START_S:END_S:U_MM:PHI_DEG[:FORCE_N]",
        help="touch the skin; may be repeated (default force 5 N)",
    )
    add(
        "--fault",
        action="append",
        type=_argument(parse_fault),
        default=[],
        metavar="NAME=VALUE",
        help=f"let something go wrong; may be repeated: {', '.join(_FAULT_NAMES)}; wiring is open-A or short-A-ground",
    )
    add("--model", choices=MODELS, default="field", help="the sheets: exact field, or ideal resistors (default field)")
    add("--noise-counts", type=float, default=0.7, help="standard deviation of each reading (default 0.7)")
    add("--leak-drift", type=float, default=0.0, help="growth of the leak between the layers [S/s] (default 0)")
    add("--seed", type=int, default=0, help="of noise and damage: the same seed gives the same bytes (default 0)")
    add("--duration-s", type=float, default=math.inf, help="unplug after so long (default: never)")
    add("--output", metavar="FILE", help="write the bytes there as fast as possible, - for standard output")
    add("--link", metavar="PATH", help="make this name a link to the port, and remove it at the end")
    add("--now", action="store_true", help="begin the script at once, not when the port is opened")
    add("--json", action="store_true", help="report in JSON, one object a line")


def run(args: argparse.Namespace) -> int:
    """Run the command; the exit code."""
    radius2_mm = args.radius1_mm if args.radius2_mm is None else args.radius2_mm
    frustum = Frustum(args.radius1_mm * 1e-3, radius2_mm * 1e-3, args.height_mm * 1e-3, math.radians(args.wrap_deg))
    sensor = Sensor(frustum, args.sensor, device_id=args.device)
    skin = VirtualSkin(
        sensor,
        args.touch,
        rate_hz=args.rate_hz,
        seed=args.seed,
        imperfections=Imperfections(noise_counts=args.noise_counts, leak_drift=args.leak_drift),
        faults=Faults(**dict(args.fault)),
        model=args.model,
        duration=args.duration_s,
    )
    return play_skin(skin, output=args.output, link=args.link, at_once=args.now, as_json=args.json)


def play_skin(
    skin: VirtualSkin,
    *,
    output: str | None = None,
    link: str | None = None,
    at_once: bool = False,
    as_json: bool = False,
) -> int:
    """Play a virtual skin, from options or from a scene, until it ends or the program is told to stop.

    Args:
        skin: what to play.
        output: file for the bytes, "-" for standard output; a pseudo-terminal by default.
        link: name of a link to the port.
        at_once: begin before somebody opens the port.
        as_json: report in JSON.

    Returns:
        the exit code, 0.

    Raises:
        SensorError: a file without an end is asked for.
        SkinConnectionError: there are no pseudo-terminals, or the file or link cannot be made.
    """
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


def parse_touch(text: str) -> ScriptedTouch:
    """Read START_S:END_S:U_MM:PHI_DEG[:FORCE_N].

    Raises:
        SensorError: it is something else.
    """
    try:
        start, end, u_mm, phi_deg, *force = (float(part) for part in text.split(":"))
        if len(force) > 1:
            raise ValueError
    except ValueError:
        raise SensorError(f"a touch must be START_S:END_S:U_MM:PHI_DEG[:FORCE_N], got {text!r}") from None
    touch = (start, end, u_mm * 1e-3, math.radians(phi_deg))
    return ScriptedTouch(*touch, force=force[0]) if force else ScriptedTouch(*touch)


def parse_fault(text: str) -> tuple[str, int | str | Wiring]:
    """Read NAME=VALUE of one fault.

    Raises:
        SensorError: no fault has that name, or the value does not suit it.
    """
    name, _, value = text.partition("=")
    if name not in _FAULT_NAMES:
        raise SensorError(f"a fault must be one of {', '.join(_FAULT_NAMES)}, got {name!r}")
    if name == "stuck_channel":
        return name, value
    if name == "wiring":
        kind, *electrodes = value.split("-")
        if kind == "open" and electrodes:
            return name, Wiring(opened=tuple(electrodes))
        if kind == "short" and len(electrodes) == 2:
            return name, Wiring(shorts=((electrodes[0], electrodes[1]),))
        raise SensorError(f"wiring must be open-A or short-A-ground (or -supply, -rail, -B), got {value!r}")
    try:
        return name, int(value, 0)
    except ValueError:
        raise SensorError(f"fault {name} must be a whole number, got {value!r}") from None


def _argument(parse: Any) -> Any:
    """The same parser for argparse, which prints only its own kind of error."""

    def parsed(text: str) -> Any:
        try:
            return parse(text)
        except SensorError as error:
            raise argparse.ArgumentTypeError(str(error)) from error

    return parsed


def _write_file(skin: VirtualSkin, output: str, as_json: bool) -> int:
    if not (math.isfinite(skin.duration) or skin.faults.unplug_after is not None):
        raise SensorError("a file needs an end: give --duration-s")
    count = 0
    try:
        if output == "-":
            count = _write_packets(skin, sys.stdout.buffer)
            sys.stdout.buffer.flush()
        else:
            with Path(output).open("wb") as file:
                count = _write_packets(skin, file)
    except OSError as error:
        raise SkinConnectionError(f"{output}: cannot be written ({error.strerror or error})") from error
    if output != "-":
        _say(as_json, {"output": output, "bytes": count}, f"wrote {count} bytes to {output}")
    return 0


def _write_packets(skin: VirtualSkin, file: BinaryIO) -> int:
    count = 0
    try:
        for _, data in skin.packets():
            count += file.write(data)
    except SkinConnectionError:
        pass  # unplugged, on purpose
    return count


def _say(as_json: bool, facts: dict[str, Any], line: str) -> None:
    print(json.dumps(facts) if as_json else line, flush=True)


@contextmanager
def _linked(path: str, link: str | None) -> Iterator[None]:
    """A stable name for the port while it lasts."""
    if link is None:
        yield
        return
    place = Path(link)
    try:
        if place.is_symlink():
            place.unlink()
        place.symlink_to(path)
    except OSError as error:
        raise SkinConnectionError(f"{link}: cannot be made a link to {path} ({error.strerror or error})") from error
    try:
        yield
    finally:
        place.unlink(missing_ok=True)


@contextmanager
def _stoppable() -> Iterator[None]:
    """SIGTERM ends the program as Ctrl-C does, so that nothing is left behind."""

    def stop(_signal: int, _frame: object) -> None:
        raise KeyboardInterrupt

    try:
        before = signal.signal(signal.SIGTERM, stop)
    except ValueError:  # not in the main thread: somebody else handles signals
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
