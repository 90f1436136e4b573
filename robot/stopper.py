"""Stops an arm by one way after the other until it is measured to stand, when its guard is gone.

The first stop goes out by whatever port is open, before anything that may block; what is missing is opened meanwhile,
the reader of the state too. Without any state nobody can see the arm stand: then a stop ends after a while, and whoever
keeps watch (``Vigil``) repeats it.
"""

from __future__ import annotations

import math
import select
import time
from collections.abc import Callable
from contextlib import suppress

from coneskin.errors import ConeSkinError

from .foreign import ForeignStops
from .state_reader import ControllerState, StateReader, decode_state
from .stop_watch import PROTECTED, StopWatch, Way
from .watch import Watch

__all__ = ["Stopper"]

_WAYS = (Way.SCRIPT, Way.DASHBOARD, Way.PROTECTIVE)
_REOPEN = 0.05  # s between two looks whether a connection is gone and can be opened again
_BLIND = 2.0  # s without a state after which a stop is given up, and the reader opened anew
_CONNECT = 0.5  # s that opening the reader may take


def _never() -> bool:
    return False


class Stopper:
    """See the module.

    Args:
        stops: open, or to be opened as far as that is possible.
        watch: the limits.
        deceleration: of the stop [rad/s2].
        reader: of the controller's state, open; None where there is none yet.
        clock: monotonic seconds.
    """

    def __init__(
        self,
        stops: ForeignStops,
        watch: Watch,
        deceleration: float,
        reader: StateReader | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._stops = stops
        self._watch = watch
        self._deceleration = deceleration
        self._reader = reader
        self._clock = clock
        self._state: ControllerState | None = None  # the newest
        self._fresh = -math.inf  # when it came
        self._opened = -math.inf if reader is None else clock()  # when the reader was last opened, or tried
        self._quiet_until = -math.inf

    @property
    def reader(self) -> StateReader | None:
        """What tells of new states; None while there is none."""
        return self._reader

    def blind(self) -> bool:
        """Whether no new state has come for so long that nobody knows what the arm does."""
        return self._clock() - self._fresh > max(2.0 * self._watch.arm_silence, _CONNECT)

    def stop(self, deceleration: float | None = None, over: Callable[[], bool] = _never) -> bool:
        """Stop the arm.

        Args:
            deceleration: of the stop [rad/s2]; by default the stopper's.
            over: asked all the time; True ends the stop as it is.

        Returns:
            whether the arm was seen standing. While states show that it moves, the stop is not given up.
        """
        gentle = self._deceleration if deceleration is None else deceleration
        watch = self._watch
        self.read()
        if not self._use(Way.SCRIPT, gentle):
            self._use(Way.DASHBOARD, gentle)
        now = start = self._clock()
        speed = None if self._state is None or self.blind() else self._state.speed
        budget = watch.stop_budget(speed or 0.0, gentle)
        stop = StopWatch(now, speed, _WAYS, watch.escalate, budget, watch.standstill, watch.arm_silence)
        look_at = now
        while stop.standing_at is None and now - max(start, self._fresh) < _BLIND and not over():
            if now >= look_at:
                self.mend(gentle)
                look_at = self._clock() + _REOPEN
            select.select([] if self._reader is None else [self._reader], [], [], 0.002)
            self.read(stop)
            now = self._clock()
            for way in stop.next_ways(now):
                self._use(way, gentle)
        return stop.standing_at is not None

    def repeat(self) -> None:
        """Send a gentle stop once more, by both ports, without looking what becomes of it."""
        self.mend(self._deceleration)
        for way in (Way.SCRIPT, Way.DASHBOARD):
            self._use(way, self._deceleration)

    def mend(self, deceleration: float) -> None:
        """Open what is missing: where a way to stop comes back, a stop with this deceleration goes through it."""
        if self._stops.reopen():  # what was sent to the old ones may be lost
            self._use(Way.SCRIPT, deceleration)
        now = self._clock()
        if now - max(self._fresh, self._opened) < (_BLIND if self._reader is not None else _CONNECT):
            return
        self._close_reader()
        reader = StateReader(self._stops.host, _CONNECT)
        with suppress(ConeSkinError):  # the next look tries again
            self._reader = reader.__enter__()
        self._opened = self._clock()

    def read(self, stop: StopWatch | None = None) -> list[ControllerState]:
        """Take the states that have come, oldest first; never waits."""
        states = []
        try:
            for payload in [] if self._reader is None else self._reader.read():
                state = decode_state(self._clock(), payload)
                states.append(state)
                if self._state is None or state.controller_time != self._state.controller_time:
                    self._fresh = state.time
                    if stop is not None:
                        stop.sample(state.time, state.speed)
                self._state = state
        except ConeSkinError:  # whoever else reads says so; here only the stops are left, until it can be opened again
            self._close_reader()
        for _, sock in self._stops.drain():
            sock.close()
        return states

    def close(self) -> None:
        """Close all connections; may be called again."""
        self._close_reader()
        self._stops.close()

    def _close_reader(self) -> None:
        if self._reader is not None:
            self._reader.close()
            self._reader = None

    def _use(self, way: Way, deceleration: float) -> bool:
        """Send a stop, unless it would replace the program of a protective stop that has only just been sent.

        Returns:
            whether this way is there.
        """
        now = self._clock()
        if now < self._quiet_until:
            return True
        taken = self._stops.use(way, deceleration)
        if taken and way is Way.PROTECTIVE:
            self._quiet_until = now + PROTECTED * self._watch.escalate
        return taken
