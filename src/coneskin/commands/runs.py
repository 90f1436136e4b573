"""``coneskin runs``: look at recorded runs, check, cut, compare and export them.

examples, of which each job's own help has more:
  coneskin runs list runs/                                  what is there
  coneskin runs info runs/2026-01-31T12-00-00               one run: scene, events, what was recorded
  coneskin runs verify runs/                                is any of them incomplete?
  coneskin runs cut runs/2026-01-31T12-00-00 --around 4.3   the second around a touch, for a repository of tests
  coneskin runs diff runs/a                                 recorded, and what today's code makes of it
  coneskin runs export runs/a -o out --format parquet
  coneskin runs prune runs/2026-01-*                        keep the events, and 5 s around each touch, stop and fault

Times count from the start of the run. Exit code: 0 well; 1 a difference (diff), or a run that cannot be read;
4 (verify) a run that is incomplete; 2 wrong usage.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import ConeSkinError, RecordingError
from coneskin.core.help_text import HelpFormatter
from coneskin.core.progress import ProgressBar
from coneskin.core.text import printable

if TYPE_CHECKING:
    from coneskin.runs.decisions import Decisions
    from coneskin.runs.replay.run import Run

INCOMPLETE = 4  #: exit code for a run that is not whole

#: job -> what it does, its examples, and its exit codes
_JOBS = {
    "list": (
        "runs in folders, one a line",
        "list runs/ /mnt/archive --json",
        "0; 1 one cannot be read, or there is none",
    ),
    "info": ("what one run is about", "info collision.rec --json", "0, whole or not; 1 it cannot be read"),
    "verify": (
        "whether runs are whole",
        "verify runs/a runs/b.rec --json",
        "0 all are; 4 one is not; 1 one cannot be read",
    ),
    "cut": (
        "the part around a moment, as a recording of its own",
        "cut runs/a --around 4.3 --keep 1 -o tests/runs/collision.rec",
        "0 cut, and its contacts are those of the whole run; 1 not",
    ),
    "diff": (
        "contacts moved, reactions earlier or later, new and missing ones",
        """diff runs/a                                  recorded, and what today's code makes of it
  coneskin runs diff runs/a --set reaction.kind=stop         today's code, and with another parameter
  coneskin runs diff runs/a --python ../old/.venv/bin/python    another version of the code, and today's
  coneskin runs diff runs/a runs/b --tolerance place_mm=1    two runs, from their first contacts on
  coneskin runs diff runs/a a-cut.rec                        a run and a cut of it, within the tolerances of a cut""",
        "0 the same within the tolerances; 1 a difference, or a run that cannot be read",
    ),
    "export": (
        "tables for other programs",
        """export runs/a -o out --format parquet      for DuckDB, pandas, Polars
  coneskin runs export runs/a -o a.mcap                    for Foxglove""",
        "0 written; 1 not: nothing is overwritten",
    ),
    "prune": (
        "drop for good what is far from any touch, stop or fault; events stay",
        "prune runs/2026-01-* --around 2    no run that is pruned is replayed as a whole any more",
        "0 all are pruned; 1 one is not",
    ),
}
_SETTING_HELP = "another value in B's scene, such as reaction.kind=stop or sensor.0.touch_level=0.08; docs/do/runs.md"
_TOLERANCE_HELP = "place_mm, angle_deg, level, speed_rad_s, time_ms or relative: what does not count"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the jobs and their options."""
    jobs = parser.add_subparsers(dest="job", metavar="JOB", required=True)

    def job(name: str, **runs: Any) -> argparse.ArgumentParser:
        (text, examples, codes), kind = _JOBS[name], HelpFormatter
        about, epilog = f"{text[0].upper()}{text[1:]}.", f"example:\n  coneskin runs {examples}\n\nExit code: {codes}."
        made = jobs.add_parser(name, help=text, description=about, epilog=epilog, formatter_class=kind)
        made.add_argument("--json", action="store_true", help="print one JSON object")
        what = {"metavar": "RUN", "help": "folder of a run, or its recording", **runs}
        made.add_argument(what.pop("dest", "run"), type=Path, **what)
        return made

    job("list", dest="runs", nargs="*", metavar="PATH", default=[Path("runs")], help="default: runs")
    job("info")
    job("verify", dest="runs", nargs="+")
    add = job("cut").add_argument
    add("--around", type=float, metavar="SECONDS", help="when, as `runs info` shows it (default: the first touch)")
    add("--keep", type=float, metavar="SECONDS", help="duration (default 1, and what the same contacts need before it)")
    add("-o", "--output", type=Path, metavar="FILE", help="recording to make (default: NAME-cut.rec)")
    add = job("diff", dest="one", metavar="A", help="a run").add_argument
    add("others", type=Path, nargs="*", metavar="B", help="another; without it: A as today's code sees it")
    add("--set", action="append", default=[], metavar="NAME=VALUE", help=_SETTING_HELP)
    add("--python", type=Path, metavar="FILE", help="interpreter of another version of coneskin, for A")
    add("--tolerance", action="append", default=[], metavar="NAME=VALUE", help=_TOLERANCE_HELP)
    add = job("export").add_argument
    add("-o", "--output", type=Path, required=True, metavar="PATH", help="folder, or file (npz, mcap)")
    formats = ("csv", "parquet", "npz", "mcap")
    add("--format", choices=formats, help="default: npz or mcap, as PATH ends with it, else csv")
    add = job("prune", dest="runs", nargs="+").add_argument
    add("--around", type=float, default=5.0, metavar="SECONDS", help="kept before and after each (default 5)")


