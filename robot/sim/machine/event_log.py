"""Log of the simulated controller: one JSON line for each event."""

from __future__ import annotations

import json
import time
from typing import IO, Any

__all__ = ["write_event"]


def write_event(file: IO[str], cycle: int, timestamp: float, event: str, facts: dict[str, Any]) -> None:
    """Write one line: cycle, controller's time [s], this machine's monotonic clock [s], event and its facts."""
    line = {"cycle": cycle, "time": round(timestamp, 3), "monotonic": time.monotonic(), "event": event}
    file.write(json.dumps(line | facts, default=_plain) + "\n")


def _plain(value: object) -> object:
    return list(value) if isinstance(value, list | tuple) else str(value)
