"""``coneskin view``: see a guarded arm and its skin in a browser, live or from recordings.

examples:
  coneskin view scene.toml                            beside `coneskin guard scene.toml`: what happens now
  coneskin view runs/2026-01-31T12-00-00              scrub through a recording: play, speed, jump to an event
  coneskin view runs/a runs/b                         two runs side by side, each with its first touch at 0
  coneskin view runs/a --html run.html                one file that opens in a browser without Python

The page only shows: it reads the recording that the guard's program writes, and nothing in it reaches the guard. It is
served to this computer alone, unless --host says otherwise. It is no safety display. Ctrl-C ends it.

Exit code: 0 shown, or written; 1 a scene or run cannot be read, or viser is not installed; 2 wrong usage.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from coneskin.core.errors import SceneError

from .terminal import add_page_options, show_page

if TYPE_CHECKING:
    from coneskin.view.live_page import LiveRun
    from coneskin.view.page_server import PageServer
    from coneskin.view.stage.stage import Stage

_PAGE_WORDS = "the page is at {} (Ctrl-C ends it); it is no safety display"
_NICE_LEVEL = 10  # by how much the page of a running guard steps back for it: no picture is worth a late stop


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    add = parser.add_argument
    add("what", nargs="+", type=Path, metavar="SCENE|RUN", help="scene file, or run folders (or their recordings)")
    add("--html", type=Path, metavar="FILE", help="write the runs into one HTML file; serve nothing")
    add("--host", default="127.0.0.1", help="to listen at; any but this computer's own lets its network look in")
    add_page_options(parser, 8080)


def run(args: argparse.Namespace) -> int:
    """Show a scene or runs."""
    from coneskin.runs.run_files import find_recordings

    scenes = [path for path in args.what if path.suffix == ".toml"]
    if scenes and len(args.what) > 1:
        raise SceneError(["a scene is shown alone: name one scene, or runs"], str(scenes[0]))
    if not scenes:
        named = [[path] if (path / "run.rec").is_file() else find_recordings([path]) for path in args.what]
        args.what = [path for paths in named for path in paths]
    if args.html is not None:
        if scenes:
            raise SceneError(["--html writes recordings: name runs, such as runs/*"], str(scenes[0]))
        return _write(args)
    from coneskin.view.live_page import LiveRun, is_live

    if scenes:
        return _follow_scene(args, scenes[0])
    recording = args.what[0] / "run.rec" if args.what[0].is_dir() else args.what[0]
    if len(args.what) == 1 and is_live(recording):
        runs = [LiveRun(recording)]
        return _follow(args, runs[0].course.stage, lambda _: runs.pop() if runs else None)
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
        show_runs(server, read_courses(args.what))
        show_page(args, server.url, _PAGE_WORDS).wait()
    return 0


def _follow_scene(args: argparse.Namespace, path: Path) -> int:
    from coneskin.scene.build import place_on_arm
    from coneskin.scene.reader import load_scene
    from coneskin.view.live_page import LiveRun, find_live_run
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
    if sys.platform == "linux":
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))  # what wakes here interrupts nothing that runs
    with _server(args) as server, contextlib.closing(LivePage(server, stage, find)) as page:
        page.serve(show_page(args, server.url, _PAGE_WORDS))
    return 0


def _server(args: argparse.Namespace) -> PageServer:
    from coneskin.view.page_server import PageServer

    return PageServer("coneskin: not a safety display", args.host, args.port)
