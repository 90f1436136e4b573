"""Outermost surface of a link about an axis: R(z, phi), by rays towards the axis."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from coneskin.core.arrays import Bools, Floats, Ints
from coneskin.geometry.displacement_map import bridge_holes
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.ray_casting import RayCaster

from .cone_fit import perpendicular_vectors
from .touch_weights import TouchWeights


@dataclass(frozen=True, slots=True, eq=False)
class AxisFrame:
    """An axis with the direction of azimuth 0."""

    origin: Floats  #: a point of the axis [m], shape (3,)
    columns: Floats  #: unit vectors of azimuth 0, of azimuth pi / 2 and of the axis as columns, shape (3, 3)

    @classmethod
    def along(cls, origin: Floats, axis: Floats, seam: Floats | None = None) -> AxisFrame:
        """Make a frame about an axis; azimuth 0 is the direction ``seam``, projected across the axis."""
        first = perpendicular_vectors(axis)[0]
        if seam is not None:
            square = seam - (seam @ axis) * axis
            if np.linalg.norm(square) > 1e-3:
                first = square / np.linalg.norm(square)
        return cls(origin, np.stack([first, np.cross(axis, first), axis], axis=1))

    @property
    def axis(self) -> Floats:
        """Unit vector along the axis."""
        return np.asarray(self.columns[:, 2])

    def azimuth(self, way: Floats) -> float:
        """Return the azimuth of a direction [rad]; 0 for one along the axis."""
        x, y = (float(value) for value in way @ self.columns[:, :2])
        return math.atan2(y, x) if math.hypot(x, y) > 1e-3 else 0.0

    def local(self, points: Floats) -> Floats:
        """Return points in the coordinates of this frame [m], shape (n, 3)."""
        return np.asarray((points - self.origin) @ self.columns)

    def extent(self, points: Floats) -> tuple[float, float, float]:
        """Return the lowest and the highest height of points on the axis, and the largest distance from it [m].

        A column at a time: a product with a matrix of three columns takes ten times as long.
        """
        x, y, z = (points @ np.ascontiguousarray(column) - self.origin @ column for column in self.columns.T)
        return float(z.min()), float(z.max()), math.sqrt(float((x * x + y * y).max()))


def axes_apart(frame: tuple[Floats, Floats], other: tuple[Floats, Floats]) -> tuple[float, float]:
    """Return the angle between two axes [rad, its sine] and how far a point of the first is from the other [m].

    An axis is a point [m] and a unit vector, each of shape (3,).
    """
    gap, cosine = frame[0] - other[0], float(frame[1] @ other[1])
    away = float(gap @ gap) - float(gap @ other[1]) ** 2
    return math.sqrt(max(0.0, 1.0 - cosine**2)), math.sqrt(max(0.0, away))


class Region(NamedTuple):
    """Cells of a profile: rows from ``first`` to before ``end``, and ``columns`` columns from ``column`` on."""

    first: int
    end: int
    column: int
    columns: int


@dataclass(frozen=True, slots=True, eq=False)
class RadialProfile:
    """Radius of the hull on a grid of heights and azimuths."""

    frame: AxisFrame
    z: Floats  #: heights of the slices [m], ascending and evenly spaced, shape (k,)
    phi: Floats  #: azimuths [rad], ascending from 0, evenly spaced over the turn, shape (p,)
    radius: Floats  #: distance from the axis to the outermost surface [m], 0 where there is none, shape (k, p)
    bridged: Floats  #: the same, with the holes and grooves filled that a sheet spans, shape (k, p)
    weight: Floats | None = None  #: what an area counts there, 1 by default, shape (k, p); 0 where no sheet may lie

    @property
    def step(self) -> float:
        """Distance between slices [m]."""
        return float(self.z[1] - self.z[0])

    def floor(self, tolerance: float) -> Floats:
        """Return the radii that a sheet must not stand off from [m], shape (k, p): holes count as filled.

        What lies less than the tolerance [m] below its rim is no hole, and the sheet has to follow it.
        """
        return np.where(self.bridged - self.radius > tolerance, self.bridged, self.radius)

    def bounds(self, tolerance: float) -> tuple[Floats, Floats]:
        """Return the largest radius and the smallest one above the floor of every slice [m], each of shape (k,).

        A slice in which no full wrap may lie has 0 for the latter.
        """
        low = self.floor(tolerance).min(axis=1)
        if self.weight is not None:
            low = np.where((self.weight > 0.0).all(axis=1), low, 0.0)
        return self.radius.max(axis=1), low

    def free(self) -> Bools:
        """Return whether a sheet may lie on each cell, shape (k, p)."""
        return np.ones(self.radius.shape, bool) if self.weight is None else self.weight > 0.0

    def azimuths(self, column: int, columns: int) -> Ints:
        """Return the indices of consecutive azimuths, going round the turn."""
        return (column + np.arange(columns)) % len(self.phi)

    def points(self, bridged: bool = False, rows: slice | Ints = slice(None), columns: Ints | None = None) -> Floats:
        """Return the places of cells on the hull [m], shape (k, p, 3), of all by default.

        Args:
            bridged: True for the floors of holes that are filled.
            rows: slices.
            columns: azimuths.
        """
        chosen = np.arange(len(self.phi)) if columns is None else columns
        out = np.stack([np.cos(self.phi[chosen]), np.sin(self.phi[chosen])], axis=1) @ self.frame.columns[:, :2].T
        radius = (self.bridged if bridged else self.radius)[rows][:, chosen]
        along = self.frame.origin + self.z[rows][:, None] * self.frame.axis
        return np.asarray(along[:, None] + radius[..., None] * out)

    def weighed(self, weights: TouchWeights) -> RadialProfile:
        """Return the profile of which each cell counts what a map says."""
        return replace(self, weight=weights.at(self.points().reshape(-1, 3)).reshape(self.radius.shape))

    def blocked(self, cells: Bools) -> RadialProfile:
        """Return the profile with cells, shape (k, p), on which no sheet may lie."""
        weight = np.ones(self.radius.shape) if self.weight is None else self.weight
        return replace(self, weight=np.where(cells, 0.0, weight))


def measure_profile(
    mesh: Mesh, rays: RayCaster, frame: AxisFrame, step: float, around: int, max_bridge: float = 0.010
) -> RadialProfile:
    """Measure R(z, phi) from end to end of a link.

    Args:
        step: approximate distance between slices [m].
        around: number of rays in a slice.
        max_bridge: width and length of the widest hole that a sheet spans rather than follows [m].
    """
    low, high, reach = frame.extent(mesh.outermost)
    count = max(8, round((high - low) / step))
    step = (high - low) / count
    z = low + step * (np.arange(count) + 0.5)
    phi = np.linspace(0.0, 2.0 * math.pi, around, endpoint=False)
    start = 1.02 * reach + 1e-3
    out = frame.columns[:, :2] @ np.stack([np.cos(phi), np.sin(phi)])
    origins, ways = np.empty((count, around, 3)), np.empty((count, around, 3))
    for i in range(3):  # numpy is slow with arrays of three columns
        origins[..., i] = (frame.origin[i] + z * frame.axis[i])[:, None] + start * out[i]
        ways[..., i] = -out[i]
    depth = rays.cast(origins.reshape(-1, 3), ways.reshape(-1, 3))[0]
    # a ray that has passed the axis has not hit a surface on its own side
    radius = np.where(depth < start, start - depth, 0.0).reshape(count, around)
    present = radius[radius > 0.0]
    arc = 2.0 * math.pi / around * (float(np.median(present)) if len(present) else 1.0)
    return RadialProfile(frame, np.asarray(z), phi, radius, bridge_holes(radius, step, arc, max_bridge))
