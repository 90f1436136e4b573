"""Heartbeat monitor: it notices when a process beside the guard falls silent, whether or not it is needed now. Pure."""

from __future__ import annotations

import math
from collections.abc import Mapping

__all__ = ["HELD_UP", "HeartbeatMonitor"]

HELD_UP = 0.02  #: s between two looks, from which on the guard itself was held up


class HeartbeatMonitor:
    """Ages of the heartbeats of several processes.

    While the guard itself is held up it hears nobody: that time is nobody's silence. What came meanwhile is read next.
    So only the longest time counts, not the sum: a guard that is held up again and again reads in between.

    Args:
        limits: longest silence of each process [s], by its name; one that is not named is not monitored.
    """

    def __init__(self, limits: Mapping[str, float]) -> None:
        self._limits = dict(limits)
        self._heard: dict[str, float] = {}
        self._held_up: dict[str, float] = {}  # the longest time, since then [s]
        self._looked: float | None = None

    def note(self, process: str, now: float) -> None:
        """Note a heartbeat at a host time [s]."""
        self._heard[process], self._held_up[process] = now, 0.0

    def forget(self, process: str) -> None:
        """Monitor a process no longer: it is known to be gone."""
        self._limits.pop(process, None)

    def quiet_until(self) -> float:
        """Return the host time before which nobody becomes silent [s], whether or not more is heard."""
        if not self._heard.keys() >= self._limits.keys():
            return -math.inf
        ends = (self._heard[name] + self._held_up[name] + limit for name, limit in self._limits.items())
        return min(ends, default=math.inf)

    def skip_to(self, now: float) -> None:
        """Note a look at a host time [s] before which it was looked often, and nobody was silent."""
        self._looked = now

    def silent(self, now: float) -> dict[str, str]:
        """Return what is wrong with each process that is silent; empty where all are heard. To be asked continuously.

        Args:
            now: host time [s].
        """
        if self._looked is not None and (held_up := now - self._looked) > HELD_UP:
            self._held_up = {process: max(held_up, longest) for process, longest in self._held_up.items()}
        self._looked = now
        found = {}
        for process, limit in self._limits.items():
            heard = self._heard.get(process)
            if heard is None:
                found[process] = f"{process}: no heartbeat yet"
            elif now - heard - self._held_up[process] > limit:
                found[process] = f"{process}: no heartbeat for {1e3 * limit:.0f} ms: it hangs, or is frozen"
        return found
