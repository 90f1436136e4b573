"""Block of a recording: one recorded item, and its bytes: from the guard to the session that records, and in a chunk.

Layout (little endian)::

    block  = u32 length of the payload , u8 kind , f64 host time [s] , payload

Blocks that follow each other need nothing between them. A file holds them in chunks that are found again after damage:
see ``chunk``. The writer gives the kinds their meaning: see ``robot.guard.journal``.
"""

from __future__ import annotations

import struct
from typing import Final, NamedTuple, TypeGuard

from coneskin.core.errors import RecordingError

END = 0  #: kind of the last block of a recording that was closed
COPY = 255  #: kind: a block that stands elsewhere as well: u8 its kind, f64 its time, its payload
DROPPED = 254  #: kind: JSON: what retention has dropped
ALL_KINDS = frozenset(range(256))
FILE_KINDS = frozenset({END, *range(240, 256)})  #: not for those who read a run
_BLOCK_HEAD: Final = struct.Struct("<IBd")
_COPY_HEAD: Final = struct.Struct("<Bd")
MAX_PAYLOAD: Final = 1 << 24  #: bytes; a longer block is damage, not data


class Block(NamedTuple):
    """One recorded item."""

    kind: int  #: what it is, 1..239; those above are the file's own
    time: float  #: host clock [s], monotonic
    payload: bytes  #: its bytes


def is_time(value: object) -> TypeGuard[float]:
    """Tell whether a value can be a time of the host's clock [s]: a number, not above 300 000 years."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e13


def encode_block(block: Block) -> bytes:
    """Return the bytes of one block."""
    kind, time, payload = block
    return _BLOCK_HEAD.pack(len(payload), kind, time) + payload


def decode_blocks(data: bytes) -> list[Block]:
    """Return the blocks that follow each other in data.

    Raises:
        RecordingError: a block is longer than any can be, or is not all there.
    """
    at, size, unpack, skip = 0, len(data), _BLOCK_HEAD.unpack_from, _BLOCK_HEAD.size
    blocks: list[Block] = []
    head: tuple[int, int, float]
    try:
        while at < size:
            head = unpack(data, at)
            length, kind, time = head
            start = at + skip
            at = start + length
            if at > size or length > MAX_PAYLOAD:
                raise RecordingError(f"a block has {length} bytes")
            blocks.append(tuple.__new__(Block, (kind, time, data[start:at])))  # half the time of Block(...)
    except struct.error:
        raise RecordingError(f"{size - at} bytes are left behind its last block") from None
    return blocks


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
