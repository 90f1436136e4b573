"""Subjects of differences: which contact, or what of the arm, a pair of events is about."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from coneskin.robot.guard.signals.journal import EventName, GuardEvent

from .event_pairs import SKIN_EVENTS, EventPair

__all__ = ["either_event", "event_words", "pair_subjects", "touched_sensor"]

_NEAR = 0.5  # s between a contact and the stop that is made for it
_WORDS: Mapping[str, str] = {
    EventName.CONTACT: "touch",
    EventName.CONTACT_LOCATED: "located",
    EventName.CONTACT_EXTENDED: "extent",
    EventName.TOUCH_ENDED: "end",
    EventName.STOPPING: "stop",
    EventName.RETREATING: "retreat",
    EventName.SPEED_REDUCED: "slow-down",
    EventName.RETREATED: "end of the retreat",
    EventName.DECELERATING: "deceleration",
}


def pair_subjects(pairs: Sequence[EventPair]) -> list[str]:
    """Return what each pair is about. Contacts have numbers, in the order in which they began."""
    counts = {False: 0, True: 0}
    contacts: list[tuple[str, float, str]] = []  # sensor, time, subject
    for pair in pairs:
        if (event := either_event(pair)).name == EventName.CONTACT:
            new = pair[0] is None
            counts[new] += 1
            contacts.append((touched_sensor(event), event.time, f"{'new contact' if new else 'contact'} {counts[new]}"))
    subjects = [_subject(either_event(pair), contacts) for pair in pairs]
    often, seen = Counter(subjects), Counter[str]()
    for at, pair in enumerate(pairs):  # the first and the second standstill, and so on
        subject = subjects[at]
        if subject == event_words(either_event(pair)) and often[subject] > 1:
            seen[subject] += 1
            subjects[at] = f"{subject} {seen[subject]}"
    return subjects


def _subject(event: GuardEvent, contacts: Sequence[tuple[str, float, str]]) -> str:
    here = [(time, subject) for sensor, time, subject in contacts if sensor == touched_sensor(event)]
    if event.name in SKIN_EVENTS:
        begun = [item for item in here if item[0] <= event.time]
        return max(begun)[1] if begun else f"touch on {touched_sensor(event)}"
    if event.name == EventName.STOPPING and (near := [item for item in here if abs(item[0] - event.time) < _NEAR]):
        return min(near, key=lambda item: abs(item[0] - event.time))[1]
    return event_words(event)


def event_words(event: GuardEvent) -> str:
    """Return what an event is called in a difference."""
    return _WORDS.get(event.name, str(event.name).replace("_", " "))


def touched_sensor(event: GuardEvent) -> str:
    """Return the name of the sensor that an event is about; empty for none."""
    contact = event.details.get("contact")
    return str((contact if isinstance(contact, Mapping) else event.details).get("sensor", ""))


def either_event(pair: EventPair) -> GuardEvent:
    """Return the event of a pair, the first one where it has both."""
    event = pair[0] if pair[0] is not None else pair[1]
    assert event is not None
    return event
