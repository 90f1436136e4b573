"""Comparison of two guards' decisions: contacts moved, reactions earlier or later, new and missing ones.

The inputs of a replay are the recorded ones: the arm moves as the recorded commands made it move. From the first
command on that the two do not share, what is said of the arm is therefore no longer about the same motion, and is not
compared. The skin's contacts still are, and so is the first reaction on each side: it is the difference.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from coneskin.robot.guard.signals.journal import EventName, GuardEvent

from .decisions import SKIN_EVENTS, Decisions, first_divergence
from .replay.event_details import Tolerances, describe_differences, distance, milliseconds

_MOST_LISTED = 40  # differences
_STOP_WINDOW = 0.5  # s between a contact and the stop that is made for it
_PAIR_WINDOW = 0.5  # s that an event may move and still be the same one
_EVENT_WORDS: Mapping[str, str] = {
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
_EventPair = tuple[GuardEvent | None, GuardEvent | None]


def _pair_events(one: Sequence[GuardEvent], other: Sequence[GuardEvent]) -> list[_EventPair]:
    """Return the events of two runs in pairs, in the order of their times; None stands for one that is not there.

    At one time the skin's events come before the arm's. Two events pair where they have the same name and sensor and
    are nearest to each other, at most 0.5 s apart. What each guard says of the arm only once pairs at any time.
    """
    ours, theirs = _grouped(one), _grouped(other)
    pairs: list[_EventPair] = []
    for key in dict.fromkeys([*ours, *theirs]):
        one_group, other_group = ours.get(key, []), theirs.get(key, [])
        if len(one_group) == len(other_group) == 1 and key[0] not in SKIN_EVENTS:
            pairs.append((one_group[0], other_group[0]))
        else:
            pairs += _pair_group(one_group, other_group)
    return sorted(pairs, key=lambda pair: ((e := _either_event(pair)).time, e.name not in SKIN_EVENTS))


def _either_event(pair: _EventPair) -> GuardEvent:
    """Return the event of a pair, the first one where it has both."""
    event = pair[0] if pair[0] is not None else pair[1]
    assert event is not None
    return event


def _grouped(events: Sequence[GuardEvent]) -> dict[tuple[str, str], list[GuardEvent]]:
    groups: dict[tuple[str, str], list[GuardEvent]] = {}
    for event in events:
        groups.setdefault((event.name, str(event.details.get("sensor", ""))), []).append(event)
    return groups


def _pair_group(one: list[GuardEvent], other: list[GuardEvent]) -> list[_EventPair]:
    pairs: list[_EventPair] = []
    i = j = 0
    while i < len(one) and j < len(other):
        apart = other[j].time - one[i].time
        next_other = abs(other[j + 1].time - one[i].time) if j + 1 < len(other) else math.inf
        next_one = abs(other[j].time - one[i + 1].time) if i + 1 < len(one) else math.inf
        if apart < -_PAIR_WINDOW or (next_other < abs(apart) and len(other) - j > len(one) - i):
            pairs.append((None, other[j]))
            j += 1
        elif apart > _PAIR_WINDOW or (next_one < abs(apart) and len(one) - i > len(other) - j):
            pairs.append((one[i], None))
            i += 1
        else:
            pairs.append((one[i], other[j]))
            i, j = i + 1, j + 1
    return [*pairs, *((event, None) for event in one[i:]), *((None, event) for event in other[j:])]


def _pair_subjects(pairs: Sequence[_EventPair]) -> list[str]:
    """Return what each pair is about. Contacts have numbers, in the order in which they began."""
    counts = {False: 0, True: 0}
    contacts: list[tuple[str, float, str]] = []  # sensor, time, subject
    for pair in pairs:
        if (event := _either_event(pair)).name == EventName.CONTACT:
            new = pair[0] is None
            counts[new] += 1
            contacts.append(
                (_touched_sensor(event), event.time, f"{'new contact' if new else 'contact'} {counts[new]}")
            )
    subjects = [_subject(_either_event(pair), contacts) for pair in pairs]
    often, seen = Counter(subjects), Counter[str]()
    for at, pair in enumerate(pairs):  # the first and the second standstill, and so on
        subject = subjects[at]
        if subject == _event_words(_either_event(pair)) and often[subject] > 1:
            seen[subject] += 1
            subjects[at] = f"{subject} {seen[subject]}"
    return subjects


def _subject(event: GuardEvent, contacts: Sequence[tuple[str, float, str]]) -> str:
    here = [(time, subject) for sensor, time, subject in contacts if sensor == _touched_sensor(event)]
    if event.name in SKIN_EVENTS:
        begun = [item for item in here if item[0] <= event.time]
        return max(begun)[1] if begun else f"touch on {_touched_sensor(event)}"
    if event.name == EventName.STOPPING and (
        near := [item for item in here if abs(item[0] - event.time) < _STOP_WINDOW]
    ):
        return min(near, key=lambda item: abs(item[0] - event.time))[1]
    return _event_words(event)


def _event_words(event: GuardEvent) -> str:
    """Return what an event is called in a difference."""
    return _EVENT_WORDS.get(event.name, str(event.name).replace("_", " "))


def _touched_sensor(event: GuardEvent) -> str:
    """Return the name of the sensor that an event is about; empty for none."""
    contact = event.details.get("contact")
    return str((contact if isinstance(contact, Mapping) else event.details).get("sensor", ""))


_REACTION_EVENTS = (EventName.STOPPING, EventName.SPEED_REDUCED, EventName.RETREATING)
_START_EVENTS = frozenset({EventName.WAITING, EventName.ACTIVATED, EventName.NOT_COMMISSIONED})
#: from the noise, of which a guard knows more the longer it has watched an untouched skin
_LEARNED_DETAILS = frozenset({"covariance", "ellipse", "radius_deviation"})


@dataclass(frozen=True, slots=True)
class Difference:
    """Difference between two runs that is about one thing.

    Attributes:
        subject: "contact 1", numbered as in the first run, or the name of an event.
        words: what is different, each in words with its unit.
        moved: how far the contact is from where it was [m], or None.
        delay: how much later its event is [s], the first of them; negative: earlier; None where there is no pair.
    """

    subject: str
    words: tuple[str, ...]
    moved: float | None = None
    delay: float | None = None

    def __str__(self) -> str:
        return f"{self.subject}: {'; '.join(self.words)}"


@dataclass(frozen=True, slots=True)
class Comparison:
    """Result of a comparison.

    Attributes:
        differences: in the order of time; empty where nothing counts.
        paired: events that have a partner.
        new: events of the second only.
        missing: events of the first only.
        diverged: from when on the two command the arm otherwise [s since the start of the first run], or None.
        not_compared: events about the arm after that, on either side.
        until: to when the two were compared, where inputs are missing after that [s since the start]; else None.
        lost: what the recordings lack; empty where nothing.
        other_code: in what the code of the two differs, as far as it is known, in sentences.
    """

    labels: tuple[str, str]
    differences: tuple[Difference, ...]
    paired: int
    new: int
    missing: int
    diverged: float | None
    not_compared: int
    until: float | None
    lost: str
    other_code: tuple[str, ...] = ()

    @property
    def same(self) -> bool:
        """True where all was compared and nothing differs by more than the tolerances."""
        return not (self.differences or self.lost) and self.diverged is None and self.paired > 0

    @property
    def farthest(self) -> float:
        """How far a contact has moved at most [m]."""
        return max((d.moved for d in self.differences if d.moved is not None), default=0.0)


def compare_decisions(one: Decisions, other: Decisions, tolerances: Tolerances | None = None) -> Comparison:
    """Compare two guards' decisions, the first of which is the reference, but for what the tolerances leave out.

    The other's times are first put on the clock of the first. Where the two are about the same recording, by their
    start, they stay; else the first contacts (or the starts) coincide.
    """
    tolerances, shift = tolerances or Tolerances(), _shift(one, other)
    until = min(one.until, other.until + shift)
    window = max(one.window[0], other.window[0] + shift), min(one.window[1], other.window[1] + shift)
    if until < window[1]:
        window = window[0], math.nextafter(until, -math.inf)
    shifted = [event._replace(time=event.time + shift) for event in other.events]
    ones, others = ([e for e in side if window[0] <= e.time <= window[1]] for side in (one.events, shifted))
    if one.window != other.window:  # a cut beside the whole run
        ones, others = _without_beginning(ones, others)
    diverged = math.inf
    if shift == 0.0 and one.commands is not None and other.commands is not None:
        first, second = (
            [c for c in side if window[0] <= c.time <= window[1]] for side in (one.commands, other.commands)
        )
        diverged = first_divergence(first, second, tolerances)
    kept = _comparable(ones, diverged), _comparable(others, diverged)
    left_out = len(ones) + len(others) - len(kept[0]) - len(kept[1])
    pairs = _pair_events(*kept)
    return Comparison(
        labels=(one.label, other.label),
        differences=tuple(_differences(pairs, tolerances)),
        paired=sum(a is not None and b is not None for a, b in pairs),
        new=sum(a is None for a, _ in pairs),
        missing=sum(b is None for _, b in pairs),
        diverged=None if math.isinf(diverged) else diverged - one.start,
        not_compared=left_out,
        until=None if math.isinf(until) else until - one.start,
        lost=one.missing or other.missing,
        other_code=other.other_code if one.other_code != other.other_code else (),
    )


def without_invented(decisions: Decisions, recorded: Decisions) -> Decisions:
    """Return decisions without what they say of an arm that moved otherwise than they commanded.

    Args:
        recorded: of the guard that moved the arm; both have commands.
    """
    assert decisions.commands is not None
    assert recorded.commands is not None
    known = min(decisions.until, recorded.until)
    then, now = (
        [command for command in side if command.time < known] for side in (recorded.commands, decisions.commands)
    )
    kept = _comparable([e for e in decisions.events if e.time < known], first_divergence(then, now))
    return replace(decisions, events=tuple(kept))


def _shift(one: Decisions, other: Decisions) -> float:
    if one.start == other.start:
        return 0.0
    firsts = [next((e.time for e in side.events if e.name == EventName.CONTACT), None) for side in (one, other)]
    if firsts[0] is not None and firsts[1] is not None:
        return firsts[0] - firsts[1]
    return one.start - other.start


def _without_beginning(*sides: list[GuardEvent]) -> Iterator[list[GuardEvent]]:
    """Leave out how the guard of a cut became active, and what a guard learns before that."""
    until = max(next((e.time for e in side if e.name == EventName.ACTIVATED), -math.inf) for side in sides)
    for side in sides:
        yield [
            event._replace(details={k: value for k, value in event.details.items() if k not in _LEARNED_DETAILS})
            for event in side
            if event.name not in _START_EVENTS or event.time > until
        ]


def _comparable(events: Sequence[GuardEvent], diverged: float) -> list[GuardEvent]:
    """Return the events that are about the same motion: the skin's, and the arm's up to its first other reaction."""
    kept, reacted = [], False
    for event in events:
        for_touch = event.name == EventName.SPEED_REDUCED or "contact" in event.details  # and not for what the arm does
        if event.name in SKIN_EVENTS or event.time < diverged:
            kept.append(event)
        elif event.name in _REACTION_EVENTS and not reacted and (event.time <= diverged or for_touch):
            reacted = True
            kept.append(event)
    return kept


def _differences(pairs: Sequence[_EventPair], tolerances: Tolerances) -> list[Difference]:
    subjects = _pair_subjects(pairs)
    found: dict[str, Difference] = {}
    # a stop is told after its contact, whose event follows it
    told = zip(pairs, subjects, strict=True)
    stops_last = sorted(told, key=lambda it: _either_event(it[0]).name == EventName.STOPPING)
    for (a, b), subject in stops_last:
        before = found.get(subject, Difference(subject, ()))
        words, moved, delay = _words(a, b, tolerances)
        gone = "touch is missing", "touch is new"
        if any(word.startswith(gone) for word in before.words):
            words = [
                word for word in words if not word.startswith(("located is ", "extent is ", "end is "))
            ]  # of course
        if (name := _event_words(_either_event((a, b)))) == subject.rstrip(
            " 0123456789"
        ):  # "retreat: missing", said once
            words = [word.removeprefix(f"{name} ").removeprefix("is ") for word in words]
        if words:
            moved = moved if before.moved is None else before.moved
            delay = delay if before.delay is None else before.delay
            found[subject] = Difference(subject, (*before.words, *words), moved, delay)
    return [found[subject] for subject in dict.fromkeys(subjects) if subject in found]


def _words(
    a: GuardEvent | None, b: GuardEvent | None, tolerances: Tolerances
) -> tuple[list[str], float | None, float | None]:
    event = _either_event((a, b))
    name = _event_words(event)
    if a is None or b is None:
        place = _place(event) if event.name == EventName.CONTACT else ""
        return [f"{name} is {'missing' if b is None else 'new'}{place}"], None, None
    delay = b.time - a.time
    details = describe_differences(a.details, b.details, tolerances)
    prefix = "" if event.name == EventName.CONTACT else f"{name} "
    if event.name == EventName.STOPPING:  # what it says of its contact, the contact's own event says as well
        details = [line for line in details if not line.startswith("contact ")]
    words = [f"{prefix}{line}" for line in details]
    if abs(delay) > tolerances.time:
        words.append(f"{name} {milliseconds(abs(delay))} {'later' if delay > 0.0 else 'earlier'}")
    moved = distance(a.details, b.details) if event.name in SKIN_EVENTS and words else None
    return words, moved, delay if abs(delay) > tolerances.time else None


def _place(event: GuardEvent) -> str:
    u, phi = event.details.get("u"), event.details.get("phi")
    if not (isinstance(u, float) and isinstance(phi, float)):
        return ""
    return f" on {_touched_sensor(event)}, u {1e3 * u:.1f} mm, phi {math.degrees(phi):.1f} deg"


def comparison_lines(comparison: Comparison) -> list[str]:
    """Return a comparison in lines, which list the first differences and count the rest."""
    one, other = comparison.labels
    lines = [f"{one} -> {other}", *(f"  {what}" for what in comparison.other_code)]
    lines += [f"  {difference}" for difference in comparison.differences[:_MOST_LISTED]]
    if (more := len(comparison.differences) - _MOST_LISTED) > 0:
        lines.append(f"  ... and {more} more")
    if comparison.diverged is not None:
        left_out = _count(comparison.not_compared, "event")
        lines.append(
            f"  from {comparison.diverged:.4f} s on the arm is commanded otherwise: its motion in the recording is no "
            f"longer that of {other}; {left_out} about the arm not compared"
        )
    if comparison.until is not None:
        lines.append(f"  compared up to {comparison.until:.4f} s only: {comparison.lost}")
    elif comparison.lost:
        lines.append(f"  the recording is not whole: {comparison.lost}")
    return [*lines, f"  {_verdict(comparison)}"]


def comparison_facts(comparison: Comparison) -> dict[str, Any]:
    """Return a comparison as values for JSON, with units in the names."""
    return {
        "labels": list(comparison.labels),
        "same": comparison.same,
        "paired": comparison.paired,
        "new": comparison.new,
        "missing": comparison.missing,
        "moved_mm": 1e3 * comparison.farthest,
        "diverged_s": comparison.diverged,
        "not_compared": comparison.not_compared,
        "compared_until_s": comparison.until,
        "lost": comparison.lost or None,
        "other_code": list(comparison.other_code),
        "differences": [
            {
                "subject": difference.subject,
                "words": list(difference.words),
                "moved_mm": None if difference.moved is None else 1e3 * difference.moved,
                "delay_ms": None if difference.delay is None else 1e3 * difference.delay,
            }
            for difference in comparison.differences
        ],
    }


def _verdict(comparison: Comparison) -> str:
    if comparison.same:
        return f"the same within the tolerances: {_count(comparison.paired, 'event')}"
    if not (comparison.paired or comparison.differences):
        return "there is nothing to compare: no event on either side"
    parts = [f"{_count(comparison.paired, 'event')} in pairs"]
    parts += [f"{count} {word}" for count, word in ((comparison.new, "new"), (comparison.missing, "missing")) if count]
    if comparison.farthest:
        parts.append(f"contacts moved by up to {1e3 * comparison.farthest:.2f} mm")
    if delays := [d.delay for d in comparison.differences if d.delay is not None]:
        worst = max(delays, key=abs)
        parts.append(f"up to {1e3 * abs(worst):.1f} ms {'later' if worst > 0.0 else 'earlier'}")
    return ("NOT the same: " if comparison.differences else "") + ", ".join(parts)


def _count(number: int, word: str) -> str:
    return f"{number} {word}{'' if number == 1 else 's'}"
