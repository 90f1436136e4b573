"""Polynomials of one step of the integrator: their values, their first root, their greatest value."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["evaluate", "first_fall", "greatest"]

_LOOKS = 4  # into how many parts a step is divided; a step is shorter than half a swing


def evaluate(series: Sequence[float], t: float) -> float:
    """Return the value of a polynomial, coefficients lowest power first."""
    value = 0.0
    for coefficient in reversed(series):
        value = value * t + coefficient
    return value


def slope_of(series: Sequence[float]) -> list[float]:
    """Return the coefficients of the derivative."""
    return [n * coefficient for n, coefficient in enumerate(series)][1:]


def first_fall(series: Sequence[float], end: float) -> float | None:
    """Return the first time in (0, end] at which a polynomial that begins at or above 0 falls below it.

    None where it does not. One that begins at 0 and falls does so at 0.
    """
    if _stays_above(series, end):
        return None
    slope = slope_of(series)
    if series[0] <= 0.0 and next((c for c in slope if c), 0.0) < 0.0:
        return 0.0
    before, steep = 0.0, slope[0]
    for look in range(1, _LOOKS + 1):
        t = end * look / _LOOKS
        value, rate = evaluate(series, t), evaluate(slope, t)
        if value < 0.0:
            return _root(series, slope, before, t)
        if steep < 0.0 < rate:  # it has turned on the way
            lowest = _root([-c for c in slope], slope_of([-c for c in slope]), before, t)
            if evaluate(series, lowest) < 0.0:
                return _root(series, slope, before, lowest)
        before, steep = t, rate
    return None


def greatest(series: Sequence[float], end: float) -> tuple[float, float]:
    """Return where in [0, end] a polynomial is greatest, and its value there."""
    slope = slope_of(series)
    best = max((evaluate(series, t), t) for t in (0.0, end))
    if not slope:
        return best[1], best[0]
    before, steep = 0.0, slope[0]
    for look in range(1, _LOOKS + 1):
        t = end * look / _LOOKS
        rate = evaluate(slope, t)
        if steep > 0.0 > rate:
            top = _root(slope, slope_of(slope), before, t)
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
