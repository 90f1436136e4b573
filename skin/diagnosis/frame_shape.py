"""Shape of frames: what is wrong with all of them, or what damages some of them on the way."""

from __future__ import annotations

import itertools
from binascii import crc_hqx
from collections import Counter
from collections.abc import Sequence
from statistics import median_high

from coneskin.core.finding import Finding
from coneskin.skin.wire import FRAME_LENGTHS, MAX_LENGTH, SYNC, VERSION

from .capture import FoundFrames, count_frames, printable_share, short_hex, sync_places
from .cause import Cause
from .foreign_checksum import find_checksum
from .foreign_stream import _undo_slip, first_line

_MIN_STARTS = 4  # that look like a frame's beginning
_AGREEING_SHARE = 0.6  # of them that must agree
_SAMPLE_COUNT = 48  # frames that are compared
_WIRE_BUFFERS = (32, 64)  # bytes; buffers of common libraries
_LAST_FIELD = 2  # bytes of the CRC
_MIN_LENGTH, _MAX_PERIOD = 8, 80
_PERIODIC_SHARE = 0.35  # share of the bytes that equal the one a frame before


def find_shape(data: bytes) -> Finding | None:
    """Say what is wrong with frames that begin with the right sync, none of which is valid."""
    places, period, share = sync_places(data)
    if len(places) < _MIN_STARTS:
        return None
    headers = Counter(data[at + 2 : at + 4] for at in places if at + 4 <= len(data))
    header, count = headers.most_common(1)[0]
    if count < _AGREEING_SHARE * headers.total() or len(header) < 2:
        return None
    version, length = header
    if share < _AGREEING_SHARE:
        if length not in FRAME_LENGTHS:
            return None
        period = length  # the frames of one length may have something between them
    frames = [data[at : at + period] for at in places if data[at + 2 : at + 4] == header and at + period <= len(data)]
    frames = frames[-_SAMPLE_COUNT:]
    if version == VERSION and length in FRAME_LENGTHS:
        if period == length:
            return find_padding(frames) or find_checksum(frames)
        return _wrong_size(frames, length, period)
    if length == VERSION and version in FRAME_LENGTHS:
        return Cause.HEADER_SWAPPED.found(f"bytes 2 and 3 are {version} and {length}: version and length are exchanged")
    if version == VERSION and period in FRAME_LENGTHS:
        return Cause.LENGTH_BYTE.found(f"byte 3 says {length} bytes, but the frames are {period} bytes long")
    if version == VERSION:
        return _wrong_size(frames, length, period)
    return Cause.VERSION.found(f"the version in byte 2 is {version}; version {VERSION} can be read")


def _wrong_size(frames: Sequence[bytes], length: int, period: int) -> Finding:
    right = length if length in FRAME_LENGTHS else min(FRAME_LENGTHS, key=lambda size: (abs(size - period), -size))
    if frames and not any(0 in frame for frame in frames) and len(frames) >= _MIN_STARTS:
        return Cause.ZEROS_LOST.found(f"the frames end after {period} bytes, and no byte of them is 0")
    if found := find_padding(frames):
        return found
    said = f"they are {period} bytes long; one has 36, 40 or 52"
    if period == right - _LAST_FIELD and (not frames or any(crc_hqx(frame, 0) for frame in frames[-4:])):
        return Cause.CRC_MISSING.found(f"the frames come without a checksum: {said}")
    if period in _WIRE_BUFFERS and period < right:
        return Cause.CUT_AT_BUFFER.found(f"the frames are cut: {said}")
    if period < right:
        return Cause.FRAME_SIZE.found(f"the frames are too short, a field is missing: {said}")
    return Cause.FRAME_SIZE.found(f"the frames are too long: {said}")


def find_padding(frames: Sequence[bytes]) -> Finding | None:
    """Find the two bytes that a compiler puts before the clock of a struct that is not packed."""
    whole = [frame for frame in frames if len(frame) >= 16]
    if len(whole) < _MIN_STARTS:
        return None
    stands = Counter(frame[10:12] for frame in whole).most_common(1)[0][1] >= 0.9 * len(whole)
    clocks = [int.from_bytes(frame[12:16], "little") for frame in whole]
    steps = [(b - a) & 0xFFFFFFFF for a, b in itertools.pairwise(clocks)]
    middle = median_high(steps)
    steady = sum(0.7 * middle <= step <= 1.3 * middle for step in steps) >= 0.7 * len(steps)
    if stands and steady and 0 < middle < 1 << 24:
        size = len(whole[0])  # of the struct, with two bytes more at its end
        right = max((length for length in FRAME_LENGTHS if length < size), default=FRAME_LENGTHS[0])
        what = f"the struct is padded: two bytes stand before the clock, and frames have {size} bytes, not {right}"
        return Cause.PADDING.found(what)
    return None


