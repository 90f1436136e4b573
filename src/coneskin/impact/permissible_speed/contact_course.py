"""Course of one contact: force over time, its peak, and what is left of it when the arm stands.

Each stretch of it is a polynomial in time. Values, first roots and greatest values of polynomials are found here too.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ContactState:
    """State of a contact, in one of the straight pieces of its force."""

    s: float  #: compression [m]
    w: float  #: its rate [m/s]
    x: float  #: place of the body [m]
    v: float  #: speed of the body [m/s]
    way: float  #: of the controller's surface [m]
    drive: float  #: its speed [m/s]
    braking: float  #: its deceleration [m/s^2]
    elastic: float  #: force of the compression at rest [N]
    slope: float  #: of that force over the compression [N/m]


_STEP_PARTS = 4  # into how many parts a step is divided; a step is shorter than half a swing


def evaluate(series: Sequence[float], t: float) -> float:
    """Return the value of a polynomial, coefficients lowest power first."""
    value = 0.0
    for coefficient in reversed(series):
        value = value * t + coefficient
    return value


def _slope_of(series: Sequence[float]) -> list[float]:
    return [n * coefficient for n, coefficient in enumerate(series)][1:]


def first_fall(series: Sequence[float], end: float) -> float | None:
    """Return the first time in (0, end] at which a polynomial that begins at or above 0 falls below it.

    None where it does not. One that begins at 0 and falls does so at 0.
    """
    if _stays_above(series, end):
        return None
    slope = _slope_of(series)
    if series[0] <= 0.0 and next((c for c in slope if c), 0.0) < 0.0:
        return 0.0
    before, steep = 0.0, slope[0]
    for look in range(1, _STEP_PARTS + 1):
        t = end * look / _STEP_PARTS
        value, rate = evaluate(series, t), evaluate(slope, t)
        if value < 0.0:
            return _root(series, slope, before, t)
        if steep < 0.0 < rate:  # it has turned on the way
            lowest = _root([-c for c in slope], _slope_of([-c for c in slope]), before, t)
            if evaluate(series, lowest) < 0.0:
                return _root(series, slope, before, lowest)
        before, steep = t, rate
    return None


def greatest(series: Sequence[float], end: float) -> tuple[float, float]:
    """Return where in [0, end] a polynomial is greatest, and its value there."""
    slope = _slope_of(series)
    best = max((evaluate(series, t), t) for t in (0.0, end))
    if not slope:
        return best[1], best[0]
    before, steep = 0.0, slope[0]
    for look in range(1, _STEP_PARTS + 1):
        t = end * look / _STEP_PARTS
        rate = evaluate(slope, t)
        if steep > 0.0 > rate:
            top = _root(slope, _slope_of(slope), before, t)
            best = max(best, (evaluate(series, top), top))
        before, steep = t, rate
    return best[1], best[0]


def _stays_above(series: Sequence[float], end: float) -> bool:
    """Tell whether a polynomial cannot fall below 0 in [0, end], by the sizes of its terms; quick, and often enough."""
    power, sum_of_terms = 1.0, 0.0
    for coefficient in series[1:]:
        power *= end
        sum_of_terms += abs(coefficient) * power
    return series[0] > sum_of_terms


def _root(series: Sequence[float], slope: Sequence[float], low: float, high: float) -> float:
    """Return the root between a time at which a polynomial is at or above 0 and one at which it is below.

    Newton's method, and halving where it would leave the bracket.
    """
    t = 0.5 * (low + high)
    for _ in range(80):
        value = evaluate(series, t)
        if value == 0.0:
            return t
        if value > 0.0:
            low = t
        else:
            high = t
        rate = evaluate(slope, t)
        nearer = t - value / rate if rate else low
        if not low < nearer < high:
            nearer = 0.5 * (low + high)
        if nearer == t or high - low <= 1e-16 * high:
            return nearer
        t = nearer
    return t


@dataclass(frozen=True, slots=True)
class Stretch:
    """Stretch of time within which all quantities are polynomials in the time since its beginning."""

    start: float  #: when it begins [s]
    duration: float  #: [s]
    compression: Sequence[float]  #: coefficients, lowest power first [m]
    rate: Sequence[float]  #: of the compression [m/s]
    place: Sequence[float]  #: of the body [m]
    speed: Sequence[float]  #: of the body [m/s]
    force: Sequence[float]  #: [N]


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
        if not 0.0 <= time <= self.end or not self.stretches:
            return 0.0
        stretch = self.stretches[bisect_right(self.stretches, time, key=lambda one: one.start) - 1]
        value = evaluate(stretch.force, time - stretch.start)
        return value if math.isfinite(value) else 0.0
