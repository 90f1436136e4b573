"""Shape of what looks like frames and is not valid: sync, header, length, padding, and then the checksum."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Sequence

from coneskin.skin.wire import MAX_LENGTH, SYNC, VERSIONS

from .capture import LENGTHS, short_hex, sync_places
from .cause import Cause, Diagnosis
from .checksum import crc16, find_checksum

__all__ = ["find_foreign_sync", "find_shape"]

_MIN_STARTS = 4  # that look like a frame's beginning
_SHARE = 0.6  # of them that must agree
_SAMPLES = 48  # frames that are compared
_WIRE_BUFFERS = (32, 64)  # bytes; buffers of common libraries
_RIGHT = 0x1021
_LAST_FIELD = 2  # bytes of the CRC
_MIN_LENGTH, _MAX_PERIOD = 8, 80
_PERIODIC = 0.35  # share of the bytes that equal the one a frame before
_HEADER_PLACES = (2, 3)


def find_shape(data: bytes) -> Diagnosis | None:
    """Say what is wrong with frames that begin with the right sync, none of which is valid."""
    places, period, share = sync_places(data)
    if len(places) < _MIN_STARTS:
        return None
    headers = Counter(data[at + 2 : at + 4] for at in places if at + 4 <= len(data))
    header, count = headers.most_common(1)[0]
    if count < _SHARE * headers.total() or len(header) < 2:
        return None
    version, length = header
    frames = [data[at : at + period] for at in places if data[at + 2 : at + 4] == header and at + period <= len(data)]
    if share < _SHARE:
        # the frames of one length may have something between them
        period = length if length in LENGTHS else 0
        frames = [
            data[at : at + period] for at in places if data[at + 2 : at + 4] == header and at + period <= len(data)
        ]
        if not period:
            return None
    frames = frames[-_SAMPLES:]
    if version in VERSIONS and LENGTHS.get(length) == version:
        if period == length:
            return _find_padding(frames, length) or find_checksum(frames)
        return _wrong_size(frames, version, length, period)
    if (length, version) in {(1, 36), (2, 40), (2, 52)}:
        what = f"bytes 2 and 3 are {version} and {length}: version and length are exchanged"
        return Diagnosis(Cause.HEADER_SWAPPED, what)
    if version in VERSIONS and LENGTHS.get(period) == version:
        what = f"byte 3 says {length} bytes, but the frames of version {version} are {period} bytes long"
        return Diagnosis(Cause.LENGTH_BYTE, what)
    if version in VERSIONS:
        return _wrong_size(frames, version, length, period)
    what = f"the version in byte 2 is {version}; versions {' and '.join(map(str, VERSIONS))} can be read"
    return Diagnosis(Cause.VERSION, what)


def _wrong_size(frames: Sequence[bytes], version: int, length: int, period: int) -> Diagnosis:
    """Name why frames are not as long as they should be."""
    wanted = [size for size, of_version in LENGTHS.items() if of_version == version]
    right = length if length in wanted else min(wanted, key=lambda size: abs(size - period))
    if frames and not any(0 in frame for frame in frames) and len(frames) >= _MIN_STARTS:
        what = f"the frames end after {period} bytes, and no byte of them is 0"
        return Diagnosis(Cause.ZEROS_LOST, what)
    if found := _find_padding(frames, right):
        return found
    said = f"they are {period} bytes long; one of version {version} has {' or '.join(map(str, wanted))}"
    if period == right - _LAST_FIELD and not _valid_alone(frames):
        return Diagnosis(Cause.CRC_MISSING, f"the frames come without a checksum: {said}")
    if period in _WIRE_BUFFERS and period < right:
        return Diagnosis(Cause.CUT_AT_BUFFER, f"the frames are cut: {said}")
    if period < right:
        return Diagnosis(Cause.FRAME_SIZE, f"the frames are too short, a field is missing: {said}")
    return Diagnosis(Cause.FRAME_SIZE, f"the frames are too long: {said}")


def _valid_alone(frames: Sequence[bytes]) -> bool:
    """Tell whether the frames have a right checksum for the length that they have."""
    return bool(frames) and all(crc16(frame, _RIGHT) == 0 for frame in frames[-4:])


def _find_padding(frames: Sequence[bytes], length: int) -> Diagnosis | None:
    """Find the two bytes that a compiler puts before the clock of a struct that is not packed."""
    whole = [frame for frame in frames if len(frame) >= 16]
    if len(whole) < _MIN_STARTS:
        return None
    stands = Counter(frame[10:12] for frame in whole).most_common(1)[0][1] >= 0.9 * len(whole)
    clocks = [int.from_bytes(frame[12:16], "little") for frame in whole]
    steps = sorted((b - a) & 0xFFFFFFFF for a, b in itertools.pairwise(clocks))
    middle = steps[len(steps) // 2]
    steady = sum(0.7 * middle <= step <= 1.3 * middle for step in steps) >= 0.7 * len(steps)
    if stands and steady and 0 < middle < 1 << 24:
        size = len(whole[0])
        what = f"the struct is padded: two bytes stand before the clock, and frames have {size} bytes, not {length}"
        return Diagnosis(Cause.PADDING, what)
    return None


def find_foreign_sync(data: bytes) -> Diagnosis | None:
    """Find frames that begin with other bytes, by their regularity."""
    for sync, cause, words in ((SYNC[::-1], Cause.SYNC_SWAPPED, "the sync bytes come as 3A C5, exchanged"),):
        places, period, share = sync_places(data, sync)
        if len(places) >= _MIN_STARTS and share >= _SHARE and _MIN_LENGTH <= period <= MAX_LENGTH:
            return Diagnosis(cause, words)
    period = _find_period(data)
    if not period:
        return None
    columns = [Counter(data[place::period]) for place in range(period)]
    fixed = [column.most_common(1)[0] for column in columns]
    total = [column.total() for column in columns]
    for phase in range(period):
        version_at, length_at = ((phase + place) % period for place in _HEADER_PLACES)
        version, length = fixed[version_at][0], fixed[length_at][0]
        constant = all(fixed[(phase + k) % period][1] >= 0.9 * total[(phase + k) % period] for k in range(4))
        if constant and LENGTHS.get(length) == version and period == length:
            sync = bytes(fixed[(phase + k) % period][0] for k in range(2))
            return Diagnosis(Cause.SYNC_OTHER, f"the frames begin with {short_hex(sync)}, not C5 3A")
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
    return period if best >= _PERIODIC else 0