def run(args: argparse.Namespace) -> int:
    """Do the job."""
    work = {"list": _list, "info": _info, "verify": _verify, "cut": _cut, "diff": _diff, "export": _export}
    return {**work, "prune": _prune}[args.job](args)


def _each(
    args: argparse.Namespace, paths: Iterable[Path], job: Callable[[Path], tuple[dict[str, Any], str]], failed: str
) -> list[dict[str, Any]]:
    """Do a job for each run, print its line, or all rows as one JSON object, and return the rows.

    Args:
        job: returns the row and the line of a run.
        failed: begins what is said of a run for which it raises; its row has an ``error``.
    """
    rows = []
    for path in paths:
        try:
            row, line = job(path)
        except ConeSkinError as exc:
            row = {"path": str(path), "whole": False, "said": f"{failed}: {exc}", "error": str(exc)}
            line = f"{path}: {row['said']}"
        rows.append(row)
        if not args.json:
            print(printable(line))
    if args.json:
        print(json.dumps({"runs": rows}))
    return rows


def _list(args: argparse.Namespace) -> int:
    from coneskin.runs.run_files import find_recordings

    def line(path: Path) -> tuple[dict[str, Any], str]:
        facts = _summary(path)
        said = "  INCOMPLETE" if facts["missing"] else ""
        folder = path.parent if path.name == "run.rec" else path
        size, arm = facts["size_bytes"] / 1e3, facts["arm"] or "-"
        return facts, (
            f"{facts['began'] or '':19}  {facts['duration_s']:8.1f} s  {size:6.0f} kB  {facts['contacts']:8}  "
            f"{facts['stops']:5}  {arm:6}  {folder}{said}"
        )

    if not args.json:
        print(f"{'began':19}  {'duration':>10}  {'size':>9}  contacts  stops  arm     run")
    rows = _each(args, find_recordings(args.runs, beside=True), line, "cannot be read")
    return 1 if any("error" in row for row in rows) else 0


def _summary(path: Path) -> dict[str, Any]:
    from coneskin.runs.run_files import summarise_run

    return summarise_run(path, _read(path), ProgressBar(f"{path}"))


def _read(path: Path) -> Run:
    from coneskin.runs.replay.run import read_run

    return read_run(path, ProgressBar(f"reading {path}"))


def _info(args: argparse.Namespace) -> int:
    from coneskin.runs.replay.run import run_path
    from coneskin.runs.run_files import summarise_run

    recorded = _read(args.run)
    facts = summarise_run(run_path(args.run), recorded, ProgressBar(f"{args.run}"))
    if args.json:
        print(json.dumps(facts))
        return 0
    words = [facts["arm"] or "none", facts["reaction"] and f"reaction {facts['reaction']}"]
    lines = [
        f"{facts['path']}: {facts['size_bytes'] / 1e3:.0f} kB",
        f"recorded {facts['began'] or 'at a time that it does not tell'} "
        f"by coneskin {facts['coneskin'] or '(unknown)'}, "
        f"from {facts['first_s']:.3f} s to {facts['first_s'] + facts['duration_s']:.3f} s after its start",
        f"arm {', '.join(filter(None, words))}" + (f"; {facts['commissioned']}" if facts["commissioned"] else ""),
        f"sensors: {', '.join(facts['sensors'])}",
        "blocks: " + ", ".join(f"{count} {kind}" for kind, count in facts["blocks"].items()),
    ]
    if cut := facts["cut"]:
        around = cut.get("around_s")
        around = f"{around:.3f}" if isinstance(around, float) else around  # a file may hold anything
        lines.append(f"cut from {cut.get('from')!r}, around {around} s")
    lines.append(f"MISSING: {facts['missing']}" if facts["missing"] else "whole: nothing is missing")
    print(printable("\n".join([*lines, *recorded.timeline()])))
    return 0


