"""Collisions in bulk: touch -> frame -> stop on the wire -> slowdown -> standstill, beside the floor of a bare call.

    python bench/reaction.py [--collisions 2000] [--floors 500] [--modes moveJ,servoJ] [--keep rows.jsonl] [--json]

A simulated arm moves in one of the modes below; its virtual skin is touched at a random time; the guard stops it, and
is reset. In turns with that, in the same run, the same arm moves in the same way without coneskin and is stopped by the
bare call that the guard ends up making: ur_rtde's, or a program of one stopj on a socket that is open already. Both are
timed by the same reader of the controller's state, and judged by the same rule (robot/stop_watch.py).

    moveJ, moveL, speedJ, servoJ   through the guarded arm; moves are asynchronous on the wheel's side
    sync                           control = "foreign": a program of its own with ur_rtde's synchronous moveJ
    script                         control = "foreign": a raw URScript program

With --keep every collision is added to a file, and a run that was interrupted goes on from there. The exit code is 0
only if every touch has stopped the arm, and was called a touch. What it does not show: a real adapter, controller and
arm; the simulated controller takes what has come once in 2 ms.
"""

from __future__ import annotations

import argparse
import json
import math
import random
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from reaction_moves import MODES
from reaction_turns import floor_turn, guarded_turn
from report import head, quantile

EACH = 200  # collisions in a turn
COLUMNS = (
    ("touch begins -> frame read", "touch_frame"),
    ("frame read -> stop sent", "frame_command"),
    ("stop sent -> come to the controller", "command_came"),
    ("stop sent -> slower", "command_slower"),
    ("frame read -> slower", "frame_slower"),
    ("stop sent -> standing", "command_standing"),
)


def summary(rows: list[dict[str, Any]], mode: str) -> dict[str, Any]:
    """Quantiles [ms] of each column, for the guard and for the floor, and what the guard adds."""
    found: dict[str, Any] = {"mode": mode}
    for who in ("guard", "floor"):
        mine = [row for row in rows if row["mode"] == mode and row["who"] == who]
        good = [row for row in mine if not row.get("missed")]
        found[who] = {"count": len(mine), "missed": len(mine) - len(good)}
        found[who]["misnamed"] = sum(row.get("called", "touch") != "touch" for row in good)
        found[who]["escalated"] = sum(bool(row.get("escalated")) for row in good)
        for _, key in COLUMNS:
            values = [1e3 * row[key] for row in good if key in row and math.isfinite(row[key])]
            if values:
                found[who][key] = [round(quantile(values, share), 3) for share in (0.5, 0.99, 0.999)]
    if found["guard"].get("frame_slower") and found["floor"].get("command_slower"):
        pairs = zip(found["guard"]["frame_slower"], found["floor"]["command_slower"], strict=True)
        found["added"] = [round(a - b, 3) for a, b in pairs]
    return found


def show(rows: list[dict[str, Any]], modes: Sequence[str]) -> None:
    print(f"{'ms: median / p99 / p99.9':48}{'guard':>27}{'bare call':>27}")
    for mode in modes:
        found = summary(rows, mode)
        counts = [f"{found[who]['count']}" for who in ("guard", "floor")]
        print(f"\n{mode:48}{counts[0]:>27}{counts[1]:>27}")
        for words, key in COLUMNS:
            cells = [found[who].get(key) for who in ("guard", "floor")]
            print(f"  {words:46}" + "".join(f"{cell(values):>27}" for values in cells))
        print(f"  {'added: frame -> slower, over call -> slower':46}{cell(found.get('added')):>27}")
        guarded = found["guard"]
        print(f"  did not stop: {guarded['missed']}; stopped, but called a fault: {guarded['misnamed']}; ", end="")
        print(f"needed a second way to stop: {guarded['escalated']}")


def cell(values: Sequence[float] | None) -> str:
    return " / ".join(f"{value:.2f}" for value in values) if values else "-"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--collisions", type=int, default=2000, help="in each mode (%(default)s)")
    parser.add_argument("--floors", type=int, help="bare calls in each mode (as many)")
    parser.add_argument("--modes", default=",".join(MODES), help="(%(default)s)")
    parser.add_argument("--keep", type=Path, metavar="FILE", help="add each collision to this file; go on from it")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    modes = args.modes.split(",")
    if unknown := set(modes) - set(MODES):
        parser.error(f"no such mode: {', '.join(sorted(unknown))}; there are {', '.join(MODES)}")
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


def measure(modes: Sequence[str], args: argparse.Namespace, rows: list[dict[str, Any]]) -> None:
    """All modes in turns, so that a busy machine is busy for all."""
    rng = random.Random(args.seed + len(rows))
    turns: tuple[tuple[str, Callable[..., list[dict[str, Any]]]], ...] = (
        ("guard", guarded_turn),
        ("floor", floor_turn),
    )
    while True:
        left = 0
        for mode in modes:
            for who, turn in turns:
                done = sum(row["mode"] == mode and row["who"] == who for row in rows)
                wanted = args.floors if who == "floor" and args.floors is not None else args.collisions
                if done >= wanted:
                    continue
                left += wanted - done
                new = turn(mode, min(max(1, EACH * wanted // args.collisions), wanted - done), rng)
                rows += new
                if args.keep:
                    with args.keep.open("a") as file:
                        file.writelines(json.dumps(row) + "\n" for row in new)
                print(f"\r{mode} {who}: {done + len(new)} of {wanted}    ", end="", file=sys.stderr, flush=True)
        if not left:
            print(file=sys.stderr)
            return


if __name__ == "__main__":
    sys.exit(main())
