"""Intervals of slices that become sheets, each within the tolerance of one straight side.

A slice k requires of a side r(z) = a + b z that high_k - t <= r(z_k) <= low_k + t, where high and low are its largest
and smallest radius and t is the tolerance across the axis. The smallest t for an interval is the minimum over b of half
of max(high - b z) - min(low - b z), a convex function of b alone. Every part of a good interval is good, so two
pointers find all longest ones, and dynamic programming chooses at most n that cover most.
"""

from __future__ import annotations

import math

import numpy as np

from coneskin.core.arrays import Floats

Interval = tuple[int, int]  #: first slice and the one after the last

_ROUNDING_ERROR = 1e-9  # m; so that no interval is given up that is good by rounding


def least_deviation(z: Floats, high: Floats, low: Floats) -> tuple[float, float, float]:
    """Return the straight side with the least largest distance from all slices (Chebyshev fit).

    Args:
        z: heights [m], ascending, shape (k,).
        high: largest radii [m], shape (k,).
        low: smallest radii [m], shape (k,).

    Returns:
        largest distance between side and slices, square to the side [m]; radius at z = 0 [m]; slope dr/dz.
    """
    deviation, radius, slope, _ = _chebyshev(z, high, low)
    return deviation, radius, slope


def _chebyshev(z: Floats, high: Floats, low: Floats) -> tuple[float, float, float, int]:
    """Return what ``least_deviation`` does, and the first of the slices that by themselves deviate as much."""

    def value(slope: float) -> tuple[float, float, float, float, int]:
        line = slope * z
        above, below = high - line, low - line
        i, j = int(above.argmax()), int(below.argmin())
        top, bottom = float(above[i]), float(below[j])
        return top - bottom, float(z[j] - z[i]), top, bottom, min(i, j)

    reach = float(z[-1] - z[0])
    if reach <= 0.0:
        gap, _, top, bottom, first = value(0.0)
        return 0.5 * gap, 0.5 * (top + bottom), 0.0, first
    bound = (float(high.max() - low.min()) + 1e-9) / (float(z[1] - z[0]))
    left, right = -bound, bound
    f_left, g_left, _, _, i_left = value(left)
    f_right, g_right, _, _, i_right = value(right)
    slope, first = 0.0, 0
    f, g, top, bottom, i = value(slope)
    for _ in range(60):
        if g < 0.0:
            left, f_left, g_left, i_left = slope, f, g, i
        elif g > 0.0:
            right, f_right, g_right, i_right = slope, f, g, i
        else:
            first = i
            break
        if not g_right > g_left:
            break
        # the convex function cannot be lower than the point where the supporting lines of both sides meet
        slope = (f_left - f_right + g_right * right - g_left * left) / (g_right - g_left)
        bottom_line = f_left + g_left * (slope - left)
        f, g, top, bottom, i = value(slope)
        if f <= bottom_line + 1e-12:
            first = min(i_left, i_right)
            break
    return 0.5 * f / math.hypot(1.0, slope), 0.5 * (top + bottom), slope, first


def longest_intervals(z: Floats, high: Floats, low: Floats, tolerance: float, min_slices: int = 2) -> list[int]:
    """Return for each slice the end of the longest good interval that begins there; the slice itself if none does.

    The end is one past the last slice. Shorter intervals than ``min_slices`` are not tried: they do not determine the
    slope, which makes the distance from a steep side smaller than the difference in radius.
    """
    usable = (low > 0.0) & np.isfinite(high)  # 0 marks a hole in the slice
    holes = np.concatenate([np.cumsum(~usable), [0]])
    hopeless = _hopeless(z, np.where(usable, high, 0.0), np.where(usable, low, 0.0), tolerance, min_slices)
    heights, tops, bottoms = z.tolist(), high.tolist(), low.tolist()
    # of the last interval that deviates too much: first of the slices that decide, its end, distance along the radii
    bad = (-1, -1, 0.0)
    line = (0.0, 0.0)  # the side that was within the tolerance of the last good interval: radius at z = 0, and slope

    def steepest(first: int, end: int) -> float:
        """Return a bound of distance along the radii by distance square to the side; as in ``_hopeless``."""
        spread = float(high[first:end].max() - low[first:end].min())
        climb = spread - min(tops[first] - bottoms[end - 1], tops[end - 1] - bottoms[first])
        return math.hypot(1.0, climb / (heights[end - 1] - heights[first]))

    def good(first: int, end: int) -> bool:
        nonlocal line, bad
        if holes[end - 1] != holes[first - 1]:
            return False
        if end - first > min_slices:  # all but the last slice are known to be within the tolerance of the line
            if end == bad[1] and first <= bad[0] and bad[2] > tolerance * steepest(first, end):
                return False
            radius = line[0] + line[1] * heights[end - 1]
            limit = tolerance * math.hypot(1.0, line[1])
            if tops[end - 1] - limit <= radius <= bottoms[end - 1] + limit:
                return True
        window = slice(first, end)
        off, *side, deciding = _chebyshev(z[window], high[window], low[window])
        if off > tolerance:
            bad = (first + deciding, end, off * math.hypot(1.0, side[1]))
            return False
        line = (side[0], side[1])
        return True

    ends: list[int] = []
    stop = 0
    for first in range(len(z)):
        if stop < first + min_slices:
            if first >= len(hopeless) or hopeless[first] or not good(first, first + min_slices):
                ends.append(first)
                continue
            stop = first + min_slices
        while stop < len(z) and good(first, stop + 1):
            stop += 1
        ends.append(stop)
    return ends


