"""``coneskin replay``: run a recording again and compare.

examples:
  coneskin replay runs/2026-01-31T12-00-00            compare: the same bytes through the same guard
  coneskin replay runs/2026-01-31T12-00-00 --events --picture run.png
  coneskin replay runs/                               which runs are there
  coneskin replay runs/*                              all of them, side by side
  coneskin replay gallery:palm --events               a run that the package contains: hand, palm, grip, slide, wire

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

from __future__ import annotations

import argparse
import itertools
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import RecordingError, SceneError
from coneskin.core.progress import ProgressBar
from coneskin.core.text import finite, printable

if TYPE_CHECKING:
    from coneskin.runs.replay.run import Replay

_EXIT_CODES = {"same": 0, "different": 1, "incomplete": 4}  # by verdict


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    add = parser.add_argument
    add("runs", nargs="+", type=Path, metavar="RUN", help="folder of a run, or its recording")
    add("--scene", type=Path, help="replay with this scene instead of the recorded one: what would it have decided?")
    add("--events", action="store_true", help="list the events")
    add("--picture", type=Path, metavar="FILE", help="draw the run: joint speeds, touch, arm (PNG, SVG, PDF)")
    add("--allow-incomplete", action="store_true", help="exit with 0 where nothing differs but blocks are missing")
    add("--set", action="append", default=[], metavar="NAME=VALUE", help="another value in the scene: what if?")
    add("--vary", action="append", default=[], metavar="NAME=A,B,C", help="several values, each with each run")
    add("--table", type=Path, metavar="FILE", help="rows of many runs, for DuckDB or pandas (parquet)")
    add("--jobs", type=int, metavar="N", help="processes for many runs (default: one for each core)")
    add("--scheduler", metavar="ADDRESS", help="Dask cluster for many runs, such as tcp://10.0.0.5:8786")
    add("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Replay and report the result."""
    from coneskin.runs.run_files import find_recordings, is_run

    if len(args.runs) == 1 and args.runs[0].is_dir() and not is_run(args.runs[0]) and not (args.set or args.vary):
        return _list_runs(args.runs[0])
    many = len(args.runs) > 1 or (not is_run(args.runs[0]) and args.runs[0].is_dir())
    if many or args.vary or args.table or args.scheduler:
        return _replay_many(args, find_recordings(args.runs))
    if args.set or args.scene:
        return _replay_with_settings(args)
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
    from coneskin.runs.event_file import event_facts
    from coneskin.runs.replay.run import read_run

    recorded = read_run(args.runs[0], ProgressBar("read"))
    result = recorded.replay(progress=ProgressBar("replayed"))
    if args.picture:
        from coneskin.runs.replay.run_picture import draw_run

        draw_run(recorded, args.picture)
    start = recorded.start
    if args.json:
        facts = {"same": result.same, "verdict": result.verdict, "compared": result.compared}
        facts |= {"duration_s": result.duration, "skin_bytes": result.frames, "missing": result.missing or None}
        facts |= {"other_code": result.other_code, "differences": result.differences}
        print(json.dumps({**facts, "events": event_facts(result.events, start)}))
    else:
        _report(result, start, args.events)
    if args.allow_incomplete and result.verdict == "incomplete":
        return 0
    return _EXIT_CODES[result.verdict]


def _report(result: Replay, start: float, listed: bool) -> None:
    from coneskin.robot.guard.signals.event_text import describe
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


