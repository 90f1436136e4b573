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
import sys
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from coneskin.core.text import positive_seconds

from .terminal import print_line

if TYPE_CHECKING:
    from coneskin.skin.sources.serial_port import PortFacts


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    add = parser.add_argument
    add("--list", action="store_true", help="list the ports that are there, and end")
    add("--timeout-s", type=positive_seconds, default=60.0, help="give up after this time (default 60)")
    add("--json", action="store_true", help="print the result as a JSON object")


def run(args: argparse.Namespace) -> int:
    """Find a port, or list those that are there."""
    from coneskin.commissioning.line.port_search import await_port, port_trouble, stable_name
    from coneskin.skin.sources.serial_port import find_ports

    if args.list:
        return _list(find_ports(), args.json)
    say = partial(print_line, file=sys.stderr)
    port = await_port(find_ports, say, args.timeout_s)
    trouble, name = port_trouble(port.device), stable_name(port.device)
    if args.json:
        print(json.dumps({"port": name, "device": port.device, "hardware": port.hardware, "trouble": trouble}))
    else:
        print(name)
    if trouble:
        say(trouble)
    return 1 if trouble else 0


def _list(ports: Sequence[PortFacts], as_json: bool) -> int:
    """List the ports with what stands against their use; return 0 where one can be used."""
    from coneskin.commissioning.line.port_search import port_trouble

    rows = [(port, port_trouble(port.device)) for port in ports]
    for port, trouble in rows:
        if as_json:
            facts = {"device": port.device, "description": port.description, "hardware": port.hardware}
            print(json.dumps({**facts, "trouble": trouble}))
        else:
            print(f"{port}{f'  {trouble}' if trouble else ''}")
    if not rows:
        print("no serial port is there", file=sys.stderr)
    return 0 if any(not trouble for _, trouble in rows) else 1
