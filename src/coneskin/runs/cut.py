"""Cut of a run: the part around a contact as a recording of its own, small enough for a repository of tests.

A guard that is started in the middle of a run has heard no process say that it is ready. The cut therefore begins with
that report, and acknowledges the guard's release at once; the skin's and the controller's bytes are the recorded ones.
Its events are those that today's guard makes of it, once they have been compared with the whole run's.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from coneskin.core.errors import RecordingError
from coneskin.core.files import draft_of, explain_os_error
from coneskin.core.progress import Progress, silent
from coneskin.core.recording.block import Block
from coneskin.core.recording.recorder import Recorder
from coneskin.core.version import code_versions
from coneskin.robot.driver.messages import Release, StatusReport
from coneskin.robot.guard.signals.journal import (
    INPUTS,
    BlockKind,
    EventName,
    GuardEvent,
    Output,
    encode_command,
)
from coneskin.scene.settings import resolved_settings

from .comparison import Comparison, compare_decisions
from .decisions import SKIN_EVENTS, Decisions, decide_again, recorded_decisions
from .replay.event_details import Tolerances
from .replay.run import Run

#: s before the settling of the guard that the skin needs: 50 untouched frames at 200 Hz, and as much again
_SKIN_SETTLE = 0.5
#: s of a cut whose duration nobody names
_KEPT_TIME = 1.0
#: what a start in the middle may change: the zero of the skin is learned from other frames
CUT_TOLERANCES = Tolerances(place=5e-4, angle=0.02, level=0.02, speed=0.01, time=5e-3, relative=0.01)
_SURFACES, _TRUTH, _ABSENT = (frozenset({kind}) for kind in (BlockKind.SURFACE, BlockKind.TRUTH, BlockKind.ABSENT))
_REACTION_EVENTS = frozenset(
    {
        *(EventName.STOPPING, EventName.RETREATING, EventName.RETREATED, EventName.SPEED_REDUCED, EventName.LATCHED),
        *(EventName.ESCALATED, EventName.STOP_FAILED),
    }
)


@dataclass(frozen=True, slots=True)
class _CutRun:
    """Result of a cut.

    Attributes:
        path: of the new recording.
        size: of the file [bytes].
        since: its first input [s since the start of the whole run].
        until: its last.
        contacts: in it.
        comparison: of its contacts with those of the whole run, within 0.5 mm, 1 deg and 5 ms.
        active: True where the guard is active at the first contact, so that the cut shows the reaction as well.
        other_reaction: how the arm reacts otherwise than in the whole run, in words; empty where it does not. A guard
            that starts in the middle knows the controller's clock less well: where states came late, or the frames
            were old, it may only stop where the other one moved away.
    """

    path: Path
    size: int
    since: float
    until: float
    contacts: int
    comparison: Comparison
    active: bool
    other_reaction: str


def cut_run(
    run: Run, target: Path, around: float | None, keep: float | None = None, name: str = "", progress: Progress = silent
) -> _CutRun:
    """Write the part of a run around a moment as a recording of its own.

    Args:
        around: the moment [s since the start of the run]; None: when the first touch was seen.
        keep: how much of it [s]: half before the moment, and as much as a guard needs to become active, half after it.
            None: 1 s, begun as much earlier as it takes until the contacts are those of the whole run.
        name: of the whole run, for the new one's header.

    Raises:
        RecordingError: there is nothing at that moment, no contact, or the contacts would be others than in the whole
            run; or the file is there already.
    """
    if around is None:
        around = next((event.time - run.start for event in run.events if event.name == EventName.CONTACT), None)
    if around is None:
        raise RecordingError("no touch was seen in the run: name the moment that is cut out, with --around")
    length = _KEPT_TIME if keep is None else keep
    if not (math.isfinite(around) and math.isfinite(length) and length > 0.0):
        raise RecordingError(f"a cut needs a moment [s] and a duration above 0 s, got {around!r} s and {length!r} s")
    start = run.start
    lead = max(0.5 * length, run.scene().monitoring_limits.settle + _SKIN_SETTLE)
    until = start + around + 0.5 * length
    if run.gap <= until:
        raise RecordingError(f"the part up to {until - start:.3f} s is not whole, so nothing is cut out: {run.missing}")
    cut = {"from": name, "around_s": around, "keep_s": length}
    made_by = {**code_versions(), "resolved": resolved_settings(run.scene())}
    header = {**run.header, **made_by, "cut": cut}  # its events are those of today's code
    all_of_it: Decisions | None = None
    while True:
        since, window = start + around - lead, f"from {around - lead:.3f} s to {around + 0.5 * length:.3f} s"
        blocks = _written(run, since, until)
        inputs = [block for block in blocks if block.kind in INPUTS and since < block.time <= until]
        if not inputs:
            raise RecordingError(f"the run has nothing {window}")
        all_of_it = all_of_it or decide_again(run, label="the whole run", progress=progress)
        part = replace(run, header=header, blocks=tuple(blocks), defects=(), copies=())
        all_of_part = recorded_decisions(part, "the cut")
        whole, again = _of_window(all_of_it, since, until), _of_window(all_of_part, since, until)
        comparison = compare_decisions(whole, again, CUT_TOLERANCES)
        contacts = [event for event in again.events if event.name == EventName.CONTACT]
        if not contacts:
            begun = ", ".join(f"{e.time - start:.3f}" for e in run.events if e.name == EventName.CONTACT)
            where = f"; the run's touches begin at {begun} s" if begun else ""
            raise RecordingError(f"no touch begins {window}: nothing to cut out{where}")
        if not comparison.differences:
            break
        if keep is not None or since <= start:  # nothing more is to be had
            lines = "; ".join(map(str, comparison.differences))
            hint = "" if keep is None else f"; keep more than {keep:g} s, or name no duration: it is then found"
            raise RecordingError(f"the cut would not show the same contacts: {lines}{hint}")
        lead *= 2.0
    active = next((e.time for e in part.events if e.name == EventName.ACTIVATED), math.inf) < contacts[0].time
    there, here = (_reaction(item.events, contacts[0].time, until) for item in (all_of_it, all_of_part))
    other = f"{', '.join(here) or 'nothing'}; in the whole run {', '.join(there) or 'nothing'}"
    _record(target, Block(BlockKind.HEADER, since, json.dumps(header).encode()), blocks)
    size, span = target.stat().st_size, (inputs[0].time - start, inputs[-1].time - start)
    return _CutRun(target, size, *span, len(contacts), comparison, active, other if active and there != here else "")


def _reaction(events: Sequence[GuardEvent], since: float, until: float) -> list[str]:
    """Return what the arm did from a contact on, in a word each [s, host clock]."""
    window = (event for event in events if since <= event.time <= until)
    return [
        str(event.name) + (" incomplete"[: 11 * (event.details.get("complete") is False)])
        for event in window
        if event.name in _REACTION_EVENTS
    ]


def _record(target: Path, header: Block, blocks: Sequence[Block]) -> None:
    """Write a recording whole or not at all, in a folder that is made."""
    hint = "; a recording is never overwritten: choose another file" if target.exists() else ""
    with explain_os_error(RecordingError, f"cannot make the recording {target}", hint):
        target.parent.mkdir(parents=True, exist_ok=True)
        with draft_of(target) as draft, Recorder(draft, copied=frozenset({BlockKind.HEADER, BlockKind.SURFACE})) as to:
            to.write(header, *blocks)


def _of_window(decisions: Decisions, since: float, until: float) -> Decisions:
    """Return the skin's events of the touches that begin in a window [s]; what is said of the arm is left out."""
    begun: set[str] = set()
    kept = []
    for event in decisions.events:
        if event.name not in SKIN_EVENTS or not since <= event.time <= until:
            continue
        sensor = str(event.details.get("sensor", ""))
        if event.name == EventName.CONTACT:
            begun.add(sensor)
        if sensor in begun:
            kept.append(event)
    return replace(decisions, events=tuple(kept), commands=None)


