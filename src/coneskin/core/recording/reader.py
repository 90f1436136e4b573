"""Reader of a recording: its intact blocks as a stream, in the order in which they were written, and its defects."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from coneskin.core.errors import RecordingError
from coneskin.core.files import open_file

from .block import COPY, DROPPED, FILE_KINDS, Block, decode_copy
from .chunk import FILE_HEAD_SIZE, MAGIC, bits, decode_body, decode_file_head
from .defects import Defect, decode_drop, find_defects
from .scan import Chunk, Damage, Extent, holds_chunk, scan_extents, walk

__all__ = ["MAX_SIZE", "RecordedBlocks", "Recording", "parts_of", "read_recording"]

MAX_SIZE = 1 << 36  #: bytes of a file: two years of one sensor and an arm; it is never held in memory
_ALL_KINDS = (1 << 64) - 1


@dataclass(frozen=True, slots=True)
class RecordedBlocks:
    """Blocks of a recording, read from its files anew at each iteration; they are never all in memory.

    Attributes:
        extents: where they are, in the order in which they were written.
        hidden: kinds that are not shown.
    """

    extents: tuple[Extent, ...]
    hidden: frozenset[int] = FILE_KINDS

    @property
    def since(self) -> float:
        """The smallest time [s, host clock]; inf where nothing is left."""
        return min((extent.since for extent in self.extents), default=math.inf)

    @property
    def until(self) -> float:
        """The largest time [s]; -inf where nothing is left."""
        return max((extent.until for extent in self.extents), default=-math.inf)

    def __iter__(self) -> Iterator[Block]:
        """Yield every block."""
        return self.select()

    def select(
        self, since: float = -math.inf, until: float = math.inf, kinds: frozenset[int] | None = None
    ) -> Iterator[Block]:
        """Yield some of the blocks; what is outside is passed over without being read, as far as it can be.

        Args:
            since: the smallest time [s, host clock].
            until: the largest.
            kinds: of block; None for all.

        Raises:
            RecordingError: a file has changed since it was opened, or cannot be read.
        """
        hidden = self.hidden
        if kinds is None and math.isinf(since) and math.isinf(until):
            for chunk in self.chunks():
                for block in decode_body(chunk.head, chunk.stored):
                    if block.kind not in hidden:
                        yield block
            return
        for block in self._raw(since, until, _ALL_KINDS if kinds is None else bits(kinds)):
            kind = block.kind
            if kind not in hidden and (kinds is None or kind in kinds) and since <= block.time <= until:
                yield block

    def own(self) -> Iterator[Block]:
        """Yield the blocks that the file has for itself: copies and notes of retention."""
        kinds = frozenset({COPY, DROPPED})
        return (block for block in self._raw(-math.inf, math.inf, bits(kinds)) if block.kind in kinds)

    def chunks(self, since: float = -math.inf, until: float = math.inf, kinds: int = _ALL_KINDS) -> Iterator[Chunk]:
        """Yield the intact chunks with blocks in a time [s, host clock] and of kinds, each once, in order."""
        following = 0
        with ExitStack() as stack:
            files: dict[Path, BinaryIO] = {}
            for extent in self.extents:
                if extent.since > until or extent.until < since or not extent.kinds & kinds:
                    following = max(following, extent.following)
                    continue
                if extent.path not in files:
                    stack.close()
                    files = {extent.path: stack.enter_context(_open(extent.path))}
                for chunk in walk(files[extent.path], extent.offset, extent.end):
                    if isinstance(chunk, Damage):
                        raise RecordingError(f"{extent.path} has changed while it was read, at byte {chunk.offset}")
                    head = chunk.head
                    if head.sequence >= following:
                        following = head.following
                        if head.since <= until and head.until >= since and head.kinds & kinds:
                            yield chunk

    def _raw(self, since: float, until: float, kinds: int) -> Iterator[Block]:
        for chunk in self.chunks(since, until, kinds):
            yield from decode_body(chunk.head, chunk.stored)


@dataclass(frozen=True, slots=True)
class Recording:
    """The readable part of a recording.

    Attributes:
        path: its first file.
        run: number of the recording.
        blocks: the intact blocks, in the order in which they were written; to be iterated over as often as one likes.
        copies: blocks without which nothing can be replayed, from a place where they stand again.
        defects: what is missing or wrong; empty where the recording is whole and was closed.
        size: of its files [bytes].
        since: the smallest time [s, host clock]; inf where nothing is left.
        until: the largest; -inf where nothing is left.
    """

    path: Path
    run: int
    blocks: RecordedBlocks
    copies: tuple[Block, ...]
    defects: tuple[Defect, ...]
    size: int
    since: float
    until: float

    def select(
        self, since: float = -math.inf, until: float = math.inf, kinds: frozenset[int] | None = None
    ) -> Iterator[Block]:
        """Yield some of the blocks; arguments as of ``RecordedBlocks.select``."""
        return self.blocks.select(since, until, kinds)

    @property
    def missing(self) -> str:
        """The defects in a sentence; empty where there are none."""
        return "; ".join(defect.describe(0.0 if math.isinf(self.since) else self.since) for defect in self.defects)


def parts_of(path: Path) -> list[Path]:
    """Return the files of a recording in their order: ``run.rec``, ``run.0001.rec``, ``run.0002.rec`` ..."""
    further = sorted(path.parent.glob(f"{_escape(path.stem)}.[0-9][0-9][0-9][0-9]*{_escape(path.suffix)}"))
    numbered = [part for part in further if part.name[len(path.stem) + 1 : -len(path.suffix) or None].isdecimal()]
    return [path, *sorted(numbered, key=lambda part: (len(part.name), part.name))]


def read_recording(path: Path, progress: Callable[[float], None] | None = None) -> Recording:
    """Read a recording, whole or torn, with all of its files.

    Args:
        path: its first file.
        progress: called now and then with the fraction that is scanned.

    Raises:
        RecordingError: there is no such file, it is no recording, it is too large, or an intact chunk
            holds what cannot be.
    """
    paths = parts_of(path)
    extents: list[Extent] = []
    damages: list[tuple[Path, int, Damage]] = []  # with the number of extents before it
    run: int | None = None
    sizes = [_size(part) for part in paths]
    total, done = max(sum(sizes), 1), 0
    for part, size in zip(paths, sizes, strict=True):
        with _open(part) as file:
            head = file.read(FILE_HEAD_SIZE)
            known = decode_file_head(head)
            if known is None and len(paths) == 1 and not head.startswith(MAGIC) and not holds_chunk(file):
                _refuse(part, head)
            tell = None if progress is None else (lambda at, base=done: progress((base + at) / total))
            found, damaged = scan_extents(part, file, size, tell)
        if known is None:
            if not found:
                _refuse(part, head)
            damages.append((part, len(extents), Damage(0, FILE_HEAD_SIZE, None)))
        elif run is None:
            run = known.run
        at = 0
        for damage in damaged:
            while at < len(found) and found[at].offset < damage.offset:
                at += 1
            damages.append((part, len(extents) + at, damage))
        extents += found
        done += size
    if progress is not None:
        progress(1.0)
    if run is None:
        run = extents[0].run
    own, defects = find_defects(extents, damages, run)
    stream = RecordedBlocks(own)
    notes = list(stream.own())
    dropped = tuple(decode_drop(block) for block in notes if block.kind == DROPPED)
    copies = tuple(decode_copy(block) for block in notes if block.kind == COPY)
    every = tuple(sorted((*defects, *dropped), key=lambda defect: defect.since))
    return Recording(path, run, stream, copies, every, sum(sizes), stream.since, stream.until)


def _open(path: Path) -> BinaryIO:
    try:
        return open_file(path, MAX_SIZE)
    except OSError as exc:
        raise RecordingError(f"cannot read the recording {path}: {exc.strerror or exc}") from exc


def _size(path: Path) -> int:
    """Return the size that a file has now [bytes]; what is written meanwhile is not waited for."""
    with _open(path) as file:
        return os.fstat(file.fileno()).st_size


def _refuse(path: Path, head: bytes) -> None:
    """Raise why a file without a chunk is none that can be read; return for the start of one."""
    if not head.startswith(MAGIC):
        raise RecordingError(f"{path} is no recording of coneskin: it does not begin with {MAGIC.decode()}")
    raise RecordingError(f"{path} has no header: not one chunk of it is intact")


def _escape(name: str) -> str:
    return "".join(f"[{letter}]" if letter in "[]*?" else letter for letter in name)
