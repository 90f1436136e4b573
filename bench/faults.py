"""The fault campaign: everything that can go wrong, at random times, and whether the arm then stands within its budget.

    python bench/faults.py [--times 100] [--kinds guard,skin] [--control owner] [--parallel 1] [--keep FILE] [--json]

A simulated arm moves under guard, by its own program (control = "owner") or by a raw one (control = "foreign"). At a
random time something fails, or two things at once (bench/faults_kinds.py). The budget is the time in which the fault
must be noticed, v / a and four times the patience (docs/safety.md), and --slack for a machine that is busy with other
things. Time runs until the log of the simulated controller says that the arm stands. A trial fails where the arm

    stands too late, goes on to its goal, moves again, or retreats without a touch,
    reacts before there is a fault,

or where the program is not told, or a frame before the fault is missing in the recording, or its replay differs. "Held
up" is the longest time for which the machine did not let the guard's loop run. The exit code is 0 only if none failed.

Every kind is tried once before any is tried twice. With --keep each trial is added to a file, and a campaign that was
interrupted goes on from there.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import ExitStack, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

from faults_judge import judge_recording, longest_gap
from faults_kinds import KINDS, FaultKind
from faults_trial import CLOCK, GOAL, STOP, Outcome, Trial
from report import head, quantile

from coneskin.errors import ConeSkinError
from coneskin.replay import read_run
from coneskin.robot.journal import Kind

PATIENCE = 3.0  # s beyond the budget in which we look how late it was
SAME = 1e-4  # rad: the arm has not moved
SKIN_LATE = 0.1  # s that a frame of the virtual skin may be late because the machine does other things
REPEATS = 4


def budget_of(kind: FaultKind, slack: float) -> float:
    return kind.notice + STOP + slack


def run_trial(kind: FaultKind, control: str, seed: str, slack: float) -> Outcome:
    """One trial; what it showed. One in which the machine held the skin up before the fault is made again."""
    for repeated in range(REPEATS):
        outcome = _try(kind, control, f"{seed}/{repeated}", slack)
        outcome.repeated = repeated
        if not (outcome.failures and outcome.skin_late > SKIN_LATE):
            break
    return outcome


def _try(kind: FaultKind, control: str, seed: str, slack: float) -> Outcome:
    outcome = Outcome()
    try:
        with Trial(control, seed, kind.reaction) as trial:
            if kind.before:
                _refused(kind, trial, outcome)
            else:
                _stopped(kind, trial, outcome, budget_of(kind, slack))
    except Exception as exc:  # one trial that breaks does not end a campaign of hours
        outcome.failures.append(f"the trial could not be made: {type(exc).__name__}: {exc}")
    return outcome


def _refused(kind: FaultKind, trial: Trial, outcome: Outcome) -> None:
    kind.inject(trial)
    answer = trial.start_program(1.5)
    outcome.why = str(answer.get("why", "")).strip().splitlines()[-1:][0] if answer.get("why") else ""
    if "refused" not in answer:
        outcome.failures.append(f"the guard has armed, or said nothing: {answer} {trial.program.errors}")
    if kind.arm and trial.moves():
        outcome.failures.append("the arm moves")


def _stopped(kind: FaultKind, trial: Trial, outcome: Outcome, budget: float) -> None:
    armed = trial.start_program(10.0)
    if "armed" not in armed:
        raise RuntimeError(f"the guard did not arm: {armed}")
    try:
        trial.run_up()
    except RuntimeError:
        outcome.skin_late = longest_gap(trial.recording, armed["armed"], CLOCK())
        raise
    outcome.skin_late = float(trial.skin.ask(report=True).get("late", 0.0))
    fault_at = began = kind.inject(trial)
    if trial.happened is not None:  # it took a while until the fault
        outcome.skin_late = max(outcome.skin_late, float(trial.skin.ask(report=True).get("late", 0.0)))
    if kind.tolerated:
        time.sleep(0.3)
        if trial.moves():
            began = trial.touch()
    if kind.arm:
        _see_it_stand(kind, trial, outcome, began, budget)
    told = trial.program.hear(9.0) if kind.answers else {}
    if kind.answers and "told" not in told:
        outcome.failures.append(f"the program was not told: {told or 'it heard nothing'}")
    outcome.why = str(told.get("why", ""))
    trial.thaw_all()
    if not trial.program.close(15.0) and kind.answers:
        outcome.failures.append("the program did not end within 15 s")
    until = min(fault_at, began) if trial.happened is None else trial.happened
    touched = kind.touched or kind.tolerated
    outcome.failures += judge_recording(trial.recording, until, armed["armed"], touched)
    outcome.skin_late = max(outcome.skin_late, longest_gap(trial.recording, armed["armed"], fault_at))
    with suppress(ConeSkinError):
        run = read_run(trial.recording)
        stops = [event for event in run.events if event.name == "stopping"]
        outcome.why = outcome.why or (str(stops[0].details["why"]) if stops else "")
        if not kind.arm:
            outcome.seconds = next((event.time - began for event in stops if event.time >= began), 9.0)
        late = [json.loads(block.payload)["late"] for block in run.blocks if block.kind == Kind.OVERRUN]
        outcome.held_up = max(late, default=0.0)
    if outcome.seconds is not None and outcome.seconds > budget:
        outcome.failures.append(f"it took {outcome.seconds:.3f} s, and may take {budget:.3f} s")


def _see_it_stand(kind: FaultKind, trial: Trial, outcome: Outcome, began: float, budget: float) -> None:
    q = trial.await_standing(budget + PATIENCE)
    stood = trial.stood_at(began)
    if kind.still and q is not None and stood is None:
        stood = began
    if q is None or stood is None:
        outcome.failures.append("the arm did not stand" if q is None else "the arm stood before the fault")
        return
    outcome.seconds = stood - began
    if q[0] > GOAL[0] - 0.05:
        outcome.failures.append("the arm went on to its goal")
    if kind.touched or kind.tolerated:
        time.sleep(0.8)  # it may retreat
        trial.await_standing(3.0)
        q = trial.simulated.state()["q"]
    if kind.after is not None:
        kind.after(trial)
    time.sleep(0.3)
    now = trial.simulated.state()["q"]
    if moved := [i for i, (a, b) in enumerate(zip(q, now, strict=True), 1) if abs(a - b) > SAME]:
        outcome.failures.append(f"joints {moved} moved again after the arm stood")


def summary(kind: FaultKind, control: str, outcomes: list[Outcome], slack: float) -> dict[str, Any]:
    """One line of the table [s]."""
    times = [outcome.seconds for outcome in outcomes if outcome.seconds is not None]
    failures = [line for outcome in outcomes for line in outcome.failures]
    return {
        "kind": kind.name,
        "control": control,
        "count": len(outcomes),
        "median": round(quantile(times, 0.5), 4) if times else None,
        "worst": round(max(times), 4) if times else None,
        "budget": None if kind.before else round(budget_of(kind, slack), 3),
        "repeated": sum(outcome.repeated for outcome in outcomes),
        "held_up": round(max(outcome.held_up for outcome in outcomes), 4),
        "failed": sum(bool(outcome.failures) for outcome in outcomes),
        "failures": list(dict.fromkeys(failures)),
        "said": next((outcome.why for outcome in outcomes if outcome.why), ""),
    }


def show(line: dict[str, Any]) -> None:
    def cell(key: str) -> str:
        return f"{line[key]:8.3f}" if line[key] is not None else f"{'-':>8}"

    name = f"{line['kind']} [{line['control']}]"
    print(
        f"{name:52}{line['count']:6}{cell('median')}{cell('worst')}{cell('budget')}{cell('held_up')}{line['failed']:8}"
    )
    if line["repeated"]:
        print(f"    repeated {line['repeated']} trials in which the virtual skin was held up before the fault")
    for failure in line["failures"][:5]:
        print(f"    FAILED: {failure}")


def chosen(args: argparse.Namespace) -> list[tuple[FaultKind, str]]:
    words = args.kinds.split(",") if args.kinds else [""]
    controls = (args.control,) if args.control else ("owner", "foreign")
    if args.quick:
        kinds = [kind for kind in KINDS if not kind.variant]
        return [(kind, kind.controls[number % len(kind.controls)]) for number, kind in enumerate(kinds)]
    return [
        (kind, control)
        for kind in KINDS
        for control in controls
        if control in kind.controls and any(word == kind.name or word in kind.name for word in words)
    ]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=100, help="trials of each kind (%(default)s)")
    parser.add_argument("--kinds", help="those with one of these words in their names, separated by commas")
    parser.add_argument("--control", choices=("owner", "foreign"), help="(both)")
    parser.add_argument("--parallel", type=int, default=1, help="trials at a time (%(default)s)")
    parser.add_argument("--keep", type=Path, metavar="FILE", help="add each trial to this file; go on from it")
    parser.add_argument("--slack-ms", type=float, default=100.0, help="of the budget (%(default)g)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--quick", action="store_true", help="each kind in one control mode, without close variants")
    parser.add_argument("--list", action="store_true", help="name the kinds, and end")
    parser.add_argument("--json", action="store_true", help="a line of JSON for each kind")
    args = parser.parse_args()
    pairs = chosen(args)
    if args.list:
        print("\n".join(f"{kind.name} [{control}]" for kind, control in pairs))
        return 0
    if not pairs:
        parser.error("no kind has such a name; --list names them")
    if not args.json:
        _head(args)
    slack, began = 1e-3 * args.slack_ms, CLOCK()
    outcomes = read_trials(args.keep) if args.keep and args.keep.exists() else {}
    new = 0
    try:
        new = run_all(pairs, args, slack, outcomes)
    except KeyboardInterrupt:
        print("\ninterrupted: this is what was tried", file=sys.stderr)
    failed = count = 0
    for kind, control in pairs:
        if tried := outcomes.get((kind.name, control)):
            line = summary(kind, control, list(tried.values()), slack)
            failed, count = failed + line["failed"], count + line["count"]
            print(json.dumps(line)) if args.json else show(line)
    if not args.json:
        print(f"\n{len(pairs)} kinds, {count} trials, {new} of them now in {CLOCK() - began:.0f} s; {failed} failed")
    return 1 if failed else 0


#: by kind and control mode, then by number
Outcomes = dict[tuple[str, str], dict[int, Outcome]]


def run_all(pairs: list[tuple[FaultKind, str]], args: argparse.Namespace, slack: float, outcomes: Outcomes) -> int:
    """Try what has not been tried; the number of trials that were made."""
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
    """The trials that --keep has written."""
    found: Outcomes = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        row = json.loads(line)
        key = row.pop("kind"), row.pop("control")
        number = row.pop("number")
        found.setdefault(key, {})[number] = Outcome(**row)
    return found


def _head(args: argparse.Namespace) -> None:
    print(f"{head()}\n{args.parallel} at a time; budgets with {args.slack_ms:g} ms for this machine\n")
    columns = "".join(f"{name:>8}" for name in ("median", "worst", "budget", "held up", "failed"))
    print(f"{'s from the fault to standstill':52}{'count':>6}{columns}")


if __name__ == "__main__":
    sys.exit(main())
