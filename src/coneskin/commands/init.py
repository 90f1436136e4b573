"""``coneskin init``: write the scene for a design, so that nobody has to write one by hand.

example:
  coneskin init skin --simulated                                         a simulated UR5e and a virtual skin
  coneskin init skin --arm UR10e --host 192.168.0.10 --port /dev/ttyUSB0
  coneskin init skin --skin-only --port /dev/ttyUSB0                     no arm: touches are reported
  coneskin init skin --arm UR5e --host 192.168.0.10 --port /dev/ttyACM0 --board uno     with the board's own values

The scene names the sensors of the design, their link, poses and electronics; the arm stops when it is touched. An
existing scene is not replaced without --force. Exit code: 0 written, 1 not written.
"""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from coneskin.core.errors import GeometryError, SceneError
from coneskin.robot.sim.machine.states import DEFAULT_MODEL

from .terminal import print_hint

if TYPE_CHECKING:
    from coneskin.design.first_scene import ArmAddress, DesignFolder
    from coneskin.skin.firmware.board_circuit import BoardCircuit

_SIMULATED_HOST = "127.0.0.1"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    from coneskin.skin.firmware.boards import BUILT_IN, boards, converters

    add = parser.add_argument
    add("design", type=Path, metavar="DESIGN-FOLDER", help="folder that `coneskin design` has written")
    add("-o", "--output", type=Path, metavar="SCENE", default=Path("scene.toml"), help="file to write (scene.toml)")
    add("--force", action="store_true", help="replace an existing scene")
    add("--simulated", action="store_true", help="a simulated arm and a virtual skin, which is touched in the motion")
    add("--arm", metavar="MODEL", help=f"model of the arm, such as UR10e; with --simulated {DEFAULT_MODEL} by default")
    add("--host", metavar="ADDRESS", help=f"of the controller; with --simulated {_SIMULATED_HOST} by default")
    help_text = "serial port of a board, such as /dev/ttyUSB0: once for each sheet, in the order of their numbers"
    add("--port", metavar="PORT", action="append", default=[], help=help_text)
    add("--board", choices=list(boards()), help="board of `coneskin firmware`: the scene says its values")
    add("--converter", choices=[BUILT_IN, *converters()], default=BUILT_IN, help="of the board (default: %(default)s)")
    add("--link", metavar="NAME", help="link of the arm, such as forearm; by default as the design's mesh is named")
    add("--skin-only", action="store_true", help="no arm")


def run(args: argparse.Namespace) -> int:
    """Write the scene, read it again, and name the next command."""
    from coneskin.core.files import write_whole
    from coneskin.design.first_scene import first_scene, read_designs
    from coneskin.scene.reader import parse_scene
    from coneskin.scene.suspicions import suspicions

    if args.output.exists() and not args.force:
        raise GeometryError(f"{args.output} exists already: name another file with -o, or replace it with --force")
    if not args.output.parent.is_dir():
        raise GeometryError(f"there is no folder {args.output.parent} for {args.output.name}: make it, or name another")
    designs = read_designs(args.design)
    address, ports, boards = _arm(args), _ports(args), _boards(args, designs)
    text = first_scene(designs, args.output.absolute(), address, ports, args.link, boards)
    try:
        scene = parse_scene(text, args.output.name, args.output.absolute().parent)  # refused here, not by the guard
    except SceneError as exc:
        hint = f"; other arms than {address.model}: --arm, none: --skin-only" if address else ""
        raise GeometryError(f"{args.design} makes no scene, and nothing is written{hint}\n{exc}") from exc
    write_whole(args.output, text)
    arm = f"a {scene.arm_label}" if scene.arm else "no arm"
    count = len(scene.sensors)
    names = ", ".join(link.name for link in scene.links)
    print(f"{args.output}: {count} sensor{'s' if count != 1 else ''} on the {names}, {arm}")
    for finding in suspicions(scene):
        print(f"warning: {finding.line}", file=sys.stderr)
    if address and not args.arm:
        print(f"no arm was named, so it is a {address.model}: --arm MODEL names another of UR's, --skin-only is none")
    print_hint(
        f"next: coneskin doctor {shlex.quote(str(args.output))}{' --simulated' if args.simulated and scene.arm else ''}"
    )
    return 0


def _arm(args: argparse.Namespace) -> ArmAddress | None:
    from coneskin.design.first_scene import ArmAddress

    if args.skin_only:
        if args.arm or args.host:
            raise GeometryError("--skin-only is a scene without an arm: leave --arm and --host out")
        return None
    model = args.arm or (DEFAULT_MODEL if args.simulated else "")
    host = args.host or (_SIMULATED_HOST if args.simulated else "")
    missing = [name for name, value in (("--arm MODEL", model), ("--host ADDRESS", host)) if not value]
    if missing:
        raise GeometryError(f"add {' and '.join(missing)}, or --skin-only, or --simulated to try it without hardware")
    return ArmAddress(model, host)


def _boards(args: argparse.Namespace, designs: Sequence[DesignFolder]) -> list[BoardCircuit]:
    """Return the board of each sensor; none where no board was named."""
    if args.board is None:
        return []
    from coneskin.skin.firmware.board_circuit import board_circuit

    sensors = [sensor for design in designs for sensor in design.sensors]
    count = len(sensors)
    if args.port and len(args.port) != count:
        raise GeometryError(f"a board reads one sensor, and the design has {count}: give --port {count} times")
    return [board_circuit(args.board, sensor, args.converter) for sensor in sensors]


def _ports(args: argparse.Namespace) -> list[str]:
    if args.simulated:
        if args.port:
            raise GeometryError("with --simulated the skin is virtual and has no --port: leave one of them out")
        return []
    if not args.port:
        from coneskin.skin.sources.serial_port import find_ports

        present = ", ".join(map(str, find_ports())) or "none at all"
        raise GeometryError(f"add --port, the serial port of the skin; present: {present}")
    return [str(port) for port in args.port]
