"""Scan of one file of a recording: its intact chunks as extents, and what is damaged between them."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, NamedTuple

from .block import Block
from .chunk import CHUNK_HEAD_SIZE, MAX_BODY, SYNC, ChunkHead

_SEARCH_WINDOW = 1 << 18  # bytes that are searched at once
_SEARCH_LENGTH = MAX_BODY + CHUNK_HEAD_SIZE + _SEARCH_WINDOW  # bytes within which one of the first two chunks begins
_EXTENT_SIZE = 1 << 22  # bytes of an extent: what a seek has to pass over


class Chunk(NamedTuple):
    """Intact chunk: its offset, its head and its stored body."""

    offset: int
    head: ChunkHead
    stored: bytes

    @property
    def end(self) -> int:
        """Offset of what follows it."""
        return self.offset + CHUNK_HEAD_SIZE + len(self.stored)

    def blocks(self) -> list[Block]:
        """Return its blocks.

        Raises:
            RecordingError: it holds what cannot be.
        """
        return self.head.unpacked(self.stored)


class Damage(NamedTuple):
    """Bytes that are no intact chunk; the head of the one that they were, where it is intact."""

    offset: int
    end: int
    head: ChunkHead | None


@dataclass(slots=True)
class Extent:
    """Intact chunks that follow each other in a file and in the recording; the index of a recording is made of them."""

    path: Path  #: the file
    offset: int  #: of the first chunk [bytes]
    end: int  #: of the last
    run: int  #: number of the recording
    first: int  #: number of the first chunk
    following: int  #: number of the chunk that must come next
    kinds: int  #: of them, as bits
    since: float  #: the smallest time [s, host clock]
    until: float  #: the largest
    last_kinds: int  #: of the last chunk, as bits

    @classmethod
    def of(cls, path: Path, chunk: Chunk) -> Extent:
        """Return the extent of one chunk of a file."""
        head = chunk.head
        place = path, chunk.offset, chunk.end, head.run, head.sequence, head.following
        return cls(*place, head.kinds, head.since, head.until, head.kinds)

    def takes(self, chunk: Chunk) -> bool:
        """Take a chunk that follows; False where it does not, or the extent is long enough."""
        head = chunk.head
        if chunk.offset != self.end or head.sequence != self.following or head.run != self.run:
            return False
        if chunk.end - self.offset > _EXTENT_SIZE:
            return False
        self.end, self.following, self.last_kinds = chunk.end, head.following, head.kinds
        self.kinds |= head.kinds
        self.since, self.until = min(self.since, head.since), max(self.until, head.until)
        return True


def walk(file: BinaryIO, at: int, size: int) -> Iterator[Chunk | Damage]:
    """Yield every intact chunk of a file from an offset on, and every stretch of bytes between them, up to its size."""
    budget = size  # of bytes read twice: heads may be made to name long bodies that are none
    file.seek(at)
    while at < size:
        data = file.read(CHUNK_HEAD_SIZE)
        head = ChunkHead.decode(data)
        if head is not None:
            end = at + CHUNK_HEAD_SIZE + head.length
            stored = file.read(head.length) if end <= size else b""
            if len(stored) == head.length and end <= size and zlib.crc32(stored) == head.body_crc:
                yield Chunk(at, head, stored)
                at = end
                continue
            budget -= min(head.length, size - at)
            end = min(end, size)
        if head is None or budget > 0:  # bytes may have been cut out of a body, and a chunk begin in it
            end = _find(file, at + 1, size)
        yield Damage(at, end, head)
        at = end
        file.seek(at)


def _find(file: BinaryIO, at: int, size: int) -> int:
    """Return the offset of the next head of a chunk; the size of the file where there is none."""
    while at < size:
        file.seek(at)
        window = file.read(min(_SEARCH_WINDOW + CHUNK_HEAD_SIZE, size - at))
        found = window.find(SYNC)
        while 0 <= found < _SEARCH_WINDOW:
            if ChunkHead.decode(window, found) is not None:
                return at + found
            found = window.find(SYNC, found + 1)
        at += _SEARCH_WINDOW
    return size


def holds_chunk(file: BinaryIO) -> bool:
    """Tell whether a chunk begins at the start of a file, or where the largest body there would have ended."""
    return _find(file, 0, _SEARCH_LENGTH) < _SEARCH_LENGTH
