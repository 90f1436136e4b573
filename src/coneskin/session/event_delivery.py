"""Event delivery: a program's own function is called for each event, from a thread in which it may take its time.

What waits for it has a bound. So a function that blocks delays neither the recording nor the monitoring of the guard.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable

from coneskin.robot.guard.signals.journal import EventName, GuardEvent

__all__ = ["EventDelivery"]

_BOUND = 1000  # events that wait
_CLOSE_TIMEOUT = 2.0  # s for the function to take what still waits


class EventDelivery:
    """Delivery of events to one function, in order, until ``close``.

    Args:
        on_event: the program's function; one that has raised is not called any more.
        bound: number of events that may wait; what comes beyond it is dropped, and the function is told how many.
    """

    def __init__(self, on_event: Callable[[GuardEvent], None], bound: int = _BOUND) -> None:
        self._on_event = on_event
        self._bound = bound
        self._waiting: deque[GuardEvent] = deque()
        self._dropped = 0
        self._closed = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._run, name="coneskin events", daemon=True)
        self._thread.start()

    def put(self, events: Iterable[GuardEvent]) -> None:
        """Take events without waiting."""
        with self._changed:
            for event in events:
                if len(self._waiting) >= self._bound:
                    self._dropped += 1
                    continue
                if self._dropped:
                    self._waiting.append(self._gap(event.time))
                self._waiting.append(event)
            self._changed.notify()

    def close(self) -> None:
        """Deliver what waits, for 2 s at most, and end; may be called again, and by the function itself."""
        with self._changed:
            if self._dropped and not self._closed:
                self._waiting.append(self._gap(time.monotonic()))
            self._closed = True
            self._changed.notify()
        if threading.current_thread() is not self._thread:
            self._thread.join(_CLOSE_TIMEOUT)

    def _gap(self, now: float) -> GuardEvent:
        what = f"on_event was busy: {self._dropped} events were not delivered to it; the recording has them"
        self._dropped = 0
        logging.getLogger("coneskin").warning(what)
        return GuardEvent(EventName.MESSAGE, now, {"what": what})

    def _run(self) -> None:
        while True:
            with self._changed:
                while not self._waiting and not self._closed:
                    self._changed.wait()
                if not self._waiting:
                    return
                event = self._waiting.popleft()
            try:
                self._on_event(event)
            except Exception:
                logging.getLogger("coneskin").exception("on_event has failed and is not called any more")
                return
