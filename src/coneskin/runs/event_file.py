"""Events in a JSON file: those of ``coneskin replay --json``, of another version of the code, or reviewed ones."""

from __future__ import annotations

import json
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

from coneskin.core.errors import RecordingError
from coneskin.core.files import read_file
from coneskin.core.recording.block import is_time
from coneskin.core.text import read_json
from coneskin.robot.guard.signals.journal import SESSION_EVENTS, EventName, GuardEvent

__all__ = ["event_facts", "parse_events", "read_events", "write_events"]

_MAX_SIZE = 1 << 28  # bytes


def event_facts(events: Iterable[GuardEvent], start: float) -> list[dict[str, Any]]:
    """Return events as values for JSON.

    Args:
        events: in order.
        start: host time that counts as 0 [s].
    """
    return [{"t": event.time - start, "name": event.name.value, **event.details} for event in events]


def parse_events(facts: Any, start: float, where: str) -> list[GuardEvent]:
    """Return the events of a guard in values from JSON; those of the session around it are left out.

    Args:
        facts: ``{"events": [{"t": ..., "name": ..., ...}]}``.
        start: host time of their zero [s].
        where: for messages.

    Raises:
        RecordingError: the values are nothing of the kind.
    """
    try:
        events = []
        for item in facts["events"]:
            details = dict(item)
            time, name = details.pop("t"), EventName(details.pop("name"))
            if not is_time(time):
                raise ValueError(f"t must be a time in seconds, got {time!r}")
            if name not in SESSION_EVENTS:
                events.append(GuardEvent(name, start + time, details))
    except (KeyError, TypeError, ValueError) as exc:
        raise RecordingError(f"{where} holds no events of a run: {type(exc).__name__}: {exc}") from exc
    return events


def read_events(path: Path, start: float) -> list[GuardEvent]:
    """Return the events in a file; arguments and errors as of ``parse_events``."""
    try:
        facts = read_json(read_file(path, _MAX_SIZE))
    except OSError as exc:
        raise RecordingError(f"cannot read the events {path}: {exc.strerror or exc}") from exc
    except ValueError as exc:
        raise RecordingError(f"{path} is no JSON: {exc}") from exc
    return parse_events(facts, start, str(path))


def write_events(path: Path, events: Iterable[GuardEvent], start: float) -> None:
    """Write events into a file, one a line, so that a review sees which have changed; it is replaced at once, or not.

    Raises:
        RecordingError: the file cannot be written.
    """
    lines = ",\n".join(json.dumps(item) for item in event_facts(events, start))
    draft = path.with_name(path.name + ".draft")
    try:
        draft.write_text(f'{{"events": [\n{lines}\n]}}\n', encoding="utf-8")
        draft.replace(path)
    except OSError as exc:
        with suppress(OSError):
            draft.unlink()
        raise RecordingError(f"cannot write the events {path}: {exc.strerror or exc}") from exc
