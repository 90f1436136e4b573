"""Exploration of the guard to the end of its states, and of the processes around it.

    python -m bench exploration [--wrong 1] [--compiled] [--parallel 2] [--wander 1000]

The core is fed what a guard is fed, by a world in which anything may happen at any time, as long as so many things are
wrong at once. States are abstract: the phase and the facts that decide, without times and numbers. Each invariant is
broken once on purpose. With --wander, so many runs of each case are made by chance besides: actions of any length, one
after the other, and then a person who helps. What they reach is explored from as well, where it was not. With
--compiled the build in build/compiled is explored, and nothing is broken.
"""

from __future__ import annotations

import argparse
import math
import os
import random
import subprocess
import sys
from collections.abc import Hashable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from bench.report import head, show
from tests.support.exploration.explorer import Exploration, explore, wander
from tests.support.exploration.guard_world import CONTROLS, INVARIANTS, PROGRESS, REACTIONS, GuardWorld, Settings
from tests.support.exploration.process_world import (
    HEEDLESS_PROGRAM,
    PATIENT_CONTROLLER,
    PROCESS_INVARIANTS,
    Parts,
    ProcessWorld,
)

ROOT = Path(__file__).parents[2]
COLUMNS = ["states", "steps", "depth", "closed", "invariants", "broken", "seconds"]
WANDERED = ["runs", "actions", "to states not explored", "states", "explored from there too", "broken"]
WAY = 30  # actions of a run by chance, before a person helps
#: silences that somebody listens for: without each of them the arm goes on
PARTS = ("program_silence", "process_silence", "hold_up", "guard_silence", "second_silence", "watchdog")
SILENT = ("lose", "touch", "reset", "thaw", "restart", "kill")  # without these actions such a one is found in seconds


def row(name: str, found: Exploration, invariants: int) -> list[str]:
    sizes = [str(number) for number in (found.states, found.steps, found.depth)]
    closed, broken = "yes" if found.closed else "no", ", ".join(found.broken) or "none"
    return [name, *sizes, closed, str(invariants), broken, f"{found.seconds:.1f}"]


def explore_one(settings: Settings, runs: int) -> tuple[Exploration, list[str]]:
    world = GuardWorld(settings)
    first = world.save()
    found = explore(world, PROGRESS)
    steps = outside = 0
    broken, fresh = "", dict[Hashable, Any]()
    for seed in range(runs):
        world.restore(first)
        world.draw = draw = random.Random(seed)
        way, states, wrong = wander(world, draw, WAY, PROGRESS, found.reached)
        broken = broken or (wrong and f"{wrong} (seed {seed}, after {', '.join(way)})")
        new = {key: saved for key, saved in states if saved is not None}
        steps, outside, fresh = steps + len(states), outside + sum(key in new for key, _ in states), new | fresh
    world.restore(first)
    wider = explore(world, PROGRESS, starts=fresh) if runs else found
    broken = broken or ", ".join(wider.broken)
    counts = [runs, steps, f"{100.0 * outside / max(1, steps):.2f} %", len(fresh), wider.states]
    return found, [*map(str, counts), broken or "none"]


def explore_guard(wrong: int, parallel: int, runs: int) -> bool:
    whole, things = True, "one thing" if wrong == 1 else f"{wrong} things"
    with ProcessPoolExecutor(parallel) as pool:
        found = {
            control: [
                (reaction, pool.submit(explore_one, Settings(reaction, control, most_wrong=wrong), runs))
                for reaction in REACTIONS
            ]
            for control in CONTROLS
        }
        for control, cases in found.items():
            done = [(reaction, case.result()) for reaction, case in cases]
            rows = [row(reaction, each, len(INVARIANTS)) for reaction, (each, _) in done]
            for way, said in (broken for _, (each, _) in done for broken in each.broken.values()):
                print(f"{said}\n  after: {', '.join(way)}")
            whole = whole and all(each.closed and not each.broken for _, (each, _) in done)
            show(f"The guard's core, {control} control, {things} wrong at once", ["reaction", *COLUMNS], rows)
            if runs:
                whole = whole and all(counts[-1] == "none" for _, (_, counts) in done)
                rows = [[reaction, *counts] for reaction, (_, counts) in done]
                show(f"Runs by chance, {control} control, {things} wrong at once", ["reaction", *WANDERED], rows)
    return whole


def explore_processes() -> bool:
    rows, needed, whole = [], [], True
    cases = [
        ("internal", "internal", {}, 2),
        ("internal, patient controller", "internal", PATIENT_CONTROLLER, 1),
        ("external", "external", HEEDLESS_PROGRAM, 1),
        ("external, with its lines", "external", {}, 1),
    ]
    for name, control, parts, wrong in cases:
        found = explore(ProcessWorld(control, Parts(**parts), wrong), PROGRESS)
        rows.append(row(name, found, len(PROCESS_INVARIANTS)))
        whole = whole and found.closed and not found.broken
        for part in PARTS:
            world = ProcessWorld(control, Parts(**{**parts, part: math.inf}), without=SILENT)
            without = explore(world, stop_at_first=True)
            needed.append([name, part, ", ".join(without.broken) or "nothing"])
    show("The processes", ["control", *COLUMNS], rows)
    show("What breaks where nobody listens any more", ["control", "without", "breaks"], needed)
    return whole


def break_each() -> bool:
    from tests.support.exploration.breaks import BREAKS, find

    rows, all_found = [], True
    for name, change in BREAKS.items():
        found = find(name)
        seen = name in found.broken
        all_found = all_found and seen
        way = len(found.broken[name][0]) if seen else 0
        rows.append([name, change.words, "yes" if seen else "NO", str(way), str(found.states), f"{found.seconds:.2f}"])
    columns = ["invariant", "what was done to the guard", "found", "actions", "states", "seconds"]
    show("Each invariant broken on purpose", columns, rows)
    return all_found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wrong", type=int, default=1, help="things that may be wrong at once")
    parser.add_argument("--parallel", type=int, default=os.cpu_count(), help="cases at a time (%(default)s)")
    parser.add_argument("--wander", type=int, default=0, metavar="RUNS", help="by chance, of each case (%(default)s)")
    parser.add_argument("--compiled", action="store_true", help="explore build/compiled")
    options = parser.parse_args()
    compiled = ROOT / "build" / "compiled"
    if options.compiled and str(compiled) not in os.environ.get("PYTHONPATH", ""):
        paths = os.pathsep.join([str(compiled), str(ROOT)])
        words = [sys.executable, "-m", "bench", "exploration", *sys.argv[1:]]
        return subprocess.run(words, cwd=ROOT, env={**os.environ, "PYTHONPATH": paths}, check=False).returncode
    print(head())
    whole = explore_guard(options.wrong, options.parallel, options.wander)
    if not options.compiled:
        whole = explore_processes() & break_each() & whole
    return 0 if whole else 1
