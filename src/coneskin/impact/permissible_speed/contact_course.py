"""Course of one contact: force over time, its peak, and what is left of it when the arm stands."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

__all__ = ["ContactCourse", "Stretch"]


@dataclass(frozen=True, slots=True)
class Stretch:
    """Stretch of time within which all quantities are polynomials in the time since its beginning.

    Attributes:
        start: when it begins [s].
        duration: [s].
        compression: coefficients, lowest power first [m].
        rate: of the compression [m/s].
        place: of the body [m].
        speed: of the body [m/s].
        force: [N].
    """

    start: float
    duration: float
    compression: Sequence[float]
    rate: Sequence[float]
    place: Sequence[float]
    speed: Sequence[float]
    force: Sequence[float]


@dataclass(frozen=True, slots=True)
class ContactCourse:
    """Course of one contact. Times count from the first contact.

    Attributes:
        peak: greatest force [N].
        peak_time: when it acts [s].
        deepest: greatest compression [m].
        last: force at the end [N].
        rest: force once all is at rest [N].
        impulse: of the force until the end [N s].
        closed: when the layers of the sensor close [s]; infinite where they never do.
        braked: when the arm begins to brake [s].
        stopping_distance: that the controller's surface goes from the first contact on [m]; infinite where nothing
            stops it.
        end: of the course [s].
        stretches: of it, in order; empty where they were not kept.
    """

    peak: float
    peak_time: float
    deepest: float
    last: float
    rest: float
    impulse: float
    closed: float
    braked: float
    stopping_distance: float
    end: float
    stretches: tuple[Stretch, ...] = ()

    def force(self, time: float) -> float:
        """Return the force at a time [N]; 0 outside of the course."""
        return self._value(time, "force")

    def compression(self, time: float) -> float:
        """Return the compression at a time [m]."""
        return self._value(time, "compression")

    def _value(self, time: float, name: str) -> float:
        if not 0.0 <= time <= self.end or not self.stretches:
            return 0.0
        index = bisect_right([stretch.start for stretch in self.stretches], time) - 1
        stretch = self.stretches[index]
        value = 0.0
        for coefficient in reversed(getattr(stretch, name)):
            value = value * (time - stretch.start) + coefficient
        return value if math.isfinite(value) else 0.0
