"""Terminal of a command: hints, typed lines, signals that end it, and a person who touches marks."""

from __future__ import annotations

import argparse
import json
import math
import os
import queue
import signal
import sys
import threading
import time
import webbrowser
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, TextIO

from coneskin.core.errors import GeometryError
from coneskin.core.text import positive_seconds

if TYPE_CHECKING:
    from coneskin.commissioning.touching import Mark, Notice
    from coneskin.skin.detection.frame.reading import TouchReading


def print_hint(text: str) -> None:
    """Print a line with a command, file names quoted for a shell, unless what is pasted would be another one.

    Where the terminal's encoding lacks a letter of a file's name, the letter is written out as an escape; a control
    character in a name is one, too. No shell reads either as the file, so the line is left out.
    """
    try:
        text.encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        return
    if text.isprintable():
        print_line(text)


def print_line(text: str, file: TextIO | None = None) -> None:
    """Print a line in one piece, to the standard output or a file: lines of several threads never share one.

    Where its reader has gone, as head does, lines go nowhere from then on: no guard ends with who reads of it.
    """
    stream = sys.stdout if file is None else file
    try:
        stream.write(f"{text}\n")
        stream.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def typed_lines() -> queue.SimpleQueue[str]:
    """Start to read the standard input; return the queue that each of its lines comes to."""
    lines: queue.SimpleQueue[str] = queue.SimpleQueue()

    def read() -> None:
        for line in sys.stdin or ():
            lines.put(line)

    threading.Thread(target=read, name="coneskin terminal", daemon=True).start()
    return lines


_ENDING_SIGNALS = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def ending_signals() -> Iterator[Callable[[], None]]:
    """Let SIGINT and SIGTERM raise, so that every ``finally`` is run.

    SIGINT raises KeyboardInterrupt, SIGTERM SystemExit with the exit code 143. Some libraries catch every exception
    where they are imported or called back: the exception is raised again by what is yielded, and at the end.

    Yields:
        a function that raises if a signal has come, to be called between the steps of the command.
    """
    came: list[int] = []

    def look() -> None:
        if came:
            raise KeyboardInterrupt if came[0] == signal.SIGINT else SystemExit(128 + came[0])

    def take(number: int, _: FrameType | None) -> None:
        came.append(number)
        look()

    if threading.current_thread() is not threading.main_thread():  # others cannot set handlers
        yield look
        return
    before = [(number, signal.signal(number, take)) for number in _ENDING_SIGNALS]
    try:
        yield look
    except Exception:
        look()  # what a library made of the signal is not the reason
        raise
    finally:
        for number, handler in before:
            signal.signal(number, handler)


def add_urdf_options(add: Callable[..., Any]) -> None:
    """Declare the options by which the packages of a URDF, and the arguments of a xacro file, are found."""
    many: dict[str, Any] = {"action": "append", "default": []}
    package_help = "folder of a ROS package that a URDF names (package://NAME/...); may be repeated"
    add("--package", metavar="NAME=DIR", help=package_help, **many)
    add("--xacro-arg", metavar="NAME=VALUE", help="argument of a xacro file (extra xacro); may be repeated", **many)


def urdf_options(args: argparse.Namespace) -> dict[str, dict[str, str]]:
    """Return ``packages`` and ``arguments``, as a URDF is read with them.

    Raises:
        GeometryError: an option is no pair.
    """
    pairs: dict[str, dict[str, str]] = {"packages": {}, "arguments": {}}
    for texts, found, rule in (
        (args.package, pairs["packages"], "--package takes NAME=DIR, as in --package ur_description=ur_description"),
        (args.xacro_arg, pairs["arguments"], "--xacro-arg takes NAME=VALUE, as in --xacro-arg ur_type=ur5e"),
    ):
        for text in texts:
            name, equals, value = text.partition("=")
            if not (name and equals and value):
                raise GeometryError(f"{rule}: {text}")
            found[name] = value
    return pairs


def add_page_options(parser: argparse.ArgumentParser, port: int) -> None:
    """Declare the options of a command that serves a page at a port."""
    add = parser.add_argument
    add("--port", type=int, default=port, help=f"to listen at, the next free one if it is taken ({port})")
    add("--no-browser", action="store_true", help="open no browser: only print the address")
    add("--json", action="store_true", help="print one JSON object: the address, or the file")
    add("--duration-s", type=positive_seconds, metavar="S", help="end after this time [s]")


