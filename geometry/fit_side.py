"""The straight side of one sheet: fitted to the slices it covers, then raised from the flats to the corners."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .fit_cone import Cone
from .fit_intervals import least_deviation
from .fit_profile import Profile
from .fit_samples import Samples
from .mesh import Mesh

__all__ = ["Side", "columns_of", "facet_offset", "fit_side", "under"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Side:
    """A straight side over some cells of a profile.

    Attributes:
        first: its first slice.
        end: the one after its last slice.
        column: its first azimuth.
        columns: number of azimuths; all of them for a full wrap.
        radius: at z = 0 of the profile's frame [m].
        slope: dr/dz.
        rise: what of the radius is owed to facets that lie inside of the true surface [m].
    """

    first: int
    end: int
    column: int
    columns: int
    radius: float
    slope: float
    rise: float = 0.0

    def radii(self, z: Floats) -> Floats:
        """Radius at heights z [m]."""
        return np.asarray(self.radius + self.slope * z)

    def area(self, profile: Profile) -> float:
        """Area of the sheet [m2]."""
        z = profile.z[self.first : self.end]
        width = 2.0 * math.pi * self.columns / len(profile.phi)
        return float(self.radii(z).sum()) * profile.step * width * math.hypot(1.0, self.slope)


def columns_of(profile: Profile, column: int, columns: int) -> NDArray[np.int64]:
    """Indices of some azimuths, going round the turn."""
    return (column + np.arange(columns)) % len(profile.phi)


def fit_side(
    profile: Profile, first: int, end: int, column: int, columns: int, tolerance: float, offset: float = 0.0
) -> Side:
    """Fit a straight side to a region and cut the region to where it holds.

    A robust mean line follows the body rather than the fillets at the ends of an interval. The line of least deviation
    would cover a little more of a tube by leaning into them; it is taken only where the body itself is curved (a
    barrel), so that the mean line is far from it and would lose more than a thirtieth of the length.

    Args:
        profile: the hull about the axis.
        first: first slice.
        end: the one after the last.
        column: first azimuth.
        columns: number of azimuths.
        tolerance: largest distance from the side [m].
        offset: added to the radius of the mean line, because facets lie inside of the true surface [m].
    """
    across = columns_of(profile, column, columns)
    z = profile.z[first:end]
    radius = profile.radius[first:end][:, across]
    high, low = radius.max(axis=1), profile.bridged[first:end][:, across].min(axis=1)
    middle = np.median(radius, axis=1)
    typical = np.abs(radius - middle[:, None]) <= 2.0 * tolerance
    count = typical.sum(axis=1)
    means = np.where(count > 0, (radius * typical).sum(axis=1) / np.maximum(count, 1), middle)
    start, slope = _line(z, means, tolerance)
    start += offset * math.hypot(1.0, slope)
    limit = tolerance * math.hypot(1.0, slope)
    line = start + slope * z
    run = _longest_run((high <= line + limit) & (low >= line - limit))
    straight = float(np.median(np.abs(means + offset * math.hypot(1.0, slope) - line))) < 0.15 * limit
    if run[1] > run[0] and (straight or run[1] - run[0] >= 0.97 * (end - first)):
        return Side(first + run[0], first + run[1], column, columns, start, slope, offset)
    _, start, slope = least_deviation(z, high, low)
    return Side(first, end, column, columns, start, slope)


def _line(z: Floats, radius: Floats, spread: float) -> tuple[float, float]:
    """Line through (z, radius) with Tukey's weights: radius at z = 0 and slope."""
    weights = np.ones(len(z))
    start, slope = float(np.median(radius)), 0.0
    if len(z) < 3:
        return start, slope
    for _ in range(20):
        total = float(weights.sum())
        zm, rm = float(weights @ z) / total, float(weights @ radius) / total
        slope = float(weights @ ((z - zm) * (radius - rm)) / (weights @ (z - zm) ** 2))
        start = rm - slope * zm
        miss = np.abs(radius - start - slope * z)
        # fillets at the ends must not pull: what counts is the spread of the better half
        scale = min(max(4.0 * float(np.median(miss)), 0.05 * spread), 2.0 * spread)
        weights = np.where(miss < scale, (1.0 - (miss / scale) ** 2) ** 2, 0.0)
    return start, slope


def _longest_run(good: NDArray[np.bool_]) -> tuple[int, int]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], good, [False]]).astype(np.int8)))
    if len(edges) == 0:
        return 0, 0
    lengths = edges[1::2] - edges[::2]
    longest = int(lengths.argmax())
    return int(edges[2 * longest]), int(edges[2 * longest + 1])


def facet_offset(mesh: Mesh, samples: Samples, cone: Cone, tolerance: float) -> float:
    """How far the corners of the facets lie outside of the facets, on average [m].

    A tube cut into facets has its corners on the tube and its flats inside; what is fitted to the flats comes out small
    by two thirds of the sagitta (0.034 mm for 72 facets round 54 mm). A mesh that was thinned out has corners on both
    sides (UR5's collision bodies) and its flats are the better guess, so the answer is 0 unless the corners agree to a
    fifth of the rise.

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
    # the sagitta grows with the radius, so corners of a steep cone are on a line, not at one distance
    heights = cone.cylindrical(mesh.vertices[faces[sound].ravel()])[1]
    if np.ptp(heights) > tolerance:
        off = off - np.polynomial.Polynomial.fit(heights, off, 1)(heights)
    spread = float(np.median(np.abs(off))) * 1.4826  # as a standard deviation
    return mean if spread <= 0.2 * abs(mean) else 0.0


def under(profile: Profile, side: Side, hull: Samples, tolerance: float) -> NDArray[np.bool_]:
    """Which points of the hull a side covers, shape (n,); ``tolerance`` [m] is allowed half as much again."""
    local = profile.frame.local(hull.points)
    z = local[:, 2]
    half = 0.5 * profile.step
    inside = (z >= profile.z[side.first] - half) & (z <= profile.z[side.end - 1] + half)
    width = 2.0 * math.pi / len(profile.phi)
    azimuth = (np.arctan2(local[:, 1], local[:, 0]) - side.column * width + 0.5 * width) % (2.0 * math.pi)
    inside &= azimuth <= side.columns * width
    miss = np.hypot(local[:, 0], local[:, 1]) - side.radii(z)
    return np.asarray(inside & (np.abs(miss) <= 1.5 * tolerance * math.hypot(1.0, side.slope)))
