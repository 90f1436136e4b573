"""``coneskin runs``: look at recorded runs, check, cut, compare and export them."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING

from coneskin.core.errors import ConeSkinError, RecordingError
from coneskin.core.text import printable

from .arguments.runs import INCOMPLETE, add_arguments

if TYPE_CHECKING:
    from coneskin.runs.decisions import Decisions
    from coneskin.runs.progress import ProgressBar
    from coneskin.runs.replay.run import Run
    from coneskin.runs.run_files import RunSummary

__all__ = ["add_arguments", "run"]


def run(args: argparse.Namespace) -> int:
    """Do the job."""
    work = {"list": _list, "info": _info, "verify": _verify, "cut": _cut, "diff": _diff, "export": _export}
    return {**work, "prune": _prune}[args.job](args)


def _list(args: argparse.Namespace) -> int:
    from coneskin.runs.run_files import find_recordings

    rows: list[dict[str, object]] = []
    broken = 0
    if not args.json:
        print(f"{'began':19}  {'duration':>10}  {'size':>9}  contacts  stops  arm     run")
    for path in find_recordings(args.runs, beside=True):
        try:
            summary = _summary(path)
        except ConeSkinError as exc:
            broken += 1
            rows.append({"path": str(path), "error": str(exc)})
            if not args.json:
                print(printable(f"{path}: cannot be read: {exc}"))
            continue
        rows.append(summary.facts())
        if not args.json:
            said = "  INCOMPLETE" if summary.missing else ""
            print(printable(
                f"{summary.began:19}  {summary.duration:8.1f} s  {summary.size / 1e3:6.0f} kB  {summary.contacts:8}  "
                f"{summary.stops:5}  {summary.arm or '-':6}  {path.parent if path.name == 'run.rec' else path}{said}"
            ))  # fmt: skip
    if args.json:
        print(json.dumps({"runs": rows}))
    return 1 if broken else 0


def _summary(path: Path) -> RunSummary:
    from coneskin.runs.run_files import summarise_run

    return summarise_run(path, _read(path), _bar(f"{path}"))


def _read(path: Path) -> Run:
    from coneskin.runs.replay.run import read_run

    return read_run(path, _bar(f"reading {path}"))


def _bar(what: str) -> ProgressBar:
    from coneskin.runs.progress import ProgressBar

    return ProgressBar(what)


def _info(args: argparse.Namespace) -> int:
    from coneskin.runs.run_files import summarise_run

    recorded = _read(args.run)
    summary = summarise_run(args.run, recorded, _bar(f"{args.run}"))
    if args.json:
        print(json.dumps(summary.facts()))
        return 0
    lines = [
        f"{summary.path}: {summary.size / 1e3:.0f} kB",
        f"recorded {summary.began or 'at a time that it does not tell'} by coneskin {summary.coneskin or '(unknown)'}, "
        f"from {summary.first:.3f} s to {summary.first + summary.duration:.3f} s after its start",
        f"arm {', '.join(filter(None, (summary.arm or 'none', summary.reaction and f'reaction {summary.reaction}')))}"
        + (f"; {summary.commissioned}" if summary.commissioned else ""),
        f"sensors: {', '.join(summary.sensors)}",
        "blocks: " + ", ".join(f"{count} {kind}" for kind, count in summary.blocks.items()),
    ]
    if summary.cut:
        around = summary.cut.get("around_s")
        around = f"{around:.3f}" if isinstance(around, float) else around  # a file may hold anything
        lines.append(f"cut from {summary.cut.get('from')!r}, around {around} s")
    lines.append(f"MISSING: {summary.missing}" if summary.missing else "whole: nothing is missing")
    print(printable("\n".join([*lines, *recorded.timeline()])))
    return 0


def _verify(args: argparse.Namespace) -> int:
    from coneskin.runs.run_files import find_recordings

    rows, codes = [], {0}
    for path in find_recordings(args.runs, beside=True):
        try:
            missing = _summary(path).missing
            code, said = (INCOMPLETE, f"incomplete: {missing}") if missing else (0, "whole")
        except ConeSkinError as exc:
            code, said = 1, f"cannot be read: {exc}"
        codes.add(code)
        rows.append({"path": str(path), "whole": code == 0, "said": said})
        if not args.json:
            print(printable(f"{path}: {said}"))
    if args.json:
        print(json.dumps({"runs": rows}))
    return 1 if 1 in codes else max(codes)


def _cut(args: argparse.Namespace) -> int:
    from coneskin.runs.cut import cut_run, first_touch
    from coneskin.runs.run_files import find_recordings, run_name

    (path,) = find_recordings([args.run])[:1]
    name = run_name(path)
    target = args.output or Path(f"{name}-cut.rec")
    run = _read(path)
    around = first_touch(run) if args.around is None else args.around
    done = cut_run(run, target, around, args.keep, name, _bar("the whole run"))
    facts = {
        "path": str(done.path),
        "size_bytes": done.size,
        "since_s": done.since,
        "until_s": done.until,
        "contacts": done.contacts,
        "active": done.active,
        "other_reaction": done.other_reaction or None,
    }
    if args.json:
        print(json.dumps(facts))
        return 0
    print(f"{done.path}: {done.size / 1e3:.0f} kB, from {done.since:.3f} s to {done.until:.3f} s")
    print(f"{done.contacts} contact{'s'[: done.contacts != 1]}, as in the whole run (within 0.5 mm and 5 ms)")
    if not done.active:
        print("the guard is not active yet at the contact: this shows the contact, and not the reaction")
    if done.other_reaction:
        print(f"NOT the reaction of the whole run: {done.other_reaction}")
    return 0


def _diff(args: argparse.Namespace) -> int:
    from coneskin.runs.comparison import compare_decisions, comparison_facts, comparison_lines
    from coneskin.runs.replay.event_details import Tolerances

    one, other = _sides(args)
    tolerances = Tolerances.from_words(args.tolerance)
    if one.window != other.window and not args.tolerance:
        from coneskin.runs.cut import CUT_TOLERANCES

        tolerances = CUT_TOLERANCES
        if not args.json:
            print("one of them is a cut: what a start in the middle changes does not count (0.5 mm, 1.1 deg, 5 ms)")
    comparison = compare_decisions(one, other, tolerances)
    if args.json:
        print(json.dumps(comparison_facts(comparison)))
    else:
        print(printable("\n".join(comparison_lines(comparison))))
    return 0 if comparison.same else 1


def _sides(args: argparse.Namespace) -> tuple[Decisions, Decisions]:
    from coneskin.runs.decisions import decide_again, recorded_decisions
    from coneskin.scene.settings import parse_settings

    settings = parse_settings(args.set)
    first = _read(args.one)
    second = first if args.other is None else _read(args.other)
    if args.python is not None:
        from coneskin.runs.event_file import decide_with

        if args.other is not None:
            raise RecordingError("--python compares two versions of the code on one run: leave B out")
        today = decide_again(first, settings, "today's code", progress=_bar("today's code"))
        return decide_with(args.python, args.one, recorded_decisions(first)), today
    if settings:
        label = "today's code" if args.other is None else str(args.one)
        return decide_again(first, label=label, progress=_bar(label)), decide_again(
            second, settings, progress=_bar("with the settings")
        )
    if args.other is None:
        return recorded_decisions(first), decide_again(first, label="today's code", progress=_bar("today's code"))
    return recorded_decisions(first, str(args.one)), recorded_decisions(second, str(args.other))


def _export(args: argparse.Namespace) -> int:
    from coneskin.runs.export.export import export_run

    written = export_run(_read(args.run), args.output, args.format, _bar("the frames"))
    if args.json:
        print(json.dumps({"files": [{"path": str(path), "rows": rows} for path, rows in written.items()]}))
    else:
        for path, rows in written.items():
            print(f"{path}: {rows} {'messages' if args.format == 'mcap' else 'rows'}")
    return 0


def _prune(args: argparse.Namespace) -> int:
    from coneskin.session.retention import prune_run

    if not 0.0 <= args.around < math.inf:
        raise RecordingError(f"--around must be 0 s or more, got {args.around:g}")
    rows: list[dict[str, object]] = []
    for path in args.runs:
        try:
            before, after = prune_run(path, args.around, _bar(f"reading {path}"))
            rows.append({"path": str(path), "bytes_before": before, "bytes_after": after})
            words = f"{path}: {before / 1e6:.3f} -> {after / 1e6:.3f} MB"
        except ConeSkinError as exc:
            rows.append({"path": str(path), "error": str(exc)})
            words = f"{path}: not pruned: {exc}"
        if not args.json:
            print(printable(words))
    if args.json:
        print(json.dumps({"runs": rows}))
    return 1 if any("error" in row for row in rows) else 0
