"""Tail of a recording that grows: what has been written is read chunk by chunk, without a lock, by another process."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

from coneskin.core.errors import RecordingError
from coneskin.core.files import open_file

from .block import END, Block
from .chunk import FILE_HEAD_SIZE, bits, decode_file_head
from .reader import MAX_SIZE
from .recorder import part_path
from .scan import Chunk, walk


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
        file = self._open(0)
        if file is None:
            raise RecordingError(f"cannot read the recording {path}: it is not there, or is no ordinary file")
        self._file = file
        if decode_file_head(file.read(FILE_HEAD_SIZE)) is None:
            file.close()
            raise RecordingError(f"{path} is no recording that can be followed; look at it with: coneskin runs info")

    def read(self) -> list[Block]:
        """Return the blocks that have come since the last call; it does not wait for any.

        Raises:
            RecordingError: an intact chunk holds what cannot be.
        """
        recent, always = deque[Chunk](), list[Chunk]()
        newest = 0.0
        for chunk in self._chunks():
            newest = max(newest, chunk.head.until)
            (always if chunk.head.kinds & self._always else recent).append(chunk)
            while recent and recent[0].head.until < newest - self._keep:
                recent.popleft()
        kept = sorted([*always, *recent], key=lambda chunk: chunk.head.sequence)
        found = [block for chunk in kept for block in chunk.blocks()]
        self.ended = self.ended or any(block.kind == END for block in found)
        return found

    def close(self) -> None:
        """Close the file; may be called again."""
        self._file.close()

    def _chunks(self) -> Iterator[Chunk]:
        """Yield each chunk that is whole."""
        while True:
            following = self._open(self._part + 1)  # before the size is asked for: then the one before is finished
            size = self._file.seek(0, 2)
            for piece in walk(self._file, self._offset, size):
                if isinstance(piece, Chunk):
                    self._offset = piece.end
                    yield piece
                elif piece.end < size or following is not None:
                    self._offset = piece.end
                    self.damaged += piece.end - piece.offset
                # else it may be a chunk that is not whole yet
            if following is None:
                return
            self._file.close()
            self._file, self._part, self._offset = following, self._part + 1, FILE_HEAD_SIZE

    def _open(self, part: int) -> BinaryIO | None:
        with suppress(OSError):
            return open_file(part_path(self.path, part), MAX_SIZE)
        return None
