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

__all__ = ["END", "MAX_PAYLOAD", "Block", "decode_blocks", "encode_block", "is_time"]

END = 0  #: kind of the last block of a recording that was closed
_HEAD = struct.Struct("<IBd")
_TAIL = struct.Struct("<I")
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
    body = _HEAD.pack(len(block.payload), block.kind, block.time) + block.payload
    return body + _TAIL.pack(zlib.crc32(body))


def decode_blocks(data: bytes) -> Iterator[tuple[int, Block]]:
    """Yield the whole blocks from the start of data, each with the offset behind it, up to the first damaged one."""
    at = 0
    while at + _HEAD.size + _TAIL.size <= len(data):
        length, kind, time = _HEAD.unpack_from(data, at)
        end = at + _HEAD.size + length
        if length > MAX_PAYLOAD or end + _TAIL.size > len(data):
            return
        if zlib.crc32(data[at:end]) != _TAIL.unpack_from(data, end)[0]:
            return
        payload = data[at + _HEAD.size : end]
        at = end + _TAIL.size
        yield at, Block(kind, time, payload)
