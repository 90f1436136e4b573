"""``coneskin replay``: run a recording again and compare."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .replay import Replay

__all__ = ["add_arguments", "run"]

_EXAMPLE = """\
example:
  coneskin replay runs/2026-01-31T12-00-00            the same bytes through the same guard: are the events the same?
  coneskin replay runs/2026-01-31T12-00-00 --scene stiffer.toml    what another scene would have decided
  coneskin replay runs/2026-01-31T12-00-00 --picture run.png

exit code: 0 the events are the same (with --scene: it ran), 1 they are not, or there are none.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.epilog = _EXAMPLE
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("run", type=Path, metavar="RUN", help="folder of a run, or its recording")
    parser.add_argument("--scene", type=Path, help="replay with this scene instead of the recorded one")
    parser.add_argument("--events", action="store_true", help="list the events")
    parser.add_argument(
        "--picture", type=Path, metavar="FILE", help="draw the run: joint speeds, touch, arm (PNG, SVG, PDF)"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Replay and report."""
    from .replay import read_run, replay
    from .scene import load

    recorded = read_run(args.run)
    result = replay(recorded, load(args.scene) if args.scene else None)
    if args.picture:
        from .run_picture import draw_run

        draw_run(recorded, args.picture)
    start = recorded.header["clocks"]["monotonic"]
    if args.json:
        facts = {
            "same": result.same,
            "duration_s": result.duration,
            "skin_bytes": result.frames,
            "missing": result.missing or None,
            "differences": result.differences,
            "events": [{"t": e.time - start, "name": e.name, **e.details} for e in result.events],
        }
        print(json.dumps(facts))
    else:
        _report(result, start, args.events or args.scene is not None, args.scene is not None)
    return 0 if args.scene or (result.same and result.recorded) else 1


def _report(result: Replay, start: float, listed: bool, other_scene: bool) -> None:
    from .timeline import describe

    if listed:
        for event in result.events:
            print(describe(event, start))
    print(f"{result.duration:.3f} s and {result.frames} bytes of skin replayed, {len(result.events)} events")
    if result.missing:
        print(f"missing: {result.missing}")
    if other_scene:
        print("this is what the other scene would have decided. The arm's movement is the recorded one: it does not")
        print("follow other commands, so that what happens after the first difference is no prediction.")
    elif not result.recorded and not result.events:
        print("no event was recorded: there is nothing to compare")
    else:
        print("the events are the same, bit by bit" if result.same else "the events are NOT the same:")
        for line in result.differences:
            print(f"  {line}")