def _verify(args: argparse.Namespace) -> int:
    from coneskin.runs.run_files import find_recordings

    def check(path: Path) -> tuple[dict[str, Any], str]:
        missing = _summary(path)["missing"]
        said = f"incomplete: {missing}" if missing else "whole"
        return {"path": str(path), "whole": not missing, "said": said}, f"{path}: {said}"

    rows = _each(args, find_recordings(args.runs, beside=True), check, "cannot be read")
    return 1 if any("error" in row for row in rows) else 0 if all(row["whole"] for row in rows) else INCOMPLETE


def _cut(args: argparse.Namespace) -> int:
    from coneskin.runs.cut import cut_run
    from coneskin.runs.run_files import find_recordings, run_name

    (path,) = find_recordings([args.run])[:1]
    name = run_name(path)
    target = args.output or Path(f"{name}-cut.rec")
    done = cut_run(_read(path), target, args.around, args.keep, name, ProgressBar("the whole run"))
    if args.json:
        facts = {"path": str(done.path), "size_bytes": done.size, "since_s": done.since, "until_s": done.until}
        facts |= {"contacts": done.contacts, "active": done.active, "other_reaction": done.other_reaction or None}
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

    if len(args.others) > 1:
        said = f"diff compares one run, or two, got {1 + len(args.others)}; many runs: coneskin replay RUN ..."
        print(f"coneskin runs: {said}, with --set or --vary for other settings", file=sys.stderr)
        return 2
    one, other = _sides(args, *args.others)
    tolerances = Tolerances.from_words(args.tolerance)
    if one.window != other.window and not args.tolerance:
        from coneskin.runs.cut import CUT_TOLERANCES

        tolerances = CUT_TOLERANCES
        if not args.json:
            print("one of them is a cut: what a start in the middle changes does not count (0.5 mm, 1.1 deg, 5 ms)")
    comparison = compare_decisions(one, other, tolerances)
    said = json.dumps(comparison_facts(comparison)) if args.json else "\n".join(comparison_lines(comparison))
    print(printable(said))
    return 0 if comparison.same else 1


def _sides(args: argparse.Namespace, beside: Path | None = None) -> tuple[Decisions, Decisions]:
    from coneskin.runs.decisions import decide_again, recorded_decisions
    from coneskin.scene.settings import parse_settings

    settings = parse_settings(args.set)
    first = _read(args.one)
    second, label = (first, "today's code") if beside is None else (_read(beside), str(args.one))
    if args.python is not None:
        from coneskin.runs.event_file import decide_with

        if beside is not None:
            raise RecordingError("--python compares two versions of the code on one run: leave B out")
        today = decide_again(first, settings, label, progress=ProgressBar(label))
        return decide_with(args.python, args.one, recorded_decisions(first)), today
    if settings:
        before = decide_again(first, label=label, progress=ProgressBar(label))
        return before, decide_again(second, settings, progress=ProgressBar("with the settings"))
    if beside is None:
        return recorded_decisions(first), decide_again(first, label=label, progress=ProgressBar(label))
    return recorded_decisions(first, str(args.one)), recorded_decisions(second, str(beside))


def _export(args: argparse.Namespace) -> int:
    from coneskin.runs.export.export import export_run

    written = export_run(_read(args.run), args.output, args.format, ProgressBar("the frames"))
    facts = {"files": [{"path": str(path), "rows": rows} for path, rows in written.items()]}
    kinds = {path: "messages" if (args.format or path.suffix[1:]) == "mcap" else "rows" for path in written}
    lines = (f"{path}: {rows} {kinds[path]}" for path, rows in written.items())
    print(json.dumps(facts) if args.json else "\n".join(lines))
    return 0


def _prune(args: argparse.Namespace) -> int:
    from coneskin.session.event_log import prune_run

    if not 0.0 <= args.around < math.inf:
        raise RecordingError(f"--around must be 0 s or more, got {args.around:g}")

    def prune(path: Path) -> tuple[dict[str, Any], str]:
        before, after = prune_run(path, args.around, ProgressBar(f"reading {path}"))
        row = {"path": str(path), "bytes_before": before, "bytes_after": after}
        return row, f"{path}: {before / 1e6:.3f} -> {after / 1e6:.3f} MB"

    rows = _each(args, args.runs, prune, "not pruned")
    return 1 if any("error" in row for row in rows) else 0
