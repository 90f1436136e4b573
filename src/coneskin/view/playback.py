"""Playback: which moment of a recording is shown, at which speed. Pure; the time is an argument."""

from __future__ import annotations

import math

__all__ = ["SPEEDS", "Playback"]

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

    def advance(self, now: float) -> float:
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
