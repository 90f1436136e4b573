"""Follow an arm that goes on slowly while it is touched. Pure.

The controller's speed slider does it, so it works for whatever moves the arm; servoj does not heed it. So the slider's
word is not taken for it: measured joint speed has to fall, or to be slow anyway, within the budget of a stop, and to
stay so. What a person does with the slider meanwhile is theirs: it is not put back over it.
"""

from __future__ import annotations

__all__ = ["HOLD", "SLOW_ENOUGH", "Slider", "Slowing"]

from typing import NamedTuple

from .stop_watch import STEADY

HOLD = 0.5  #: s without a touch after which the arm goes on at the speed it had
SLOW_ENOUGH = 0.25  #: rad/s; at a metre's reach, 250 mm/s, the reduced speed of ISO 10218-1
_PART = 0.9  # of its speed at the touch, to which the arm must have slowed down
_STEP = 0.02  # by which the slider may read otherwise than it was set


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

    Attributes:
        before: where the slider was.
        fraction: where it is to be.
        top: largest speed of the leading joint around the touch [rad/s].
    """

    def __init__(self, now: float, speed: float, before: float, fraction: float, budget: float, longest: float) -> None:
        self.before = before
        self.fraction = min(before, fraction)
        self.top = speed
        self._deadline = now + budget
        self._end = now + longest
        self._free_since: float | None = None
        self._fast = 0  # samples in a row

    def sample(self, time: float, speed: float) -> None:
        """Take the measured speed of the leading joint at a time [s, rad/s]."""
        if time < self._deadline:
            self.top = max(self.top, speed)  # it may still have been speeding up
        self._fast = self._fast + 1 if speed > max(_PART * self.top, SLOW_ENOUGH) else 0

    def touched(self, now: float, touched: bool) -> None:
        """Say whether anything touches."""
        if touched:
            self._free_since = None
        elif self._free_since is None:
            self._free_since = now

    def trouble(self, now: float, slider: float | None) -> str:
        """Why the arm has to be stopped after all; empty where it has not.

        Args:
            now: [s].
            slider: where it is.
        """
        if now >= self._deadline:
            if self._fast >= STEADY:
                return "the arm did not become slower"
            if self._free_since is None and slider is not None and slider > self.fraction + _STEP:
                return f"the speed slider is at {slider:.0%} again while the skin is touched"
        if self._free_since is None and now >= self._end:
            return "the touch lasts too long"
        return ""

    def puts_back(self, slider: float | None) -> bool:
        """Whether the slider is where it was set, or not yet seen to be there, so that nobody has moved it since.

        Args:
            slider: where it is.
        """
        return slider is not None and min(abs(slider - self.fraction), abs(slider - self.before)) <= _STEP

    def over(self, now: float) -> bool:
        """Whether the arm may go on as before."""
        return self._free_since is not None and now - self._free_since >= HOLD