def _written(run: Run, since: float, until: float) -> list[Block]:
    """Return the blocks of the cut: its inputs, and what today's guard makes of them."""
    arm, core, outputs = run.scene().arm, run.build_core(), list[Output]()
    external = arm is not None and arm.control == "external"
    process = "watchdog" if external else "driver"
    blocks = []
    for block in _cut_inputs(run, since, until, ready=arm is not None):
        queue = [block]
        while queue:
            taken = queue.pop(0)
            blocks.append(taken)
            if taken.kind in INPUTS:
                core.feed(taken, outputs)
            commands = [output for output in outputs if not isinstance(output, GuardEvent)]
            blocks += [Block(BlockKind.COMMAND, taken.time, encode_command(command, process)) for command in commands]
            blocks += [output.block() for output in outputs if isinstance(output, GuardEvent)]
            releases = (command for command in commands if isinstance(command, Release))
            acknowledgements = (StatusReport("released", str(release.number)) for release in releases)
            queue += [Block(BlockKind.DRIVER, taken.time, report.encode()) for report in acknowledgements]
            outputs.clear()
    return blocks


def _cut_inputs(run: Run, since: float, until: float, ready: bool) -> Iterator[Block]:
    surfaces = {
        block.payload: block for block in (*run.copies, *run.select(kinds=_SURFACES)) if block.kind in _SURFACES
    }
    before = (*surfaces.values(), *run.select(kinds=_TRUTH), *run.select(until=since, kinds=_ABSENT))
    for block in before:
        yield block._replace(time=since)
    if ready:
        yield Block(BlockKind.DRIVER, since, StatusReport("ready").encode())
    for slider in list(run.select(until=since, kinds=frozenset({BlockKind.SLIDER})))[-1:]:
        yield slider._replace(time=since)
    yield from run.select(since, until, INPUTS)
