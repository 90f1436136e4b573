"""Blocks that a recording's file has for itself: its end, copies of what a replay cannot do without, and drops."""

from __future__ import annotations

import json
import struct
from typing import Any

from coneskin.core.errors import RecordingError
from coneskin.core.json_text import read_json

from .block import END, Block, is_time
from .defect import Defect, DefectKind

__all__ = ["COPY", "DROPPED", "FILE_KINDS", "decode_copy", "decode_drop", "encode_copy", "encode_drop"]

COPY = 255  #: kind: a block that stands elsewhere as well: u8 its kind, f64 its time, its payload
DROPPED = 254  #: kind: JSON: what retention has dropped
_COPY = struct.Struct("<Bd")
FILE_KINDS = frozenset({END, *range(240, 256)})  #: not for those who read a run


def encode_copy(block: Block, time: float) -> Block:
    """Return the copy of a block, to be written at a time [s, host clock]."""
    return Block(COPY, time, _COPY.pack(block.kind, block.time) + block.payload)


def decode_copy(copy: Block) -> Block:
    """Return the block that a copy holds.

    Raises:
        RecordingError: it holds none.
    """
    if len(copy.payload) < _COPY.size:
        raise RecordingError(f"a copy of {copy.time:.6f} s holds no block")
    kind, time = _COPY.unpack_from(copy.payload)
    if not is_time(time):
        raise RecordingError(f"a copy of {copy.time:.6f} s holds a block of the time {time} s")
    return Block(kind, time, copy.payload[_COPY.size :])


def encode_drop(time: float, defect: Defect) -> Block:
    """Return the note of what was dropped.

    Args:
        time: of the note [s, host clock].
        defect: its extent.
    """
    facts = {
        "since": defect.since,
        "until": defect.until,
        "blocks": defect.blocks,
        "bytes": defect.size,
        "kinds": sorted(defect.kinds or ()),
    }
    return Block(DROPPED, time, json.dumps(facts).encode())


def decode_drop(block: Block) -> Defect:
    """Return what a note says.

    Raises:
        RecordingError: it says nothing that can be.
    """
    try:
        facts: dict[str, Any] = read_json(block.payload)
        since, until, blocks, size = (facts[key] for key in ("since", "until", "blocks", "bytes"))
        kinds = frozenset(facts["kinds"])
        whole = all(type(count) is int and count >= 0 for count in (blocks, size, *kinds))
        if block.kind != DROPPED or not whole or not (is_time(since) and is_time(until)):
            raise ValueError("a time or a number cannot be")
    except (ValueError, TypeError, KeyError) as exc:
        raise RecordingError(f"the block of {block.time:.6f} s does not say what was dropped: {exc}") from exc
    return Defect(DefectKind.DROPPED, since, until, size=size, blocks=blocks, kinds=kinds)
