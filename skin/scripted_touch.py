"""A touch of a virtual skin: where, when and how firmly. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass

from coneskin.errors import SensorError

from .substrate import Foam

__all__ = ["ScriptedTouch"]

_FORGOTTEN = 40.0  # relaxation times, after which nothing is left of a touch


@dataclass(frozen=True, slots=True)
class ScriptedTouch:
    """One touch of the script.

    Attributes:
        start: when it begins [s].
        end: when it ends [s]; may be infinite.
        u: slant distance from end 1 [m].
        phi: azimuth [rad].
        force: at its firmest [N].
        rise: time in which the force rises, and falls again [s].
        radius: of a flat body's face [m]; 0 for a round body, whose contact grows with the force.
        sensor: name of the sensor touched; empty: the first.

    Raises:
        SensorError: it ends before it begins, or a value is negative or not finite.
    """

    start: float
    end: float
    u: float
    phi: float
    force: float = 5.0
    rise: float = 0.01
    radius: float = 0.0
    sensor: str = ""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.start) and self.end > self.start):
            raise SensorError(f"a touch must end after it starts, got {self.start!r} s to {self.end!r} s")
        for name in ("u", "phi", "force", "rise", "radius"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise SensorError(f"touch.{name} must be finite and not negative, got {value!r}")

    def force_at(self, time: float) -> float:
        """Force at a time [N]: it rises and falls along half a cosine."""
        since = min(time - self.start, self.end - time)
        if since <= 0.0:
            return 0.0
        return self.force if since >= self.rise else 0.5 * self.force * (1.0 - math.cos(math.pi * since / self.rise))

    def seated_at(self, time: float, foam: Foam) -> float:
        """Force that would in the end press the foam as far as it is pressed at a time [N]."""
        since, length = time - self.start, self.end - self.start
        if since <= 0.0 or since > length + _FORGOTTEN * foam.relaxation_time:
            return 0.0
        swing, state = 0.5 * self.force, 0.0
        ramp = min(self.rise, 0.5 * length)  # a short touch turns back on its way up
        if ramp > 0.0:
            rate = math.pi / self.rise
            state = foam.advance_swing(state, swing, swing, rate, 0.0, min(since, ramp))
        state = foam.advance(state, self.force, min(max(since - ramp, 0.0), length - 2.0 * ramp))
        if ramp > 0.0 and since > length - ramp:
            state = foam.advance_swing(state, swing, swing, -rate, rate * ramp, min(since - length, 0.0) + ramp)
        state = foam.advance(state, 0.0, max(since - length, 0.0))
        return foam.seated(state, self.force_at(time))