def _replay_with_settings(args: argparse.Namespace) -> int:
    """Say what a run would have been with other settings, or another scene, and return the exit code 0."""
    from coneskin.runs.comparison import compare_decisions, comparison_facts, comparison_lines, without_invented
    from coneskin.runs.decisions import decide_again, recorded_decisions
    from coneskin.runs.event_file import event_facts
    from coneskin.runs.replay.run import read_run
    from coneskin.scene.reader import load_scene
    from coneskin.scene.settings import parse_settings

    if args.scene is not None and args.set:
        raise SceneError(["--scene and --set exclude each other: set the value in the scene"], "replay")
    run, settings = read_run(args.runs[0], ProgressBar("read")), parse_settings(args.set)
    recorded = recorded_decisions(run)
    if args.scene is None:
        before = decide_again(run, label="today's code", progress=ProgressBar("as it was"))
        after = decide_again(run, settings, progress=ProgressBar("as it would be"))
    else:
        scene, bar = load_scene(args.scene), ProgressBar("as it would be")
        before, after = recorded, decide_again(run, label=str(args.scene), scene=scene, progress=bar)
    comparison = compare_decisions(before, after)
    events = without_invented(after, recorded).events
    if args.json:
        print(json.dumps({"comparison": comparison_facts(comparison), "events": event_facts(events, run.start)}))
        return 0
    if args.events:
        for line in run.timeline(events):
            print(line)
    print(printable("\n".join(comparison_lines(comparison))))
    return 0


def _replay_many(args: argparse.Namespace, paths: Sequence[Path]) -> int:
    """Replay many runs with each variant; return 0, 1 for a difference or an error, or 4 for a damaged run."""
    from coneskin.runs.what_if.variants import score_variants, variant_lines, write_rows
    from coneskin.runs.what_if.what_if import judge_runs

    variants = _variants(args)
    if args.table is not None and args.table.suffix != ".parquet":
        raise RecordingError(f"the table of many runs is a .parquet file, got {args.table}")
    bar = ProgressBar(f"{len(paths)} run{'s'[: len(paths) != 1]}")
    rows = judge_runs(paths, variants, jobs=args.jobs, scheduler=args.scheduler or "", progress=bar)
    scores = score_variants(rows)
    if args.table is not None:
        write_rows(args.table, rows)
    if args.picture is not None:
        from coneskin.runs.what_if.variants import draw_variants

        draw_variants(scores, args.picture)
    if args.json:
        print(json.dumps({"runs": rows, "variants": [finite(score._asdict()) for score in scores]}))
    else:
        _report_runs(rows, varied=variants != [{}])
        print(printable("\n".join(variant_lines(scores))))
    return _exit_code(rows, compared=variants == [{}], incomplete_too=args.allow_incomplete)


def _variants(args: argparse.Namespace) -> list[dict[str, Any]]:
    """Return the settings of each variant: those of --set in all, and every combination of --vary."""
    from coneskin.scene.settings import parse_choices, parse_settings

    fixed, choices = parse_settings(args.set), dict(map(parse_choices, args.vary))
    return [{**fixed, **dict(zip(choices, values, strict=True))} for values in itertools.product(*choices.values())]


def _report_runs(rows: Sequence[dict[str, Any]], varied: bool) -> None:
    """Say what is wrong with which run, and where the truth of the table comes from."""
    broken: dict[tuple[str, str], list[str]] = {}
    for row in rows:
        if row["error"]:
            broken.setdefault((row["path"], row["error"]), []).append(row["variant"])
    for (path, error), variants in broken.items():
        some = len(variants) < sum(row["path"] == path for row in rows)
        print(printable(f"{path}: BROKEN{' with ' + '; '.join(variants) if some else ''}: {error}"))
    good = [row for row in rows if not row["error"]]
    if not varied:
        different = [row for row in good if not row["same"]]
        for row in different:
            why = row["first_difference"] or ("incomplete" if not row["complete"] else "the arm is commanded otherwise")
            print(printable(f"{row['path']}: NOT the same: {why}"))
        print(f"{len(good) - len(different)} of {len(rows)} run{'s'[: len(rows) != 1]} replayed the same as recorded")
    elif any(row["truth"] == "recorded" for row in good):
        print(
            "no one knows what touched some of these runs: the contacts that they recorded count as the truth there, "
            "any other as unlabeled; say what touched in NAME.touches.toml, as docs/do/runs.md tells"
        )


def _exit_code(rows: Sequence[dict[str, Any]], compared: bool, incomplete_too: bool) -> int:
    if any(row["error"] for row in rows):
        return 1
    if not compared:
        return 0
    different = [row for row in rows if not row["same"]]
    if any(row["first_difference"] or row["diverged_s"] is not None or row["complete"] for row in different):
        return 1
    return 4 if different and not incomplete_too else 0
