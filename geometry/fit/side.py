"""Straight side of one sheet: intervals of slices that it may cover, its fit, and its rise from facets to corners.

A slice k requires of a side r(z) = a + b z that high_k - t <= r(z_k) <= low_k + t, where high and low are its largest
and smallest radius and t is the tolerance across the axis. The smallest t for an interval is the minimum over b of half
of max(high - b z) - min(low - b z), a convex function of b alone. Every part of a good interval is good, so two
pointers find all longest ones, and dynamic programming chooses at most n that cover most.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from coneskin.core.arrays import Bools, Floats
from coneskin.geometry.mesh import Mesh

from .cone_fit import InfiniteCone
from .profile import RadialProfile
from .surface_samples import SurfaceSamples

Interval = tuple[int, int]  #: first slice and the one after the last

_ROUNDING_ERROR = 1e-9  # m; so that no interval is given up that is good by rounding


def _least_deviation(z: Floats, high: Floats, low: Floats) -> tuple[float, float, float]:
    """Return the straight side with the least largest distance from all slices (Chebyshev fit).

    Args:
        z: heights [m], ascending, shape (k,).
        high: largest radii [m], shape (k,).
        low: smallest radii [m], shape (k,).

    Returns:
        largest distance between side and slices, square to the side [m]; radius at z = 0 [m]; slope dr/dz.
    """

    def value(slope: float) -> tuple[float, float, float, float]:
        line = slope * z
        above, below = high - line, low - line
        i, j = int(above.argmax()), int(below.argmin())
        top, bottom = float(above[i]), float(below[j])
        return top - bottom, float(z[j] - z[i]), top, bottom

    reach = float(z[-1] - z[0])
    if reach <= 0.0:
        gap, _, top, bottom = value(0.0)
        return 0.5 * gap, 0.5 * (top + bottom), 0.0
    bound = (float(high.max() - low.min()) + 1e-9) / (float(z[1] - z[0]))
    left, right = -bound, bound
    f_left, g_left, _, _ = value(left)
    f_right, g_right, _, _ = value(right)
    slope = 0.0
    f, g, top, bottom = value(slope)
    for _ in range(60):
        if g < 0.0:
            left, f_left, g_left = slope, f, g
        elif g > 0.0:
            right, f_right, g_right = slope, f, g
        if g == 0.0 or not g_right > g_left:
            break
        # the convex function cannot be lower than the point where the supporting lines of both sides meet
        slope = (f_left - f_right + g_right * right - g_left * left) / (g_right - g_left)
        bottom_line = f_left + g_left * (slope - left)
        f, g, top, bottom = value(slope)
        if f <= bottom_line + 1e-12:
            break
    return 0.5 * f / math.hypot(1.0, slope), 0.5 * (top + bottom), slope


def longest_intervals(z: Floats, high: Floats, low: Floats, tolerance: float, min_slices: int = 2) -> list[int]:
    """Return for each slice the end of the longest good interval that begins there; the slice itself if none does.

    The end is one past the last slice. Shorter intervals than ``min_slices`` are not tried: they do not determine the
    slope, which makes the distance from a steep side smaller than the difference in radius.
    """
    usable = (low > 0.0) & np.isfinite(high)  # 0 marks a hole in the slice
    holes = np.concatenate([np.cumsum(~usable), [0]])
    hopeless = _hopeless(z, np.where(usable, high, 0.0), np.where(usable, low, 0.0), tolerance, min_slices)
    heights, tops, bottoms = z.tolist(), high.tolist(), low.tolist()
    line = (0.0, 0.0)  # the side that was within the tolerance of the last good interval: radius at z = 0, and slope

    def good(first: int, end: int) -> bool:
        nonlocal line
        if holes[end - 1] != holes[first - 1]:
            return False
        if end - first > min_slices:  # all but the last slice are known to be within the tolerance of the line
            radius = line[0] + line[1] * heights[end - 1]
            limit = tolerance * math.hypot(1.0, line[1])
            if tops[end - 1] - limit <= radius <= bottoms[end - 1] + limit:
                return True
        window = slice(first, end)
        off, *side = _least_deviation(z[window], high[window], low[window])
        if off <= tolerance:
            line = (side[0], side[1])
        return off <= tolerance

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
        return _least_deviation(z[first:end], high[first:end], low[first:end])[0]

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


@dataclass(frozen=True, slots=True)
class StraightSide:
    """A straight side over some cells of a profile."""

    first: int  #: index of the first slice
    end: int  #: index after the last slice
    column: int  #: index of the first azimuth
    columns: int  #: number of azimuths; all of them for a full wrap
    radius: float  #: radius at z = 0 of the profile's frame [m]
    slope: float  #: dr/dz
    rise: float = 0.0  #: part of the radius that makes up for facets inside the true surface [m]

    def radii(self, z: Floats) -> Floats:
        """Return the radii at heights z [m]."""
        return np.asarray(self.radius + self.slope * z)

    def area(self, profile: RadialProfile) -> float:
        """Return the area of the side, by the weights of the profile [m2]."""
        radii = self.radii(profile.z[self.first : self.end])
        cell = profile.step * 2.0 * math.pi / len(profile.phi) * math.hypot(1.0, self.slope)
        if profile.weight is None:
            return float(radii.sum()) * self.columns * cell
        cells = profile.azimuths(self.column, self.columns)
        return float(radii @ profile.weight[self.first : self.end][:, cells].sum(axis=1)) * cell

    def covers(self, profile: RadialProfile, hull: SurfaceSamples, tolerance: float) -> Bools:
        """Return whether it covers each sample of the hull, shape (n,): 1.5 times ``tolerance`` [m] from it or less."""
        local = profile.frame.local(hull.points)
        z = local[:, 2]
        half = 0.5 * profile.step
        inside = (z >= profile.z[self.first] - half) & (z <= profile.z[self.end - 1] + half)
        width = 2.0 * math.pi / len(profile.phi)
        azimuth = (np.arctan2(local[:, 1], local[:, 0]) - self.column * width + 0.5 * width) % (2.0 * math.pi)
        inside &= azimuth <= self.columns * width
        miss = np.sqrt(local[:, 0] ** 2 + local[:, 1] ** 2) - self.radii(z)
        return np.asarray(inside & (np.abs(miss) <= 1.5 * tolerance * math.hypot(1.0, self.slope)))


def fit_side(
    profile: RadialProfile, first: int, end: int, column: int, columns: int, tolerance: float, offset: float = 0.0
) -> StraightSide:
    """Fit a straight side to a region and trim the region to the part within the tolerance.

    A robust mean line follows the body rather than the fillets at the ends of an interval. The line of least deviation
    would cover a little more of a tube by leaning into the fillets. It is used only where the body itself is curved (a
    barrel) and the mean line would lose more than 3 % of the length.

    Args:
        first: first slice.
        end: slice after the last.
        column: first azimuth.
        columns: number of azimuths.
        tolerance: largest distance from the side [m].
        offset: added to the radius of the mean line, because facets lie inside the true surface [m].
    """
    across = profile.azimuths(column, columns)
    z = profile.z[first:end]
    radius = profile.radius[first:end][:, across]
    high, low = radius.max(axis=1), profile.floor(tolerance)[first:end][:, across].min(axis=1)
    middle = np.median(radius, axis=1)
    typical = np.abs(radius - middle[:, None]) <= 2.0 * tolerance
    count = typical.sum(axis=1)
    means = np.where(count > 0, (radius * typical).sum(axis=1) / np.maximum(count, 1), middle)
    start, slope = _line(z, means, tolerance)
    start += offset * math.hypot(1.0, slope)
    limit = tolerance * math.hypot(1.0, slope)
    line = start + slope * z
    run = longest_run((high <= line + limit) & (low >= line - limit))
    straight = float(np.median(np.abs(means + offset * math.hypot(1.0, slope) - line))) < 0.15 * limit
    if run[1] > run[0] and (straight or run[1] - run[0] >= 0.97 * (end - first)):
        return StraightSide(first + run[0], first + run[1], column, columns, start, slope, offset)
    _, start, slope = _least_deviation(z, high, low)
    return StraightSide(first, end, column, columns, start, slope)


def _line(z: Floats, radius: Floats, spread: float) -> tuple[float, float]:
    """Fit a line to (z, radius) with Tukey's weights; return the radius at z = 0 and the slope."""
    weights = np.ones(len(z))
    start, slope = _median(radius), 0.0
    if len(z) < 3:
        return start, slope
    for _ in range(20):
        total = float(weights.sum())
        if total <= 0.0:  # no slice is near the last line
            break
        zm, rm = float(weights @ z) / total, float(weights @ radius) / total
        lever = float(weights @ (z - zm) ** 2)
        if lever <= 0.0:  # only one is
            break
        before = start, slope
        slope = float(weights @ ((z - zm) * (radius - rm))) / lever
        start = rm - slope * zm
        if abs(start - before[0]) < 1e-8 and abs(slope - before[1]) < 1e-7:
            break
        miss = np.abs(radius - start - slope * z)
        # fillets at the ends must not bias the line: the scale is the spread of the better half
        scale = min(max(4.0 * _median(miss), 0.05 * spread), 2.0 * spread)
        weights = np.where(miss < scale, (1.0 - (miss / scale) ** 2) ** 2, 0.0)
    return start, slope


