"""Command line of the simulated UR controller, ``coneskin sim-ur``.

example:
  coneskin sim-ur --model ur10e --start-q-deg 0 -90 90 -90 -90 0
  python -c "import rtde_receive; print(rtde_receive.RTDEReceiveInterface('127.0.0.1').getActualQ())"

ur_rtde uses fixed ports, so each further arm on one machine needs an address of its own, such as --host 127.0.0.2.
Ctrl-C stops the controller. Exit code: 0 stopped; 1 it cannot listen there, or an option is not possible.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import signal
import socket
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from coneskin.core.channel import Channel
from coneskin.core.errors import ConeSkinError, RobotRefused
from coneskin.core.files import explain_os_error, read_text
from coneskin.core.help_text import HelpFormatter
from coneskin.robot.arm.models import MODEL_NAMES, arm_model
from coneskin.robot.sim.urscript.translator import MAX_LENGTH
from coneskin.robot.ur.measured import read_measured

from .compiler import SIMULATOR_MEMORY, bounded_memory
from .machine.controller import Controller
from .machine.states import DEFAULT_MODEL, PORTS, READ_ONLY, START_Q, Options, Version
from .motion.plant import RemotePlant
from .server import Server, is_loopback


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of ``coneskin sim-ur``."""
    parser.description = "Simulate a UR controller. The unmodified ur_rtde package connects to it and moves its arm."
    add = parser.add_argument
    help_text = "time from a program's last byte to its first cycle [ms] (%(default)g)"
    add("--start-delay-ms", type=float, default=10.0, metavar="T", help=help_text)
    help_text = "time after which a protective stop can be unlocked [s] (%(default)g)"
    add("--unlock-after-s", type=float, default=5.0, metavar="T", help=help_text)
    add("--program", type=Path, metavar="FILE", help="URScript program that the dashboard command play starts")
    help_text = "programs and installations that the dashboard can load"
    add("--programs", type=Path, metavar="FOLDER", help=help_text)
    help_text = "where a loaded program's node External Control gets its script (%(default)s)"
    add("--external-control", default="127.0.0.1:50002", metavar="HOST:PORT", help=help_text)
    help_text = "behave as the controller that scripts/measure_controller.py has seen"
    add("--measured", type=Path, metavar="FILE", help=help_text)
    add("--log", type=Path, metavar="FILE", help="write a JSON line for each command and event")
    add("--host", default="127.0.0.1", help="address to listen on; others can reach all but 127.* (%(default)s)")
    add("--model", default=DEFAULT_MODEL, help=f"arm: {', '.join(MODEL_NAMES)} (%(default)s)")
    add("--version", default="5.25", metavar="MAJOR.MINOR", help="PolyScope version to report (%(default)s)")
    help_text = "joint positions at the start [deg] (0 -90 90 -90 -90 0)"
    start_q = [round(math.degrees(q), 2) for q in START_Q]
    add("--start-q-deg", type=float, nargs=6, metavar="Q", default=start_q, help=help_text)
    help_text = "effect of a protective stop on the running program (%(default)s)"
    add("--protective-stop", choices=("pause", "stop"), default="pause", help=help_text)
    help_text = (
        "control at the start; in local control no program and no command is taken. With remote control disabled in "
        "its settings, as in URSim, it takes all and says that it is not in remote control (%(default)s)"
    )
    add("--control", choices=("local", "remote", "disabled"), default="remote", help=help_text)
    services = [name for name in PORTS if not name.endswith(READ_ONLY)]
    help_text = f"services that are switched off: {', '.join(services)}"
    add("--closed", nargs="+", default=(), choices=services, metavar="SERVICE", help=help_text)
    add("--fieldbus", action="store_true", help="a fieldbus adapter holds the lower half of the input registers")
    add("--plant-descriptor", type=int, help=argparse.SUPPRESS)  # of a line to a plant, inherited: `RemotePlant`
    help_text = "open a port, to this computer alone, that takes faults (--json names it)"
    add("--faults", action="store_true", help=help_text)
    add("--json", action="store_true", help="print the ready line as JSON")
    add("--exit-with-parent", action="store_true", help="end with the process that started this one")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command by itself, as ``python -m coneskin.robot.sim.command``; return the exit code."""
    about = (__doc__ or "").partition("\n\n")[2]
    parser = argparse.ArgumentParser(prog="coneskin sim-ur", epilog=about, formatter_class=HelpFormatter)
    add_arguments(parser)
    try:
        return run(parser.parse_args(arguments))
    except ConeSkinError as exc:
        print(f"coneskin sim-ur: {exc}", file=sys.stderr)
        return 1


def run(args: argparse.Namespace) -> int:
    """Run the controller until SIGTERM or SIGINT; return the exit code 0.

    Raises:
        ConeSkinError: it cannot listen there, or an option is not possible.
    """
    if args.programs and not args.programs.is_dir():
        raise RobotRefused(f"--programs must be a folder, got {args.programs}")
    options = Options(
        model=args.model,
        version=_version(args.version),
        start_q=[math.radians(q) for q in args.start_q_deg],
        start_delay=_time("--start-delay-ms", args.start_delay_ms, 60_000) / 1000.0,
        unlock_after=_time("--unlock-after-s", args.unlock_after_s, 3_600),
        after_protective_stop=args.protective_stop,
        program=_read(args.program) if args.program else "",
        programs=args.programs,
        external_control=_address(args.external_control),
        remote_control=args.control != "local",
        remote_enabled=args.control != "disabled",
        closed=frozenset(args.closed),
        fieldbus=args.fieldbus,
    )
    if args.measured:
        measured = read_measured(args.measured)
        options = replace(
            options,
            start_delay=max(0.0, measured.start[0]),
            watchdog_delay=max(0.0, measured.watchdog[0]),
            deceleration=measured.deceleration or options.deceleration,
        )
    parent = os.getppid()
    with ExitStack() as stack:
        with explain_os_error(RobotRefused, f"--log {args.log} cannot be written"):
            log = stack.enter_context(args.log.open("w", buffering=1)) if args.log else None
        plant = None if args.plant_descriptor is None else _plant(args.plant_descriptor, options)
        controller = Controller(options, log, plant)
        server = stack.enter_context(Server(controller, args.host, faults=args.faults))
        stack.enter_context(bounded_memory(SIMULATOR_MEMORY))
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: server.stop())
        _announce(args, controller, server)
        server.run(alive=lambda: not args.exit_with_parent or os.getppid() == parent)
    return 0


def _announce(args: argparse.Namespace, controller: Controller, server: Server) -> None:
    facts = {
        "ready": True,
        "host": args.host,
        "model": controller.arm.model.name,
        "version": args.version,
        "ports": controller.options.services,
        "fault_address": server.fault_address,
        "pid": os.getpid(),
    }
    if not server.local:
        _warn(
            f"it listens on {args.host}, beyond this computer. Whoever can reach it may run programs in it: it asks "
            "for no password, as a real controller does not. It moves no real arm."
        )
    host, port = controller.options.external_control
    if not is_loopback(host):
        _warn(
            f"a program with the node External Control takes its script from {host} port {port}, beyond this computer."
        )
    ports = ", ".join(f"{name} {port}" for name, port in controller.options.services.items())
    line = f"simulated {facts['model']} (PolyScope {args.version}) ready on {args.host}: {ports}; Ctrl-C stops it"
    print(json.dumps(facts) if args.json else line, flush=True)


def _warn(text: str) -> None:
    print(f"coneskin sim-ur: WARNING: {text}", file=sys.stderr, flush=True)


def _time(option: str, value: float, most: int) -> float:
    if not 0.0 <= value <= most:
        raise RobotRefused(f"{option} must be from 0 to {most}, got {value:g}")
    return value


def _version(text: str) -> Version:
    major, _, minor = text.partition(".")
    if not (major.isdigit() and minor.isdigit()):
        raise RobotRefused(f"--version must be MAJOR.MINOR such as 5.25, got {text!r}")
    return int(major), int(minor)


def _plant(descriptor: int, options: Options) -> RemotePlant:
    with explain_os_error(RobotRefused, f"--plant-descriptor {descriptor} is no line to a plant"):
        return RemotePlant(Channel(socket.socket(fileno=descriptor)), options.start_q, arm_model(options.model))


def _address(text: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    if not (host and port.isdecimal() and 0 < int(port) < 65536):
        raise RobotRefused(f"--external-control must be HOST:PORT such as 127.0.0.1:50002, got {text!r}")
    return host, int(port)


def _read(path: Path) -> str:
    return read_text(path, MAX_LENGTH, "a URScript text", lambda why: RobotRefused(f"--program {path}: {why}"))


if __name__ == "__main__":
    sys.exit(main())
