"""Playback of a recording, and playout of a run that is followed. Pure: the time is an argument.

A recorder hands over what it has every 50 ms, in which an arm moves in jerks. So the poses of a followed run, and the
bodies that the arm meets, are shown a little late, by a clock that runs as evenly as the computer's own. What touches
and what the guard does is shown at once.
"""

from __future__ import annotations

import math

SPEEDS = (0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)  #: times the recorded speed


class Playback:
    """Playback of a stretch of time.

    Args:
        since: where it begins [s].
        until: where it ends.

    Attributes:
        time: that is shown [s].
        playing: it goes on by itself.
        speed: times the recorded one.
    """

    def __init__(self, since: float, until: float) -> None:
        self.since, self.until = since, until
        self.time = since
        self.playing = False
        self.speed = 1.0
        self._then: float | None = None

    def play(self, now: float) -> None:
        """Go on from here; from the beginning where the end is shown.

        Args:
            now: the clock [s].
        """
        if self.time >= self.until:
            self.time = self.since
        self.playing, self._then = True, now

    def pause(self) -> None:
        """Stay where it is."""
        self.playing, self._then = False, None

    def show(self, time: float) -> None:
        """Stand at a time [s], or the nearest that there is; nonsense is not followed."""
        self.pause()
        if math.isfinite(time):
            self.time = min(max(time, self.since), self.until)

    def poll(self, now: float) -> float:
        """Go on by what has passed since the last call, and return the time that is shown [s].

        Args:
            now: the clock [s].
        """
        if self.playing:
            if self._then is not None and now > self._then:
                self.time += self.speed * (now - self._then)
            self._then = now
            if self.time >= self.until:
                self.time = self.until
                self.pause()
        return self.time


DELAY = 0.07  #: s by which poses and bodies are late: a parcel of the recorder's, and the wait for the next
_OFFSET_DRIFT = 0.01  # s for each second; by which the offset of the two clocks may shrink


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
            offset = max(offset, self._offset - _OFFSET_DRIFT * (now - self._looked))
        self._offset, self._looked = offset, now
        return min(newest, now + offset - DELAY)
