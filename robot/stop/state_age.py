"""Age of a controller's states: which of them are new ones, when they were measured, and how late they come. Pure.

One definition for all who ask: for silence, for lag, and for the stop that is judged by measured speeds. A state is a
fresh one where its own time differs from that of the state before. So a controller that freezes, or a reader that
repeats itself, is silent. One whose clock is set, back or ahead, is not: its clock has stepped, which is told once.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from coneskin.robot.driver.values import ControllerState

_OFFSET_WINDOW: Final = 5.0  # s; at 100 ppm the clocks part by 1 ms in two of them
_MAX_STEP_AHEAD: Final = 0.25  # s by which a state may gain on the host's clock; more is no queue that is read out
#: s; of what shows where a motion away has got and what it presses on, states or frames, whatever silence is allowed
MAX_SUPERVISION_LAG: Final = 0.05
_LAG_TIME: Final = 0.02  # s for which they must be as late


class _StateStamp(NamedTuple):
    """What the newest state of a controller shows, and those before it have shown."""

    controller_time: float = -math.inf  # its own [s]
    fresh: bool = False  # it was a new one
    fresh_at: float = -math.inf  # host time of the newest one that was [s]
    measured_at: float = -math.inf  # host time [s]
    stepped: float = 0.0  # by how much the controller's clock had stepped before it, ahead or back [s]
    late_since: float = math.inf  # host time of the first that came too late to move away by, as all since [s]
    very_late_since: float = math.inf  # the same of those that came later than they may [s]


class StateAge:
    """Age of the states of one controller: whether they stay away, repeat themselves, or come later than they may.

    A queue in the network that fills lets states come later and later, and no time between two of them is long. A host
    that was held up reads many late ones at once and then the newest, which is none.

    A state is read late when the host is busy, never early. So the smallest difference of the two clocks over some
    seconds is the true one but for the quickest path through the network (0.1 to 0.3 ms). Drift has no time to show.

    Args:
        limit: longest age of the newest state [s].

    Attributes:
        newest: what the newest state shows.
    """

    def __init__(self, limit: float) -> None:
        self.newest = _StateStamp()
        self._limit = limit
        #: smallest differences of the clocks in the last window and in this one, controller's time at its begin [s]
        self._window = math.inf, math.inf, -math.inf

    def feed(self, state: ControllerState) -> float:
        """Take a state that was just read, and return the host time at which it was measured [s], never a later one."""
        host, controller, last = state.time, state.controller_time, self.newest
        difference, stepped, fresh = host - controller, 0.0, controller != last.controller_time
        before, now, since = self._window
        if controller < last.controller_time:
            stepped = controller - last.controller_time
        elif (gained := min(now, before) - difference) > _MAX_STEP_AHEAD and gained < math.inf:
            stepped = gained
        if stepped:
            before = now = math.inf
            since = controller
        elif controller - since > _OFFSET_WINDOW:
            before, now, since = now, math.inf, controller
        now = difference if difference < now else now
        self._window = before, now, since
        measured_at = min(controller + (now if now < before else before), host)
        fresh_at, late, very_late = last.fresh_at, last.late_since, last.very_late_since
        if fresh:
            fresh_at, lag = host, host - measured_at
            late = min(late, host) if lag > MAX_SUPERVISION_LAG else math.inf
            very_late = min(very_late, host) if lag > self._limit else math.inf
        stamp = controller, fresh, fresh_at, measured_at, stepped, late, very_late
        self.newest = tuple.__new__(_StateStamp, stamp)  # quicker than _StateStamp()
        return measured_at

    def silent(self, now: float, limit: float = 0.0) -> bool:
        """Tell whether the newest fresh state is too old at a host time [s], older than a limit that may be longer."""
        return now - self.newest[2] > max(limit, self._limit)  # by its place, as every input asks

    def trouble(self, now: float) -> str:
        """Return what is wrong with how the states come, at a host time [s]. Empty where nothing is."""
        if self.silent(now):
            return f"the controller has sent no state for {1e3 * self._limit:g} ms"
        if now - self.newest[6] > self._limit:
            causes = "its network is congested, or it does not keep up with its clock, as a simulator may not"
            return f"the controller's states come more than {1e3 * self._limit:g} ms late: {causes}"
        return ""

    def stale(self, now: float) -> str:
        """Return why they cannot supervise a motion away at a host time [s]. Empty where they can."""
        if now - self.newest.late_since <= _LAG_TIME:
            return ""
        limit = f"{1e3 * MAX_SUPERVISION_LAG:.0f} ms"
        return f"the controller's states come more than {limit} late, too late to move away by"
