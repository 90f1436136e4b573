"""Folding of events that repeat themselves: the first come as they are, then one with a count, at growing intervals.

A loose plug made 410 000 events in a night, and unreadable states 500 a second: they bury the event that matters and
fill the disk. None is lost in silence: each that is kept back is counted in the next of its kind. Pure.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from .signals.journal import EventName, Outputs, emit

__all__ = ["EventFolding"]

_BURST_EVENTS = 10  # events of a kind that come as they are
_CLEAR_TIME = 10.0  # s without one, after which they do so again
_FIRST_INTERVAL = 1.0  # s until the first count; the next ones take twice as long
_MAX_INTERVAL = 600.0  # s


@dataclass(slots=True)
class _Kind:
    """Events of one kind that came one upon the other."""

    newest: float  # when the last one came [s]
    reported: float  # when the last one was put out [s]
    sent: int = 0
    held: int = 0  # since then
    interval: float = _FIRST_INTERVAL
    details: dict[str, Any] = field(default_factory=dict)


class EventFolding:
    """Folding of the events of one guard, by their name and what they are about."""

    def __init__(self) -> None:
        self._kinds: dict[tuple[EventName, str], _Kind] = {}
        self._due = math.inf  # when the next count is [s]

    def emit(self, out: Outputs, name: EventName, about: str, now: float, **details: Any) -> None:
        """Put an event out, of a host time [s], or hold it back and count it.

        Args:
            out: takes it.
            name: of the event.
            about: what it is about: with the name, the kind.
            now: host time [s].
            **details: of the event. The newest are reported.
        """
        kind = self._kinds.get((name, about))
        if kind is None or (now - kind.newest >= _CLEAR_TIME and not kind.held):
            kind = self._kinds[name, about] = _Kind(now, now)
        kind.newest = now
        if kind.sent < _BURST_EVENTS:
            kind.sent += 1
            kind.reported = now
            emit(out, name, now, **details)
            return
        kind.held += 1
        kind.details = details
        self._due = min(self._due, kind.reported + kind.interval)

    def poll(self, now: float, out: Outputs) -> None:
        """Report the counts that are due at a host time [s]."""
        if now < self._due:
            return
        for (name, _), kind in self._kinds.items():
            if kind.held and now >= kind.reported + kind.interval:
                emit(out, name, now, **kind.details, count=kind.held)
                kind.held, kind.reported = 0, now
                kind.interval = min(2.0 * kind.interval, _MAX_INTERVAL)
        self._due = min((kind.reported + kind.interval for kind in self._kinds.values() if kind.held), default=math.inf)

    def flush(self, now: float, out: Outputs) -> None:
        """Report every count, and begin anew: what comes now matters."""
        for (name, _), kind in self._kinds.items():
            if kind.held:
                emit(out, name, now, **kind.details, count=kind.held)
        self._kinds.clear()
        self._due = math.inf
