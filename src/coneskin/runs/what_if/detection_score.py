"""Score of a detection: touches missed, false alarms, and how late the others were seen."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from coneskin.robot.guard.signals.journal import EventName
from coneskin.runs.decisions import Decisions

from .touch_labels import TouchLabel

__all__ = ["DetectionScore", "score_detection"]

_LATE = 0.1  # s after the end of a touch in which the skin still relaxes


@dataclass(frozen=True, slots=True)
class DetectionScore:
    """Score of one run.

    Attributes:
        touches: that there were.
        missed: of them, those without a contact.
        false_alarms: contacts without a touch.
        delays: from the beginning of each other touch to its first contact [s]; negative where it was seen before.
    """

    touches: int
    missed: int
    false_alarms: int
    delays: tuple[float, ...]

    @property
    def median_delay(self) -> float | None:
        """Median of the delays [s], or None."""
        return statistics.median(self.delays) if self.delays else None


def score_detection(decisions: Decisions, labels: Sequence[TouchLabel]) -> DetectionScore:
    """Compare the contacts that a guard sees with the touches that there were.

    A contact belongs to the touch of its sensor in whose time it begins; a second one in the same touch is no false
    alarm. A touch that begins where inputs are missing is left out.
    """
    known = decisions.until - decisions.start
    counted = [label for label in labels if label.start < known]
    first: dict[TouchLabel, float] = {}
    false_alarms = 0
    for event in decisions.events:
        if event.name != EventName.CONTACT:
            continue
        time, sensor = event.time - decisions.start, str(event.details.get("sensor", ""))
        own = [
            label
            for label in counted
            if label.sensor in ("", sensor) and label.start - label.early <= time <= label.end + _LATE
        ]
        if not own:
            false_alarms += 1
            continue
        label = min(own, key=lambda one: abs(one.start - time))
        first.setdefault(label, time)
    delays = tuple(time - label.start for label, time in first.items())
    return DetectionScore(len(counted), len(counted) - len(first), false_alarms, delays)
