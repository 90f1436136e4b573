"""Verdict on a trial of the fault campaign: makes it, and judges what the arm did."""

from __future__ import annotations

import itertools
import json
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from coneskin.core.errors import ConeSkinError
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.runs.replay.run import Run, read_run
from coneskin.skin.wire import FrameDecoder

from .kind import FEW_FRAMES_TIME, FaultKind
from .setup import CLOCK, GOAL, SLOW, STOP_BUDGET, MachineWatch, Outcome
from .trial import Trial


def longest_gap(path: Path, since: float, until: float) -> float:
    """Return the longest time in which no byte of the skin was read, between these times [s]."""
    with suppress(ConeSkinError):
        times = [block.time for block in read_run(path).blocks if block.kind == BlockKind.SKIN]
        times = [time for time in times if since <= time <= until]
        return max((b - a for a, b in itertools.pairwise(times)), default=0.0)
    return 0.0


def judge_recording(path: Path, fault_at: float, active_at: float, touched: bool) -> Iterator[str]:
    """Yield what the recording lacks, or must not hold, one line each."""
    try:
        run = read_run(path)
    except ConeSkinError as exc:
        yield f"the recording cannot be read: {exc}"
        return
    names = [(event.name, event.time) for event in run.events]
    if not touched and any(name == "retreating" for name, _ in names):
        yield "it retreated without a touch"
    early = [event for event in run.events if event.name in ("stopping", "speed_reduced") and event.time < fault_at]
    if early:
        yield f"it reacted {fault_at - early[0].time:.3f} s before the fault: {early[0].details}"
    last = max((block.time for block in run.blocks), default=0.0)
    if last < fault_at - 0.06:
        yield f"the recording ends {fault_at - last:.3f} s before the fault"
    if missing := _missing_frames(run, active_at, fault_at):
        yield f"{missing} frames before the fault are not in the recording"
    again = run.replay()
    if again.differences:
        yield f"its replay is another: {again.differences[:1]}"


def _missing_frames(run: Run, since: float, until: float) -> int:
    decoder = FrameDecoder()
    before: dict[int, int] = {}  # by sensor
    missing = 0
    for block in run.blocks:
        if block.kind == BlockKind.SKIN and since <= block.time < until - 0.01:
            for frame in decoder.feed(block.payload):
                if frame.sensor in before:
                    missing += (frame.sequence - before[frame.sensor] - 1) & 0xFFFF
                before[frame.sensor] = frame.sequence
    return missing


STOP_TIMEOUT = 3.0  # s beyond the budget for which a late standstill is waited for
RESTARTS_END = 8.0  # s after which an arm that is started again and again does not stand any more
STILL_TIME = 1.0  # s without motion; then it stands for good, because programs start again within 0.3 s
SAME_POSITION = 1e-4  # rad; within it the arm has not moved
PUSH_IN = 0.005  # m beyond a bare stop that the surface may go towards a touch
STANDING_TEXT = "the arm stands"  # what a program is told
REPORT_DELAY = 0.02  # s between the last look of the guard and the time at which the program notes what it was told
HELD_UP = 0.02  # s for which the machine may hold up the virtual skin, or a process that only sleeps; 5 mm take 10 ms
MAX_REPEATS = 4  # trials at most, in which it held them up for longer, or nothing moved that a fault could stop
NOT_MADE = "the trial could not be made"
STOOD_BEFORE = "the arm stood before the fault"


def budget_of(kind: FaultKind, slack: float) -> float:
    return kind.notice + STOP_BUDGET + slack


def run_trial(kind: FaultKind, control: str, seed: str, slack: float) -> Outcome:
    """Make one trial and return its outcome; one that failed is made again where it says nothing about the guard."""
    discarded: list[str] = []
    for repeated in range(MAX_REPEATS):
        with MachineWatch() as machine:
            outcome = _try(kind, control, f"{seed}/{repeated}", slack)
        outcome.repeated, outcome.discarded, outcome.machine_late = repeated, discarded, machine.late
        held_up = max(outcome.skin_late, outcome.machine_late) > HELD_UP
        if not outcome.failures or not (held_up or all(map(_is_setup, outcome.failures))):
            break
        discarded = [*discarded, *(f"{line} ({outcome.why})" for line in outcome.failures)]
    return outcome


def _is_setup(failure: str) -> bool:
    """Tell whether a failure is of the trial: it was not made, or nothing moved. A stop without cause has a second."""
    return failure.startswith((NOT_MADE, STOOD_BEFORE))


def _try(kind: FaultKind, control: str, seed: str, slack: float) -> Outcome:
    outcome = Outcome()
    try:
        with Trial(control, seed, kind.setup) as trial:
            if kind.before:
                _refused(kind, trial, outcome)
            else:
                _stopped(kind, trial, outcome, budget_of(kind, slack))
    except Exception as exc:  # one trial that breaks does not end a campaign of hours
        outcome.failures.append(f"{NOT_MADE}: {type(exc).__name__}: {exc}")
    return outcome


