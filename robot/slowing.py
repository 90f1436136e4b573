"""Follow an arm that goes on slowly while it is touched. Pure.

The controller's speed slider does it, so it works for whatever moves the arm; servoj does not heed it. So the slider's
word is not taken for it: measured joint speed has to fall, or to be slow anyway, within the budget of a stop.
"""

from __future__ import annotations

__all__ = ["HOLD", "SLOW_ENOUGH", "Slider", "Slowing"]

from typing import NamedTuple

HOLD = 0.5  #: s without a touch after which the arm goes on at the speed it had
SLOW_ENOUGH = 0.25  #: rad/s; at a metre's reach, 250 mm/s, the reduced speed of ISO 10218-1
_PART = 0.9  # of its speed at the touch, to which the arm must have slowed down


class Slider(NamedTuple):
    """Set the controller's speed slider.

    Attributes:
        fraction: above 0, up to 1.
    """

    fraction: float


class Slowing:
    """One touch that slows the arm down.

    Args:
        now: when it began [s].
        speed: of the leading joint then [rad/s].
        before: where the slider was.
        fraction: where it is to be.
        budget: within which the arm must be slower [s].
        longest: that the touch may last [s].
    """

    def __init__(self, now: float, speed: float, before: float, fraction: float, budget: float, longest: float) -> None:
        self.before = before
        self.fraction = min(before, fraction)
        self._top = speed
        self._deadline = now + budget
        self._end = now + longest
        self._free_since: float | None = None
        self._slower = speed <= SLOW_ENOUGH

    def sample(self, speed: float) -> None:
        """Take the measured speed of the leading joint [rad/s]."""
        if not self._slower:
            self._top = max(self._top, speed)
            self._slower = speed <= max(_PART * self._top, SLOW_ENOUGH)

    def touched(self, now: float, touched: bool) -> None:
        """Say whether anything touches."""
        if touched:
            self._free_since = None
        elif self._free_since is None:
            self._free_since = now

    def trouble(self, now: float) -> str:
        """Why the arm has to be stopped after all; empty where it has not."""
        if not self._slower and now >= self._deadline:
            return "the arm did not become slower"
        if self._free_since is None and now >= self._end:
            return "the touch lasts too long"
        return ""

    def over(self, now: float) -> bool:
        """Whether the arm may go on as before."""
        return self._free_since is not None and now - self._free_since >= HOLD
