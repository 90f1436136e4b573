"""A recording: blocks appended to one file, each complete in itself.

Layout (little endian)::

    file   = magic "CONESKIN" , u16 version , block*
    block  = u32 length of the payload , u8 kind , f64 host time [s] , payload , u32 CRC-32 of all before in this block

The writer hands every flush to the operating system at once, so a process that is killed loses nothing that was
flushed. The reader takes whole blocks up to the first that is torn or damaged and says what is missing; a recording
that was closed ends with an END block. What the kinds mean is up to who writes: see ``robot.journal``.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, NamedTuple

from coneskin.errors import RecordingError

__all__ = [
    "END",
    "MAGIC",
    "VERSION",
    "Block",
    "Recorder",
    "Recording",
    "decode_blocks",
    "encode_block",
    "read_recording",
]

MAGIC = b"CONESKIN"
VERSION = 1
END = 0  #: the kind of the last block of a recording that was closed
_FILE_HEAD = MAGIC + struct.pack("<H", VERSION)
_HEAD = struct.Struct("<IBd")
_TAIL = struct.Struct("<I")
_LONGEST = 1 << 24  # a length beyond this is damage, not data


class Block(NamedTuple):
    """One thing that happened.

    Attributes:
        kind: what it is, 1..255.
        time: host clock [s], monotonic.
        payload: its bytes.
    """

    kind: int
    time: float
    payload: bytes


@dataclass(frozen=True, slots=True)
class Recording:
    """What could be read of a recording.

    Attributes:
        blocks: the whole blocks, in the order in which they were written.
        missing: what is not there, in a sentence; empty where the recording was closed.
    """

    blocks: tuple[Block, ...]
    missing: str


def encode_block(block: Block) -> bytes:
    """The bytes of one block."""
    body = _HEAD.pack(len(block.payload), block.kind, block.time) + block.payload
    return body + _TAIL.pack(zlib.crc32(body))


def decode_blocks(data: bytes) -> Iterator[tuple[int, Block]]:
    """Whole blocks from the start of data, each with the offset behind it; ends at the first torn or damaged one."""
    at = 0
    while at + _HEAD.size + _TAIL.size <= len(data):
        length, kind, time = _HEAD.unpack_from(data, at)
        end = at + _HEAD.size + length
        if length > _LONGEST or end + _TAIL.size > len(data):
            return
        if zlib.crc32(data[at:end]) != _TAIL.unpack_from(data, end)[0]:
            return
        payload = data[at + _HEAD.size : end]
        at = end + _TAIL.size
        yield at, Block(kind, time, payload)


class Recorder:
    """Writes a recording; use it in a ``with``.

    Args:
        path: the file to make.

    Raises:
        RecordingError: on entering, where the file exists or cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: BinaryIO | None = None
        self._last = 0.0

    def __enter__(self) -> Recorder:
        try:
            self._file = self.path.open("xb", buffering=0)
        except OSError as exc:
            raise RecordingError(f"cannot make the recording {self.path}: {exc.strerror or exc}") from exc
        self._write(_FILE_HEAD)
        return self

    def __exit__(self, kind: type[BaseException] | None, exc: BaseException | None, tb: TracebackType | None) -> None:
        self.close()

    def write(self, *blocks: Block) -> None:
        """Append blocks and hand them to the operating system.

        Raises:
            RecordingError: the recording is closed, or the disk does not take them.
        """
        if blocks:
            self._last = blocks[-1].time
            self._write(b"".join(map(encode_block, blocks)))

    def close(self) -> None:
        """Write the END block and close the file; may be called again."""
        if self._file is None:
            return
        try:
            self._write(encode_block(Block(END, self._last, b"")))
        finally:
            self._file.close()
            self._file = None

    def _write(self, data: bytes) -> None:
        if self._file is None:
            raise RecordingError(f"the recording {self.path} is not open")
        view = memoryview(data)
        try:
            while view:
                view = view[self._file.write(view) or 0 :]
        except OSError as exc:
            raise RecordingError(f"cannot write to the recording {self.path}: {exc.strerror or exc}") from exc


def read_recording(path: Path) -> Recording:
    """Read a recording, whole or torn.

    Args:
        path: the file.

    Raises:
        RecordingError: there is no such file, it is no recording, or it is of a version that is not known.
    """
    try:
        data = path.read_bytes()
    except OSError as exc:
        raise RecordingError(f"cannot read the recording {path}: {exc.strerror or exc}") from exc
    if not data.startswith(MAGIC):
        raise RecordingError(f"{path} is no recording of coneskin: it does not begin with {MAGIC.decode()}")
    version = int.from_bytes(data[len(MAGIC) : len(_FILE_HEAD)], "little")
    if version != VERSION:
        raise RecordingError(f"{path} is a recording of version {version}; this coneskin reads version {VERSION}")
    blocks: list[Block] = []
    end = 0
    body = data[len(_FILE_HEAD) :]
    for end, block in decode_blocks(body):  # noqa: B007 - end is used behind the loop
        blocks.append(block)
    rest = len(body) - end
    if blocks and blocks[-1].kind == END:
        blocks.pop()
        missing = f"{rest} bytes behind the end of the recording are ignored" if rest else ""
    else:
        last = f"{blocks[-1].time:.6f} s" if blocks else "the start"
        missing = f"the recording was not closed: nothing is known after {last}"
        if rest:
            missing += f"; {rest} bytes of a torn or damaged block at offset {len(_FILE_HEAD) + end} are ignored"
    return Recording(tuple(blocks), missing)
