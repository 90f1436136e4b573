"""Fault campaign: faults at random times, and the time until the arm stands, against its budget.

    python -m bench faults [--times 100] [--kinds guard,skin] [--control internal] [--parallel 1] [--keep FILE] [--json]

A simulated arm moves under guard, by its own program (control = "internal") or by a raw one (control = "external").
At a random time something fails, or two at once (bench/faults/kinds_*.py). The budget is the time in which the fault
must be noticed, v / a and four times escalate_ms (docs/safety.md), and --slack for a machine that is busy with other
things. Time runs until the log of the simulated controller says that the arm stands. A trial fails where the arm

    stands too late, goes on to its goal, moves again, or retreats without a touch,
    reacts before there is a fault,
    pushes more than 5 mm further into a touch than a bare stop does,

or where the program is not informed, or is told that the arm stands before it does, or a frame before the fault is
missing in the recording, or its replay differs.
"Held up" is the longest time for which the machine did not let the guard's loop run. The exit code is 0 only if none
failed.

Every kind is tried once before any is tried twice. With --keep each trial is added to a file, and a campaign that was
interrupted goes on from there.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path

from .kind import FaultKind
from .kinds_peer import CONTROLLER_KINDS, DRIVER_KINDS, NETWORK_KINDS, SKIN_KINDS, SWITCH_KINDS
from .kinds_process import PROCESS_KINDS, PROGRAM_KINDS
from .kinds_reaction import CONTACT_KINDS, REACTION_KINDS
from .setup import CLOCK, Outcome
from .table import show_kinds, summary
from .trial import EXTERNAL_CONTROL
from .verdict import run_trial

#: in the order in which they are tried
KINDS: tuple[FaultKind, ...] = (
    *SKIN_KINDS,
    *CONTROLLER_KINDS,
    *NETWORK_KINDS,
    *SWITCH_KINDS,
    *PROCESS_KINDS,
    *PROGRAM_KINDS,
    *CONTACT_KINDS,
    *REACTION_KINDS,
    *DRIVER_KINDS,
)


def chosen(args: argparse.Namespace) -> list[tuple[FaultKind, str]]:
    words = args.kinds.split(",") if args.kinds else [""]
    known = [kind for kind in KINDS if EXTERNAL_CONTROL in os.environ or not kind.setup.mover.startswith("driver")]
    controls = (args.control,) if args.control else ("internal", "external")
    if args.quick:
        kinds = [kind for kind in known if not kind.variant and any(word in kind.name for word in words)]
        return [(kind, kind.controls[number % len(kind.controls)]) for number, kind in enumerate(kinds)][:: args.every]
    return [
        (kind, control)
        for kind in known
        for control in controls
        if control in kind.controls and any(word == kind.name or word in kind.name for word in words)
    ]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=100, help="trials of each kind (%(default)s)")
    parser.add_argument("--kinds", help="only kinds with one of these words in their names, separated by commas")
    parser.add_argument("--control", choices=("internal", "external"), help="(both)")
    parser.add_argument("--parallel", type=int, default=1, help="trials at a time (%(default)s)")
    parser.add_argument("--keep", type=Path, metavar="FILE", help="add each trial to this file; go on from it")
    parser.add_argument("--slack-ms", type=float, default=100.0, help="added to each budget [ms] (%(default)g)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--quick", action="store_true", help="each kind in one control mode, without close variants")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="with --quick, only every Nth of these")
    parser.add_argument("--list", action="store_true", help="name the kinds, and end")
    parser.add_argument("--json", action="store_true", help="a line of JSON for each kind")
    parser.add_argument(
        "--external-control",
        type=Path,
        metavar="SCRIPT",
        help="resources/external_control.urscript of Universal Robots' client library: kinds in which it moves the arm",
    )
    args = parser.parse_args()
    if args.external_control:
        if not args.external_control.is_file():
            parser.error(f"--external-control: there is no file {args.external_control}")
        os.environ[EXTERNAL_CONTROL] = str(args.external_control.resolve())
    pairs = chosen(args)
    if args.list:
        print("\n".join(f"{kind.name} [{control}]" for kind, control in pairs))
        return 0
    if not pairs:
        parser.error("no kind has such a name; --list names them")
    slack, began = 1e-3 * args.slack_ms, CLOCK()
    outcomes = read_trials(args.keep) if args.keep and args.keep.exists() else {}
    new = 0
    try:
        new = run_all(pairs, args, slack, outcomes)
    except KeyboardInterrupt:
        print("\ninterrupted: this is what was tried", file=sys.stderr)
    tried = ((kind, control, outcomes.get((kind.name, control))) for kind, control in pairs)
    lines = [summary(kind, control, list(each.values()), slack) for kind, control, each in tried if each]
    failed, count = sum(line["failed"] for line in lines), sum(line["count"] for line in lines)
    if args.json:
        print("\n".join(map(json.dumps, lines)))
    else:
        show_kinds(lines, args.parallel, args.slack_ms)
        print(f"\n{len(pairs)} kinds, {count} trials, {new} of them now in {CLOCK() - began:.0f} s; {failed} failed")
    return 1 if failed else 0


#: by kind and control mode, then by number
Outcomes = dict[tuple[str, str], dict[int, Outcome]]


def run_all(pairs: list[tuple[FaultKind, str]], args: argparse.Namespace, slack: float, outcomes: Outcomes) -> int:
    """Try what has not been tried; return the number of trials that were made."""
    left = [
        (number, kind, control)
        for number in range(args.times)
        for kind, control in pairs
        if number not in outcomes.get((kind.name, control), {})
    ]
    with ThreadPoolExecutor(args.parallel) as pool, ExitStack() as stack:
        file = stack.enter_context(args.keep.open("a")) if args.keep else None
        trials = {
            pool.submit(run_trial, kind, control, f"{args.seed}/{kind.name}/{control}/{number}", slack): (
                number,
                kind.name,
                control,
            )
            for number, kind, control in left
        }
        try:
            for done, trial in enumerate(as_completed(trials), 1):
                number, name, control = trials[trial]
                outcomes.setdefault((name, control), {})[number] = outcome = trial.result()
                if file is not None:
                    row = {"kind": name, "control": control, "number": number, **asdict(outcome)}
                    print(json.dumps(row), file=file, flush=True)
                print(f"\r{done} of {len(left)} trials    ", end="", file=sys.stderr, flush=True)
        except KeyboardInterrupt:
            pool.shutdown(cancel_futures=True)
            raise
    print(file=sys.stderr)
    return len(left)


def read_trials(path: Path) -> Outcomes:
    """Return the trials that --keep has written."""
    found: Outcomes = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        row = json.loads(line)
        key = row.pop("kind"), row.pop("control")
        number = row.pop("number")
        found.setdefault(key, {})[number] = Outcome(**row)
    return found
