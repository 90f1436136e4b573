"""Several runs, or other settings, in ``coneskin replay``."""

from __future__ import annotations

import argparse
import itertools
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from coneskin.core.errors import RecordingError, SceneError
from coneskin.core.text import printable

__all__ = ["replay_many", "replay_with_settings"]


def replay_with_settings(path: Path, words: Sequence[str], scene_file: Path | None, listed: bool, as_json: bool) -> int:
    """Say what a run would have been with other settings, or another scene, and return the exit code 0."""
    from coneskin.runs.comparison import compare_decisions, comparison_facts, comparison_lines, without_invented
    from coneskin.runs.decisions import decide_again, recorded_decisions
    from coneskin.runs.event_file import event_facts
    from coneskin.runs.progress import ProgressBar
    from coneskin.runs.replay.event_text import describe
    from coneskin.runs.replay.run import read_run
    from coneskin.scene.reader import load_scene
    from coneskin.scene.settings import parse_settings

    if scene_file is not None and words:
        raise SceneError(["--scene and --set exclude each other: set the value in the scene"], "replay")
    run, settings = read_run(path, ProgressBar("read")), parse_settings(words)
    recorded = recorded_decisions(run)
    if scene_file is None:
        before = decide_again(run, label="today's code", progress=ProgressBar("as it was"))
        after = decide_again(run, settings, progress=ProgressBar("as it would be"))
    else:
        scene, bar = load_scene(scene_file), ProgressBar("as it would be")
        before, after = recorded, decide_again(run, label=str(scene_file), scene=scene, progress=bar)
    comparison = compare_decisions(before, after)
    events = without_invented(after, recorded).events
    if as_json:
        print(json.dumps({"comparison": comparison_facts(comparison), "events": event_facts(events, run.start)}))
        return 0
    if listed:
        for event in events:
            print(describe(event, run.start))
    print(printable("\n".join(comparison_lines(comparison))))
    return 0


def replay_many(args: argparse.Namespace, paths: Sequence[Path]) -> int:
    """Replay many runs with each variant; return 0, 1 for a difference or an error, or 4 for a damaged run."""
    from coneskin.runs.progress import ProgressBar
    from coneskin.runs.what_if.batch import judge_runs
    from coneskin.runs.what_if.variant_table import score_variants, variant_lines, write_rows

    variants = _variants(args)
    if args.table is not None and args.table.suffix != ".parquet":
        raise RecordingError(f"the table of many runs is a .parquet file, got {args.table}")
    bar = ProgressBar(f"{len(paths)} run{'s'[: len(paths) != 1]}")
    rows = judge_runs(
        paths,
        variants,
        jobs=args.jobs,
        scheduler=args.scheduler or "",
        progress=bar,
    )
    scores = score_variants(rows)
    if args.table is not None:
        write_rows(args.table, rows)
    if args.picture is not None:
        from coneskin.runs.what_if.variant_picture import draw_variants

        draw_variants(scores, args.picture)
    if args.json:
        print(json.dumps({"runs": rows, "variants": [score.facts() for score in scores]}))
    else:
        _report(rows, varied=variants != [{}])
        print(printable("\n".join(variant_lines(scores))))
    return _exit_code(rows, compared=variants == [{}], incomplete_too=args.allow_incomplete)


def _variants(args: argparse.Namespace) -> list[dict[str, Any]]:
    """Return the settings of each variant: those of --set in all, and every combination of --vary."""
    from coneskin.scene.settings import parse_choices, parse_settings

    fixed = parse_settings(args.set)
    axes = []
    for word in args.vary:
        name, values = parse_choices(word)
        axes.append([{name: value} for value in values])
    variants = []
    for choice in itertools.product(*axes):
        settings = dict(fixed)
        for one in choice:
            settings |= one
        variants.append(settings)
    return variants


def _report(rows: Sequence[dict[str, Any]], varied: bool) -> None:
    """Say what is wrong with which run, and where the truth of the table comes from."""
    broken: dict[tuple[str, str], list[str]] = {}
    for row in rows:
        if row["error"]:
            broken.setdefault((row["path"], row["error"]), []).append(row["variant"])
    for (path, error), variants in broken.items():
        some = len(variants) < sum(row["path"] == path for row in rows)
        print(printable(f"{path}: BROKEN{' with ' + '; '.join(variants) if some else ''}: {error}"))
    for row in rows:
        if row["error"]:
            continue
        if not varied and not row["same"]:
            why = row["first_difference"] or ("incomplete" if not row["complete"] else "the arm is commanded otherwise")
            print(printable(f"{row['path']}: NOT the same: {why}"))
    good = [row for row in rows if not row["error"]]
    if not varied:
        same = sum(bool(row["same"]) for row in good)
        print(f"{same} of {len(rows)} run{'s'[: len(rows) != 1]} replayed the same as recorded")
    elif any(row["truth"] == "recorded" for row in good):
        print("no one knows what touched some of these runs: the contacts that they recorded count as the truth there")


def _exit_code(rows: Sequence[dict[str, Any]], compared: bool, incomplete_too: bool) -> int:
    if any(row["error"] for row in rows):
        return 1
    if not compared:
        return 0
    different = [row for row in rows if not row["same"]]
    if any(row["first_difference"] or row["diverged_s"] is not None or row["complete"] for row in different):
        return 1
    return 4 if different and not incomplete_too else 0
