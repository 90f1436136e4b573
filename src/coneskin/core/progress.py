"""Progress through a long run, and its bar on a terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import TextIO

Progress = Callable[[float], None]  #: called now and then with the fraction that is done, from 0 to 1


def silent(fraction: float) -> None:
    """Show nothing."""


_BAR_WIDTH = 30  # characters
_BAR_DELAY = 1.0  # s without a bar
_DRAWING_PERIOD = 0.2  # s between two drawings


class ProgressBar:
    """Bar that is drawn on a terminal only, in one line; call it with the fraction that is done."""

    def __init__(self, what: str, stream: TextIO | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        self._what = what
        self._stream = sys.stderr if stream is None else stream
        self._clock = clock
        self._start = clock()
        self._drawn = -1.0

    def __call__(self, fraction: float) -> None:
        """Show the fraction that is done, from 0 to 1."""
        now = self._clock()
        since = now - self._start
        if since < _BAR_DELAY or not self._stream.isatty() or (fraction < 1.0 and now - self._drawn < _DRAWING_PERIOD):
            return
        self._drawn = now
        full = round(_BAR_WIDTH * fraction)
        left = since * (1.0 - fraction) / fraction if fraction else float("inf")
        self._stream.write(
            f"\r{self._what} [{'#' * full}{'.' * (_BAR_WIDTH - full)}] {fraction:4.0%}, {left:.0f} s left  "
        )
        self._stream.write("\n" if fraction >= 1.0 else "")
        self._stream.flush()
