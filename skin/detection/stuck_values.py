"""Values that stand still though each has noise in a working device: such a current would hide an open wire."""

from __future__ import annotations

from typing import TYPE_CHECKING

from coneskin.skin.wire import Frame

if TYPE_CHECKING:  # for replays only
    from .quiet_frames import QuietFrames

__all__ = ["StuckValues"]


class StuckValues:
    """How long each lively value of a sensor's frames has stood still.

    Args:
        most: frames in a row with the same value that are a fault; 0: none is.
    """

    __slots__ = ("_last", "_most", "_still")

    def __init__(self, most: int) -> None:
        self._most = most
        self._last: tuple[int, ...] = (-1, -1, -1, -1, -1)
        self._still = [0, 0, 0, 0, 0]

    def take(self, frame: Frame) -> bool:
        """Take a frame; tell whether one of its values is stuck."""
        if not self._most:
            return False
        counts = (
            *(frame.radial_current, frame.angular_current),
            *(frame.touch_supply, frame.radial_supply, frame.angular_supply),
        )
        still, last = self._still, self._last
        for k in (0, 1, 2, 3, 4):
            still[k] = still[k] + 1 if counts[k] == last[k] else 0
        self._last = counts
        return max(still) >= self._most

    def learn(self, frames: QuietFrames, begin: int, end: int) -> int:
        """Take frames in a row; return how many are taken: none where a value may be stuck."""
        if not self._most:
            return end - begin
        last, still = end - 1, []
        for k, (values, repeats) in enumerate(zip(frames.lively, frames.repeats, strict=True)):
            here = repeats[last]
            if here >= last - begin:  # it has had this value since the first frame
                here = last - begin + (self._still[k] + 1 if values[begin] == self._last[k] else 0)
            still.append(here)
        longest = max(max(self._still) + end - begin, max(max(repeats[begin:end]) for repeats in frames.repeats))
        if longest >= self._most:
            return 0
        self._still = still
        self._last = tuple([values[last] for values in frames.lively])
        return end - begin