def _refused(kind: FaultKind, trial: Trial, outcome: Outcome) -> None:
    kind.inject(trial)
    answer = trial.start_program(1.5)
    outcome.why = str(answer.get("why", "")).strip().splitlines()[-1:][0] if answer.get("why") else ""
    if "refused" not in answer:
        outcome.failures.append(f"the guard became active, or reported nothing: {answer} {trial.program.errors}")
    if kind.arm and trial.moves():
        outcome.failures.append("the arm moves")


def _stopped(kind: FaultKind, trial: Trial, outcome: Outcome, budget: float) -> None:
    activation = trial.start_program(10.0)
    if "activated" not in activation:
        raise RuntimeError(f"the guard did not become active: {activation}")
    try:
        trial.run_up()
    except RuntimeError:
        outcome.skin_late = float(trial.skin.ask(report=True).get("late", 0.0))
        outcome.skin_late = max(outcome.skin_late, longest_gap(trial.recording, activation["activated"], CLOCK()))
        raise
    outcome.skin_late = float(trial.skin.ask(report=True).get("late", 0.0))
    fault_at = began = kind.inject(trial)
    if trial.happened is not None:  # it took a while until the fault
        outcome.skin_late = max(outcome.skin_late, float(trial.skin.ask(report=True).get("late", 0.0)))
    if kind.tolerated:
        time.sleep(0.3)
        if trial.moves():
            began = trial.touch()
    if kind.arm and kind.restarts:
        _see_it_stay(trial, outcome, began)
    elif kind.arm:
        _see_it_stand(kind, trial, outcome, began, budget)
    informed = trial.program.hear(9.0) if kind.answers else {}
    if kind.answers and "raised" not in informed:
        outcome.failures.append(f"the program was not informed: {informed or 'nothing was raised'}")
    outcome.why = str(informed.get("why", ""))
    _judge_motion(kind, trial, outcome, informed)
    trial.thaw_all()
    if not trial.program.close(15.0) and kind.answers:
        outcome.failures.append("the program did not end within 15 s")
    until = min(fault_at, began) if trial.happened is None else trial.happened
    touched = kind.touched or kind.tolerated
    outcome.failures += judge_recording(trial.recording, until, activation["activated"], touched)
    outcome.skin_late = max(outcome.skin_late, longest_gap(trial.recording, activation["activated"], fault_at))
    with suppress(ConeSkinError):
        run = read_run(trial.recording)
        stops = [event for event in run.events if event.name == "stopping"]
        outcome.why = outcome.why or (str(stops[0].details["why"]) if stops else "")
        if not kind.arm:
            outcome.seconds = next((event.time - began for event in stops if event.time >= began), 9.0)
        late = [json.loads(block.payload)["late"] for block in run.blocks if block.kind == BlockKind.OVERRUN]
        outcome.held_up = max(late, default=0.0)
    if outcome.seconds is not None and outcome.seconds > budget:
        outcome.failures.append(f"it took {outcome.seconds:.3f} s, and may take {budget:.3f} s")


def _judge_motion(kind: FaultKind, trial: Trial, outcome: Outcome, informed: dict[str, Any]) -> None:
    """Judge how far the surface went towards each touch, and whether what the program was told is true."""
    motion = trial.motion
    if motion is None:
        return
    at_once = kind.restarts or kind.setup.reaction == SLOW  # it is to be stopped, or slower, long before it must stand
    notice = 0.0 if at_once else max(0.0, kind.notice - FEW_FRAMES_TIME)
    ways = [way for touch in trial.touches if (way := motion.pushed_in(touch, notice)) is not None]
    outcome.pushed_in = max(ways, default=None)
    if outcome.pushed_in is not None and outcome.pushed_in > PUSH_IN:
        outcome.failures.append(
            f"the arm pushed {1e3 * outcome.pushed_in:.1f} mm further into a touch than a stop does"
        )
    told = kind.arm and not kind.still and STANDING_TEXT in outcome.why
    if told and (later := motion.moved_after(informed["at"] + REPORT_DELAY)) > 0.0:
        outcome.failures.append(f"it was said that the arm stands, {later:.3f} s before it did")


def _see_it_stay(trial: Trial, outcome: Outcome, began: float) -> None:
    """See the arm stand for good, though it is started again after each stop."""
    end, moved = CLOCK() + RESTARTS_END, CLOCK()
    while CLOCK() - moved < STILL_TIME:
        if trial.moves():
            moved = CLOCK()
        if moved > end:
            outcome.failures.append(f"the arm still moved {moved - began:.1f} s after the fault")
            return
        time.sleep(0.005)
    outcome.seconds = max(0.0, moved - began)


def _see_it_stand(kind: FaultKind, trial: Trial, outcome: Outcome, began: float, budget: float) -> None:
    q = trial.await_standing(budget + STOP_TIMEOUT)
    stood = trial.stood_at(began)
    if kind.still and q is not None and stood is None:
        stood = began
    if q is None or stood is None:
        outcome.failures.append("the arm did not stand" if q is None else STOOD_BEFORE)
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
    if moved := [i for i, (a, b) in enumerate(zip(q, now, strict=True), 1) if abs(a - b) > SAME_POSITION]:
        outcome.failures.append(f"joints {moved} moved again after the arm stood")