def show_page(args: argparse.Namespace, url: str, words: str) -> threading.Event:
    """Say where a page is, in words with a place for the address, and open it in a browser, as the options want it.

    Returns:
        the event that SIGTERM or the end of the time sets.
    """
    over = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: over.set())
    if args.duration_s is not None:
        end = threading.Timer(min(args.duration_s, threading.TIMEOUT_MAX), over.set)
        end.daemon = True
        end.start()
    print(json.dumps({"url": url}) if args.json else words.format(url), flush=True)
    if not args.no_browser:
        webbrowser.open(url)
    return over


_LIVE_PERIOD = 0.2  # s between two lines of what is read now


def add_touch_options(parser: argparse.ArgumentParser, picture: str) -> None:
    """Declare the options of a command in which marks are touched, and whose picture shows what ``picture`` names."""
    add = parser.add_argument
    add("scene", type=Path, metavar="SCENE", help="scene file, TOML")
    add("--by", default="", metavar="NAME", help="who touches; goes into the record")
    add("--simulated", action="store_true", help="touch a virtual skin; refused for a real one")
    add("--picture", type=Path, metavar="FILE", help=f"draw the {picture} (png, svg, pdf)")
    add("--list", action="store_true", help="list the marks, and touch nothing")
    add("--json", action="store_true", help="print JSON objects, one per line")


class TouchTerminal:
    """Terminal of a person who touches marks: what is to be done, what the sensors read now, and what the person says.

    Args:
        args: with ``json``, and with ``simulated`` and ``list``, with which there is no person.
    """

    def __init__(self, args: argparse.Namespace) -> None:
        self._json = args.json
        self._live = sys.stdout.isatty() and not args.json
        self._shown = 0.0
        self._lines = None if args.simulated or args.list else typed_lines()

    def refuses(self) -> bool:
        """Tell whether a mark was said to be out of reach since the last call."""
        if self._lines is None or self._lines.empty():
            return False
        return self._lines.get().strip().lower() in ("n", "no")

    def list_marks(self, marks: Iterable[tuple[str, Mark]]) -> None:
        """List marks, each with the name of its sensor."""
        for number, (sensor, mark) in enumerate(marks, 1):
            if self._json:
                place = {"where": mark.where, "u_mm": 1e3 * mark.u, "phi_deg": math.degrees(mark.phi)}
                print(json.dumps({"kind": "mark", "number": number, "sensor": sensor, **place}))
            else:
                print(f"{number:>3}  {sensor}: {mark.where}")

    def notice(self, notice: Notice) -> None:
        """Show what the person is told."""
        if self._json:
            print(json.dumps({"kind": notice.kind, "text": notice.text, **notice.details}), flush=True)
        else:
            print(f"{self.clear()}{notice.kind:>6}  {notice.text}", flush=True)

    def reading(self, readings: dict[str, TouchReading | None]) -> None:
        """Show what the sensors read now, a few times a second."""
        now = time.monotonic()
        if now - self._shown < _LIVE_PERIOD or not (self._live or self._json):
            return
        self._shown = now
        touched = {name: reading for name, reading in readings.items() if reading is not None}
        if self._json:
            for name, seen in touched.items():
                line: dict[str, Any] = {"u_mm": round(1e3 * seen.u, 1), "phi_deg": round(math.degrees(seen.phi), 1)}
                line |= {"level": round(seen.level, 3), "certain": seen.location_valid, "doubt": seen.doubt}
                print(json.dumps({"kind": "reading", "sensor": name, **line}), flush=True)
        else:
            said = [
                f"{name}: u = {1e3 * seen.u:.0f} mm, phi = {math.degrees(seen.phi):.0f} deg, level {seen.level:.2f}"
                + ("" if seen.location_valid else f" ({seen.doubt or 'not certain'})")
                for name, seen in touched.items()
            ]
            print(f"{self.clear()}   now  {'; '.join(said) or 'not touched'}", end="", flush=True)

    def clear(self) -> str:
        """Return what takes the live line off the terminal."""
        return "\r\033[K" if self._live else ""
