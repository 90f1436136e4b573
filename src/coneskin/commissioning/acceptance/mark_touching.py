"""Touching of marks, live: what the sensors read goes into a procedure, and its notices to the person."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from coneskin.skin.detection.frame.touch_reading import TouchReading

    from .procedure import Notice
    from .skin_watch import SkinWatch

__all__ = ["MarkProcedure", "touch_marks"]

_STEP = 0.02  # s between two looks at what is not skin


class MarkProcedure(Protocol):
    """Procedure that waits for one mark after the other."""

    over: bool
    incomplete: str

    def look(self, now: float, readings: Mapping[str, TouchReading | None]) -> list[Notice]:
        """Take what the sensors read now."""

    def refuse(self) -> list[Notice]:
        """Take the mark that is waited for as one that the person cannot reach."""


def touch_marks(
    procedure: MarkProcedure,
    watch: SkinWatch,
    tell: Callable[[list[Notice]], None],
    reading: Callable[[dict[str, TouchReading | None]], None],
    refused: Callable[[], bool],
    check: Callable[[], None] = lambda: None,
) -> None:
    """Follow a procedure until it is over, or cannot be carried out.

    Args:
        procedure: with its marks.
        watch: of the sensors, ready.
        tell: takes the notices.
        reading: called some 50 times a second with what the sensors read now.
        refused: tells whether the person has said since the last call that a mark cannot be reached.
        check: called as often; raises what ends the procedure.
    """
    looked = 0.0
    while not procedure.over and not procedure.incomplete:
        readings = watch.read(_STEP)
        now = time.monotonic()
        tell(procedure.look(now, readings))
        if now - looked >= _STEP:
            looked = now
            check()
            reading(readings)
            if refused():
                tell(procedure.refuse())
