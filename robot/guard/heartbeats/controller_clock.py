"""Controller clock on the host's time: when a state was measured, whenever it came to be read. Pure.

A state is read late when the host is busy, never early. So the smallest difference of the two clocks over some seconds
is the true one but for the quickest path through the network (0.1 to 0.3 ms), and drift has no time to show.
"""

from __future__ import annotations

import math

__all__ = ["ControllerClock"]

_OFFSET_WINDOW = 5.0  # s; at 100 ppm the clocks part by 1 ms in two of them


class ControllerClock:
    """Map from the controller's time to the host's monotonic time."""

    def __init__(self) -> None:
        self._before = self._now = math.inf  # smallest differences of the last window and of this one
        self._since = self._newest = -math.inf

    def measured_at(self, host: float, controller: float) -> float:
        """Take the two times of a state that was just read and return when it was measured.

        Args:
            host: when it was read [s].
            controller: its own time [s]; where it runs backwards the controller has started anew.

        Returns:
            host time at which it was measured [s]; never later than ``host``.
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
