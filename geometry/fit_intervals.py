"""Which lengths of a link become sheets: intervals of slices, each within the tolerance of one straight side.

A slice k asks of a side r(z) = a + b z that high_k - t <= r(z_k) <= low_k + t, where high and low are its largest and
smallest radius and t the tolerance across the axis. The least t for an interval is the least over b of half of
max(high - b z) - min(low - b z), a convex function of b alone. An interval inside a good one is good, so two pointers
find every longest one, and a dynamic programme chooses at most n that cover most.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["balance", "choose_intervals", "least_deviation", "longest_from"]

Floats = NDArray[np.float64]
Interval = tuple[int, int]  #: first slice and the one after the last


def least_deviation(z: Floats, high: Floats, low: Floats) -> tuple[float, float, float]:
    """The straight side that stays nearest to all slices.

    Args:
        z: heights [m], ascending, shape (k,).
        high: largest radii [m], shape (k,).
        low: smallest radii [m], shape (k,).

    Returns:
        largest distance between side and slices, square to the side [m]; radius at z = 0 [m]; slope dr/dz.
    """

    def value(slope: float) -> tuple[float, float, float, float]:
        above, below = high - slope * z, low - slope * z
        i, j = int(above.argmax()), int(below.argmin())
        return float(above[i] - below[j]), float(z[j] - z[i]), float(above[i]), float(below[j])

    reach = float(z[-1] - z[0])
    if reach <= 0.0:
        gap, _, top, bottom = value(0.0)
        return 0.5 * gap, 0.5 * (top + bottom), 0.0
    bound = (float(high.max() - low.min()) + 1e-9) / (float(z[1] - z[0]))
    left, right = -bound, bound
    f_left, g_left, *_ = value(left)
    f_right, g_right, *_ = value(right)
    slope = 0.0
    f, g, top, bottom = value(slope)
    for _ in range(60):
        if g < 0.0:
            left, f_left, g_left = slope, f, g
        elif g > 0.0:
            right, f_right, g_right = slope, f, g
        else:
            break
        if not g_right > g_left:
            break
        # where the supporting lines of both sides meet, the convex function cannot be lower
        slope = (f_left - f_right + g_right * right - g_left * left) / (g_right - g_left)
        bottom_line = f_left + g_left * (slope - left)
        f, g, top, bottom = value(slope)
        if f <= bottom_line + 1e-12:
            break
    return 0.5 * f / math.hypot(1.0, slope), 0.5 * (top + bottom), slope


def longest_from(z: Floats, high: Floats, low: Floats, tolerance: float, shortest: int = 2) -> list[int]:
    """For each slice, the end (one past the last) of the longest good interval that begins there; itself if none does.

    Intervals begin with the shortest that counts: fewer slices do not know the slope, by which the distance across a
    steep side is smaller than that across the axis.
    """
    usable = (low > 0.0) & np.isfinite(high)  # 0 marks a hole through the slice

    def good(first: int, end: int) -> bool:
        window = slice(first, end)
        if end > len(z) or not usable[window].all():
            return False
        return least_deviation(z[window], high[window], low[window])[0] <= tolerance

    ends: list[int] = []
    stop = 0
    for first in range(len(z)):
        if stop < first + shortest:
            if not good(first, first + shortest):
                ends.append(first)
                continue
            stop = first + shortest
        while stop < len(z) and good(first, stop + 1):
            stop += 1
        ends.append(stop)
    return ends


def choose_intervals(
    z: Floats, high: Floats, low: Floats, tolerance: float, most: int, shortest: int = 2, gain: int = 1
) -> list[Interval]:
    """At most n intervals that cover most slices.

    Args:
        z: heights [m], ascending, shape (k,).
        high: largest radii [m], shape (k,).
        low: smallest radii [m], 0 where a slice has a hole, shape (k,).
        tolerance: largest distance from the side [m].
        most: number of intervals at most.
        shortest: slices that an interval must have, at least 2.
        gain: slices that a further interval must add to the cover.

    Returns:
        the intervals, in order; empty where none is long enough.
    """
    ends = longest_from(z, high, low, tolerance, shortest)
    count = len(z)
    starts = np.zeros(count + 1, dtype=int)  # earliest good start for every end
    first = 0
    for end in range(1, count + 1):
        while first < end and ends[first] < end:
            first += 1
        starts[end] = first
    covered = np.zeros((most + 1, count + 1))
    origin = np.full((most + 1, count + 1), -1)
    for n in range(1, most + 1):
        for end in range(1, count + 1):
            covered[n, end] = covered[n, end - 1]
            last_start = end - shortest
            if starts[end] <= last_start:
                options = covered[n - 1, starts[end] : last_start + 1] - np.arange(starts[end], last_start + 1)
                best = int(options.argmax())
                if options[best] + end > covered[n, end]:
                    covered[n, end] = options[best] + end
                    origin[n, end] = starts[end] + best
    used = 0
    while used < most and covered[used + 1, count] >= covered[used, count] + max(gain, 1):
        used += 1
    chosen: list[Interval] = []
    end = count
    for n in range(used, 0, -1):
        while end > 0 and origin[n, end] < 0:
            end -= 1
        if end == 0:  # fewer than n do as well
            break
        chosen.append((int(origin[n, end]), end))
        end = int(origin[n, end])
    return balance(z, high, low, chosen[::-1], shortest)


def balance(z: Floats, high: Floats, low: Floats, chosen: list[Interval], shortest: int = 2) -> list[Interval]:
    """Move the borders between neighbours to where both deviate alike: the belt of a double cone."""
    chosen = list(chosen)

    def deviation(first: int, end: int) -> float:
        return least_deviation(z[first:end], high[first:end], low[first:end])[0]

    for _ in range(2):
        for n in range(len(chosen) - 1):
            (first, border), (after, end) = chosen[n], chosen[n + 1]
            if border != after:
                continue
            lowest, highest = first + shortest, end - shortest
            while lowest < highest:  # the left deviation grows with the border, the right one falls
                middle = (lowest + highest) // 2
                if deviation(first, middle) < deviation(middle, end):
                    lowest = middle + 1
                else:
                    highest = middle
            best = min(
                range(max(first + shortest, lowest - 1), min(end - shortest, lowest) + 1),
                key=lambda b: max(deviation(first, b), deviation(b, end)),
                default=border,
            )
            chosen[n], chosen[n + 1] = (first, best), (best, end)
    return chosen
