"""Reader of a recording: its intact blocks as a stream, in the order in which they were written, and its defects.

A recording that grows is read chunk by chunk, without a lock, by another process.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from glob import escape
from pathlib import Path
from typing import BinaryIO

from coneskin.core.errors import RecordingError
from coneskin.core.files import explain_os_error, open_file
from coneskin.core.progress import Progress, silent

from .block import ALL_KINDS, COPY, DROPPED, END, FILE_KINDS, Block, decode_copy
from .chunk import FILE_HEAD_SIZE, LAST_BIT, MAGIC, bits, decode_file_head
from .defects import Defect, find_defects
from .scan import Chunk, Damage, Extent, holds_chunk, walk

MAX_SIZE = 1 << 36  #: bytes of a file: two years of one sensor and an arm; it is never held in memory


@dataclass(frozen=True, slots=True)
class Recording:
    """The readable part of a recording. Its blocks are read from its files at each iteration, never all into memory.

    Attributes:
        extents: where the intact blocks are, in the order in which they were written.
        copies: blocks without which nothing can be replayed, from a place where they stand again.
        defects: what is missing or wrong; empty where the recording is whole and was closed.
        size: of its files [bytes].
        hidden: kinds of block that are not shown.
    """

    extents: tuple[Extent, ...]
    copies: tuple[Block, ...] = ()
    defects: tuple[Defect, ...] = ()
    size: int = 0
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
        self, since: float = -math.inf, until: float = math.inf, kinds: frozenset[int] = ALL_KINDS
    ) -> Iterator[Block]:
        """Yield some of the blocks; what is outside is passed over without being read, as far as it can be.

        Args:
            since: the smallest time [s, host clock].
            until: the largest.
            kinds: of block.

        Raises:
            RecordingError: a file has changed since it was opened, or cannot be read.
        """
        for blocks in self.batches(since, until, kinds):
            yield from blocks

    def batches(
        self, since: float = -math.inf, until: float = math.inf, kinds: frozenset[int] = ALL_KINDS
    ) -> Iterator[list[Block]]:
        """Yield the blocks of ``select``, those of a chunk together: quicker than one by one."""
        shown = kinds - self.hidden
        mask = bits(shown)
        unlike = ~bits([kind for kind in shown if kind < LAST_BIT])  # a chunk of such a kind shows a part of it
        for chunk in self._chunks(since, until, mask):
            head, blocks = chunk.head, chunk.blocks()
            if head.kinds & unlike or head.since < since or head.until > until:
                blocks = [block for block in blocks if block.kind in shown and since <= block.time <= until]
            if blocks:
                yield blocks

    def _chunks(self, since: float, until: float, kinds: int) -> Iterator[Chunk]:
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
                    files = {extent.path: stack.enter_context(open_recording(extent.path))}
                for chunk in walk(files[extent.path], extent.offset, extent.end):
                    if isinstance(chunk, Damage):
                        raise RecordingError(f"{extent.path} has changed while it was read, at byte {chunk.offset}")
                    head = chunk.head
                    if head.sequence >= following:
                        following = head.following
                        if head.since <= until and head.until >= since and head.kinds & kinds:
                            yield chunk


def part_path(path: Path, number: int) -> Path:
    """Return the path of a file of a recording: ``run.rec``, ``run.0001.rec``, ``run.0002.rec`` ..."""
    return path if number == 0 else path.with_name(f"{path.stem}.{number:04d}{path.suffix}")


def parts_of(path: Path) -> list[Path]:
    """Return the files of a recording that are there, in their order."""
    further = sorted(path.parent.glob(f"{escape(path.stem)}.[0-9][0-9][0-9][0-9]*{escape(path.suffix)}"))
    numbered = [part for part in further if part.name[len(path.stem) + 1 : -len(path.suffix) or None].isdecimal()]
    return [path, *sorted(numbered, key=lambda part: (len(part.name), part.name))]


def read_recording(path: Path, progress: Progress = silent) -> Recording:
    """Read a recording, whole or torn, with all of its files, by the path of the first.

    Raises:
        RecordingError: there is no such file, it is no recording, it is too large, or an intact chunk
            holds what cannot be.
    """
    paths = parts_of(path)
    extents: list[Extent] = []
    damages: list[tuple[Path, int, Damage]] = []  # with the number of extents before it
    run: int | None = None
    with explain_os_error(RecordingError, f"cannot read the recording {path}"):
        sizes = [part.stat().st_size for part in paths]  # what is written meanwhile is not waited for
    total, done = max(sum(sizes), 1), 0
    for part, size in zip(paths, sizes, strict=True):
        with open_recording(part) as file:
            head = file.read(FILE_HEAD_SIZE)
            known = decode_file_head(head)
            if known is None and len(paths) == 1 and not head.startswith(MAGIC) and not holds_chunk(file):
                _refuse(part, head)
            before = len(extents)
            if known is None:
                damages.append((part, before, Damage(0, FILE_HEAD_SIZE, None)))
            for piece in walk(file, FILE_HEAD_SIZE, size):
                if isinstance(piece, Damage):
                    damages.append((part, len(extents), piece))
                elif len(extents) == before or not extents[-1].takes(piece):
                    extents.append(Extent.of(part, piece))
                    progress((done + piece.offset) / total)
        if known is None and len(extents) == before:
            _refuse(part, head)
        run = known if run is None else run
        done += size
    progress(1.0)
    own, defects = find_defects(extents, damages, extents[0].run if run is None else run)
    notes = list(Recording(own, hidden=frozenset()).select(kinds=frozenset({COPY, DROPPED})))
    dropped = (Defect.noted(block) for block in notes if block.kind == DROPPED)
    copies = tuple(decode_copy(block) for block in notes if block.kind == COPY)
    every = tuple(sorted((*defects, *dropped), key=lambda defect: defect.since))
    return Recording(own, copies, every, sum(sizes))


def open_recording(path: Path) -> BinaryIO:
    """Open a file of a recording for reading.

    Raises:
        RecordingError: it cannot be read, or is too long.
    """
    with explain_os_error(RecordingError, f"cannot read the recording {path}"):
        return open_file(path, MAX_SIZE)


def _refuse(path: Path, head: bytes) -> None:
    """Raise why a file without a chunk is none that can be read; return for the start of one."""
    if not head.startswith(MAGIC):
        raise RecordingError(f"{path} is no recording of coneskin: it does not begin with {MAGIC.decode()}")
    raise RecordingError(f"{path} has no header: not one chunk of it is intact")


class RecordingTail:
    """Reader of a recording that grows.

    Args:
        path: its first file.
        keep: of what is there already, the chunks older than this before the newest are left out [s] ...
        always: ... but for those with blocks of these kinds.

    Attributes:
        ended: the recording was closed: nothing more will come.

    Raises:
        RecordingError: there is no such file, or it is no recording.
    """

    def __init__(self, path: Path, keep: float, always: frozenset[int]) -> None:
        self.path = path
        self.ended = False
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
                # else it may be a chunk that is not whole yet
            if following is None:
                return
            self._file.close()
            self._file, self._part, self._offset = following, self._part + 1, FILE_HEAD_SIZE

    def _open(self, part: int) -> BinaryIO | None:
        with suppress(OSError):
            return open_file(part_path(self.path, part), MAX_SIZE)
        return None
