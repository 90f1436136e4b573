"""Times of many collisions, touch -> frame -> stop on the wire -> standstill, beside the baseline of a bare call.

    python -m bench reaction [--collisions 2000] [--baselines 500] [--modes moveJ,servoJ] [--keep rows.jsonl] [--json]

A simulated arm moves in one of the modes below; its virtual skin is touched at a random time; the guard stops it, and
is reset. In turns with that, in the same run, the same arm moves in the same way without coneskin and is stopped by the
bare call that the guard ends up making: ur_rtde's, or a program of one stopj on a socket that is open already. Both are
timed by the clock in the controller's states, and judged by the same rule (robot/stop/stop_monitor.py).

    moveJ, moveL, speedJ, servoJ   through the guarded arm; moves are asynchronous on the wheel's side
    sync                           control = "external": a program of its own with ur_rtde's synchronous moveJ
    script                         control = "external": a raw URScript program
    urcl                           control = "external": a program with Universal Robots' own client library, which
                                   moves the arm as the ROS driver does; only with --urcl BUILD (see ur_clients.py)

With --keep every collision is added to a file, and a run that was interrupted goes on from there. The exit code is 0
only if every touch has stopped the arm, and was called a touch. What it does not show: a real adapter, controller and
arm; the simulated controller takes what has come once in 2 ms.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import random
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from bench.report import head, quantile

from .moves import MODES, URCL_MOVER
from .turns import baseline_turn, guarded_turn

TURN_SIZE = 200  # collisions in a turn
COLUMN_NAMES = (
    ("touch begins -> frame read", "touch_frame"),
    ("frame read -> stop sent", "frame_command"),
    ("stop sent -> come to the controller", "command_came"),
    ("stop sent -> slower", "command_slower"),
    ("frame read -> slower", "frame_slower"),
    ("stop sent -> standing", "command_standing"),
)


def summary(rows: list[dict[str, Any]], mode: str) -> dict[str, Any]:
    """Return the quantiles [ms] of each column, for the guard and for the baseline, and what the guard adds."""
    found: dict[str, Any] = {"mode": mode}
    for by in ("guard", "baseline"):
        mine = [row for row in rows if row["mode"] == mode and row["by"] == by]
        good = [row for row in mine if not row.get("missed")]
        found[by] = {"count": len(mine), "missed": len(mine) - len(good)}
        found[by]["misnamed"] = sum(row.get("called", "touch") != "touch" for row in good)
        found[by]["escalated"] = sum(bool(row.get("escalated")) for row in good)
        for _, key in COLUMN_NAMES:
            values = [1e3 * row[key] for row in good if key in row and math.isfinite(row[key])]
            if values:
                found[by][key] = [round(quantile(values, share), 3) for share in (0.5, 0.99, 0.999)]
    if found["guard"].get("frame_slower") and found["baseline"].get("command_slower"):
        pairs = zip(found["guard"]["frame_slower"], found["baseline"]["command_slower"], strict=True)
        found["added"] = [round(a - b, 3) for a, b in pairs]
    return found


def show(rows: list[dict[str, Any]], modes: Sequence[str]) -> None:
    print(f"{'ms: median / p99 / p99.9':48}{'guard':>27}{'bare call':>27}")
    for mode in modes:
        found = summary(rows, mode)
        counts = [f"{found[by]['count']}" for by in ("guard", "baseline")]
        print(f"\n{mode:48}{counts[0]:>27}{counts[1]:>27}")
        for words, key in COLUMN_NAMES:
            cells = [found[by].get(key) for by in ("guard", "baseline")]
            print(f"  {words:46}" + "".join(f"{cell(values):>27}" for values in cells))
        print(f"  {'added: frame -> slower, over call -> slower':46}{cell(found.get('added')):>27}")
        guarded = found["guard"]
        print(f"  did not stop: {guarded['missed']}; stopped, but called a fault: {guarded['misnamed']}; ", end="")
        print(f"needed a second stop path: {guarded['escalated']}")


def cell(values: Sequence[float] | None) -> str:
    return " / ".join(f"{value:.2f}" for value in values) if values else "-"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--collisions", type=int, default=2000, help="in each mode (%(default)s)")
    parser.add_argument("--baselines", type=int, help="bare calls in each mode (as many)")
    parser.add_argument("--modes", help=f"({','.join(MODES)}; urcl too with --urcl)")
    parser.add_argument("--urcl", type=Path, metavar="BUILD", help="build of Universal Robots' client library")
    parser.add_argument("--source", type=Path, metavar="FOLDER", help="its source (the folder above the build)")
    parser.add_argument("--keep", type=Path, metavar="FILE", help="add each collision to this file; go on from it")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    known = (*MODES, "urcl") if args.urcl else MODES
    modes = args.modes.split(",") if args.modes else list(known)
    if unknown := set(modes) - set(known):
        parser.error(f"no such mode: {', '.join(sorted(unknown))}; there are {', '.join(known)}")
    if "urcl" in modes:
        os.environ[URCL_MOVER] = build_mover(args.urcl.resolve(), (args.source or args.urcl.parent).resolve())
    machine = head()
    rows = [json.loads(line) for line in args.keep.read_text().splitlines()] if args.keep and args.keep.exists() else []
    try:
        measure(modes, args, rows)
    except KeyboardInterrupt:
        print("\ninterrupted: this is what was measured", file=sys.stderr)
    if args.json:
        print(json.dumps({"machine": machine, "modes": [summary(rows, mode) for mode in modes]}))
    else:
        print(machine + "\n")
        show(rows, modes)
    return 1 if any(row.get("missed") or row.get("called", "touch") != "touch" for row in rows) else 0


def build_mover(build: Path, source: Path) -> str:
    """Compile the mover of mode urcl into the library's build; return the value of URCL_MOVER."""
    made, text = build / "coneskin_urcl_mover", Path(__file__).with_name("urcl_mover.cpp")
    if not made.exists() or made.stat().st_mtime < text.stat().st_mtime:
        include = [f"-I{source / 'include'}", f"-I{source / '3rdparty'}", f"-I{build / 'include'}"]
        link = [f"-L{build}", "-lurcl", f"-Wl,-rpath,{build}", "-pthread"]
        subprocess.run(["c++", "-std=c++17", "-O1", *include, str(text), "-o", str(made), *link], check=True)
    return f"{made}\t{source / 'resources' / 'external_control.urscript'}"


def measure(modes: Sequence[str], args: argparse.Namespace, rows: list[dict[str, Any]]) -> None:
    """Measure all modes in turns, so that a busy machine is busy for all."""
    rng = random.Random(args.seed + len(rows))
    turns: tuple[tuple[str, Callable[..., list[dict[str, Any]]]], ...] = (
        ("guard", guarded_turn),
        ("baseline", baseline_turn),
    )
    while True:
        left = 0
        for mode in modes:
            for by, turn in turns:
                done = sum(row["mode"] == mode and row["by"] == by for row in rows)
                wanted = args.baselines if by == "baseline" and args.baselines is not None else args.collisions
                if done >= wanted:
                    continue
                left += wanted - done
                new = turn(mode, min(max(1, TURN_SIZE * wanted // args.collisions), wanted - done), rng)
                rows += new
                if args.keep:
                    with args.keep.open("a") as file:
                        file.writelines(json.dumps(row) + "\n" for row in new)
                print(f"\r{mode} {by}: {done + len(new)} of {wanted}    ", end="", file=sys.stderr, flush=True)
        if not left:
            print(file=sys.stderr)
            return
