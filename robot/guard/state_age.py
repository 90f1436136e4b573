"""Age of a controller's states: whether they stay away, repeat themselves, or come later than they may. Pure.

A queue in the network that fills lets states come later and later, and no time between two of them is long. A host that
was held up reads many late ones at once and then the newest, which is none.

A state is read late when the host is busy, never early. So the smallest difference of the two clocks over some seconds
is the true one but for the quickest path through the network (0.1 to 0.3 ms), and drift has no time to show.
"""

from __future__ import annotations

import math

from coneskin.robot.driver.values import ControllerState

__all__ = ["StateAge"]

_OFFSET_WINDOW = 5.0  # s; at 100 ppm the clocks part by 1 ms in two of them


class _ControllerClock:
    """Map from the controller's time to the host's monotonic time."""

    def __init__(self) -> None:
        self._before = self._now = math.inf  # smallest differences of the last window and of this one
        self._since = self._newest = -math.inf

    def measured_at(self, host: float, controller: float) -> float:
        """Take the two times of a state that was just read and return when it was measured.

        Args:
            host: when it was read [s].
            controller: its own time [s]. Where it runs backwards the controller has started anew.

        Returns:
            host time at which it was measured [s], never later than ``host``.
        """
        if controller < self._newest:
            self._before = self._now = math.inf
            self._since = controller
        elif controller - self._since > _OFFSET_WINDOW:
            self._before, self._now, self._since = self._now, math.inf, controller
        self._newest = controller
        difference = host - controller
        if difference < self._now:
            self._now = difference
        smallest = self._now if self._now < self._before else self._before
        return min(controller + smallest, host)


_MAX_SUPERVISION_LAG = 0.05  # s; of states that show where a motion away has got, whatever silence is allowed
_LAG_TIME = 0.02  # s for which they must be as late


class StateAge:
    """Age of the states of one controller.

    Args:
        limit: longest age of the newest state [s].
    """

    def __init__(self, limit: float) -> None:
        self._limit = limit
        self._clock = _ControllerClock()
        self._controller_time = -math.inf  # the latest so far
        self._fresh = -math.inf  # host time of the newest state that was a new one
        self._late_since = self._very_late_since = math.inf  # host times of the first state that came so late

    def feed(self, state: ControllerState) -> float:
        """Take a state that was just read, and return the host time at which it was measured [s]."""
        measured_at = self._clock.measured_at(state.time, state.controller_time)
        if state.controller_time > self._controller_time:
            self._controller_time, self._fresh = state.controller_time, state.time
            lag = state.time - measured_at
            self._late_since = min(self._late_since, state.time) if lag > _MAX_SUPERVISION_LAG else math.inf
            self._very_late_since = min(self._very_late_since, state.time) if lag > self._limit else math.inf
        return measured_at

    def silent(self, now: float) -> bool:
        """Tell whether the newest state is too old at a host time [s]. One whose time does not go on is."""
        return now - self._fresh > self._limit

    def trouble(self, now: float) -> str:
        """Return what is wrong with how the states come, at a host time [s]. Empty where nothing is."""
        limit = f"{1e3 * self._limit:g} ms"
        if self.silent(now):
            return f"the controller has sent no state for {limit}"
        if now - self._very_late_since > self._limit:
            causes = "its network is congested, or it does not keep up with its clock, as a simulator may not"
            return f"the controller's states come more than {limit} late: {causes}"
        return ""

    def stale(self, now: float) -> str:
        """Return why they cannot supervise a motion away at a host time [s]. Empty where they can."""
        if now - self._late_since <= _LAG_TIME:
            return ""
        limit = f"{1e3 * _MAX_SUPERVISION_LAG:.0f} ms"
        return f"the controller's states come more than {limit} late, too late to move away by"
