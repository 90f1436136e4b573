"""Events in a JSON file: of ``coneskin replay --json``, of another version of coneskin, or golden ones.

Golden events are those that a person has reviewed, in a file beside the run. Without one, the recorded events count.
Another version of coneskin runs in an interpreter of its own.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from coneskin.core.errors import RecordingError
from coneskin.core.files import explain_os_error, read_file, write_whole
from coneskin.core.recording.block import is_time
from coneskin.core.text import read_json
from coneskin.robot.guard.signals.journal import SESSION_EVENTS, EventName, GuardEvent

from .comparison import Comparison, compare_decisions, without_invented
from .decisions import Decisions, decide_again, recorded_decisions
from .replay.event_details import Tolerances
from .replay.run import read_run

_MAX_SIZE = 1 << 28  # bytes
_GOLDEN_SUFFIX = ".events.json"  # of golden events, beside the recording


def event_facts(events: Iterable[GuardEvent], start: float) -> list[dict[str, Any]]:
    """Return events as values for JSON; times count from a host time [s]."""
    return [{"t": event.time - start, "name": event.name.value, **event.details} for event in events]


def _parse_events(facts: Any, start: float, where: str) -> list[GuardEvent]:
    """Return a guard's events in ``{"events": [{"t": ..., "name": ..., ...}]}``, whose zero is a host time [s]."""
    try:
        events = []
        for item in facts["events"]:
            details = dict(item)
            time, name = details.pop("t"), EventName(details.pop("name"))
            if not is_time(time):
                raise ValueError(f"t must be a time in seconds, got {time!r}")
            if name not in SESSION_EVENTS:
                events.append(GuardEvent(name, start + time, details))
    except (KeyError, TypeError, ValueError) as exc:
        raise RecordingError(f"{where} holds no events of a run: {type(exc).__name__}: {exc}") from exc
    return events


def _read_events(path: Path, start: float) -> list[GuardEvent]:
    with explain_os_error(RecordingError, f"cannot read the events {path}"):
        data = read_file(path, _MAX_SIZE)
    try:
        facts = read_json(data)
    except ValueError as exc:
        raise RecordingError(f"{path} is no JSON: {exc}") from exc
    return _parse_events(facts, start, str(path))


def _write_events(path: Path, events: Iterable[GuardEvent], start: float) -> None:
    """Write events into a file, one a line, so that a review sees which have changed."""
    lines = ",\n".join(json.dumps(item) for item in event_facts(events, start))
    with explain_os_error(RecordingError, f"cannot write the events {path}"):
        write_whole(path, f'{{"events": [\n{lines}\n]}}\n')


def check_golden(recording: Path, tolerances: Tolerances | None = None) -> Comparison:
    """Compare what today's guard makes of a recording with its golden events.

    Raises:
        RecordingError: the recording cannot be read, is incomplete, or has no events; or the golden file is no such.
        SceneError: its scene cannot be read.
    """
    return _compare_golden(recording, *_decide(recording), tolerances)


def _compare_golden(
    recording: Path, recorded: Decisions, again: Decisions, tolerances: Tolerances | None
) -> Comparison:
    golden = recording.with_suffix(_GOLDEN_SUFFIX)
    if not golden.is_file():
        return compare_decisions(recorded, again, tolerances)
    events = _read_events(golden, recorded.start)
    reviewed = replace(recorded, label=golden.name, events=tuple(events), commands=None)
    return compare_decisions(reviewed, without_invented(again, recorded), tolerances)


def update_golden(recording: Path, tolerances: Tolerances | None = None) -> Path | None:
    """Write today's events as the golden ones where they differ, and return that file; errors as of the check."""
    recorded, again = _decide(recording)
    if _compare_golden(recording, recorded, again, tolerances).same:
        return None
    golden = recording.with_suffix(_GOLDEN_SUFFIX)
    _write_events(golden, without_invented(again, recorded).events, recorded.start)
    return golden


def _decide(recording: Path) -> tuple[Decisions, Decisions]:
    run = read_run(recording)
    if not run.complete:
        raise RecordingError(f"{recording} is incomplete, so it proves nothing: {run.missing}")
    recorded = recorded_decisions(run)
    if not recorded.events:
        raise RecordingError(f"{recording} has no events, so it proves nothing")
    return recorded, decide_again(run, label="today's code")


_REPLAY_TIMEOUT = 3600.0  # s


def decide_with(python: Path, recording: Path, reference: Decisions) -> Decisions:
    """Return what another version of coneskin makes of a run; its commands are not known.

    Args:
        python: the interpreter of an environment in which that version is installed.
        reference: decisions in the same run, for its start and for what it has lost.

    Raises:
        RecordingError: the interpreter cannot be started, or its coneskin cannot replay the run.
    """
    command = [str(python), "-m", "coneskin", "replay", str(recording), "--json"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_REPLAY_TIMEOUT, check=False)
    except (OSError, subprocess.TimeoutExpired) as exc:
        raise RecordingError(f"{python} does not replay {recording}: {exc}") from exc
    try:
        facts = json.loads(done.stdout.splitlines()[-1])
    except (ValueError, IndexError) as exc:
        said = done.stderr.strip().splitlines()
        raise RecordingError(
            f"{python} does not replay {recording}: {said[-1] if said else 'it says nothing'}"
        ) from exc
    events = _parse_events(facts, reference.start, str(python))
    return Decisions(str(python), tuple(events), None, reference.start, reference.until, reference.missing)
