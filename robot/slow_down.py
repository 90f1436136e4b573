"""The slow reaction of one arm: lowers the speed slider, follows what comes of it, and puts it back. Pure."""

from __future__ import annotations

import math

from .commands import Reaction
from .outputs import Outputs, tell
from .slowing import HOLD, Slider, Slowing
from .watch import Watch

__all__ = ["SlowDown"]

_OLD = 0.5  # s; it is read 50 times a second


class SlowDown:
    """See the module.

    Attributes:
        slider: where the controller's speed slider was last; None where that is not known.
        now: what is under way, or None.
    """

    def __init__(self) -> None:
        self.slider: float | None = None
        self._read_at = -math.inf
        self.now: Slowing | None = None
        self._last: tuple[float, Slowing] | None = None  # when it was over, and what

    def note(self, time: float, slider: float | None) -> None:
        """Take where the slider is, as read at a time [s]; None where it cannot be read any more."""
        self.slider, self._read_at = slider, time

    def knows(self, time: float) -> bool:
        """Whether it is known at a time [s] where the slider is."""
        return self.slider is not None and time - self._read_at <= _OLD

    def begin(self, time: float, speed: float, reaction: Reaction, watch: Watch, out: Outputs) -> bool:
        """Go slow; False where the slider is not known.

        Args:
            time: host time [s].
            speed: of the leading joint [rad/s].
            reaction: its kind is "slow".
            watch: the limits; the arm has the time of a stop to become slower.
            out: takes what comes of it.
        """
        before = self.slider
        if before is None or not self.knows(time):
            return False
        if self._last is not None and time - self._last[0] < HOLD:  # slider and speed may not yet be as before
            before, speed = self._last[1].before, max(speed, self._last[1].top)
        budget = watch.stop_budget(speed, reaction.deceleration)
        self.now = Slowing(time, speed, before, reaction.slow_to, budget, reaction.time_budget)
        out.append(Slider(self.now.fraction))
        tell(out, "slowing", time, slider=self.now.fraction, before=before)
        return True

    def look(self, time: float, touched: bool) -> str:
        """Why the arm has to be stopped after all; empty where it has not."""
        if self.now is None:
            return ""
        self.now.touched(time, touched)
        if not self.knows(time):
            return "the controller does not say any more where its speed slider is"
        return self.now.trouble(time, self.slider)

    def over(self, time: float) -> bool:
        """Whether the arm may go on as before."""
        return self.now is None or self.now.over(time)

    def put_back(self, time: float, out: Outputs) -> None:
        """End it: the slider goes to where it was, unless a person has moved it since."""
        slowing, self.now = self.now, None
        if slowing is not None and self.knows(time) and slowing.puts_back(self.slider):
            out.append(Slider(slowing.before))
            self.slider, self._last = slowing.before, (time, slowing)
