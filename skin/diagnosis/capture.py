"""Capture: the newest bytes of a line, each with the time at which it came."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

__all__ = ["Capture", "CaptureWindow"]


@dataclass(frozen=True, slots=True)
class Capture:
    """Bytes of a line in pieces, as they were read.

    Attributes:
        pieces: (host clock [s], bytes), in their order.
        now: host clock when the capture ends [s].
        timed: the times say something; False for bytes from a file.
        since: host clock when the listening began [s].
    """

    pieces: Sequence[tuple[float, bytes]]
    now: float
    timed: bool = True
    since: float = 0.0

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

    def arrivals(self, offsets: Sequence[int]) -> list[float]:
        """Return when the bytes at these offsets came [s]."""
        ends = list(accumulate(len(piece) for _, piece in self.pieces))
        last = len(ends) - 1
        return [self.pieces[min(bisect_right(ends, offset), last)][0] for offset in offsets]


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

    def add(self, data: bytes, now: float) -> None:
        """Take the next bytes, which came at a host time [s]."""
        pieces = self._pieces
        pieces.append((now, data))
        self._held += len(data)
        while len(pieces) > 1 and (pieces[0][0] < now - self._span or self._held > self._size):
            self._held -= len(pieces.popleft()[1])

    def capture(self, now: float, timed: bool = True) -> Capture:
        """Return what is kept at a host time [s]."""
        return Capture(tuple(self._pieces), now, timed, self._since)
