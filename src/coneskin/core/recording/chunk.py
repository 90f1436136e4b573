"""Chunk of a recording: blocks behind a head with their number, kinds and times; docs/look-up/recording.md."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

from coneskin.core.errors import RecordingError

from .block import MAX_PAYLOAD, Block, decode_blocks, encode_block, is_time

MAGIC = b"CONESKIN"  #: of a file
SYNC = b"\xa7CSK"  #: of a chunk
_FILE_HEAD = struct.Struct("<8sIQI")
_CHUNK_HEAD = struct.Struct("<4sIQQIIQddB3xII")
FILE_HEAD_SIZE = _FILE_HEAD.size  #: bytes
CHUNK_HEAD_SIZE = _CHUNK_HEAD.size  #: bytes
MAX_BODY = 2 * MAX_PAYLOAD  #: bytes of a chunk's blocks before compression; more is damage, not data
_PLAIN, _ZLIB = 0, 1  # encodings of a body
_ZLIB_LEVEL = 1  # of zlib: 3.1 times smaller in 2 to 4 ms for a second of an arm and a skin; 6 gains 8 % more
LAST_BIT = 63  #: of ``ChunkHead.kinds``: this kind or one above it


@dataclass(frozen=True, slots=True)
class ChunkHead:
    """Head of a chunk."""

    length: int  #: of the body, as it is stored [bytes]
    run: int  #: number of the recording that it belongs to
    sequence: int  #: its number in the recording, from 0 on, without a hole
    span: int  #: numbers that it stands for, 1 but where retention has made one of several
    blocks: int  #: that are in it
    kinds: int  #: bit k stands for a block of kind k, bit 63 for all from 63 on
    since: float  #: the smallest time of a block [s, host clock]
    until: float  #: the largest
    encoding: int  #: 0 plain, 1 zlib
    body_crc: int  #: CRC-32 of the stored body

    @property
    def following(self) -> int:
        """Number of the chunk that must come next."""
        return self.sequence + self.span

    @classmethod
    def decode(cls, data: bytes, at: int = 0) -> ChunkHead | None:
        """Return the head at an offset; None where there is none: sync, checksum or a limit is wrong."""
        if data[at : at + 4] != SYNC or len(data) < at + CHUNK_HEAD_SIZE:
            return None
        _, *fields, crc = _CHUNK_HEAD.unpack_from(data, at)
        if zlib.crc32(data[at : at + CHUNK_HEAD_SIZE - 4]) != crc:
            return None
        head = cls(*fields)
        timed = is_time(head.since) and is_time(head.until) and head.since <= head.until
        return head if timed and head.length <= MAX_BODY and head.span and head.blocks else None

    def unpacked(self, stored: bytes) -> list[Block]:
        """Return the blocks of a stored body whose checksum is right.

        Raises:
            RecordingError: the body is not what this head says: it was made so, not damaged.
        """
        try:
            blocks = decode_blocks(self._plain(stored))
        except RecordingError as exc:
            raise self._wrong(str(exc)) from None
        for _, time, _ in blocks:
            if not self.since <= time <= self.until:
                raise self._wrong(f"a block of it has the time {time} s")
        return blocks

    def _plain(self, stored: bytes) -> bytes:
        if self.encoding == _PLAIN:
            return stored
        if self.encoding != _ZLIB:
            raise RecordingError(f"its encoding {self.encoding} is none of 0 (plain) and 1 (zlib)")
        unpacker = zlib.decompressobj()
        try:
            body = unpacker.decompress(stored, MAX_BODY)
        except zlib.error as exc:
            raise RecordingError(str(exc)) from exc
        if not unpacker.eof or unpacker.unused_data:
            raise RecordingError(f"it has more than {MAX_BODY} bytes, or ends too early")
        return body

    def _wrong(self, what: str) -> RecordingError:
        return RecordingError(f"chunk {self.sequence} of {self.since:.6f} s is not what its head says: {what}")


def bits(kinds: Sequence[int] | frozenset[int]) -> int:
    """Return kinds of block as the bits of ``ChunkHead.kinds``."""
    found = 0
    for kind in kinds:
        found |= 1 << min(kind, LAST_BIT)
    return found


def encode_file_head(part: int, run: int) -> bytes:
    """Return the first bytes of a file: its number in the recording, from 0, and the recording's, drawn by chance."""
    data = _FILE_HEAD.pack(MAGIC, part, run, 0)[:-4]
    return data + struct.pack("<I", zlib.crc32(data))


def decode_file_head(data: bytes) -> int | None:
    """Return the number of the recording that a file's head names; None where it is damaged, or too short."""
    if len(data) < _FILE_HEAD.size:
        return None
    magic, _, run, crc = _FILE_HEAD.unpack_from(data)
    if magic != MAGIC or zlib.crc32(data[: _FILE_HEAD.size - 4]) != crc:
        return None
    return int(run)


def encode_chunk(run: int, sequence: int, blocks: Sequence[Block], span: int = 1) -> bytes:
    """Return the bytes of a chunk of at least one block, compressed where that makes it smaller."""
    body = b"".join(map(encode_block, blocks))
    packed = zlib.compress(body, _ZLIB_LEVEL)
    encoding, stored = (_ZLIB, packed) if len(packed) < len(body) else (_PLAIN, body)
    times = [block.time for block in blocks]
    fields = (SYNC, len(stored), run, sequence, span, len(blocks), bits({block.kind for block in blocks}))  # type: ignore[arg-type]
    head = _CHUNK_HEAD.pack(*fields, min(times), max(times), encoding, zlib.crc32(stored), 0)[:-4]
    return head + struct.pack("<I", zlib.crc32(head)) + stored