def _hopeless(z: Floats, high: Floats, low: Floats, tolerance: float, count: int) -> list[bool]:
    """Return for each run of ``count`` slices whether its least round slice alone keeps it from being good.

    Half of max(high - low) is a bound of the distance along the radii. Square to the side it is less by the cosine of
    the slope, which is bounded as well: with a steeper side the first and the last slice deviate more than all do from
    a level one.
    """
    if len(z) < count:
        return []
    tops, bottoms, gaps = (np.lib.stride_tricks.sliding_window_view(a, count) for a in (high, low, high - low))
    spread = tops.max(axis=1) - bottoms.min(axis=1)
    first, last = slice(None, len(z) - count + 1), slice(count - 1, None)
    climb = spread - np.minimum(high[first] - low[last], high[last] - low[first])
    steepest = climb / (z[last] - z[first])
    hopeless: list[bool] = (0.5 * gaps.max(axis=1) > (tolerance + _ROUNDING_ERROR) * np.hypot(1.0, steepest)).tolist()
    return hopeless


def choose_intervals(
    ends: list[int], max_count: int, min_slices: int = 2, worth: Floats | None = None
) -> list[Interval]:
    """Choose the intervals, up to a number, that together cover most.

    Args:
        ends: for each slice the end of the longest good interval that begins there (``longest_intervals``).
        max_count: number of intervals at most.
        min_slices: slices that an interval must have, at least 2.
        worth: what each slice counts, not negative, shape (k,); 1 by default.

    Returns:
        the intervals, in order; as few as cover most; empty where none is long enough.
    """
    count = len(ends)
    total = np.concatenate([[0.0], np.cumsum(np.ones(count) if worth is None else worth)])
    starts = np.zeros(count + 1, dtype=int)  # earliest good start for every end
    first = 0
    for end in range(1, count + 1):
        while first < end and ends[first] < end:
            first += 1
        starts[end] = first
    covered = np.zeros((max_count + 1, count + 1))
    origin = np.full((max_count + 1, count + 1), -1)
    for n in range(1, max_count + 1):
        for end in range(1, count + 1):
            covered[n, end] = covered[n, end - 1]
            last_start = end - min_slices
            if starts[end] <= last_start:
                options = covered[n - 1, starts[end] : last_start + 1] - total[starts[end] : last_start + 1]
                best = int(options.argmax())
                if options[best] + total[end] > covered[n, end] + 1e-12 * total[-1]:
                    covered[n, end] = options[best] + total[end]
                    origin[n, end] = starts[end] + best
    used = 0
    while used < max_count and covered[used + 1, count] > covered[used, count] + 1e-9 * total[-1]:
        used += 1
    chosen: list[Interval] = []
    end = count
    for n in range(used, 0, -1):
        while end > 0 and origin[n, end] < 0:
            end -= 1
        if end == 0:  # fewer than n cover as much
            break
        chosen.append((int(origin[n, end]), end))
        end = int(origin[n, end])
    return chosen[::-1]


def balance_borders(
    z: Floats, high: Floats, low: Floats, chosen: list[Interval], min_slices: int = 2
) -> list[Interval]:
    """Move the borders between neighbours to where both deviate equally, such as the belt of a double cone.

    Args:
        z: heights [m], ascending, shape (k,).
        high: largest radii [m], shape (k,).
        low: smallest radii [m], shape (k,).
        chosen: intervals in order.
        min_slices: slices that an interval must keep.
    """
    chosen = list(chosen)

    def deviation(first: int, end: int) -> float:
        return least_deviation(z[first:end], high[first:end], low[first:end])[0]

    for _ in range(2):
        for n in range(len(chosen) - 1):
            (first, border), (after, end) = chosen[n], chosen[n + 1]
            if border != after:
                continue
            lowest, highest = first + min_slices, end - min_slices
            while lowest < highest:  # the left deviation grows with the border, the right one falls
                middle = (lowest + highest) // 2
                if deviation(first, middle) < deviation(middle, end):
                    lowest = middle + 1
                else:
                    highest = middle
            best = min(
                range(max(first + min_slices, lowest - 1), min(end - min_slices, lowest) + 1),
                key=lambda b: max(deviation(first, b), deviation(b, end)),
                default=border,
            )
            chosen[n], chosen[n + 1] = (first, best), (best, end)
    return chosen