def _median(values: Floats) -> float:
    """Return the median of not many numbers; ``numpy.median`` takes longer to begin than to find it."""
    ordered = np.sort(values)
    middle = len(ordered) // 2
    return float(ordered[middle] if len(ordered) % 2 else 0.5 * (ordered[middle - 1] + ordered[middle]))


def longest_run(good: Bools) -> tuple[int, int]:
    """Return the first and the end of the longest run of True, 0 and 0 where there is none."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], good, [False]]).astype(np.int8)))
    if len(edges) == 0:
        return 0, 0
    longest = int((edges[1::2] - edges[::2]).argmax())
    return int(edges[2 * longest]), int(edges[2 * longest + 1])


def facet_offset(mesh: Mesh, samples: SurfaceSamples, cone: InfiniteCone, tolerance: float) -> float:
    """Return the mean distance by which the corners of the facets lie outside the facets [m].

    A tessellated tube has its corners on the tube and its facets inside; a fit to the facets is too small by two thirds
    of the sagitta (0.034 mm for 72 facets around 54 mm). A decimated mesh has corners on both sides (UR5's collision
    bodies), and its facets are the better estimate, so the result is 0 unless the corners agree to a fifth of the rise.

    Args:
        samples: points of the hull in the region of the sheet.
        cone: the fitted side.
        tolerance: largest distance of a sample from the side [m].
    """
    inside = np.abs(cone.distances(samples.points)) < tolerance
    inside &= cone.alignment(samples.points, samples.normals) > 0.97
    if int(inside.sum()) < 24:
        return 0.0
    points, faces = samples.points[inside], mesh.faces[samples.faces[inside]]
    corners = cone.distances(mesh.vertices[faces.ravel()]).reshape(-1, 3)
    rise = corners.mean(axis=1) - cone.distances(points)
    sound = np.abs(corners).max(axis=1) < 2.0 * tolerance
    if int(sound.sum()) < 24:
        return 0.0
    mean, off = float(rise[sound].mean()), corners[sound].ravel()
    # the sagitta grows with the radius, so the distances of the corners of a steep cone form a line over the height
    heights = cone.cylindrical_coordinates(mesh.vertices[faces[sound].ravel()])[1]
    if np.ptp(heights) > tolerance:
        off = off - np.polynomial.Polynomial.fit(heights, off, 1)(heights)
    spread = float(np.median(np.abs(off))) * 1.4826  # an estimate of the standard deviation
    return mean if spread <= 0.2 * abs(mean) else 0.0
