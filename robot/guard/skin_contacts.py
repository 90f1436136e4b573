"""Contacts on the skin: each event and each frame of a touch goes to the arm, and what changes is reported. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from coneskin.skin.detection.detector import Detector
from coneskin.skin.detection.events import TouchBegan, TouchEnded, TouchEvent

from .event_folding import EventFolding
from .phase import Phase
from .signals.contact import Contact, GuardedSensor
from .signals.journal import EventName
from .signals.outputs import Outputs, emit

if TYPE_CHECKING:
    from .arm_supervisor import ArmSupervisor

__all__ = ["SkinContacts"]

#: s; a skin that is this far behind does not show what a motion away presses on, however late a scene lets it be
_MAX_SUPERVISION_AGE = 0.05


class SkinContacts:
    """Contacts that there are now, by sensor.

    Args:
        sensors: where they are.
        arm: takes them before anything is reported; None where there is none.
        folding: counts what comes again and again while no program moves an arm.
    """

    def __init__(self, sensors: Sequence[GuardedSensor], arm: ArmSupervisor | None, folding: EventFolding) -> None:
        self._sensors: Mapping[str, GuardedSensor] = {sensor.name: sensor for sensor in sensors}
        self._arm = arm
        self._folding = folding
        self._contacts: dict[str, Contact] = {}
        self._newest_number = 0
        self._extended = 0  # number of the newest touch that was reported as not one disc
        self._located: set[str] = set()  # sensors whose touch had a certain place in its newest event

    @property
    def any(self) -> bool:
        """True while there is a contact."""
        return bool(self._contacts)

    def note(self, event: TouchEvent, out: Outputs) -> None:
        """Take a touch that has begun, changed or ended."""
        if isinstance(event, TouchEnded):
            self._end(event, out)
            return
        began = isinstance(event, TouchBegan)
        before = self._contacts.get(event.sensor)
        self._newest_number += began
        number = self._newest_number if began or before is None else before.number
        contact = self._contacts[event.sensor] = Contact(event, self._sensors[event.sensor], number)
        if self._arm is not None:
            self._arm.touch(event.time, contact, began, out)
        if began:
            self._emit(out, EventName.CONTACT, event, contact.details())
        elif event.location_valid and event.sensor not in self._located:
            self._emit(out, EventName.CONTACT_LOCATED, event, contact.details())
        if not event.location_valid and event.elongation is not None and number > self._extended:
            self._extended = number
            self._emit(out, EventName.CONTACT_EXTENDED, event, contact.details())
        (self._located.add if event.location_valid else self._located.discard)(event.sensor)

    def follow(self, now: float, detectors: Iterable[Detector], out: Outputs) -> None:
        """Give the arm what each touch's newest frame says; events come only where something changes."""
        contacts = self._contacts
        if not contacts:
            return
        for detector in detectors:
            name, reading = detector.sensor.name, detector.reading_now
            if reading is not None and (before := contacts.get(name)) is not None:
                contacts[name] = Contact(reading, before.where, before.number)
        if self._arm is not None:
            self._arm.follow(now, tuple(contacts.values()), out)

    @staticmethod
    def stale(now: float, detectors: Iterable[Detector]) -> str:
        """Return whose frames are too old to supervise a motion away by; empty where none are."""
        for detector in detectors:
            age = detector.timing.measured_age(now)
            if age > _MAX_SUPERVISION_AGE:
                return (
                    f"{detector.sensor.name}: what it measured {1e3 * age:.0f} ms ago is too old to move away by "
                    f"({1e3 * _MAX_SUPERVISION_AGE:.0f} ms at most; a busy computer needs fewer frames a second)"
                )
        return ""

    def _end(self, event: TouchEnded, out: Outputs) -> None:
        self._contacts.pop(event.sensor, None)
        if self._arm is not None:
            self._arm.follow(event.time, tuple(self._contacts.values()), out)
        self._emit(out, EventName.TOUCH_ENDED, event, {"sensor": event.sensor})

    def _emit(self, out: Outputs, name: EventName, event: TouchEvent, details: dict[str, Any]) -> None:
        """Report a touch; one upon the other is counted where the program does not move an arm."""
        if self._arm is None or self._arm.phase in (Phase.STARTING, Phase.LATCHED):
            self._folding.emit(out, name, event.sensor, event.time, **details)
        else:
            emit(out, name, event.time, **details)
