"""Recorder: it collects blocks into chunks, appends them to a file, and goes on in a new one where that is full.

It holds a lock on the file, so that nobody replaces the file under it: what comes after would be lost in a file without
a name. The system forgets the lock when the recorder's process ends, however that ends. Reading needs no lock.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from coneskin.core.errors import RecordingError
from coneskin.core.files import explain_os_error

from .block import END, Block, encode_copy
from .chunk import encode_chunk, encode_file_head
from .reader import open_recording, part_path

if sys.platform != "win32":
    import fcntl

FLUSH_PERIOD = 0.05  #: s of blocks in a chunk: what a killed recorder loses; shorter ones are compressed less
_FLUSH_SIZE = 1 << 17  # bytes of blocks in a chunk
_RETENTION_STEPS = 8  # of retention with each chunk
_RETENTION_END = object()
_FILE_MODE = 0o600  # what was recorded tells who worked when: for its owner alone, who may chmod it


class Recorder:
    """A writer of one recording, for use in a ``with``. Only its owner may read the files.

    Args:
        path: the file to make.
        part_size: bytes from which on the recording goes on in a new file; None for never.
        keep: files that stay as they are; one before them is handed to ``retain``. None for all.
        retain: shortens a file in steps, of which some are made with each chunk, so that no step takes long.
        copied: kinds of block that are written again where each further file begins, and at the end: what a replay
            cannot do without.

    Attributes:
        parts: the files so far.

    Raises:
        RecordingError: on entering, where the file exists or cannot be made.
    """

    def __init__(
        self,
        path: Path,
        part_size: int | None = None,
        copied: frozenset[int] = frozenset(),
        keep: int | None = None,
        retain: Callable[[Path], Iterator[None]] | None = None,
    ) -> None:
        self.path = path
        self.parts: list[Path] = []
        self._part_size = part_size
        self._copied = copied
        self._keep, self._retain = keep, retain
        self._waiting: list[Path] = []  # for retention
        self._retaining: Iterator[None] = iter(())
        self._file: BinaryIO | None = None
        self._run = int.from_bytes(os.urandom(8), "little")
        self._sequence = self._written = self._collected = 0
        self._blocks: list[Block] = []
        self._copies: list[Block] = []
        self._last = 0.0

    def __enter__(self) -> Recorder:
        self._open_part()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def write(self, *blocks: Block, flush: bool = False) -> None:
        """Append blocks; with ``flush``, hand all that was collected to the operating system at once.

        Raises:
            RecordingError: the recording is closed, or the disk does not take them.
        """
        if self._file is None:
            raise RecordingError(f"the recording {self.path} is not open")
        for block in blocks:
            self._blocks.append(block)
            self._collected += len(block.payload)
            self._last = block.time
            if block.kind in self._copied:
                self._copies.append(block)
                flush = True
            if self._collected >= _FLUSH_SIZE:
                self.flush()
        if self._blocks and (flush or not 0.0 <= self._last - self._blocks[0].time < FLUSH_PERIOD):
            self.flush()

    def flush(self) -> None:
        """Hand all that was collected to the operating system, as a chunk.

        Raises:
            RecordingError: the disk does not take it.
        """
        if self._blocks:
            blocks, self._blocks, self._collected = self._blocks, [], 0
            self._append(blocks)
            if self._part_size is not None and self._written >= self._part_size:
                self._open_part()
                if self._keep is not None and len(self.parts) > self._keep:
                    self._waiting.append(self.parts[-1 - self._keep])
            if self._retain is not None:
                self._go_on_retaining(self._retain)

    def close(self) -> None:
        """Write the end and close the file; may be called again."""
        if self._file is None:
            return
        try:
            self.flush()
            self._append([*self._copied_again(), Block(END, self._last, b"")])
        finally:
            self._close_part()
            self._retaining = iter(())

    def _go_on_retaining(self, retain: Callable[[Path], Iterator[None]]) -> None:
        """Make some steps of the retention; a file that cannot be shortened stays as it is."""
        with suppress(RecordingError):
            for _ in range(_RETENTION_STEPS):
                if next(self._retaining, _RETENTION_END) is _RETENTION_END:
                    if not self._waiting:
                        return
                    self._retaining = retain(self._waiting.pop(0))

    def _open_part(self) -> None:
        """Begin a file; the one before ends without a word, because the numbers of the chunks go on."""
        path = part_path(self.path, len(self.parts))
        try:
            file = open(path, "xb", buffering=0, opener=open_for_owner)  # noqa: SIM115 - closed by ``close``
        except FileExistsError:
            hint = "name another file, or none where the scene has [recording]: each run then has a folder of its own"
            raise RecordingError(f"{path} is there already, and a recording is never overwritten: {hint}") from None
        except OSError as exc:
            raise RecordingError(f"cannot make the recording {path}: {exc.strerror or exc}") from exc
        _mark_recorded(file)
        try:
            self._close_part()
        except RecordingError:
            file.close()
            path.unlink()
            raise
        self._file, self._written = file, 0
        self._hand_over(encode_file_head(len(self.parts), self._run))
        self.parts.append(path)
        if len(self.parts) > 1 and self._copies:
            self._append(self._copied_again())

    def _copied_again(self) -> list[Block]:
        return [encode_copy(block, self._last) for block in self._copies]

    def _close_part(self) -> None:
        if self._file is not None:
            file, self._file = self._file, None
            # a network's disk only then says that it is full
            with explain_os_error(RecordingError, f"cannot close the recording {self.path}"):
                file.close()

    def _append(self, blocks: list[Block]) -> None:
        self._hand_over(encode_chunk(self._run, self._sequence, blocks))
        self._sequence += 1

    def _hand_over(self, data: bytes) -> None:
        assert self._file is not None  # whoever collects blocks has opened it
        self._written += len(data)
        view = memoryview(data)
        with explain_os_error(RecordingError, f"cannot write to the recording {self.path}"):
            while view:
                view = view[self._file.write(view) or 0 :]


def open_for_owner(name: str, flags: int) -> int:
    """Open a file that, where it is new, only its owner may read; for ``opener`` of ``open``."""
    return os.open(name, flags, _FILE_MODE)


def _mark_recorded(file: BinaryIO) -> None:
    """Hold the lock of a file until it is closed; a file system without locks has none."""
    if sys.platform != "win32":
        with suppress(OSError):
            fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)


@contextmanager
def hold_against_recorder(path: Path) -> Iterator[None]:
    """Hold the lock of a file that no recorder writes.

    Raises:
        RecordingError: it is being recorded now, or cannot be read.
    """
    with open_recording(path) as file:
        if sys.platform != "win32":
            try:
                fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise RecordingError(
                    f"{path} is being recorded now, or pruned by somebody else: wait until that has ended"
                ) from None
            except OSError:
                pass  # a file system without locks
        yield
