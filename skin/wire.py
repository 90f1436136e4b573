"""Wire format, versions 1 and 2: frames with a checksum, and a decoder that finds them in any stream.

Layout, meaning of each field and reasons are in docs/look-up/wire-format.md. In short: sync, version, length,
device, sensor, status, sequence, device clock, three phases of (guide, guide, drive current), supply, CRC. Version 1
measures the supply once in a frame; version 2 once in each phase and, in its longer form, the driven electrodes' own
potentials as well.

Bytes in, values out: nothing here knows ports, time or sensors, and noise never raises.
"""

from __future__ import annotations

from binascii import crc_hqx
from enum import IntFlag
from struct import Struct
from typing import Final, NamedTuple

__all__ = [
    "DRIVEN_HEAD",
    "FRAME_LENGTH",
    "MAX_LENGTH",
    "SYNC",
    "VERSIONS",
    "DrivenPotentials",
    "Frame",
    "FrameDecoder",
    "Status",
    "encode",
    "frame_at",
]

SYNC: Final = b"\xc5\x3a"
VERSIONS: Final = (1, 2)  #: that can be read and written
FRAME_LENGTH: Final = 36  #: bytes of a frame of version 1; one of version 2 has 40, or 52 with the driven potentials
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


class DrivenPotentials(NamedTuple):
    """Potentials of the driven electrodes themselves, each on a wire that carries no current [counts]."""

    touch_a: int  #: touch phase: electrode A, at the supply but for its lead
    touch_b: int  #: touch phase: electrode B, at the supply but for its lead
    radial_a: int  #: radial phase: electrode A
    radial_b: int  #: radial phase: electrode B
    angular_c: int  #: angular phase: electrode C
    angular_d: int  #: angular phase: electrode D


class Frame(NamedTuple):
    """One measurement of one sensor, in the numbers of the wire (integers, counts of the converter)."""

    version: int  #: of the format, 1 or 2
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
    radial_supply: int  #: the same in the radial phase; version 1 measures it once for all three
    angular_supply: int  #: the same in the angular phase
    driven: DrivenPotentials | None = None  #: version 2 only: where the leads' voltage drop is measured too


class _Layout(NamedTuple):
    """The bytes of one version in one length."""

    length: int
    read: Struct  #: sync, length and CRC are checked, not carried
    write: Struct  #: all but the CRC


def _layout(version: int, counts: int) -> tuple[bytes, _Layout]:
    write = Struct(f"<2sBBHBBHI{counts}H")
    layout = _Layout(write.size + 2, Struct(f"<2xBxHBBHI{counts}H2x"), write)
    return SYNC + bytes((version, layout.length)), layout


_SUPPLY_AT: Final = Frame._fields.index("touch_supply")
_DRIVEN_AT: Final = Frame._fields.index("driven")
(_HEADER_1, _LAYOUT_1), (_HEADER_2, _LAYOUT_2), (_HEADER_2_DRIVEN, _LAYOUT_2_DRIVEN) = (
    _layout(1, 10),
    _layout(2, 12),
    _layout(2, 18),
)
DRIVEN_HEAD: Final = _HEADER_2_DRIVEN  #: first bytes of a frame with the driven potentials
_LAYOUTS: Final = {_HEADER_1: _LAYOUT_1, _HEADER_2: _LAYOUT_2, _HEADER_2_DRIVEN: _LAYOUT_2_DRIVEN}


def encode(frame: Frame) -> bytes:
    """Turn a frame into its bytes: 36 of version 1; 40 of version 2, 52 where it has the driven potentials.

    Args:
        frame: every field within the range of its width.

    Returns:
        the bytes, CRC included.

    Raises:
        ValueError: the frame is of an unknown version, a field does not fit its width, or its version cannot carry it:
            version 1 has one supply for all phases and no driven potentials.
    """
    *values, driven = frame
    if frame.version == 1:
        if not frame.touch_supply == frame.radial_supply == frame.angular_supply or driven is not None:
            raise ValueError(f"version 1 carries one supply for all phases and no driven potentials: {frame}")
        header, layout, values = _HEADER_1, _LAYOUT_1, values[: _SUPPLY_AT + 1]
    elif frame.version != 2:
        raise ValueError(f"frame.version must be 1 or 2, got {frame.version}")
    elif driven is None:
        header, layout = _HEADER_2, _LAYOUT_2
    else:
        header, layout, values = _HEADER_2_DRIVEN, _LAYOUT_2_DRIVEN, [*values, *driven]
    try:
        body = layout.write.pack(SYNC, header[2], header[3], *values[1:])
    except Exception as error:  # struct.error names neither field nor value
        raise ValueError(f"a field does not fit its width on the wire ({error}): {frame}") from error
    return body + crc_hqx(body, 0).to_bytes(2, "big")


def frame_at(data: bytes, offset: int = 0) -> Frame | None:
    """Read the frame that starts at an offset.

    Args:
        data: at least the bytes of the frame from there.
        offset: where the frame starts [bytes].

    Returns:
        the frame, or None if no valid frame of a known version starts there.
    """
    layout = _LAYOUTS.get(data[offset : offset + 4])
    if layout is None:
        return None
    piece = data[offset : offset + layout.length]
    if len(piece) != layout.length or crc_hqx(piece, 0):
        return None
    return _read(layout, piece, 0)


def _read(layout: _Layout, data: bytes, offset: int) -> Frame:
    """Return the frame of a checked piece."""
    values = layout.read.unpack_from(data, offset)
    if layout is _LAYOUT_1:
        supply = values[_SUPPLY_AT]
        return Frame._make((*values, supply, supply, None))
    if layout is _LAYOUT_2:
        return Frame._make((*values, None))
    return Frame._make((*values[:_DRIVEN_AT], DrivenPotentials._make(values[_DRIVEN_AT:])))


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
        """Take the next bytes of the stream.

        Args:
            data: any number of bytes.

        Returns:
            the frames that are complete now, in their order.
        """
        layout = _LAYOUTS.get(data[:4])
        if layout is not None and len(data) == layout.length and not self._rest and not crc_hqx(data, 0):
            self.frames += 1
            return [_read(layout, data, 0)]
        return self._search(self._rest + data)

    @property
    def rest(self) -> bytes:
        """The bytes kept because they may be the beginning of a frame."""
        return self._rest

    def skip_to(self, frames: int, rest: bytes) -> None:
        """Go on where so many more good frames were found elsewhere, and these bytes are left."""
        self.frames += frames
        self._rest = rest

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
            layout = _LAYOUTS.get(data[at : at + 4])
            plausible = layout is not None if version in VERSIONS else _MIN_LENGTH <= length <= MAX_LENGTH
            if plausible and end - at < length:
                break
            if plausible and not crc_hqx(data[at : at + length], 0):
                if layout is not None:
                    found.append(_read(layout, data, at))
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
