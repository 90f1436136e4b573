"""Wire format: frames with a checksum, in three lengths, and a decoder that finds them in any stream.

The layout, the meaning of each field and the reasons are in docs/look-up/wire-format.md. In short: sync, version,
length, device, sensor, status, sequence, device clock, three phases of (guide, guide, drive current), supply, CRC. The
shortest frame measures the supply once; the others measure it in each phase, and the longest one the driven
electrodes' own potentials as well.

Bytes in, values out: nothing here knows ports, time or sensors, and noise never raises.
"""

from __future__ import annotations

from binascii import crc_hqx
from enum import IntFlag
from struct import Struct
from typing import Any, Final, NamedTuple

SYNC: Final = b"\xc5\x3a"
VERSION: Final = 1  #: of the format
FRAME_LENGTHS: Final = (36, 40, 52)  #: bytes: one supply; that of each phase; with the driven potentials too
FRAME_LENGTH: Final = FRAME_LENGTHS[0]  #: bytes of the shortest frame
#: Bytes; no version, present or future, is longer, so a false start in noise delays a good frame by less than a frame.
MAX_LENGTH: Final = 64
_MIN_LENGTH: Final = 8  # bytes; sync, version, length, at least two of content, CRC


class Status(IntFlag):
    """The device's report about itself; each bit that is set makes the frame invalid, save RESTARTED and TOUCH."""

    SUPPLY = 0x01  #: the drive supply left its range
    ADC = 0x02  #: a conversion failed, or the converter's self-check did
    OVERRUN = 0x04  #: a phase did not get its settling time
    SELF_TEST = 0x08  #: the device's self-test failed
    OVERCURRENT = 0x10  #: the drive current was limited
    RESTARTED = 0x20  #: first frame since the device started: sequence and clock begin anew
    TOUCH = 0x40  #: the device's own threshold is exceeded (information only)
    RESERVED = 0x80  #: always zero


STATUS_FAULTS: Final = int(~(Status.RESTARTED | Status.TOUCH) & 0xFF)  #: bits that make a frame invalid


class DrivenPotentials(NamedTuple):
    """Potentials of the driven electrodes themselves, each on a wire that carries no current [counts]."""

    touch_a: int  #: touch phase: electrode A, at the supply but for its lead
    touch_b: int  #: touch phase: electrode B, at the supply but for its lead
    radial_a: int  #: radial phase: electrode A
    radial_b: int  #: radial phase: electrode B
    angular_c: int  #: angular phase: electrode C
    angular_d: int  #: angular phase: electrode D


class Frame(NamedTuple):
    """One measurement of one sensor, in the numbers of the wire (integers, counts of the converter).

    What is asked of every frame is taken by its place: compiled, that is five times as quick as by its name.
    """

    length: int  #: bytes on the wire, one of FRAME_LENGTHS
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
    touch_supply: int  #: the supply that drives the electrodes, through the same converter, in the touch phase
    radial_supply: int  #: the same in the radial phase; the shortest frame has one for all three
    angular_supply: int  #: the same in the angular phase
    driven: DrivenPotentials | None = None  #: longest frame only: where the leads' voltage drop is measured too


class _Layout(NamedTuple):
    """The bytes of one length."""

    header: bytes
    length: int
    read: Struct  #: sync, length and CRC are checked, not carried
    write: Struct  #: all but the CRC


def _layout(length: int) -> _Layout:
    counts = (length - 16) // 2
    read, write = Struct(f"<3xBHBBHI{counts}H2x"), Struct(f"<2sBBHBBHI{counts}H")
    return _Layout(SYNC + bytes((VERSION, length)), length, read, write)


_SUPPLY_AT: Final = Frame._fields.index("touch_supply")
_DRIVEN_AT: Final = Frame._fields.index("driven")
_ONE_SUPPLY, _THREE_SUPPLIES, _WITH_DRIVEN = map(_layout, FRAME_LENGTHS)
DRIVEN_HEAD: Final = _WITH_DRIVEN.header  #: first bytes of a frame with the driven potentials
_LAYOUT_BY_HEADER: Final = {layout.header: layout for layout in (_ONE_SUPPLY, _THREE_SUPPLIES, _WITH_DRIVEN)}


