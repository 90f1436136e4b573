"""Fit of one cone to points of a mesh: gated, reweighted Gauss-Newton, regular at the cylinder.

The unknowns are two tilts and two shifts of the axis, the distance c = rho cos(a) of the side from the origin and the
half angle a. There is no apex among them, so a cylinder (a = 0) is an ordinary point. The residual is the distance from
the side, d = rho cos(a) - z sin(a) - c, where z runs along the axis and rho away from it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from coneskin.core.arrays import Floats

from .surface_samples import SurfaceSamples

MAX_HALF_ANGLE = math.radians(80.0)  #: rad; a flatter ring is a flange, not a cone
_MAX_STEPS = 30  # Gauss-Newton steps at the last gate


@dataclass(frozen=True, slots=True, eq=False)
class InfiniteCone:
    """A cone without ends, or a cylinder."""

    origin: Floats  #: a point of the axis [m], shape (3,)
    axis: Floats  #: unit vector, shape (3,)
    radius: float  #: distance of the side from the axis at the origin [m]
    half_angle: float  #: angle between side and axis [rad]; positive where the cone widens along the axis

    def cylindrical_coordinates(self, points: Floats) -> tuple[Floats, Floats]:
        """Return the distances from the axis and the heights along it from the origin [m], each of shape (n,)."""
        q = points - self.origin
        z = q @ self.axis
        return np.linalg.norm(q - z[:, None] * self.axis, axis=1), z

    def distances(self, points: Floats) -> Floats:
        """Return the signed distances from the side [m], positive outside, shape (n,)."""
        rho, z = self.cylindrical_coordinates(points)
        return np.asarray((rho - self.radius) * math.cos(self.half_angle) - z * math.sin(self.half_angle))

    def alignment(self, points: Floats, normals: Floats) -> Floats:
        """Return the cosines between the normals of points and those of the side, shape (n,)."""
        q = points - self.origin
        across = q - (q @ self.axis)[:, None] * self.axis
        rho = np.maximum(np.linalg.norm(across, axis=1), 1e-12)
        out = np.einsum("ij,ij->i", across, normals) / rho
        return np.asarray(out * math.cos(self.half_angle) - (normals @ self.axis) * math.sin(self.half_angle))


def perpendicular_vectors(axis: Floats) -> tuple[Floats, Floats]:
    """Return two unit vectors that form a right-handed frame with an axis: (first, second, axis)."""
    x, y, z = (float(value) for value in axis)
    # the cross product of the unit vector along the least component; numbers, because numpy is slow with three
    least = min(abs(x), abs(y), abs(z))
    a, b, c = (0.0, -z, y) if least == abs(x) else (z, 0.0, -x) if least == abs(y) else (-y, x, 0.0)
    size = math.sqrt(a * a + b * b + c * c)
    a, b, c = a / size, b / size, c / size
    return np.array([a, b, c]), np.array([y * c - z * b, z * a - x * c, x * b - y * a])


def _slopes(x: Floats, y: Floats, z: Floats, rho: Floats, half_angle: float) -> Floats:
    """Return the derivatives of ``InfiniteCone.distances``, shape (6, n): numpy is slow with arrays of few columns.

    The rows are tilt 1, tilt 2, shift 1, shift 2, c = radius cos(half angle) and the half angle. Tilt i turns the axis
    towards the i-th vector of ``perpendicular_vectors`` [m/rad]; shift i moves the origin along it [m/m].
    """
    rho = np.maximum(rho, 1e-12)
    ca, sa = math.cos(half_angle), math.sin(half_angle)
    lever = -(z * ca / rho + sa)
    return np.stack([lever * x, lever * y, -ca * x / rho, -ca * y / rho, -np.ones(len(z)), -rho * sa - z * ca])


def fit_cone(
    samples: SurfaceSamples,
    start: InfiniteCone,
    gates: tuple[float, ...],
    angle: float = 0.2,
    precision: float = 1e-4,
) -> InfiniteCone | None:
    """Fit a cone to the points that lie near it and whose normals agree with its own.

    Args:
        start: first guess; some points must lie within the first gate of it.
        gates: distances beyond which a point has no weight [m], decreasing; each is kept until the fit converges.
        angle: between the normals, above which a point has no weight [rad]; twice that at the first of several gates.
        precision: last movement of the side, as a share of the last gate.

    Returns:
        the cone, with its origin in the middle of its points; None where too few points are left or the fit diverges.
    """
    cone = start
    for number, gate in enumerate(gates):
        last = number == len(gates) - 1
        stride = 1 if last else max(1, len(samples) // 2000)  # a rough fit is enough at the early gates
        points, normals = samples.points[::stride], samples.normals[::stride]
        aligned = math.cos(angle * (2.0 if number == 0 and not last else 1.0))
        for _ in range(_MAX_STEPS if last else _MAX_STEPS // 2):
            better, moved = _step(cone, points, normals, gate, aligned)
            if better is None:
                return None
            cone = better
            if moved < (precision if last else 1e-2) * gate:
                break
    return cone


def _step(
    cone: InfiniteCone, points: Floats, normals: Floats, gate: float, aligned: float
) -> tuple[InfiniteCone | None, float]:
    """Take one Gauss-Newton step with Tukey's weights; return the new cone and how far the side moved [m]."""
    e1, e2 = perpendicular_vectors(cone.axis)
    frame = (e1, e2, cone.axis)
    sa, ca = math.sin(cone.half_angle), math.cos(cone.half_angle)
    x, y, z = (points @ way - cone.origin @ way for way in frame)
    out_x, out_y, up = (normals @ way for way in frame)
    rho = np.sqrt(x * x + y * y)  # numpy.hypot takes twenty times as long
    distance = (rho - cone.radius) * ca - z * sa
    out = (x * out_x + y * out_y) * ca - rho * up * sa
    near = np.flatnonzero((np.abs(distance) < gate) & (out > aligned * rho))
    if len(near) < 24:
        return None, math.inf
    x, y, z, rho, distance = x[near], y[near], z[near], rho[near], distance[near]
    middle = float(z.mean())
    z = z - middle
    size = max(float(np.abs(z).max()), float(rho.max()))
    scale = np.array([size, size, 1.0, 1.0, 1.0, size])  # tilts in metres too
    slopes = _slopes(x, y, z, rho, cone.half_angle) / scale[:, None]
    weighted = slopes * (1.0 - (distance / gate) ** 2) ** 2
    normal = weighted @ slopes.T
    # Negligible beside the data; it fixes only what the points leave undetermined (a narrow strip, a short ring).
    normal[np.diag_indices(6)] += 1e-9 * np.trace(normal)
    scaled = -np.linalg.solve(normal, weighted @ distance)
    longest = float(np.abs(scaled).max())
    if longest > 0.2 * size:
        scaled *= 0.2 * size / longest
    tilt1, tilt2, shift1, shift2, dc, dangle = scaled / scale
    axis = cone.axis + tilt1 * e1 + tilt2 * e2
    axis /= np.linalg.norm(axis)
    half_angle = cone.half_angle + dangle
    if abs(half_angle) > MAX_HALF_ANGLE:
        return None, math.inf
    radius = (cone.radius * ca + middle * sa + dc) / math.cos(half_angle)
    if not 1e-4 < radius < 5.0:
        return None, math.inf
    origin = cone.origin + middle * cone.axis + shift1 * e1 + shift2 * e2
    return InfiniteCone(origin, axis, radius, half_angle), longest
