"""Retention: some kinds of block stay for ever, all of them around some moments; a note says what was dropped."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

from coneskin.core.errors import RecordingError
from coneskin.core.files import draft_of, explain_os_error, open_file

from .block import FILE_KINDS, Block
from .chunk import FILE_HEAD_SIZE, bits, decode_file_head, encode_chunk
from .defects import Defect, DefectKind
from .reader import MAX_SIZE
from .recorder import open_for_owner
from .scan import Chunk, walk

_MAX_KEPT_SIZE = 1 << 16  # bytes of blocks that are kept in one chunk in the place of several
_MAX_SPAN = 1 << 16  # chunks in whose place one stands


def prune_file(path: Path, windows: Sequence[tuple[float, float]], kept: frozenset[int]) -> Iterator[None]:
    """Drop blocks of one file of a recording; it yields now and then, so that other work can be done between.

    The file is replaced at the end, at once. What is damaged in it stays missing.

    Args:
        path: the file.
        windows: moments around which all stays: from and until when [s, host clock].
        kept: kinds of block that stay everywhere.

    Raises:
        RecordingError: the file cannot be read or replaced.
    """
    failure = explain_os_error(RecordingError, f"cannot prune {path}")
    with failure, draft_of(path, overwrite=True) as draft, open_file(path, MAX_SIZE) as file:
        size, head = os.fstat(file.fileno()).st_size, file.read(FILE_HEAD_SIZE)
        known = decode_file_head(head)
        if known is None:
            raise RecordingError(f"{path} cannot be pruned: its head is damaged")
        with open(draft, "wb", opener=open_for_owner) as target:
            target.write(head)
            yield from _copy(file, size, target, known, windows, kept | FILE_KINDS)


def _copy(
    file: BinaryIO, size: int, target: BinaryIO, run: int, windows: Sequence[tuple[float, float]], kept: frozenset[int]
) -> Iterator[None]:
    everywhere = bits(kept)
    shortened = _Shortened(run)
    for chunk in walk(file, FILE_HEAD_SIZE, size):
        yield
        if not isinstance(chunk, Chunk) or chunk.head.run != run:
            continue
        head = chunk.head
        if not head.kinds & ~everywhere or any(head.since <= until and since <= head.until for since, until in windows):
            target.write(shortened.take_out())
            file.seek(chunk.offset)
            target.write(file.read(chunk.end - chunk.offset))
            continue
        if not shortened.fits(chunk):
            target.write(shortened.take_out())
        shortened.put_in(chunk, kept)
    target.write(shortened.take_out())


class _Shortened:
    """What is kept of chunks that follow each other, for one chunk in their place."""

    def __init__(self, run: int) -> None:
        self._run = run
        self._start()

    def _start(self) -> None:
        self._first = self._span = self._size = 0
        self._blocks: list[Block] = []
        self._since, self._until = math.inf, -math.inf
        self._dropped = self._bytes = 0
        self._kinds: set[int] = set()

    def fits(self, chunk: Chunk) -> bool:
        if not self._span:
            return True
        full = self._size > _MAX_KEPT_SIZE or self._span + chunk.head.span > _MAX_SPAN
        return chunk.head.sequence == self._first + self._span and not full

    def put_in(self, chunk: Chunk, kept: frozenset[int]) -> None:
        if not self._span:
            self._first = chunk.head.sequence
        self._span += chunk.head.span
        for block in chunk.blocks():
            if block.kind in kept:
                self._blocks.append(block)
                self._size += len(block.payload)
                continue
            self._since, self._until = min(self._since, block.time), max(self._until, block.time)
            self._dropped += 1
            self._bytes += len(block.payload)
            self._kinds.add(block.kind)

    def take_out(self) -> bytes:
        if not self._span:
            return b""
        blocks, kinds = self._blocks, frozenset(self._kinds)
        if self._dropped:
            extent = Defect(
                DefectKind.DROPPED, self._since, self._until, size=self._bytes, blocks=self._dropped, kinds=kinds
            )
            blocks = [extent.note_block(), *blocks]
        data = encode_chunk(self._run, self._first, blocks, self._span)
        self._start()
        return data
