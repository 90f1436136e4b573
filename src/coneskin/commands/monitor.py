"""``coneskin monitor``: what arrives on a line, and what is wrong with it; no arm and no scene are needed.

example:
  coneskin monitor /dev/ttyUSB0            what the firmware sends, and the first mistake in it
  coneskin monitor scene.toml --hex        beside what the scene expects, with the bytes
  coneskin monitor runs/2026-01-31T12-00-00   what a recorded line said
  coneskin monitor /dev/ttyUSB0 --duration-s 3 --json

The first line is the diagnosis. On a terminal the screen is drawn over and over; into a pipe goes a line a second.
Ctrl-C ends with a summary. Exit code: 0 the last diagnosis is good, 1 it is not.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import shutil
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING

from coneskin.core.errors import SkinConnectionError, SkinTimeout
from coneskin.core.text import positive_seconds

if TYPE_CHECKING:
    from coneskin.commissioning.line.line import Line
    from coneskin.commissioning.line.line_monitor import LineMonitor, LineReport

_FIRST_PERIOD = 1.5  # s until the first diagnosis
_LINE_PERIOD, _SCREEN_PERIOD = 1.0, 0.25  # s
_READ_TIMEOUT = 0.05  # s
_HOME, _CLEAR_LINE, _CLEAR_BELOW = "\x1b[H", "\x1b[K", "\x1b[J"
_CLEAR_SCREEN = "\x1b[2J"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    add = parser.add_argument
    help_text = "a port, a scene file (.toml), a run (its folder or .rec) or a file of bytes"
    add("target", metavar="PORT|SCENE|FILE", help=help_text)
    add("--baud", type=_baud, default=921600, help="of a port, in bits a second (default 921600)")
    add("--hex", action="store_true", help="show the bytes; those that have changed are highlighted")
    add("--duration-s", type=positive_seconds, default=math.inf, help="end after this time (default: never)")
    add("--json", action="store_true", help="print each report as a JSON object, one a line")


def _baud(text: str) -> int:
    value = int(text)
    if not 1200 <= value <= 12_000_000:
        raise argparse.ArgumentTypeError(f"must be from 1200 to 12000000, got {text}")
    return value


def run(args: argparse.Namespace) -> int:
    """Listen until told to end; return 0 where the last diagnosis is good."""
    from coneskin.commissioning.line.line import find_line

    line = find_line(args.target, args.baud)
    show = _shower(args)
    report = _play_file(line, show) if line.path is not None else _listen(line, args, show)
    return 0 if report.diagnosis.verdict == "ok" else 1


def _shower(args: argparse.Namespace) -> Callable[[LineReport], None]:
    """Return what shows a report in the way that was asked for."""
    from coneskin.commissioning.line.line_monitor import describe_line, describe_report, draw_screen

    if args.json:
        return lambda report: print(json.dumps(describe_report(report)), flush=True)
    if not sys.stdout.isatty():

        def show_line(report: LineReport) -> None:
            print(describe_line(report), flush=True)
            if args.hex:
                screen = draw_screen(report, with_hex=True, columns=80, color=False)
                print("\n".join(screen[2:]), flush=True)

        return show_line
    color = "NO_COLOR" not in os.environ
    print(_CLEAR_SCREEN, end="")

    def show_screen(report: LineReport) -> None:
        size = shutil.get_terminal_size()
        lines = draw_screen(report, with_hex=args.hex, columns=size.columns, color=color)[: size.lines - 1]
        print(_HOME + "".join(f"{text}{_CLEAR_LINE}\n" for text in lines) + _CLEAR_BELOW, end="", flush=True)

    return show_screen


def _play_file(line: Line, show: Callable[[LineReport], None]) -> LineReport:
    """Show what a file says: the report at its end, and before it each other diagnosis that it gave meanwhile."""
    from coneskin.commissioning.line.line_monitor import LineMonitor

    monitor: LineMonitor | None = None
    seen, due, now = "", 0.0, 0.0
    for now, data in line.pieces():
        if monitor is None:
            monitor, due = LineMonitor(now, line.sensors, line.baud, timed=line.recorded), now + _FIRST_PERIOD
        if now >= due:
            due = now + _LINE_PERIOD
            report = monitor.report(now)
            if report.diagnosis.item != seen:
                seen = report.diagnosis.item
                show(report)
        monitor.feed(data, now)
    report = (monitor or LineMonitor(now, line.sensors, line.baud, timed=False)).report(now)
    show(report)
    return report


def _listen(line: Line, args: argparse.Namespace, show: Callable[[LineReport], None]) -> LineReport:
    """Show what arrives, until the time is over, the user ends it, or the line is gone."""
    from coneskin.commissioning.line.line_monitor import LineMonitor

    assert line.source is not None
    period = _SCREEN_PERIOD if sys.stdout.isatty() and not args.json else _LINE_PERIOD
    gone = ""
    with line.source as source:
        start = time.monotonic()
        monitor = LineMonitor(start, line.sensors, line.baud)
        due, end = start + min(_FIRST_PERIOD, args.duration_s), start + args.duration_s
        heard = start
        try:
            while (now := time.monotonic()) < end:
                wait = max(0.001, min(_READ_TIMEOUT, due - now))
                heard = now + wait  # a computer that is held up longer has not heard that nothing came
                with suppress(SkinTimeout):
                    data = source.read(wait)
                    monitor.feed(data, heard := time.monotonic())
                if (now := time.monotonic()) >= due:
                    show(monitor.report(min(heard, now)))
                    due = max(due + period, now)
        except KeyboardInterrupt:
            pass  # the way to end it
        except SkinConnectionError as error:
            gone = str(error)
        report = monitor.report(min(heard, time.monotonic()))
    show(report)
    if not args.json:
        print(_summary(report), file=sys.stderr)
    if gone:
        raise SkinConnectionError(gone)
    return report


def _summary(report: LineReport) -> str:
    frames = sum(sensor.frames for sensor in report.sensors)
    missing = sum(sensor.missing for sensor in report.sensors)
    return (
        f"{report.time:.1f} s, {report.size} bytes, {frames} frames of {len(report.sensors)} sensor(s), "
        f"{missing} missing, {report.crc_errors} wrong checksums, {report.skipped} bytes in no frame"
    )
