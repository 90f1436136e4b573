"""Person at the terminal who touches marks: what is shown meanwhile, and what is typed."""

from __future__ import annotations

import json
import math
import queue
import sys
import time
from typing import TYPE_CHECKING, Any

from .typed_lines import typed_lines

if TYPE_CHECKING:
    from coneskin.commissioning.touching import Notice
    from coneskin.skin.detection.frame.reading import TouchReading

__all__ = ["LiveReading", "Person"]

_LIVE_PERIOD = 0.2  # s between two lines of what is read now


class LiveReading:
    """Line of what the sensors read now, and the notices between.

    Args:
        as_json: an object for each line, for programs.
    """

    def __init__(self, as_json: bool) -> None:
        self._json = as_json
        self._live = sys.stdout.isatty() and not as_json
        self._shown = 0.0

    def notice(self, notice: Notice) -> None:
        """Show what the person is told."""
        if self._json:
            print(json.dumps({"kind": notice.kind, "text": notice.text, **notice.details}), flush=True)
        else:
            print(f"{self.clear()}{notice.kind:>6}  {notice.text}", flush=True)

    def reading(self, readings: dict[str, TouchReading | None]) -> None:
        """Show what the sensors read now, a few times a second."""
        now = time.monotonic()
        if now - self._shown < _LIVE_PERIOD or not (self._live or self._json):
            return
        self._shown = now
        touched = {name: reading for name, reading in readings.items() if reading is not None}
        if self._json:
            for name, seen in touched.items():
                line: dict[str, Any] = {"u_mm": round(1e3 * seen.u, 1), "phi_deg": round(math.degrees(seen.phi), 1)}
                line |= {"level": round(seen.level, 3), "certain": seen.location_valid, "doubt": seen.doubt}
                print(json.dumps({"kind": "reading", "sensor": name, **line}), flush=True)
        else:
            said = [
                f"{name}: u = {1e3 * seen.u:.0f} mm, phi = {math.degrees(seen.phi):.0f} deg, level {seen.level:.2f}"
                + ("" if seen.location_valid else f" ({seen.doubt or 'not certain'})")
                for name, seen in touched.items()
            ]
            print(f"{self.clear()}   now  {'; '.join(said) or 'not touched'}", end="", flush=True)

    def clear(self) -> str:
        """Return what takes the live line off the terminal."""
        return "\r\033[K" if self._live else ""


class Person:
    """Person at the terminal."""

    def __init__(self) -> None:
        self._lines = typed_lines()

    def refuses(self) -> bool:
        """Tell whether a mark was said to be out of reach since the last call."""
        try:
            return self._lines.get_nowait().strip().lower() in ("n", "no")
        except queue.Empty:
            return False
