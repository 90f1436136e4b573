"""Straight side of one sheet: fitted to the slices it covers, then raised from the facets to their corners."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from coneskin.core.arrays import Bools, Floats
from coneskin.geometry.mesh import Mesh

from .cone_fit import InfiniteCone
from .intervals import least_deviation
from .profile import RadialProfile
from .surface_samples import SurfaceSamples


@dataclass(frozen=True, slots=True)
class StraightSide:
    """A straight side over some cells of a profile.

    Attributes:
        first: index of the first slice.
        end: index after the last slice.
        column: index of the first azimuth.
        columns: number of azimuths; all of them for a full wrap.
        radius: radius at z = 0 of the profile's frame [m].
        slope: dr/dz.
        rise: part of the radius that makes up for facets inside the true surface [m].
    """

    first: int
    end: int
    column: int
    columns: int
    radius: float
    slope: float
    rise: float = 0.0

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


def fit_side(
    profile: RadialProfile, first: int, end: int, column: int, columns: int, tolerance: float, offset: float = 0.0
) -> StraightSide:
    """Fit a straight side to a region and trim the region to the part within the tolerance.

    A robust mean line follows the body rather than the fillets at the ends of an interval. The line of least deviation
    would cover a little more of a tube by leaning into the fillets. It is used only where the body itself is curved (a
    barrel) and the mean line would lose more than 3 % of the length.

    Args:
        profile: the hull about the axis.
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
    _, start, slope = least_deviation(z, high, low)
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
        before = start, slope
        slope = float(weights @ ((z - zm) * (radius - rm)) / (weights @ (z - zm) ** 2))
        start = rm - slope * zm
        if abs(start - before[0]) < 1e-10 and abs(slope - before[1]) < 1e-9:
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
        mesh: the link.
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


def covered_points(profile: RadialProfile, side: StraightSide, hull: SurfaceSamples, tolerance: float) -> Bools:
    """Return whether a side covers each point of the hull, shape (n,); it covers 1.5 times ``tolerance`` [m]."""
    local = profile.frame.local(hull.points)
    z = local[:, 2]
    half = 0.5 * profile.step
    inside = (z >= profile.z[side.first] - half) & (z <= profile.z[side.end - 1] + half)
    width = 2.0 * math.pi / len(profile.phi)
    azimuth = (np.arctan2(local[:, 1], local[:, 0]) - side.column * width + 0.5 * width) % (2.0 * math.pi)
    inside &= azimuth <= side.columns * width
    miss = np.sqrt(local[:, 0] ** 2 + local[:, 1] ** 2) - side.radii(z)
    return np.asarray(inside & (np.abs(miss) <= 1.5 * tolerance * math.hypot(1.0, side.slope)))
