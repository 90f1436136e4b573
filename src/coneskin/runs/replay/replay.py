"""Result of a replay: the same bytes through the same guard must give the same events."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING

from coneskin.robot.guard.signals.journal import GuardEvent

if TYPE_CHECKING:
    pass

__all__ = ["MOST_DIFFERENCES", "Replay", "Verdict"]

MOST_DIFFERENCES = 5  #: that a replay describes


class Verdict(StrEnum):
    """What a replay shows."""

    SAME = "same"  #: the recording is whole and was closed, and each event, of which there are some, is the same
    DIFFERENT = "different"  #: an event differs
    INCOMPLETE = "incomplete"  #: nothing differs as far as it can be compared; the rest, or all, is missing


@dataclass(frozen=True, slots=True)
class Replay:
    """Result of a replay.

    Attributes:
        events: of the replay, up to the first gap, where inputs are missing.
        recorded: events of the recording, all of them.
        compared: number of recorded events that could be compared.
        differences: the first events that differ, with units for people; at most ``MOST_DIFFERENCES``.
        frames: bytes of the skin's stream that were replayed.
        duration: of the recording [s].
        missing: what the recording lacks, in a sentence.
        other_code: in what today's code differs from what recorded the run, as of ``Run.other_code``.
        verdict: of all that.
    """

    events: list[GuardEvent]
    recorded: list[GuardEvent]
    compared: int
    differences: list[str]
    frames: int
    duration: float
    missing: str
    other_code: tuple[str, ...] = ()
    verdict: Verdict = field(init=False)

    def __post_init__(self) -> None:
        whole = not self.missing and self.compared
        verdict = Verdict.DIFFERENT if self.differences else Verdict.SAME if whole else Verdict.INCOMPLETE
        object.__setattr__(self, "verdict", verdict)

    @property
    def same(self) -> bool:
        """True where the whole run is there, has events, and each of them is the same, bit by bit."""
        return self.verdict is Verdict.SAME

    @property
    def agrees(self) -> bool:
        """True where nothing differs as far as it can be compared; a run of which all is missing agrees, too."""
        return not self.differences
