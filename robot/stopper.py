"""Stops an arm by one way after the other until it is measured to stand, and waits for it: when the guard is gone."""

from __future__ import annotations

import select
import time
from collections.abc import Callable

from coneskin.errors import ConeSkinError

from .foreign import ForeignStops
from .state_reader import StateReader, decode_state
from .stop_watch import StopWatch, Way
from .watch import Watch

__all__ = ["Stopper"]

WAYS = (Way.SCRIPT, Way.DASHBOARD, Way.PROTECTIVE)
_REOPEN = 0.05  # s between two looks whether a connection is gone and can be opened again
_LONGEST = 5.0  # s that a stop may take before it is given up


class Stopper:
    """See the module.

    Args:
        stops: open.
        reader: of the controller's state, open.
        watch: the limits.
        deceleration: of the stop [rad/s2].
        clock: monotonic seconds.
    """

    def __init__(
        self,
        stops: ForeignStops,
        reader: StateReader,
        watch: Watch,
        deceleration: float,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._stops = stops
        self._reader: StateReader | None = reader
        self._watch = watch
        self._deceleration = deceleration
        self._clock = clock
        self._speed: float | None = None

    @property
    def reader(self) -> StateReader | None:
        """What tells of new states; None once it is gone."""
        return self._reader

    def stop(self) -> bool:
        """Stop the arm; whether it was seen standing."""
        now = start = self._clock()
        reopen_at = now + _REOPEN
        self.read()
        self._stops.reopen()
        watch, budget = self._watch, (self._speed or 0.0) / self._deceleration + 4.0 * self._watch.escalate
        stop = StopWatch(now, self._speed, WAYS, watch.escalate, budget, watch.standstill, watch.arm_silence)
        self._stops.use(WAYS[0], self._deceleration)
        while stop.standing_at is None and now - start < _LONGEST:
            select.select([self._reader] if self._reader else [], [], [], 0.002)
            self.read(stop)
            now = self._clock()
            for way in stop.next_ways(now):
                self._stops.use(way, self._deceleration)
            if now >= reopen_at:
                reopen_at = now + _REOPEN
                if self._stops.reopen():  # what was sent to the old ones may be lost
                    self._stops.use(WAYS[0], self._deceleration)
        return stop.standing_at is not None

    def read(self, stop: StopWatch | None = None) -> None:
        """Take the states that have come; never waits."""
        try:
            payloads = [] if self._reader is None else self._reader.read()
            for payload in payloads:
                state = decode_state(self._clock(), payload)
                self._speed = state.speed
                if stop is not None:
                    stop.sample(state.time, state.speed)
        except ConeSkinError:
            self._reader = None  # whoever else reads says so; here only the stops are left
        for _, sock in self._stops.drain():
            sock.close()
