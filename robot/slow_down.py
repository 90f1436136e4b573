"""The slow reaction of one arm: lowers the speed slider, follows what comes of it, and puts it back. Pure."""

from __future__ import annotations

from .commands import Reaction
from .outputs import Outputs, tell
from .slowing import HOLD, Slider, Slowing

__all__ = ["SlowDown"]


class SlowDown:
    """See the module.

    Attributes:
        slider: where the controller's speed slider is; None where that is not known.
        now: what is under way, or None.
    """

    def __init__(self) -> None:
        self.slider: float | None = None
        self.now: Slowing | None = None
        self._last: tuple[float, Slowing] | None = None  # when it was over, and what

    def begin(self, time: float, speed: float, reaction: Reaction, patience: float, out: Outputs) -> bool:
        """Go slow; False where the slider is not known.

        Args:
            time: host time [s].
            speed: of the leading joint [rad/s].
            reaction: its kind is "slow".
            patience: that the arm has besides v / a to become slower [s].
            out: takes what comes of it.
        """
        before = self.slider
        if before is None:
            return False
        if self._last is not None and time - self._last[0] < HOLD:  # slider and speed may not yet be as before
            before, speed = self._last[1].before, max(speed, self._last[1].top)
        budget = speed / reaction.deceleration + patience
        self.now = Slowing(time, speed, before, reaction.slow_to, budget, reaction.time_budget)
        out.append(Slider(self.now.fraction))
        tell(out, "slowing", time, slider=self.now.fraction, before=before)
        return True

    def look(self, time: float, touched: bool) -> str:
        """Why the arm has to be stopped after all; empty where it has not."""
        if self.now is None:
            return ""
        self.now.touched(time, touched)
        return self.now.trouble(time, self.slider)

    def over(self, time: float) -> bool:
        """Whether the arm may go on as before."""
        return self.now is None or self.now.over(time)

    def put_back(self, time: float, out: Outputs) -> None:
        """End it: the slider goes to where it was, unless a person has moved it since."""
        slowing, self.now = self.now, None
        if slowing is not None and slowing.puts_back(self.slider):
            out.append(Slider(slowing.before))
            self.slider, self._last = slowing.before, (time, slowing)
