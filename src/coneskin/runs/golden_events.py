"""Golden events of a run: those that a person has reviewed, in a file beside it; without one, the recorded ones."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from coneskin.core.errors import RecordingError

from .comparison import Comparison, compare_decisions, without_invented
from .comparison_text import comparison_lines
from .decisions import Decisions, decide_again, recorded_decisions
from .event_file import read_events, write_events
from .replay.quantities import Tolerances
from .replay.run import read_run

__all__ = ["check_golden", "describe_failure", "golden_path", "update_golden"]


def golden_path(recording: Path) -> Path:
    """Return the file of a recording's golden events: ``run.events.json`` of ``run.rec``."""
    return recording.with_suffix(".events.json")


def check_golden(recording: Path, tolerances: Tolerances) -> Comparison:
    """Compare what today's guard makes of a recording with its golden events.

    Raises:
        RecordingError: the recording cannot be read, is incomplete, or has no events; or the golden file is no such.
        SceneError: its scene cannot be read.
    """
    recorded, again = _decide(recording)
    golden = golden_path(recording)
    if not golden.is_file():
        return compare_decisions(recorded, again, tolerances)
    events = read_events(golden, recorded.start)
    reviewed = replace(recorded, label=golden.name, events=tuple(events), commands=None)
    return compare_decisions(reviewed, without_invented(again, recorded), tolerances)


def update_golden(recording: Path, tolerances: Tolerances) -> bool:
    """Write today's events as the golden ones where they differ, and tell whether they did; errors as of the check."""
    if check_golden(recording, tolerances).same:
        return False
    recorded, again = _decide(recording)
    write_events(golden_path(recording), without_invented(again, recorded).events, recorded.start)
    return True


def describe_failure(recording: Path, comparison: Comparison) -> str:
    """Return the lines of a failed comparison, and what to do."""
    first, *lines = comparison_lines(comparison)
    return "\n".join(
        [f"{recording}: {first}", *lines, "  if that is meant: review it, then run again with --coneskin-update"]
    )


def _decide(recording: Path) -> tuple[Decisions, Decisions]:
    run = read_run(recording)
    if not run.complete:
        raise RecordingError(f"{recording} is incomplete, so it proves nothing: {run.missing}")
    recorded = recorded_decisions(run)
    if not recorded.events:
        raise RecordingError(f"{recording} has no events, so it proves nothing")
    return recorded, decide_again(run, label="today's code")
