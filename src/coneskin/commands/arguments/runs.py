"""Options of ``coneskin runs``: one parser for each of its jobs, with examples and exit codes."""

from __future__ import annotations

import argparse
from pathlib import Path

__all__ = ["INCOMPLETE", "add_arguments"]

INCOMPLETE = 4  #: exit code for a run that is not whole

_EXAMPLE = """\
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
_LIST = """\
examples:
  coneskin runs list                              what is in runs/
  coneskin runs list runs/ /mnt/archive --json    in several folders and below, for a program

Exit code: 0; 1 one of them cannot be read, or there is none.
"""
_INFO = """\
examples:
  coneskin runs info runs/2026-01-31T12-00-00
  coneskin runs info collision.rec --json

Exit code: 0, whole or not; 1 it cannot be read.
"""
_VERIFY = """\
examples:
  coneskin runs verify runs/
  coneskin runs verify runs/a runs/b.rec --json

Exit code: 0 all are whole; 4 one is incomplete, damaged, or was not closed; 1 one cannot be read.
"""
_CUT = """\
examples:
  coneskin runs cut runs/2026-01-31T12-00-00     around its first touch
  coneskin runs cut runs/2026-01-31T12-00-00 --around 4.3 --keep 1 -o tests/runs/collision.rec
  coneskin runs info runs/2026-01-31T12-00-00    shows when the touches were

Exit code: 0 cut, and its contacts are those of the whole run; 1 not.
"""
_DIFF = """\
examples:
  coneskin runs diff runs/a                                  recorded, and what today's code makes of it
  coneskin runs diff runs/a --set reaction.kind=stop         today's code, and with another parameter
  coneskin runs diff runs/a --set sensor.0.touch_level=0.08 --set detector.release_frames=5
  coneskin runs diff runs/a --python ../old/.venv/bin/python    another version of the code, and today's
  coneskin runs diff runs/a runs/b --tolerance place_mm=1    two runs, from their first contacts on
  coneskin runs diff runs/a a-cut.rec                        a run and a cut of it, within the tolerances of a cut

Exit code: 0 the same within the tolerances; 1 a difference, or a run that cannot be read.
"""
_EXPORT = """\
examples:
  coneskin runs export runs/a -o out                       CSV files in a folder
  coneskin runs export runs/a -o out --format parquet      for DuckDB, pandas, Polars
  coneskin runs export runs/a -o a.npz --format npz
  coneskin runs export runs/a -o a.mcap --format mcap      for Foxglove

Exit code: 0 written; 1 not: nothing is overwritten.
"""
_PRUNE = """\
examples:
  coneskin runs prune runs/2026-01-31T12-00-00
  coneskin runs prune runs/2026-01-* --around 2 --json

What is dropped is gone for good; the run says so, and is no longer replayed as a whole.
Exit code: 0 all are pruned; 1 one is not.
"""
_SETTING = "another value in B's scene, such as reaction.kind=stop or sensor.0.touch_level=0.08; docs/do/runs.md"
_TOLERANCE = "place_mm, angle_deg, level, speed_rad_s, time_ms or relative: what does not count"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the jobs and their options."""
    parser.epilog = _EXAMPLE
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    jobs = parser.add_subparsers(dest="job", metavar="JOB", required=True)

    def job(name: str, text: str, epilog: str) -> argparse.ArgumentParser:
        made = jobs.add_parser(
            name,
            help=text,
            description=text[0].upper() + text[1:] + ".",
            epilog=epilog,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        made.add_argument("--json", action="store_true", help="print one JSON object")
        return made

    many = {"nargs": "+", "type": Path, "metavar": "RUN", "help": "folders of runs, or recordings"}
    listing = job("list", "runs in folders, one a line", _LIST)
    listing.add_argument("runs", nargs="*", type=Path, metavar="PATH", default=[Path("runs")], help="default: runs")
    info = job("info", "what one run is about", _INFO)
    info.add_argument("run", type=Path, metavar="RUN", help="folder of a run, or its recording")
    verify = job("verify", "whether runs are whole", _VERIFY)
    verify.add_argument("runs", **many)  # type: ignore[arg-type]
    cut = job("cut", "the part around a moment, as a recording of its own", _CUT)
    cut.add_argument("run", type=Path, metavar="RUN", help="folder of a run, or its recording")
    cut.add_argument(
        "--around", type=float, metavar="SECONDS", help="the moment, as `runs info` shows it (default: the first touch)"
    )
    cut.add_argument(
        "--keep",
        type=float,
        metavar="SECONDS",
        help="duration (default 1, and as much before it as the same contacts need)",
    )
    cut.add_argument("-o", "--output", type=Path, metavar="FILE", help="recording to make (default: NAME-cut.rec)")
    diff = job("diff", "contacts moved, reactions earlier or later, new and missing ones", _DIFF)
    diff.add_argument("one", type=Path, metavar="A", help="a run")
    diff.add_argument("other", type=Path, nargs="?", metavar="B", help="another; without it: A as today's code sees it")
    diff.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help=_SETTING)
    diff.add_argument("--python", type=Path, metavar="FILE", help="interpreter of another version of coneskin, for A")
    diff.add_argument("--tolerance", action="append", default=[], metavar="NAME=VALUE", help=_TOLERANCE)
    export = job("export", "tables for other programs", _EXPORT)
    export.add_argument("run", type=Path, metavar="RUN", help="folder of a run, or its recording")
    export.add_argument("-o", "--output", type=Path, required=True, metavar="PATH", help="folder, or file (npz, mcap)")
    export.add_argument("--format", choices=("csv", "parquet", "npz", "mcap"), default="csv", help="default: csv")
    prune = job("prune", "drop for good what is far from any touch, stop or fault; events stay", _PRUNE)
    prune.add_argument("runs", **many)  # type: ignore[arg-type]
    prune.add_argument(
        "--around", type=float, default=5.0, metavar="SECONDS", help="kept before and after each (default 5)"
    )
