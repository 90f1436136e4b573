"""``coneskin sim-ur``: the simulated UR controller as a program."""

from __future__ import annotations

import argparse
import json
import math
import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from coneskin.errors import ConeSkinError, RobotRefused

from .sim_controller import Controller
from .sim_options import START_Q, Options, Version
from .sim_server import PORTS, Server
from .ur_models import MODEL_NAMES, model

__all__ = ["EXAMPLE", "add_arguments", "main", "run"]

EXAMPLE = """example:
  coneskin sim-ur --model ur10e --start-q-deg 0 -90 90 -90 -90 0
  python -c "import rtde_receive; print(rtde_receive.RTDEReceiveInterface('127.0.0.1').getActualQ())"

Several arms on one machine: --host 127.0.0.2, 127.0.0.3 ... (ur_rtde knows no other ports). Stop it with Ctrl-C."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of ``coneskin sim-ur``."""
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.description = "A simulated UR controller that the unmodified ur_rtde wheel connects to and drives."
    parser.epilog = EXAMPLE
    add = parser.add_argument
    add("--host", default="127.0.0.1", help="address to listen on (%(default)s)")
    add("--model", default="ur10e", help=f"arm: {', '.join(MODEL_NAMES)} (%(default)s)")
    add("--version", default="5.25", metavar="MAJOR.MINOR", help="PolyScope version to report (%(default)s)")
    add("--quirks", choices=("real", "fixed"), default="real", help="ur_rtde's control program as it is, or mended")
    add(
        "--start-q-deg",
        type=float,
        nargs=6,
        metavar="Q",
        default=[round(math.degrees(q), 2) for q in START_Q],
        help="joint positions at the start [deg]",
    )
    add(
        "--start-delay-ms", type=float, default=10.0, help="from a program's last byte to its first cycle (%(default)s)"
    )
    add("--unlock-after-s", type=float, default=5.0, help="time before a protective stop can be unlocked (%(default)s)")
    add(
        "--protective-stop",
        choices=("pause", "stop"),
        default="pause",
        help="what one does to the program (%(default)s)",
    )
    add("--wrong-size", choices=("truncate", "drop"), default="truncate", help="packets longer than their recipe")
    add("--program", type=Path, metavar="FILE", help="URScript that the dashboard's play starts")
    add("--log", type=Path, metavar="FILE", help="write a JSON line for every command and event")
    add("--json", action="store_true", help="print the ready line as JSON")
    add("--exit-with-parent", action="store_true", help="end when the process that started this one has gone")


def main(arguments: Sequence[str] | None = None) -> int:
    """The command by itself: ``python -m coneskin.robot.sim_command``."""
    parser = argparse.ArgumentParser(prog="coneskin sim-ur")
    add_arguments(parser)
    return run(parser.parse_args(arguments))


def run(args: argparse.Namespace) -> int:
    """Run the controller until SIGTERM or SIGINT. Returns the exit code."""
    try:
        return _serve(args)
    except ConeSkinError as exc:
        print(f"coneskin sim-ur: {exc}", file=sys.stderr)
        return 1


def _serve(args: argparse.Namespace) -> int:
    options = Options(
        model=args.model,
        version=_version(args.version),
        start_q=_start_q(args.model, args.start_q_deg),
        quirks=args.quirks,
        wrong_size=args.wrong_size,
        start_delay=args.start_delay_ms / 1000.0,
        unlock_after=args.unlock_after_s,
        after_protective_stop=args.protective_stop,
        program=_read(args.program) if args.program else "",
    )
    parent = os.getppid()
    log = None
    try:
        if args.log:
            log = args.log.open("w", buffering=1)
    except OSError as exc:
        raise RobotRefused(f"--log {args.log} cannot be written: {exc.strerror}") from exc
    try:
        controller = Controller(options, log)
        with Server(controller, args.host) as server:
            for number in (signal.SIGTERM, signal.SIGINT):
                signal.signal(number, lambda *_: server.stop())
            _announce(args, controller, server)
            server.run(alive=lambda: not args.exit_with_parent or os.getppid() == parent)
    finally:
        if log is not None:
            log.close()
    return 0


def _announce(args: argparse.Namespace, controller: Controller, server: Server) -> None:
    facts = {
        "ready": True,
        "host": args.host,
        "model": controller.arm.model.name,
        "version": args.version,
        "ports": PORTS,
        "fault_port": server.fault_port,
        "pid": os.getpid(),
    }
    if args.json:
        print(json.dumps(facts), flush=True)
    else:
        print(
            f"simulated {facts['model']} (PolyScope {args.version}) ready on {args.host}: RTDE {PORTS['RTDE']}, "
            f"dashboard {PORTS['dashboard']}, scripts {PORTS['primary']}-{PORTS['realtime']}; Ctrl-C stops it",
            flush=True,
        )


def _start_q(name: str, degrees: Sequence[float]) -> list[float]:
    """Joint positions [rad], within the limits of the arm."""
    arm = model(name)
    start = [math.radians(q) for q in degrees]
    for joint, (low, q, high) in enumerate(zip(arm.joint_lower, start, arm.joint_upper, strict=True), 1):
        if not low <= q <= high:
            raise RobotRefused(
                f"--start-q-deg: joint {joint} of the {arm.name} must be from {math.degrees(low):g} to "
                f"{math.degrees(high):g} deg, got {math.degrees(q):g} deg"
            )
    return start


def _version(text: str) -> Version:
    major, _, minor = text.partition(".")
    if not (major.isdigit() and minor.isdigit()):
        raise RobotRefused(f"--version must be MAJOR.MINOR such as 5.25, got {text!r}")
    return int(major), int(minor)


def _read(path: Path) -> str:
    try:
        return path.read_text()
    except (OSError, UnicodeDecodeError) as exc:
        raise RobotRefused(f"--program {path} cannot be read: {exc}") from exc


if __name__ == "__main__":
    sys.exit(main())
