"""The wire format, version 1: frames of 36 bytes with a checksum, and a decoder that finds them in any stream.

The layout, the meaning of each field and the reasons are in docs/wire-format.md. In short: sync, version, length,
device, sensor, status, sequence, device clock, three phases of (guide, guide, drive current), supply, CRC.

Bytes in, values out: nothing here knows ports, time or sensors, and noise never raises.
"""

from __future__ import annotations

from binascii import crc_hqx
from enum import IntFlag
from struct import Struct
from typing import Final, NamedTuple

__all__ = ["FRAME_LENGTH", "MAX_LENGTH", "SYNC", "VERSION", "Decoder", "Frame", "Status", "encode", "frame_at"]

SYNC: Final = b"\xc5\x3a"
VERSION: Final = 1
FRAME_LENGTH: Final = 36
MAX_LENGTH: Final = 64
"""No version, present or future, is longer [bytes]: a false start in noise can then hold a good frame back by less
than one frame."""
_MIN_LENGTH: Final = 8  # sync, version, length, at least two bytes of content, CRC

_HEADER: Final = SYNC + bytes((VERSION, FRAME_LENGTH))
_FIELDS: Final = Struct("<2xBxHBBHI10H2x")  # sync, length and CRC are checked, not carried
_BODY: Final = Struct("<2sBBHBBHI10H")


class Status(IntFlag):
    """What the device says about itself; each bit that is set makes the frame invalid, save RESTARTED and TOUCH."""

    SUPPLY = 0x01  #: the drive supply left its range
    ADC = 0x02  #: a conversion failed, or the converter's self-check did
    OVERRUN = 0x04  #: a phase did not get its settling time
    SELF_TEST = 0x08  #: the device's self-test failed
    OVERCURRENT = 0x10  #: the drive current was limited
    RESTARTED = 0x20  #: first frame since the device started: sequence and clock begin anew
    TOUCH = 0x40  #: the device's own threshold is exceeded (information only)
    RESERVED = 0x80  #: zero in version 1


class Frame(NamedTuple):
    """One measurement of one sensor, in the numbers of the wire (integers, counts of the converter)."""

    version: int  #: of the format, 1
    device: int  #: which electronics, 0..65535
    sensor: int  #: which sensor of that electronics, 0..255
    status: int  #: bits of Status
    sequence: int  #: counts the frames of this sensor, modulo 65536
    clock_us: int  #: device clock at the end of the touch phase [us], modulo 2**32
    touch_c: int  #: touch phase (A = B = supply): guide C over its pull-down
    touch_d: int  #: touch phase: guide D over its pull-down
    touch_current: int  #: touch phase: drive current
    radial_c: int  #: radial phase (B = supply, A = 0): guide C
    radial_d: int  #: radial phase: guide D
    radial_current: int  #: radial phase: drive current, through A and B
    angular_a: int  #: angular phase (C = supply, D = 0): guide A
    angular_b: int  #: angular phase: guide B
    angular_current: int  #: angular phase: drive current, through C and D
    supply: int  #: the supply that drives the electrodes, through the same converter


def encode(frame: Frame) -> bytes:
    """Turn a frame into its 36 bytes.

    Args:
        frame: every field within the range of its width.

    Returns:
        the bytes, CRC included.

    Raises:
        ValueError: the frame is of another version, or a field does not fit its width.
    """
    if frame.version != VERSION:
        raise ValueError(f"frame.version must be {VERSION}, got {frame.version}")
    try:
        body = _BODY.pack(SYNC, VERSION, FRAME_LENGTH, *frame[1:])
    except Exception as error:  # struct.error names neither field nor value
        raise ValueError(f"a field does not fit its width on the wire ({error}): {frame}") from error
    return body + crc_hqx(body, 0).to_bytes(2, "big")


def frame_at(data: bytes, offset: int = 0) -> Frame | None:
    """Read the frame that starts at an offset.

    Args:
        data: at least offset + 36 bytes.
        offset: where the frame starts [bytes].

    Returns:
        the frame, or None if no valid frame of version 1 starts there.
    """
    piece = data[offset : offset + FRAME_LENGTH]
    if len(piece) != FRAME_LENGTH or not piece.startswith(_HEADER) or crc_hqx(piece, 0):
        return None
    return Frame._make(_FIELDS.unpack(piece))


class Decoder:
    """Finds frames in a stream that may be cut anywhere and may carry noise.

    The frames found depend on the stream alone, never on how it was cut into pieces. A frame of 36 bytes is accepted
    when sync, version, length and CRC agree: 48 bits, so noise passes once in 2.8e14 positions; a true frame whose
    content was damaged at random passes once in 65536 (any 1, 2 or 3 wrong bits and any burst up to 16 bits never do).

    Attributes:
        frames: frames accepted.
        bytes_skipped: bytes that belong to no frame.
        crc_errors: a frame's start was there, its checksum was wrong.
        unknown_versions: whole frames, with the right checksum, of a version that this decoder cannot read.
        last_unknown_version: the version of the newest of those, or None.
    """

    __slots__ = (
        "_rest",
        "bytes_skipped",
        "crc_errors",
        "frames",
        "last_unknown_version",
        "unknown_versions",
    )

    def __init__(self) -> None:
        self._rest = b""
        self.frames = 0
        self.bytes_skipped = 0
        self.crc_errors = 0
        self.unknown_versions = 0
        self.last_unknown_version: int | None = None

    @property
    def pending(self) -> int:
        """Bytes kept because they may be the beginning of a frame, fewer than 64."""
        return len(self._rest)

    def feed(self, data: bytes) -> list[Frame]:
        """Take the next bytes of the stream.

        Args:
            data: any number of bytes.

        Returns:
            the frames that are complete now, in their order.
        """
        if len(data) == FRAME_LENGTH and not self._rest and data.startswith(_HEADER) and not crc_hqx(data, 0):
            self.frames += 1
            return [Frame._make(_FIELDS.unpack(data))]
        return self._search(self._rest + data)

    def _search(self, data: bytes) -> list[Frame]:
        """The slow path: look for frames from the beginning of data, keep the unfinished end."""
        found: list[Frame] = []
        at, end = 0, len(data)
        while True:
            start = data.find(SYNC, at)
            if start < 0:  # the last byte may be the first half of a sync word
                start = end - 1 if data.endswith(SYNC[:1]) and end > at else end
            self.bytes_skipped += start - at
            at = start
            if end - at < 4:
                break
            version, length = data[at + 2], data[at + 3]
            plausible = length == FRAME_LENGTH if version == VERSION else _MIN_LENGTH <= length <= MAX_LENGTH
            if plausible and end - at < length:
                break
            if plausible and not crc_hqx(data[at : at + length], 0):
                if version == VERSION:
                    found.append(Frame._make(_FIELDS.unpack_from(data, at)))
                else:
                    self.unknown_versions += 1
                    self.last_unknown_version = version
                at += length
                continue
            if plausible and version == VERSION:
                self.crc_errors += 1
            self.bytes_skipped += 1
            at += 1
        self._rest = data[at:]
        self.frames += len(found)
        return found
