"""Setting of the controller's speed slider by the guard, beside a person who may move it as well. Pure.

The slider is read some time after it was set. Until then it may still show what it was before, or an earlier setting of
the guard; whatever else it shows was set by a person.
"""

from __future__ import annotations

import math

__all__ = ["SliderSetting"]

_READ_TOLERANCE = 0.01  # of the slider; between what was set and what is read
_READ_DELAY = 0.5  # s after which it must show what was set


class SliderSetting:
    """Setting of one slider.

    Attributes:
        ceiling: where a person has put it.
        fraction: where the guard has put it; None where that has not, or a person has moved it since.
        set_at: when that was [s].
    """

    def __init__(self) -> None:
        self.ceiling = 1.0
        self.fraction: float | None = None
        self.set_at = -math.inf
        self._expected: list[float] = []  # what may be read, the oldest first, until the newest is
        self._late: list[float] = []  # what may still arrive after a person's setting
        self._resumes = False

    @property
    def shown(self) -> bool:
        """True where the slider was read where the guard has put it."""
        return self.fraction is not None and len(self._expected) == 1

    def note(self, now: float, slider: float) -> bool:
        """Take where the slider is at a time [s]; return whether a person has moved it there."""
        if self.fraction is None:
            if now - self.set_at <= _READ_DELAY and any(abs(slider - value) <= _READ_TOLERANCE for value in self._late):
                self.fraction, self._expected, self._late = slider, [slider], []  # it was under way to the controller
                return False
            moved, self.ceiling = abs(slider - self.ceiling) > _READ_TOLERANCE, slider
            return moved
        if self._resumes:
            self._resumes, self.set_at = False, now
        shown = [number for number, value in enumerate(self._expected) if abs(slider - value) <= _READ_TOLERANCE]
        if shown:
            del self._expected[: shown[-1]]
        if shown and (len(self._expected) == 1 or now - self.set_at <= _READ_DELAY):
            return False
        self._late = self._expected[1:]
        self.ceiling, self.fraction = slider, None
        return True

    def set(self, now: float, fraction: float, slider: float) -> None:
        """Note that the guard sets the slider, which was read last at ``slider``."""
        if self.fraction is None:
            self._expected = [slider]
        self._expected.append(fraction)
        self.fraction, self.set_at = fraction, now

    def resume(self) -> None:
        """Note that a stop may have put the slider to 0, and that it is put back now."""
        if self.fraction is not None:
            self._expected, self._resumes = [0.0, self.fraction], True

    def found(self, slider: float) -> float | None:
        """Return where to put the slider back to, from ``slider``; None where it is not where the guard has put it."""
        if self.fraction is None or all(abs(slider - value) > _READ_TOLERANCE for value in self._expected):
            return None
        return self.ceiling
