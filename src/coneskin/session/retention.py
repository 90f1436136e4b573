"""Retention of a run: its events stay for ever, all that was recorded around them for a while, the rest is dropped."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from coneskin.core.progress import Progress, silent
from coneskin.core.recording.defects import DefectKind
from coneskin.core.recording.reader import Recording, parts_of, read_recording
from coneskin.core.recording.recorder import hold_against_recorder
from coneskin.core.recording.retention import prune_file
from coneskin.robot.guard.signals.journal import BlockKind, EventName, decode_event

AROUND = 5.0  #: s before and after an event in which all stays
_KEPT_KINDS = frozenset({BlockKind.HEADER, BlockKind.SURFACE, BlockKind.TRUTH, BlockKind.EVENT, BlockKind.OVERRUN})
_EVENT_KINDS = frozenset({BlockKind.EVENT})
#: events that are no reason to keep what led to them
_ORDINARY_EVENTS = frozenset(
    {
        EventName.WAITING,
        EventName.ACTIVATED,
        EventName.NOT_COMMISSIONED,
        EventName.MESSAGE,
        EventName.REFUSED,
        EventName.RESET,
        EventName.ENDING,
        EventName.RECORDING_GAP,
    }
)


def prune_run(path: Path, around: float = AROUND, progress: Progress = silent) -> tuple[int, int]:
    """Drop what is far from any touch, stop or fault; a run that was pruned says so, and cannot be replayed as a whole.

    Args:
        path: a recording, or the folder of a run with one in it.
        around: time before and after such an event in which all stays [s].

    Returns:
        bytes before and after.

    Raises:
        RecordingError: it cannot be read, or is being recorded now.
    """
    path = path / "run.rec" if path.is_dir() else path
    recording = read_recording(path, progress)
    parts = parts_of(path)
    with hold_against_recorder(parts[-1]):
        windows = _windows(recording, around)
        # a touch may be in what is lost
        lost = [defect for defect in recording.defects if defect.kind is not DefectKind.DROPPED]
        windows += [(defect.since - around, defect.until + around) for defect in lost]
        for part in parts:
            for _ in prune_file(part, windows, _KEPT_KINDS):
                pass
    return recording.size, sum(part.stat().st_size for part in parts)


def prune_part(path: Path, around: float = AROUND) -> Iterator[None]:
    """Drop the same from one file of a recording that goes on, step by step.

    Raises:
        RecordingError: it cannot be read.
    """
    yield from prune_file(path, _windows(read_recording(path), around), _KEPT_KINDS)


def _windows(recording: Recording, around: float) -> list[tuple[float, float]]:
    """Return the times around what is no ordinary event; those that overlap are one."""
    windows: list[tuple[float, float]] = []
    for block in recording.select(kinds=_EVENT_KINDS):
        if decode_event(block).name not in _ORDINARY_EVENTS:
            since = block.time - around
            if windows and since <= windows[-1][1]:
                since = windows.pop()[0]
            windows.append((since, block.time + around))
    return windows
