"""Live run: the recording of a guard that runs, found and followed from another process.

The recorder hands a chunk to the system once it holds 50 ms or an event, so that is how late a reader is. Nothing is
locked, and the guard does not know that somebody reads.
"""

from __future__ import annotations

import time
from pathlib import Path

from coneskin.core.recording.reader import parts_of
from coneskin.core.recording.tail import RecordingTail
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.runs.replay.run import Run, read_header

from .history import History
from .run_course import RunCourse
from .stage.stage import set_stage

KEPT = 60.0  #: s of a live run that its page keeps
_GROWING_TIME = 3.0  # s since the last write, within which a recording grows: a guard records ticks all the time
_KINDS_KEPT = frozenset({BlockKind.HEADER, BlockKind.SURFACE, BlockKind.EVENT})


class LiveRun:
    """Run that is followed.

    Args:
        path: the first file of its recording.

    Attributes:
        path: the same.
        course: what is shown; its history grows.
        ended: the recording was closed.

    Raises:
        RecordingError: there is no recording, or its header has not been written yet.
        SceneError: this version of coneskin cannot read its scene.
    """

    def __init__(self, path: Path) -> None:
        self._tail = RecordingTail(path, KEPT, _KINDS_KEPT)
        try:
            blocks = self._tail.read()
            first = next((block for block in blocks if block.kind == BlockKind.HEADER), None)
            run = Run(read_header(first, path), blocks)
            scene = run.scene()
            history = History(scene, KEPT)
            history.feed_all(blocks)
            stage = set_stage(scene, run.place_sensors(), f"live: {path}")
        except BaseException:
            self._tail.close()
            raise
        self.path, self.course = path, RunCourse(stage, history, run.start)
        self._grown = time.monotonic()

    @property
    def ended(self) -> bool:
        """True once the recording was closed."""
        return self._tail.ended

    def poll(self) -> int:
        """Take what has come, and return how many blocks that were.

        Raises:
            RecordingError: the recording is gone, or damaged.
        """
        blocks = self._tail.read()
        if blocks:
            self.course.history.feed_all(blocks)
            self._grown = time.monotonic()
        return len(blocks)

    @property
    def silence(self) -> float:
        """Time since anything came [s]."""
        return time.monotonic() - self._grown

    def close(self) -> None:
        """Close the recording; may be called again."""
        self._tail.close()


def is_live(path: Path) -> bool:
    """Tell whether a recording grows: its newest file was written a moment ago."""
    try:
        newest = max(part.stat().st_mtime for part in parts_of(path))
    except OSError:
        return False
    return time.time() - newest < _GROWING_TIME


def find_live_run(folder: Path) -> Path | None:
    """Return the recording in a folder of runs that grows now, the newest of several; None without any."""
    found = [path for path in folder.glob("*/run.rec") if is_live(path)]
    return max(found, key=lambda path: path.stat().st_mtime, default=None)
