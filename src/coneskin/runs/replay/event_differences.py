"""Differences between the events of a recording and those of its replay: found bit by bit, told in units for people."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from difflib import SequenceMatcher
from itertools import zip_longest

from coneskin.robot.guard.signals.journal import GuardEvent

from .detail_differences import describe_differences, milliseconds
from .event_text import describe
from .quantities import EXACT

__all__ = ["event_differences"]


def event_differences(recorded: Sequence[GuardEvent], replayed: Sequence[GuardEvent], start: float) -> Iterator[str]:
    """Yield a line for each event that is not the same, bit by bit, or has no partner.

    Args:
        recorded: events of the recording.
        replayed: of the replay, in the same order.
        start: host time that counts as 0 [s].
    """
    bits = [_bits(event) for event in recorded], [_bits(event) for event in replayed]
    if bits[0] == bits[1]:
        return
    for same, i, end, j, other_end in SequenceMatcher(None, *bits, autojunk=False).get_opcodes():
        if same != "equal":
            for old, new in zip_longest(recorded[i:end], replayed[j:other_end]):
                yield _describe(old, new, start)


def _bits(event: GuardEvent) -> tuple[str, str, str]:
    """Return an event as text with every bit of its floats."""
    return event.time.hex(), event.name, json.dumps(event.details)


def _describe(old: GuardEvent | None, new: GuardEvent | None, start: float) -> str:
    if old is None or new is None:
        event, word = (old, "was recorded, and is not replayed") if new is None else (new, "is new")
        assert event is not None
        return f"{describe(event, start).strip()}: {word}"
    if old.name != new.name:
        return f"{describe(old, start).strip()}: replayed as {describe(new, start).strip()}"
    words = describe_differences(old.details, new.details, EXACT, all_of_them=True)
    if new.time != old.time:
        words.append(f"{milliseconds(abs(new.time - old.time))} {'later' if new.time > old.time else 'earlier'}")
    said = "; ".join(words) or "other words for the same"  # the order of its details
    return f"{old.time - start:.4f} s, {old.name}: {said}"
