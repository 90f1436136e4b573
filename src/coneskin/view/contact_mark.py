"""Mark of a contact: where it is drawn on its link, how large its uncertainty is, and how far it has faded."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from coneskin.geometry.pose import Vector
from coneskin.robot.guard.signals.journal import EventName, GuardEvent

FADING = 4.0  #: s that the mark of a touch that is over is still seen
_MAX_TOUCHES = 400  # touches that are remembered, in a page that stays open
_PLACE_EVENTS = frozenset({EventName.CONTACT, EventName.CONTACT_LOCATED, EventName.CONTACT_EXTENDED})
_MAX_DISTANCE = 100.0  # m; a place farther off is no place


class ContactMark(NamedTuple):
    """Mark of a contact at one moment.

    Attributes:
        number: of the touch.
        sensor: its name.
        point: in the frame of the link [m].
        normal: outward unit normal there.
        ellipse: the two half axes within which the place is with 95 % [m], or None.
        located: the place is certain.
        strength: 1 while it lasts, then falling to 0.
    """

    number: int
    sensor: str
    point: Vector
    normal: Vector
    ellipse: tuple[Vector, Vector] | None
    located: bool
    strength: float


@dataclass(slots=True)
class _Touch:
    """Touch: the places told of it, each with its time [s], when it ended, and until when it holds the arm."""

    places: list[tuple[float, ContactMark]] = field(default_factory=list)
    ended: float = math.inf
    held: float = -math.inf


class ContactLog:
    """Touches of a run, taken event by event. The one that has stopped the arm is seen until the reset.

    An event whose place is nonsense has no mark; it stands among the events all the same.
    """

    def __init__(self) -> None:
        self._touches: dict[int, _Touch] = {}
        self._stopping: Any = None  # number of the touch that has stopped the arm

    def feed(self, event: GuardEvent) -> None:
        """Take an event; those that tell of no touch are passed over."""
        if event.name == EventName.TOUCH_ENDED:
            for touch in self._touches.values():
                if touch.places[-1][1].sensor == event.details.get("sensor"):
                    touch.ended = min(touch.ended, event.time)
            return
        if event.name in (EventName.RESET, EventName.ACTIVATED):
            for touch in self._touches.values():
                touch.held = min(touch.held, event.time)
            self._stopping = None
            return
        if event.name == EventName.STOPPING and isinstance(contact := event.details.get("contact"), dict):
            self._stopping = contact.get("number")
            if isinstance(self._stopping, int) and self._stopping in self._touches:
                self._touches[self._stopping].held = math.inf
        number = event.details.get("number")
        if not isinstance(number, int):
            return
        if event.name in _PLACE_EVENTS and (mark := _mark(number, event.details)) is not None:
            touch = self._touches.setdefault(number, _Touch())
            touch.places.append((event.time, mark))
            if number == self._stopping:
                touch.held = math.inf
            while len(self._touches) > _MAX_TOUCHES:
                del self._touches[next(iter(self._touches))]

    def marks(self, time: float) -> list[ContactMark]:
        """Return the marks that are seen at a time [s, host clock], the strongest first."""
        found = []
        for touch in self._touches.values():
            told = [mark for then, mark in touch.places if then <= time]
            age = 0.0 if time < touch.held else time - max(touch.ended, touch.held)
            if told and age < FADING:
                found.append(told[-1]._replace(strength=min(1.0, 1.0 - age / FADING)))
        return sorted(found, key=lambda mark: (-mark.strength, -mark.number))


def _mark(number: int, details: Mapping[str, Any]) -> ContactMark | None:
    """Return the mark of an event's details; None where they have no place."""
    point, normal = _vector(details.get("point")), _vector(details.get("normal"))
    if point is None or normal is None:
        return None
    axes = details.get("ellipse")
    ellipse = None
    if isinstance(axes, list | tuple) and len(axes) == 2:
        first, second = _vector(axes[0]), _vector(axes[1])
        ellipse = None if first is None or second is None else (first, second)
    located = details.get("location_valid") is True
    return ContactMark(number, str(details.get("sensor")), point, normal, ellipse, located, 1.0)


def _vector(value: Any) -> Vector | None:
    if not isinstance(value, list | tuple) or len(value) != 3:
        return None
    if not all(isinstance(x, int | float) and abs(x) < _MAX_DISTANCE for x in value):
        return None
    return float(value[0]), float(value[1]), float(value[2])
