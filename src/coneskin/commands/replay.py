"""``coneskin replay``: run a recording again and compare."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from coneskin.runs.replay.run import Replay

__all__ = ["add_arguments", "run"]

_CODES = {"same": 0, "different": 1, "incomplete": 4}  # by verdict

_EXAMPLE = """\
examples:
  coneskin replay runs/2026-01-31T12-00-00            compare: the same bytes through the same guard
  coneskin replay runs/2026-01-31T12-00-00 --events --picture run.png
  coneskin replay runs/                               which runs are there
  coneskin replay runs/*                              all of them, side by side

what if:
  coneskin replay runs/a --set reaction.kind=stop --set detection.touch_level=0.08
  coneskin replay runs/a --set reaction.rule.0.kind=slow --set sensor."forearm skin".touch_level=0.08
  coneskin replay runs/a --scene other.toml           another scene
  coneskin replay runs/* --vary detection.touch_level=0.06,0.08,0.12 --picture delay.png --table all.parquet

Times count from the start of the run. Names of settings: docs/do/runs.md. Exit code:
  0  the events are the same, bit by bit; with --scene, --set, --vary: it ran
  1  an event differs, or a run cannot be read
  2  wrong usage, or a folder that is no run
  4  nothing differs, but the recording is incomplete or damaged, was not closed, or has no events;
     with --allow-incomplete 0 instead
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.epilog = _EXAMPLE
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN", help="folder of a run, or its recording")
    parser.add_argument(
        "--scene",
        type=Path,
        help="replay with this scene instead of the recorded one: what would it have decided?",
    )
    parser.add_argument("--events", action="store_true", help="list the events")
    parser.add_argument(
        "--picture", type=Path, metavar="FILE", help="draw the run: joint speeds, touch, arm (PNG, SVG, PDF)"
    )
    parser.add_argument(
        "--allow-incomplete",
        action="store_true",
        help="exit with 0 where nothing differs as far as it can be compared, though blocks or all events are missing",
    )
    parser.add_argument(
        "--set", action="append", default=[], metavar="NAME=VALUE", help="another value in the scene: what if?"
    )
    parser.add_argument(
        "--vary", action="append", default=[], metavar="NAME=A,B,C", help="several values, each with each run"
    )
    parser.add_argument("--table", type=Path, metavar="FILE", help="rows of many runs, for DuckDB or pandas (parquet)")
    parser.add_argument("--jobs", type=int, metavar="N", help="processes for many runs (default: one for each core)")
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="Dask cluster for many runs, such as tcp://10.0.0.5:8786"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Replay and report the result."""
    from coneskin.runs.run_files import find_recordings, is_run

    if len(args.runs) == 1 and args.runs[0].is_dir() and not is_run(args.runs[0]) and not (args.set or args.vary):
        return _list_runs(args.runs[0])
    many = len(args.runs) > 1 or (not is_run(args.runs[0]) and args.runs[0].is_dir())
    if many or args.vary or args.table or args.scheduler:
        from .replay_runs import replay_many

        return replay_many(args, find_recordings(args.runs))
    if args.set or args.scene:
        from .replay_runs import replay_with_settings

        return replay_with_settings(args.runs[0], args.set, args.scene, args.events, args.json)
    return _replay_one(args)


def _list_runs(folder: Path) -> int:
    from coneskin.runs.run_files import find_recordings

    paths = find_recordings([folder])
    what = f"{folder} is no run; there are {len(paths)} below it: name one, several, or replay all of them"
    print(f"coneskin replay: {what}", file=sys.stderr)
    for path in paths:
        print(f"  coneskin replay {path.parent if path.name == 'run.rec' else path}")
    return 2


def _replay_one(args: argparse.Namespace) -> int:
    from coneskin.runs.progress import ProgressBar
    from coneskin.runs.replay.run import read_run, replay

    recorded = read_run(args.runs[0], ProgressBar("read"))
    result = replay(recorded, progress=ProgressBar("replayed"))
    if args.picture:
        from coneskin.runs.replay.run_picture import draw_run

        draw_run(recorded, args.picture)
    start = recorded.start
    if args.json:
        facts = {
            "same": result.same,
            "verdict": result.verdict,
            "compared": result.compared,
            "duration_s": result.duration,
            "skin_bytes": result.frames,
            "missing": result.missing or None,
            "other_code": result.other_code,
            "differences": result.differences,
            "events": [{"t": e.time - start, "name": e.name, **e.details} for e in result.events],
        }
        print(json.dumps(facts))
    else:
        _report(result, start, args.events)
    if args.allow_incomplete and result.verdict == "incomplete":
        return 0
    return _CODES[result.verdict]


def _report(result: Replay, start: float, listed: bool) -> None:
    from coneskin.core.text import printable
    from coneskin.runs.replay.event_text import describe
    from coneskin.runs.replay.run import MOST_DIFFERENCES

    if listed:
        for event in result.events:
            print(describe(event, start))
    print(f"{result.duration:.3f} s and {result.frames} bytes of skin data replayed, {len(result.events)} events")
    if result.missing:
        print(printable(f"missing: {result.missing}"))
    if result.verdict == "incomplete" and not result.compared:
        print("INCOMPLETE: no event that could be compared was recorded")
    elif result.verdict == "incomplete":
        rest = len(result.recorded) - result.compared
        follows = f"; {rest} event{'s'[: rest != 1]} behind what is missing cannot be compared" if rest > 0 else ""
        print(
            f"INCOMPLETE: {result.compared} event{'s'[: result.compared != 1]} up to what is missing are the same, "
            f"bit by bit{follows}"
        )
    else:
        print("the events are the same, bit by bit" if result.same else "the events are NOT the same:")
        if not result.same:
            print(printable("".join(f"  {what}\n" for what in result.other_code)), end="")
        for line in result.differences:
            print(printable(f"  {line}"))
        if len(result.differences) == MOST_DIFFERENCES:
            print("  ... perhaps more; `coneskin runs diff` lists them all")