def encode(frame: Frame) -> bytes:
    """Turn a frame into its bytes.

    Args:
        frame: every field within the range of its width.

    Returns:
        the bytes, CRC included.

    Raises:
        ValueError: the length is none of FRAME_LENGTHS, a field does not fit its width, or a frame of this length does
            not carry it.
    """
    *values, driven = frame
    if frame.length not in FRAME_LENGTHS:
        raise ValueError(f"frame.length must be one of 36, 40, 52 bytes, got {frame.length}")
    if (driven is not None) != (frame.length == _WITH_DRIVEN.length):
        raise ValueError(f"a frame of 52 bytes, and no other, carries the driven potentials: {frame}")
    layout = _THREE_SUPPLIES
    if driven is not None:
        layout, values = _WITH_DRIVEN, [*values, *driven]
    elif frame.length == FRAME_LENGTH:
        if not frame.touch_supply == frame.radial_supply == frame.angular_supply:
            raise ValueError(f"a frame of 36 bytes carries one supply for all phases: {frame}")
        layout, values = _ONE_SUPPLY, values[: _SUPPLY_AT + 1]
    try:
        body = layout.write.pack(SYNC, VERSION, *values)
    except Exception as error:  # struct.error names neither field nor value
        raise ValueError(f"a field does not fit its width on the wire ({error}): {frame}") from error
    return body + crc_hqx(body, 0).to_bytes(2, "big")


def frame_at(data: bytes, offset: int = 0) -> Frame | None:
    """Read the frame that starts at an offset.

    Args:
        data: at least the bytes of the frame from there.
        offset: where the frame starts [bytes].

    Returns:
        the frame, or None if no valid frame starts there.
    """
    layout = _LAYOUT_BY_HEADER.get(data[offset : offset + 4])
    if layout is None:
        return None
    piece = data[offset : offset + layout.length]
    if len(piece) != layout.length or crc_hqx(piece, 0):
        return None
    return _read(layout, piece)


def _read(layout: _Layout, piece: bytes) -> Frame:
    """Return the frame of a checked piece."""
    values: tuple[Any, ...] = layout.read.unpack(piece)
    if layout is _ONE_SUPPLY:
        supply = values[_SUPPLY_AT]
        values += (supply, supply, None)
    elif layout is _THREE_SUPPLIES:
        values += (None,)
    else:
        values = (*values[:_DRIVEN_AT], DrivenPotentials._make(values[_DRIVEN_AT:]))
    return tuple.__new__(Frame, values)  # a third of the time of Frame._make


class FrameDecoder:
    """A decoder that finds frames in a stream that may be cut anywhere and may carry noise.

    The frames found depend on the stream alone, never on how it was cut into pieces. A frame is accepted when sync,
    version, length and CRC agree: 48 bits in each of three layouts, so noise passes once in 9e13 positions; a true
    frame whose content was damaged at random passes once in 65536 (any 1, 2 or 3 wrong bits and any burst up to 16
    bits never do).

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
        """Number of bytes kept because they may be the beginning of a frame, fewer than 64."""
        return len(self._rest)

    def feed(self, data: bytes) -> list[Frame]:
        """Take the next bytes of the stream, any number of them.

        Returns:
            the frames that are complete now, in their order.
        """
        layout = _LAYOUT_BY_HEADER.get(data[:4])
        if layout is not None and len(data) == layout.length and not self._rest and not crc_hqx(data, 0):
            self.frames += 1
            return [_read(layout, data)]
        return self._search(self._rest + data)

    def _search(self, data: bytes) -> list[Frame]:
        """Look for frames from the beginning of data and keep the unfinished end: the slow path."""
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
            layout = _LAYOUT_BY_HEADER.get(data[at : at + 4])
            plausible = layout is not None if version == VERSION else _MIN_LENGTH <= length <= MAX_LENGTH
            if plausible and end - at < length:
                break
            piece = data[at : at + length]
            if plausible and not crc_hqx(piece, 0):
                if layout is not None:
                    found.append(_read(layout, piece))
                else:
                    self.unknown_versions += 1
                    self.last_unknown_version = version
                at += length
                continue
            if layout is not None:
                self.crc_errors += 1
            self.bytes_skipped += 1
            at += 1
        self._rest = data[at:]
        self.frames += len(found)
        return found
