"""Live run: the recording of a guard that runs, found and followed from another process.

The recorder hands a chunk to the system once it holds 50 ms or an event, so that is how late a reader is. Nothing is
locked, and the guard does not know that somebody reads.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO

from coneskin.core.errors import RecordingError
from coneskin.core.files import open_file
from coneskin.core.recording.block import END, Block
from coneskin.core.recording.chunk import (
    CHUNK_HEAD_SIZE,
    FILE_HEAD_SIZE,
    SYNC,
    ChunkHead,
    bits,
    decode_body,
    decode_chunk_head,
    decode_file_head,
)
from coneskin.core.recording.reader import MAX_SIZE
from coneskin.core.recording.recorder import part_path
from coneskin.core.text import read_json
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.runs.replay.run import Run

from .history import History
from .run_course import RunCourse
from .stage.stage import set_stage

__all__ = ["KEPT", "LiveRun", "find_live_run", "is_live"]

_SEARCH_SIZE = 1 << 16  # bytes that are looked at together for the next chunk, where one is damaged


class _RecordingTail:
    """Reader of a recording that grows.

    Args:
        path: its first file.
        keep: of what is there already, the chunks older than this before the newest are left out [s] ...
        always: ... but for those with blocks of these kinds.

    Attributes:
        ended: the recording was closed: nothing more will come.
        damaged: bytes that were passed over, because they are no intact chunk.

    Raises:
        RecordingError: there is no such file, or it is no recording.
    """

    def __init__(self, path: Path, keep: float, always: frozenset[int]) -> None:
        self.path = path
        self.ended = False
        self.damaged = 0
        self._keep, self._always = keep, bits(always)
        self._part, self._offset = 0, FILE_HEAD_SIZE
        self._file = self._open(0)
        if decode_file_head(self._file.read(FILE_HEAD_SIZE)) is None:
            self._file.close()
            raise RecordingError(f"{path} is no recording that can be followed; look at it with: coneskin runs info")

    def read(self) -> list[Block]:
        """Return the blocks that have come since the last call; it does not wait for any.

        Raises:
            RecordingError: the file is gone, or an intact chunk holds what cannot be.
        """
        found: list[Block] = []
        chunks = list(self._chunks())
        newest = max((head.until for _, _, head in chunks), default=0.0)
        for part, offset, head in chunks:
            if head.until < newest - self._keep and not head.kinds & self._always:
                continue
            file = self._file if part == self._part else self._open(part)
            try:
                file.seek(offset)
                stored = file.read(head.length)
            finally:
                if file is not self._file:
                    file.close()
            if len(stored) == head.length:
                found += decode_body(head, stored)
        self.ended = self.ended or any(block.kind == END for block in found)
        return found

    def close(self) -> None:
        """Close the file; may be called again."""
        self._file.close()

    def _chunks(self) -> Iterator[tuple[int, int, ChunkHead]]:
        """Yield part, offset of the body, and head of each chunk that is whole."""
        while True:
            size = self._file.seek(0, 2)
            while self._offset + CHUNK_HEAD_SIZE <= size:
                self._file.seek(self._offset)
                head = decode_chunk_head(self._file.read(CHUNK_HEAD_SIZE))
                if head is None:
                    self._pass_over(size)
                    continue
                end = self._offset + CHUNK_HEAD_SIZE + head.length
                if end > size:
                    break
                yield self._part, end - head.length, head
                self._offset = end
            if not self._next_part():
                return

    def _next_part(self) -> bool:
        """Go on in the next file, where there is one: the one before is finished then."""
        try:
            file = open_file(part_path(self.path, self._part + 1), MAX_SIZE)
        except OSError:
            return False
        self._file.close()
        self._file, self._part, self._offset = file, self._part + 1, FILE_HEAD_SIZE
        return True

    def _pass_over(self, size: int) -> None:
        """Go on at the next head of a chunk behind damaged bytes."""
        begin = self._offset
        self._file.seek(begin + 1)
        window = self._file.read(min(_SEARCH_SIZE, size - begin - 1))
        found = window.find(SYNC)
        self._offset = begin + 1 + found if found >= 0 else max(begin + 1, begin + 1 + len(window) - len(SYNC) + 1)
        self.damaged += self._offset - begin

    def _open(self, part: int) -> BinaryIO:
        path = part_path(self.path, part)
        with suppress(OSError):
            return open_file(path, MAX_SIZE)
        raise RecordingError(f"cannot read the recording {path}: it is not there, or is no ordinary file")


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
        self._tail = _RecordingTail(path, KEPT, _KINDS_KEPT)
        try:
            blocks = self._tail.read()
            run = Run(_header(blocks, path), blocks)
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
    from coneskin.core.recording.reader import parts_of

    try:
        newest = max(part.stat().st_mtime for part in parts_of(path))
    except OSError:
        return False
    return time.time() - newest < _GROWING_TIME


def find_live_run(folder: Path) -> Path | None:
    """Return the recording in a folder of runs that grows now, the newest of several; None without any."""
    found = [path for path in folder.glob("*/run.rec") if is_live(path)]
    return max(found, key=lambda path: path.stat().st_mtime, default=None)


def _header(blocks: Iterable[Block], path: Path) -> dict[str, Any]:
    for block in blocks:
        if block.kind == BlockKind.HEADER:
            try:
                header = read_json(block.payload)
            except ValueError as exc:
                raise RecordingError(f"the header of {path} is damaged: {exc}") from exc
            if isinstance(header, dict) and isinstance(header.get("scene"), str):
                return header
    raise RecordingError(f"{path} has no header yet: nothing of it can be shown")
