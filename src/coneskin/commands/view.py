"""``coneskin view``: see a guarded arm and its skin in a browser, live or from recordings."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from coneskin.core.errors import SceneError
from coneskin.core.text import positive_seconds

from .terminal import page_timeout, show_page

if TYPE_CHECKING:
    from coneskin.view.live_run import LiveRun
    from coneskin.view.page_server import PageServer
    from coneskin.view.stage.stage import Stage

__all__ = ["add_arguments", "run"]

_PAGE_WORDS = "the page is at {} (Ctrl-C ends it); it is no safety display"
_NICE_LEVEL = 10  # by how much the page of a running guard steps back for it: no picture is worth a late stop

_EXAMPLE = """\
examples:
  coneskin view scene.toml                            beside `coneskin guard scene.toml`: what happens now
  coneskin view runs/2026-01-31T12-00-00              scrub through a recording: play, speed, jump to an event
  coneskin view runs/a runs/b                         two runs side by side, each with its first touch at 0
  coneskin view runs/a --html run.html                one file that opens in a browser without Python

The page only shows: it reads the recording that the guard's program writes, and nothing in it reaches the guard. It is
served to this computer alone, unless --host says otherwise. It is no safety display. Ctrl-C ends it.

Exit code: 0 shown, or written; 1 a scene or run cannot be read, or viser is not installed; 2 wrong usage.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    add = parser.add_argument
    parser.epilog = _EXAMPLE
    add("what", nargs="+", type=Path, metavar="SCENE|RUN", help="scene file, or run folders (or their recordings)")
    add("--html", type=Path, metavar="FILE", help="write the runs into one HTML file; serve nothing")
    add(
        "--host", default="127.0.0.1", help="address to listen at; any but this computer's own lets its network look in"
    )
    add("--port", type=int, default=8080, help="to listen at, the next free one if it is taken (8080)")
    add("--no-browser", action="store_true", help="open no browser: only print the address")
    add("--json", action="store_true", help="print one JSON object: the address, or the file")
    add("--duration-s", type=positive_seconds, metavar="S", help="end after this time [s]")


def run(args: argparse.Namespace) -> int:
    """Show a scene or runs."""
    scenes = [path for path in args.what if path.suffix == ".toml"]
    if scenes and len(args.what) > 1:
        raise SceneError(["a scene is shown alone: name one scene, or runs"], str(scenes[0]))
    if args.html is not None:
        if scenes:
            raise SceneError(["--html writes recordings: name runs, such as runs/*"], str(scenes[0]))
        return _write(args)
    from coneskin.view.live_run import is_live

    recordings = [path / "run.rec" if path.is_dir() else path for path in args.what]
    if scenes:
        return _follow_scene(args, scenes[0])
    if len(recordings) == 1 and is_live(recordings[0]):
        return _follow_run(args, recordings[0])
    return _show(args)


def _write(args: argparse.Namespace) -> int:
    from coneskin.view.html_file import write_html
    from coneskin.view.run_course import read_courses

    rate = write_html(args.html, read_courses(args.what))
    if args.json:
        print(json.dumps({"html": str(args.html), "pictures_per_s": rate}))
    else:
        print(f"written to {args.html}: {rate:.3g} pictures a second; it opens in a browser, without Python")
    return 0


def _show(args: argparse.Namespace) -> int:
    from coneskin.view.run_course import read_courses
    from coneskin.view.run_page import show_runs

    with _server(args) as server:
        courses = read_courses(args.what)
        show_runs(server, courses)
        show_page(args, server.url, _PAGE_WORDS).wait(page_timeout(args))
    return 0


def _follow_run(args: argparse.Namespace, recording: Path) -> int:
    from coneskin.view.live_run import LiveRun

    first = LiveRun(recording)
    runs = [first]

    def find(_before: LiveRun | None) -> LiveRun | None:
        return runs.pop() if runs else None

    return _follow(args, first.course.stage, find)


def _follow_scene(args: argparse.Namespace, path: Path) -> int:
    from coneskin.scene.build import place_on_arm
    from coneskin.scene.reader import load_scene
    from coneskin.view.live_run import LiveRun, find_live_run
    from coneskin.view.stage.stage import set_stage

    scene = load_scene(path)
    stage = set_stage(scene, place_on_arm(scene), str(path), meshes=True)
    if scene.recording is None:
        print(
            f"coneskin view: {path} names no folder for recordings, so a guard of it cannot be followed; "
            'add [recording] with folder = "runs"',
            file=sys.stderr,
        )
    folder = None if scene.recording is None else scene.recording.folder

    def find(before: LiveRun | None) -> LiveRun | None:
        found = None if folder is None else find_live_run(folder)
        return None if found is None or (before is not None and before.path == found) else LiveRun(found)

    return _follow(args, stage, find)


def _follow(args: argparse.Namespace, stage: Stage, find: Callable[[LiveRun | None], LiveRun | None]) -> int:
    from coneskin.view.live_page import LivePage

    if hasattr(os, "nice"):
        os.nice(_NICE_LEVEL)
    with _server(args) as server, contextlib.closing(LivePage(server, stage, find)) as page:
        over = show_page(args, server.url, _PAGE_WORDS)
        end = None if args.duration_s is None else time.monotonic() + args.duration_s
        page.serve(over, lambda: end is not None and time.monotonic() >= end)
    return 0


def _server(args: argparse.Namespace) -> PageServer:
    from coneskin.view.page_server import PageServer

    return PageServer("coneskin: not a safety display", args.host, args.port)
