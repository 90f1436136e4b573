"""Outcome of a collision in physics: what the body had to bear, and how soon the arm stood."""

from __future__ import annotations

import math
from dataclasses import dataclass

__all__ = ["CLAMP_TIME", "ImpactMeter", "ImpactOutcome"]

#: s after the first contact from which on a force counts as clamping; ISO/TS 15066, 5.5.5.3: a transient contact is
#: over by then
CLAMP_TIME = 0.5
_STANDS = 0.01  # rad/s below which a joint counts as standing
_RESTED = 0.005  # s for which all must; a reaction moves the arm again soon after


@dataclass(frozen=True, slots=True)
class ImpactOutcome:
    """Outcome of one collision. Times count from the first contact.

    Attributes:
        peak: greatest force of one skin on one body [N].
        clamp: sum of all forces after ``CLAMP_TIME`` [N].
        impulse: of all forces until then [N s].
        depth: greatest indentation of the padding [m].
        approach: speed of the surfaces towards each other as they met [m/s].
        noticed: when the guard, or the force limit, gave its first command [s]; NaN where it gave none.
        standstill: when the arm first stood, measured [s]; NaN where it did not.
    """

    peak: float = 0.0
    clamp: float = 0.0
    impulse: float = 0.0
    depth: float = 0.0
    approach: float = 0.0
    noticed: float = math.nan
    standstill: float = math.nan


class ImpactMeter:
    """Meter of one collision, which is shown the plant after each step.

    Attributes:
        began: time of the first contact [s]; NaN before.
    """

    def __init__(self) -> None:
        self.began = math.nan
        self._approach = self._clamp = self._impulse = self._peak = self._depth = 0.0
        self._noticed = self._stood = self._now = math.nan

    @property
    def over(self) -> bool:
        """True once the clamping force was taken."""
        return self._now - self.began > CLAMP_TIME

    def take(
        self, time: float, force: float, rate: float, peak: float, depth: float, impulse: float, speed: float
    ) -> None:
        """Take a step.

        Args:
            time: [s].
            force: sum of all forces now [N].
            rate: greatest speed of the surfaces towards each other now [m/s].
            peak: greatest force so far [N].
            depth: greatest indentation so far [m].
            impulse: so far [N s].
            speed: of the fastest joint, measured [rad/s].
        """
        if math.isnan(self.began):
            if peak <= 0.0:
                return
            self.began, self._approach = time, rate
        self._peak, self._depth = peak, depth
        if time - self.began <= CLAMP_TIME:
            self._impulse, self._clamp = impulse, force
        if self._now - self._stood < _RESTED and speed > _STANDS:
            self._stood = math.nan
        elif math.isnan(self._stood) and speed <= _STANDS:
            self._stood = time
        self._now = time

    def notice(self, time: float) -> None:
        """Take the first command of what protects the body [s]."""
        if math.isnan(self._noticed):
            self._noticed = time

    @property
    def outcome(self) -> ImpactOutcome:
        """Outcome so far."""
        stood = self._stood if self._now - self._stood >= _RESTED else math.nan
        return ImpactOutcome(
            self._peak,
            self._clamp,
            self._impulse,
            self._depth,
            self._approach,
            self._noticed - self.began,
            stood - self.began,
        )
