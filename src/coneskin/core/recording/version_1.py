"""Reader of recordings of version 1, whose blocks have no sync and no number. It holds all of them in memory.

    file  = magic "CONESKIN" , u16 version , block*
    block = u32 length of the payload , u8 kind , f64 host time [s] , payload , u32 CRC-32 of all before in this block

After damage the next block is found by the high bytes of its time, which change once in hours, and by its checksum.
"""

from __future__ import annotations

import math
import struct
import zlib
from pathlib import Path

from coneskin.core.bounded_file import read_file
from coneskin.core.errors import RecordingError

from .block import END, MAX_PAYLOAD, Block, is_time
from .chunk import MAGIC
from .defect import Defect, DefectKind

__all__ = ["MAX_SIZE_1", "read_version_1"]

MAX_SIZE_1 = 1 << 30  #: bytes of a file
_START = len(MAGIC) + 2
_HEAD = struct.Struct("<IBd")
_TAIL = 4  # bytes
_HIGH = slice(11, 13)  # of a block: sign, exponent and four bits of its time
_MAX_JUMP = 1e6  # s between two blocks


def read_version_1(path: Path, size: int) -> tuple[tuple[Block, ...], tuple[Defect, ...]] | None:
    """Return the blocks and the defects of a recording of version 1; None where it is none.

    Raises:
        RecordingError: it is too large, or a block has a time that cannot be.
    """
    with open(path, "rb") as file:
        first = file.read(_START)
    if not first.startswith(MAGIC) or first[len(MAGIC) :] != b"\x01\x00":
        return None
    if size > MAX_SIZE_1:
        raise RecordingError(f"{path} is of version 1 and has {size} bytes; at most {MAX_SIZE_1} are read")
    try:
        data = read_file(path, MAX_SIZE_1)[:size]
    except OSError as exc:
        raise RecordingError(f"cannot read the recording {path}: {exc.strerror or exc}") from exc
    blocks: list[Block] = []
    defects: list[Defect] = []
    at = _START
    budget = 4 * size  # bytes that are looked at in vain
    while at < len(data):
        block = _block_at(data, at)
        if block is not None and (not blocks or abs(block.time - blocks[-1].time) < _MAX_JUMP or at == _START):
            blocks.append(block)
            at += _HEAD.size + len(block.payload) + _TAIL
            continue
        if block is not None and not is_time(block.time):
            raise RecordingError(f"block {len(blocks)} of {path} is damaged: its time is {block.time} s")
        after, budget = _find(data, at + 1, blocks[-1] if blocks else None, budget)
        since = blocks[-1].time if blocks else -math.inf
        if after < len(data):
            until = _HEAD.unpack_from(data, after)[2]
            defects.append(Defect(DefectKind.LOST, since, until, at, after - at, blocks=1))
        elif not (blocks and blocks[-1].kind == END):
            defects.append(Defect(DefectKind.NOT_CLOSED, since, offset=at, size=after - at))
        else:
            defects.append(Defect(DefectKind.STRAY, since, offset=at, size=after - at))
        at = after
    if not (blocks and blocks[-1].kind == END) and not any(d.kind is DefectKind.NOT_CLOSED for d in defects):
        defects.append(Defect(DefectKind.NOT_CLOSED, blocks[-1].time if blocks else -math.inf))
    return tuple(block for block in blocks if block.kind != END), tuple(defects)


def _block_at(data: bytes, at: int) -> Block | None:
    """Return the intact block at an offset; None where there is none."""
    if at + _HEAD.size + _TAIL > len(data):
        return None
    length, kind, time = _HEAD.unpack_from(data, at)
    end = at + _HEAD.size + length
    if length > MAX_PAYLOAD or end + _TAIL > len(data):
        return None
    if zlib.crc32(memoryview(data)[at:end]) != int.from_bytes(data[end : end + _TAIL], "little"):
        return None
    return Block(kind, time, data[at + _HEAD.size : end])


def _find(data: bytes, at: int, before: Block | None, budget: int) -> tuple[int, int]:
    """Return the offset of the next intact block, the size of the data where there is none; and the budget left."""
    high = None if before is None else struct.pack("<d", before.time)[6:]
    while budget > 0:
        if high is not None:
            found = data.find(high, at + _HIGH.start)
            if found < 0:
                break
            at = found - _HIGH.start
        if at + _HEAD.size + _TAIL > len(data):
            break
        length, _, time = _HEAD.unpack_from(data, at)
        budget -= 1
        fits = length <= MAX_PAYLOAD and at + _HEAD.size + length + _TAIL <= len(data)
        if fits and is_time(time) and (before is None or abs(time - before.time) < _MAX_JUMP):
            budget -= length
            if _block_at(data, at) is not None:
                return at, budget
        at += 1
    return len(data), budget