def find_foreign_sync(data: bytes) -> Finding | None:
    """Find frames that begin with other bytes, by their regularity."""
    places, period, share = sync_places(data, SYNC[::-1])
    if len(places) >= _MIN_STARTS and share >= _AGREEING_SHARE and _MIN_LENGTH <= period <= MAX_LENGTH:
        return Cause.SYNC_SWAPPED.found("the sync bytes come as 3A C5, exchanged")
    period = _find_period(data)
    if not period:
        return None
    columns = [Counter(data[place::period]) for place in range(period)]
    fixed = [(*column.most_common(1)[0], column.total()) for column in columns]
    for phase in range(period):
        head = [fixed[(phase + place) % period] for place in range(4)]
        constant = all(count >= 0.9 * total for _, count, total in head)
        first, second, version, length = (byte for byte, _, _ in head)
        if constant and version == VERSION and length in FRAME_LENGTHS and period == length:
            return Cause.SYNC_OTHER.found(f"the frames begin with {short_hex(bytes((first, second)))}, not C5 3A")
    return None


def _find_period(data: bytes) -> int:
    """Return the distance at which the bytes repeat themselves most [bytes]; 0 where they do not."""
    piece = data[-4096:]
    best, period = 0.0, 0
    for step in range(_MIN_LENGTH, _MAX_PERIOD):
        pairs = len(piece) - step
        if pairs <= step:
            break
        same = sum(map(int.__eq__, piece, piece[step:])) / pairs
        if same > best + 0.02:  # a multiple of the period repeats as well
            best, period = same, step
    return period if best >= _PERIODIC_SHARE else 0


_FLOW_BYTES = {0x11, 0x13}
_MAX_REPAIRS = 24  # damaged frames that are looked at
_LOST_SHARE = 0.005  # share of the bytes that may be lost without a word
_SAME_SHARE = 0.8  # share of what lies between frames that must be the same


def find_damage(data: bytes, found: FoundFrames) -> Finding | None:
    """Say what damages the frames of a capture, or stands between them; None where hardly anything does."""
    if found.covered >= 1.0 - _LOST_SHARE or not found.gaps:
        return None
    share = f"{100.0 * (1.0 - found.covered):.1f} % of the bytes are no frames"
    for cause, words, undo in (
        (Cause.NEWLINES, "each 0A in a frame has become 0D 0A", lambda data: data.replace(b"\r\n", b"\n")),
        (Cause.SLIP, "the frames are wrapped in SLIP", _undo_slip),
    ):
        frames, covered = count_frames(undo(data))
        if frames > len(found.frames) and covered > found.covered + 0.5 * (1.0 - found.covered):
            return cause.found(f"{share}: {words}")
    between = b"".join(found.gaps)
    if SYNC not in between:
        gap, count = Counter(found.gaps).most_common(1)[0]
        if count >= _SAME_SHARE * len(found.gaps) and len(gap) <= 8:
            return Cause.EXTRA_BYTES.found(f"{short_hex(gap)} stands between the frames")
    broken = _broken_frames(found.gaps)
    if (repaired := _repair(broken)) is not None:
        return repaired[0].found(f"{share}: {repaired[1]}")
    whole = [piece for piece in broken if len(piece) == piece[3]]
    if sum(len(piece) < piece[3] for piece in broken) > 0.5 * len(broken):
        return Cause.BYTES_LOST.found(f"{share}: frames are shorter than they say")
    if len(whole) >= 8 and len(whole) > 2 * len(found.frames):
        named = find_checksum(whole)
        if named.item not in (Cause.CRC_UNKNOWN.key, Cause.CRC_CONSTANT.key):
            return named
    if whole and len(whole) >= 0.5 * len(found.gaps):
        return Cause.DAMAGED.found(f"{share}: {len(whole)} frames of the right length have a wrong checksum")
    if printable_share(between) > 0.9:
        return Cause.TEXT.found(f"text stands between the frames: {first_line(between)!r}")
    return Cause.DAMAGED.found(f"{share}, such as {short_hex(max(found.gaps, key=len))}")


def _broken_frames(gaps: Sequence[bytes]) -> list[bytes]:
    """Return the pieces that begin as a frame does, each up to the next such beginning."""
    pieces = [gap[at:end] for gap in gaps for at, end in itertools.pairwise([*sync_places(gap)[0], len(gap)])]
    return [piece for piece in pieces if len(piece) >= 8 and piece[2] == VERSION and piece[3] in FRAME_LENGTHS]


def _repair(broken: Sequence[bytes]) -> tuple[Cause, str] | None:
    """Find which byte is missing in frames that are one byte too short."""
    short = [piece for piece in broken if len(piece) == piece[3] - 1][:_MAX_REPAIRS]
    if len(short) < 2 or len(short) < 0.5 * min(len(broken), _MAX_REPAIRS):
        return None
    votes: Counter[int] = Counter()
    for piece in short:
        votes.update(set(_missing_bytes(piece)))
    in_flow = sum(votes[byte] for byte in _FLOW_BYTES)
    (byte, count), *_ = votes.most_common(1) or [(-1, 0)]
    if in_flow >= 0.7 * len(short) and count <= in_flow:
        return Cause.FLOW_CONTROL, "the bytes 11 and 13 are missing from the frames"
    if byte == 0 and count >= 0.7 * len(short):
        return Cause.ZEROS_LOST, "the byte 00 is missing from the frames"
    return Cause.BYTES_LOST, "frames are one byte too short"


def _missing_bytes(piece: bytes) -> list[int]:
    """Return each byte that makes the checksum right where it is put in somewhere."""
    return [
        byte
        for place in range(2, len(piece) + 1)
        for byte in (0x11, 0x13, 0x00, 0x0A, 0x0D)
        if crc_hqx(piece[:place] + bytes((byte,)) + piece[place:], 0) == 0
    ]
