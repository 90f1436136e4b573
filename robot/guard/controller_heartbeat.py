"""Supervision of the program that moves an externally controlled arm: does it end where the guard falls silent? Pure.

The guard sends a count, and the program reports the count that it found at its start (``ArmDriver.heartbeat_lines``). A
report that is older than the program belongs to one before it.
"""

from __future__ import annotations

COUNT_PERIOD = 0.02  #: s between two counts
_COUNT_MASK = 0x3FFFFFFF  # counts are whole numbers of 30 bits
_COUNT_MARGIN = 5  # counts by which a report may be older than the first state that shows the program
_REPORT_TIME = 0.5  # s that a program has to report after its start
_NO_HEARTBEAT = "the controller's program does not depend on the guard's heartbeat: it goes on if the network is cut"


def heartbeat_count(now: float) -> int:
    """Return the count that is sent at a host time [s], never 0."""
    return int(now / COUNT_PERIOD) & _COUNT_MASK or 1


class ControllerHeartbeat:
    """Supervision of the programs on one controller, one after the other.

    Args:
        required: a program without the heartbeat must not move the arm.
    """

    def __init__(self, required: bool) -> None:
        self.required = required
        self._echo = 0
        self._program: tuple[float, bool] | None = None  # that runs: when it was first seen, and whether it is reported

    def feed(self, count: int) -> None:
        """Take the count that the newest program with the heartbeat found at its start."""
        self._echo = count

    def sample(self, now: float, running: bool) -> None:
        """Take whether a program runs, as read at a host time [s]."""
        if not running:
            self._program = None
        elif self._program is None:
            self._program = now, False

    def blocker(self) -> str:
        """Return why the guard must not become active. Empty where it may."""
        return _NO_HEARTBEAT if self.required and self._program is not None and not self._depends() else ""

    def trouble(self, now: float) -> str:
        """Return what is wrong with the program that runs, once for each program. Empty where nothing is."""
        began, reported = self._program or (now, True)
        if reported or self._depends() or now - began < _REPORT_TIME:
            return ""
        self._program = began, True
        return _NO_HEARTBEAT

    def _depends(self) -> bool:
        if self._program is None or not self._echo:
            return False
        first = heartbeat_count(self._program[0]) - _COUNT_MARGIN
        return (self._echo - first) & _COUNT_MASK < _COUNT_MASK // 2
