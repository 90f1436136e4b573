"""Block of a recording: one recorded item, and its bytes on the way from the guard to the session that records.

Layout (little endian)::

    block  = u32 length of the payload , u8 kind , f64 host time [s] , payload , u32 CRC-32 of all before in this block

Blocks that follow each other need nothing between them. A file holds them otherwise, in chunks that are found again
after damage: see ``chunk``. The writer gives the kinds their meaning: see ``robot.guard.journal``.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from typing import NamedTuple, TypeGuard

from coneskin.core.errors import RecordingError

__all__ = [
    "ALL_KINDS",
    "COPY",
    "DROPPED",
    "END",
    "FILE_KINDS",
    "MAX_PAYLOAD",
    "Block",
    "decode_blocks",
    "decode_copy",
    "encode_block",
    "encode_copy",
    "is_time",
]

END = 0  #: kind of the last block of a recording that was closed
COPY = 255  #: kind: a block that stands elsewhere as well: u8 its kind, f64 its time, its payload
DROPPED = 254  #: kind: JSON: what retention has dropped
ALL_KINDS = frozenset(range(256))
FILE_KINDS = frozenset({END, *range(240, 256)})  #: not for those who read a run
_BLOCK_HEAD = struct.Struct("<IBd")
_BLOCK_TAIL = struct.Struct("<I")
_COPY_HEAD = struct.Struct("<Bd")
MAX_PAYLOAD = 1 << 24  #: bytes; a longer block is damage, not data


class Block(NamedTuple):
    """One recorded item.

    Attributes:
        kind: what it is, 1..239; those above are the file's own.
        time: host clock [s], monotonic.
        payload: its bytes.
    """

    kind: int
    time: float
    payload: bytes


def is_time(value: object) -> TypeGuard[float]:
    """Tell whether a value can be a time of the host's clock [s]: a number, not above 300 000 years."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e13


def encode_block(block: Block) -> bytes:
    """Return the bytes of one block."""
    body = _BLOCK_HEAD.pack(len(block.payload), block.kind, block.time) + block.payload
    return body + _BLOCK_TAIL.pack(zlib.crc32(body))


def decode_blocks(data: bytes) -> Iterator[tuple[int, Block]]:
    """Yield the whole blocks from the start of data, each with the offset behind it, up to the first damaged one."""
    at = 0
    while at + _BLOCK_HEAD.size + _BLOCK_TAIL.size <= len(data):
        length, kind, time = _BLOCK_HEAD.unpack_from(data, at)
        end = at + _BLOCK_HEAD.size + length
        if length > MAX_PAYLOAD or end + _BLOCK_TAIL.size > len(data):
            return
        if zlib.crc32(data[at:end]) != _BLOCK_TAIL.unpack_from(data, end)[0]:
            return
        payload = data[at + _BLOCK_HEAD.size : end]
        at = end + _BLOCK_TAIL.size
        yield at, Block(kind, time, payload)


def encode_copy(block: Block, time: float) -> Block:
    """Return the copy of a block, to be written at a time [s, host clock]."""
    return Block(COPY, time, _COPY_HEAD.pack(block.kind, block.time) + block.payload)


def decode_copy(copy: Block) -> Block:
    """Return the block that a copy holds.

    Raises:
        RecordingError: it holds none.
    """
    if len(copy.payload) < _COPY_HEAD.size:
        raise RecordingError(f"a copy of {copy.time:.6f} s holds no block")
    kind, time = _COPY_HEAD.unpack_from(copy.payload)
    if not is_time(time):
        raise RecordingError(f"a copy of {copy.time:.6f} s holds a block of the time {time} s")
    return Block(kind, time, copy.payload[_COPY_HEAD.size :])
