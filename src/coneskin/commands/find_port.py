"""``coneskin find-port``: find the port of a device by unplugging it and plugging it in again.

example:
  coneskin find-port                 unplug the device when told to, and plug it in again
  coneskin find-port --list          the ports that are there, and what stands against their use

The last line of the output is the port, under a name that stays where the system has one: write it into the scene, or
give it to `coneskin monitor`. Exit code: 0 found and permitted, 1 not.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from coneskin.core.errors import SkinTimeout
from coneskin.core.text import positive_seconds
from coneskin.skin.sources.serial_port import PortFacts, find_ports, port_group

from .terminal import print_line

_BY_ID = Path("/dev/serial/by-id")
_POLL_PERIOD = 0.2  # s between two looks at the list of ports
_MAX_LOOKS = 15  # at a port that has just come: a busy computer gives its rights and its lasting name only then


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    add = parser.add_argument
    add("--list", action="store_true", help="list the ports that are there, and end")
    add("--timeout-s", type=positive_seconds, default=60.0, help="give up after this time (default 60)")
    add("--json", action="store_true", help="print the result as a JSON object")


def run(args: argparse.Namespace) -> int:
    """Find a port, or list those that are there."""
    if args.list:
        return _list(find_ports(), args.json)
    say = partial(print_line, file=sys.stderr)
    port = _await_port(find_ports, say, args.timeout_s)
    trouble, name = _settled_port(port.device)
    facts = {"port": name, "device": port.device, "hardware": port.hardware, "trouble": trouble}
    print(json.dumps(facts) if args.json else name)
    if trouble:
        say(trouble)
    return 1 if trouble else 0


def _list(ports: Sequence[PortFacts], as_json: bool) -> int:
    """List the ports with what stands against their use; return 0 where one can be used."""
    rows = [(port, _port_trouble(port.device)) for port in ports]
    for port, trouble in rows:
        facts = {"device": port.device, "description": port.description, "hardware": port.hardware, "trouble": trouble}
        print(json.dumps(facts) if as_json else f"{port}  {trouble}".rstrip())
    if not rows:
        print("no serial port is there", file=sys.stderr)
    return 0 if any(not trouble for _, trouble in rows) else 1


def _await_port(
    look: Callable[[], Sequence[PortFacts]],
    say: Callable[[str], None],
    timeout: float,
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
) -> PortFacts:
    """Watch the list of ports for a time [s] until one has come, and tell the person what to do.

    Raises:
        SkinTimeout: none has come.
    """
    before, unplugged, end = {port.device: port for port in look()}, dict[str, PortFacts](), clock() + timeout

    def request() -> str:
        return "plug it in again" if unplugged else "unplug the device" if before else "plug the device in"

    say(f"{request()} (within {timeout:g} s; Ctrl-C ends)")
    while clock() < end:
        sleep(_POLL_PERIOD)
        now = {port.device: port for port in look()}
        gone = [port for device, port in before.items() if device not in now]
        come = [port for device, port in now.items() if device not in before]
        before = now
        unplugged.update((port.device, port) for port in gone)
        if len(come) == 1:
            port = come[0]
            same = [old.device for old in unplugged.values() if port.hardware and old.hardware == port.hardware]
            moved = len(same) == 1 and same[0] != port.device
            say(f"{port} has come" + (f"; it was {same[0]} before" if moved else ""))
            return port
        if come:
            unplugged.clear()
            listing = ", ".join(port.device for port in come)
            say(f"{len(come)} ports have come at once, {listing}: unplug one device only, and not a hub: {request()}")
        elif gone:
            verb = "has" if len(gone) == 1 else "have"
            say(f"{', '.join(port.device for port in gone)} {verb} gone: {request()}")
    raise SkinTimeout(
        f"no port has come within {timeout:g} s; try another cable (some only charge) and another USB port, and see "
        "whether `dmesg` names the device"
    )


def _stable_name(device: str, folder: Path = _BY_ID) -> str:
    """Return a name of a port that stays when it is plugged in elsewhere; the device itself where there is none."""
    try:
        links = sorted(folder.iterdir())
    except OSError:
        return device
    return next((str(link) for link in links if link.resolve() == Path(device).resolve()), device)


def _settled_port(device: str, sleep: Callable[[float], None] = time.sleep) -> tuple[str, str]:
    """Return what stands against the use of a port that has just come, and its name that stays."""
    looks = 0
    while (found := (_port_trouble(device), _stable_name(device)))[0] and (looks := looks + 1) < _MAX_LOOKS:
        sleep(_POLL_PERIOD)
    return found


def _port_trouble(device: str) -> str:
    """Return why this user may not use a port, and what to do; empty where nothing stands against it."""
    if os.name != "posix" or os.access(device, os.R_OK | os.W_OK):
        return ""
    if not Path(device).exists():
        return f"{device}: no such port"
    return f"{device}: not permitted; run `sudo usermod -aG {port_group(Path(device))} $USER`, and log in again"
