"""Playout of a run that is followed: from parcels that come now and then to a motion in even steps.

A recorder hands over what it has every 50 ms, in which an arm moves in jerks. So its poses, and the bodies that it
meets, are shown a little late, by a clock that runs as evenly as the computer's own. Only these: what touches and what
the guard does is shown at once.
"""

from __future__ import annotations

__all__ = ["DELAY", "Playout"]

DELAY = 0.07  #: s by which poses and bodies are late: a parcel of the recorder's, and the wait for the next
_FORGETS = 0.01  # s for each second; by which the offset of the two clocks may shrink


class Playout:
    """Playout of one run.

    The offset of the run's clock from this computer's is the largest that was seen: of the parcel that was on its way
    for the shortest time.
    """

    def __init__(self) -> None:
        self._offset: float | None = None
        self._looked = 0.0

    def time(self, newest: float, now: float) -> float:
        """Return the time of the run that is to be shown; it never runs back, and never ahead of what has come.

        Args:
            newest: time of the newest that has come, on the run's clock [s].
            now: the clock [s].
        """
        offset = newest - now
        if self._offset is not None:
            offset = max(offset, self._offset - _FORGETS * (now - self._looked))
        self._offset, self._looked = offset, now
        return min(newest, now + offset - DELAY)
