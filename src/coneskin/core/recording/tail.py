"""Tail of a recording that grows: what has been written is read chunk by chunk, without a lock, by another process."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

from coneskin.core.errors import RecordingError
from coneskin.core.files import open_file

from .block import END, Block
from .chunk import (
    CHUNK_HEAD_SIZE,
    FILE_HEAD_SIZE,
    SYNC,
    ChunkHead,
    bits,
    decode_body,
    decode_chunk_head,
    decode_file_head,
)
from .reader import MAX_SIZE
from .recorder import part_path

__all__ = ["RecordingTail"]

_SEARCH_SIZE = 1 << 16  # bytes that are looked at together for the next chunk, where one is damaged


class RecordingTail:
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
