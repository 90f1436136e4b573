"""Manual reset: a person has looked at a stop, and lets the arm move again; the guard accepts it or says why not."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from coneskin.core.errors import RobotRefused
from coneskin.robot.guard.signals.journal import EventName, GuardEvent

from .event_log import EventLog
from .outcome import reasons

__all__ = ["ManualReset", "latched_stop"]

_ANSWERS = (EventName.ACTIVATED, EventName.REFUSED)


class ManualReset:
    """Resets of one run, each of which has a number.

    Args:
        send: to the guard.
    """

    def __init__(self, send: Callable[[bytes], object]) -> None:
        self._send = send
        self._number = 0

    def request(self, log: EventLog, stop: int, timeout: float, describe_line: Callable[[Sequence[str]], str]) -> None:
        """Ask for a reset, and wait for the answer.

        Args:
            log: of the run.
            stop: number of the stop that the person has looked at; 0 where there is none.
            timeout: for the guard to become active [s].
            describe_line: says what is wrong with the skin's line, given the reasons.

        Raises:
            RobotRefused: something is still wrong; the reasons are listed.
        """
        if stop == 0:
            raise RobotRefused("reset refused: no stop that has latched the arm was reported to this program")
        self._number += 1
        request, seen = self._number, len(log.events)
        self._send(b"reset %d %d" % (stop, request))
        event = log.wait_for(_ANSWERS, timeout, seen, lambda event: event.details.get("request") == request)
        if event is None or event.name != EventName.ACTIVATED:
            listed = ["the guard did not become active in time"] if event is None else reasons(event)
            line = describe_line(listed)
            raise RobotRefused(f"reset refused: {'; '.join([*([line] if line else []), *listed])}")


def latched_stop(events: Sequence[GuardEvent]) -> int:
    """Return the number of the newest stop that has latched the arm; 0 before the first."""
    return next((int(event.details["stop"]) for event in reversed(events) if event.name == EventName.LATCHED), 0)
