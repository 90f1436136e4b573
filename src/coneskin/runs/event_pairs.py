"""Pairs of events that stand for each other in two runs."""

from __future__ import annotations

from collections.abc import Sequence

from coneskin.robot.guard.signals.journal import EventName, GuardEvent

__all__ = ["SKIN_EVENTS", "EventPair", "pair_events"]

#: what the skin alone decides
SKIN_EVENTS = frozenset(
    {EventName.CONTACT, EventName.CONTACT_LOCATED, EventName.CONTACT_EXTENDED, EventName.TOUCH_ENDED}
)

EventPair = tuple[GuardEvent | None, GuardEvent | None]

_WINDOW = 0.5  # s that an event may move and still be the same one


def pair_events(one: Sequence[GuardEvent], other: Sequence[GuardEvent], shift: float = 0.0) -> list[EventPair]:
    """Return the events of two runs in pairs, in the order of their times; None stands for one that is not there.

    At one time the skin's events come before the arm's. Two events pair where they have the same name and sensor and
    are nearest to each other, at most 0.5 s apart. What each guard says of the arm only once pairs at any time.

    Args:
        one: events of a run.
        other: of the other run.
        shift: is added to its times [s], where the clocks of the two are not one.
    """
    ours, theirs = _grouped(one), _grouped(other)
    pairs: list[EventPair] = []
    for key in dict.fromkeys([*ours, *theirs]):
        one_group, other_group = ours.get(key, []), theirs.get(key, [])
        if len(one_group) == len(other_group) == 1 and key[0] not in SKIN_EVENTS:
            pairs.append((one_group[0], other_group[0]))
        else:
            pairs += _pair_group(one_group, other_group, shift)
    return sorted(pairs, key=lambda pair: _order(pair, shift))


def _order(pair: EventPair, shift: float) -> tuple[float, bool]:
    event = pair[0] or pair[1]
    assert event is not None
    return event.time + (0.0 if pair[0] else shift), event.name not in SKIN_EVENTS


def _grouped(events: Sequence[GuardEvent]) -> dict[tuple[str, str], list[GuardEvent]]:
    groups: dict[tuple[str, str], list[GuardEvent]] = {}
    for event in events:
        groups.setdefault((event.name, str(event.details.get("sensor", ""))), []).append(event)
    return groups


def _pair_group(one: list[GuardEvent], other: list[GuardEvent], shift: float) -> list[EventPair]:
    pairs: list[EventPair] = []
    i = j = 0
    while i < len(one) and j < len(other):
        apart = other[j].time + shift - one[i].time
        next_other = abs(other[j + 1].time + shift - one[i].time) if j + 1 < len(other) else float("inf")
        next_one = abs(other[j].time + shift - one[i + 1].time) if i + 1 < len(one) else float("inf")
        if apart < -_WINDOW or (next_other < abs(apart) and len(other) - j > len(one) - i):
            pairs.append((None, other[j]))
            j += 1
        elif apart > _WINDOW or (next_one < abs(apart) and len(one) - i > len(other) - j):
            pairs.append((one[i], None))
            i += 1
        else:
            pairs.append((one[i], other[j]))
            i, j = i + 1, j + 1
    return [*pairs, *((event, None) for event in one[i:]), *((None, event) for event in other[j:])]
