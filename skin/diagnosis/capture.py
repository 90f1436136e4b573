"""Capture: the newest bytes of a line, each with the time at which it came, and the frames found in them."""

from __future__ import annotations

import itertools
import re
from bisect import bisect_right
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import NamedTuple

from coneskin.skin.wire import MAX_LENGTH, SYNC, Frame, frame_at


@dataclass(frozen=True, slots=True)
class Capture:
    """Bytes of a line in pieces, as they were read."""

    pieces: Sequence[tuple[float, bytes]]  #: (host clock [s], bytes), in their order
    now: float  #: host clock when the capture ends [s]
    timed: bool = True  #: the times say something; False for bytes from a file
    since: float = 0.0  #: host clock when the listening began [s]

    @property
    def data(self) -> bytes:
        """All bytes."""
        return b"".join(piece for _, piece in self.pieces)

    @property
    def duration(self) -> float:
        """Time from the first piece to the end [s]."""
        return self.now - self.pieces[0][0] if self.pieces else self.now - self.since

    @property
    def silence(self) -> float:
        """Time since the newest piece [s]."""
        return self.now - (self.pieces[-1][0] if self.pieces else self.since)

    def _arrivals(self, offsets: Sequence[int]) -> list[float]:
        """Return when the bytes at these offsets came [s]."""
        ends = list(accumulate(len(piece) for _, piece in self.pieces))
        last = len(ends) - 1
        return [self.pieces[min(bisect_right(ends, offset), last)][0] for offset in offsets]

    def by_sensor(self, found: FoundFrames) -> dict[tuple[int, int], tuple[list[Frame], list[float]]]:
        """Return the frames that were found in it, and when each came [s], by the numbers of device and sensor."""
        rows: dict[tuple[int, int], tuple[list[Frame], list[float]]] = {}
        for frame, time in zip(found.frames, self._arrivals(found.offsets), strict=True):
            frames, times = rows.setdefault((frame.device, frame.sensor), ([], []))
            frames.append(frame)
            times.append(time)
        return rows


class CaptureWindow:
    """The newest bytes of a line, for a while and up to a size.

    Args:
        span: how long a piece is kept [s].
        size: how many bytes are kept.
        since: host clock when the listening began [s].
    """

    def __init__(self, since: float, span: float = 2.5, size: int = 1 << 17) -> None:
        self._span, self._size, self._since = span, size, since
        self._pieces: deque[tuple[float, bytes]] = deque()
        self._held = 0

    def feed(self, data: bytes, now: float) -> None:
        """Take the next bytes, which came at a host time [s]."""
        pieces = self._pieces
        pieces.append((now, data))
        self._held += len(data)
        while len(pieces) > 1 and (pieces[0][0] < now - self._span or self._held > self._size):
            self._held -= len(pieces.popleft()[1])

    def capture(self, now: float, timed: bool = True) -> Capture:
        """Return what is kept at a host time [s]."""
        return Capture(tuple(self._pieces), now, timed, self._since)


EDGE = MAX_LENGTH  #: bytes at either end of a capture that may belong to a frame that is cut
_LENGTH_AT = 3  # offset of the length in a frame
_SHOWN_BYTES = 12  # bytes in a message
_TEXT_BYTES = frozenset({9, 10, 13, *range(32, 127)})


class FoundFrames(NamedTuple):
    """Valid frames of a capture."""

    frames: list[Frame]
    offsets: list[int]  #: where each starts [bytes]
    gaps: list[bytes]  #: what stands between two of them, where anything does
    covered: float  #: share of the bytes that belong to valid frames, the ends of the capture left out


def find_frames(data: bytes) -> FoundFrames:
    """Find the valid frames in a capture."""
    frames: list[Frame] = []
    offsets: list[int] = []
    gaps: list[bytes] = []
    lost = end = 0
    at = data.find(SYNC)
    while at >= 0:
        frame = frame_at(data, at)
        if frame is None:
            at = data.find(SYNC, at + 1)
            continue
        if at > end and frames:
            gaps.append(data[end:at])
        lost += max(0, at - max(end, EDGE if not frames else 0))
        frames.append(frame)
        offsets.append(at)
        end = at + data[at + _LENGTH_AT]
        at = data.find(SYNC, end)
    lost += max(0, len(data) - EDGE - end)
    inside = max(1, len(data) - 2 * EDGE)
    return FoundFrames(frames, offsets, gaps, 1.0 - min(1.0, lost / inside) if frames else 0.0)


def count_frames(data: bytes) -> tuple[int, float]:
    """Return how many valid frames are in the bytes, and the share of the bytes that they cover."""
    found = find_frames(data)
    return len(found.frames), found.covered


def sync_places(data: bytes, sync: bytes = SYNC) -> tuple[list[int], int, float]:
    """Find a sync word.

    Returns:
        its places, the commonest distance from one to the next [bytes] (0 where there are not two), and the share of
        the distances that are that one.
    """
    places = [found.start() for found in re.finditer(re.escape(sync), data)]
    steps = Counter(b - a for a, b in itertools.pairwise(places))
    if not steps:
        return places, 0, 0.0
    step, count = steps.most_common(1)[0]
    return places, step, count / steps.total()


def printable_share(data: bytes) -> float:
    """Return the share of the bytes that are printable ASCII, tabs or line ends."""
    return sum(byte in _TEXT_BYTES for byte in data) / len(data) if data else 0.0


def short_hex(data: bytes) -> str:
    """Return the first bytes in hexadecimal, for a message."""
    return data[:_SHOWN_BYTES].hex(" ").upper() + (" ..." if len(data) > _SHOWN_BYTES else "")


def swap_bytes(value: int, size: int = 2) -> int:
    """Return a number of so many bytes with their order turned."""
    return int.from_bytes(value.to_bytes(size, "little"), "big")
