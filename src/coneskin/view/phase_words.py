"""Words and colours of a guard's phase, as its events tell it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from coneskin.robot.guard.signals.journal import EventName

__all__ = ["UNKNOWN", "PhaseWords", "phase_after"]

_GREY, _GREEN, _AMBER, _RED, _VIOLET, _BLUE = "#6b7280", "#15803d", "#b45309", "#b91c1c", "#6d28d9", "#1d4ed8"


class PhaseWords(NamedTuple):
    """Phase of a guard for people.

    Attributes:
        text: in a few words.
        colour: of its band, as in a style sheet.
    """

    text: str
    colour: str


UNKNOWN = PhaseWords("nothing is known of the guard", _GREY)  #: before its first event
_ACTIVE = PhaseWords("active", _GREEN)
#: event -> the phase that it begins
_BEGINS: Mapping[str, PhaseWords] = {
    EventName.WAITING: PhaseWords("waiting, not active", _GREY),
    EventName.ACTIVATED: _ACTIVE,
    EventName.SPEED_REDUCED: PhaseWords("touched: slower", _AMBER),
    EventName.RESUMED: _ACTIVE,
    EventName.STOPPING: PhaseWords("stopping", _RED),
    EventName.STANDSTILL: PhaseWords("stands", _RED),
    EventName.STOP_FAILED: PhaseWords("standstill NOT confirmed", _RED),
    EventName.RETREATING: PhaseWords("moving away from the touch", _AMBER),
    EventName.RETREATED: PhaseWords("stopping after the motion away", _RED),
    EventName.LATCHED: PhaseWords("latched: stands until a manual reset", _VIOLET),
    EventName.RESET: PhaseWords("reset, not active yet", _GREY),
    EventName.ENDING: PhaseWords("ending", _GREY),
    EventName.GUARD_EXITED: PhaseWords("no guard: it has ended", _GREY),
    EventName.GUARD_UNRESPONSIVE: PhaseWords("the guard does not answer", _RED),
    EventName.GUARD_RESPONSIVE: PhaseWords("the guard answers again", _BLUE),
    EventName.FALLBACK_STOP: PhaseWords("stopped without the guard", _RED),
}
_STAYS = {EventName.WAITING, EventName.STANDSTILL}  # within the phases below they say nothing new
_OVER = {"latched: stands until a manual reset", "ending", "no guard: it has ended"}


def phase_after(before: PhaseWords, name: str) -> PhaseWords:
    """Return the phase after an event.

    Args:
        before: the phase.
        name: of the event.
    """
    if name in _STAYS and before.text in _OVER:
        return before
    return _BEGINS.get(name, before)
