"""Bends of a developable side: how a strip between two rulings turns, and where its points lie.

A strip is bent evenly: it is a part of a circular cone, a cylinder or a plane. With the unit vectors T along the arc of
end 1, U along the ruling and N outwards, with g the geodesic curvature of that arc and k its normal curvature, along
the arc

    T' = -g U - k N        U' = g T        N' = k T

so that T, U, N turn about the fixed vector k U - g N, and all points have closed forms that hold for planes, cylinders
and cones alike.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from .frustum import sinc
from .pose import Vector

if TYPE_CHECKING:
    from coneskin.core.arrays import Floats


@dataclass(frozen=True, slots=True)
class Bend:
    """A strip between two rulings, bent evenly.

    Attributes:
        width: azimuth that it takes [rad], above 0.
        turn: angle by which its normal turns from one ruling to the other [rad]; 0 for a plane, negative for a hollow.
    """

    width: float
    turn: float


_STRAIGHT_TURN = 1e-9  # rad; a strip that turns by less has its nearest foot by the formula of a plane


class RulingFrame(NamedTuple):
    """A ruling: its point at end 1 [m], and the unit vectors T, U and N there."""

    at: Vector
    t: Vector
    u: Vector
    n: Vector


@dataclass(frozen=True, slots=True)
class BentStrip:
    """A strip and the frame at its first ruling."""

    arc: float  #: length along end 1 [m]
    g: float  #: geodesic curvature of end 1 [1/m], sin a / radius of a cone
    k: float  #: normal curvature there [1/m]; 0 of a plane
    first: RulingFrame  #: frame at the first ruling

    def frame(self, along: float) -> RulingFrame:
        """Return the frame at a distance [m] from the first ruling."""
        g, k = self.g, self.k
        (x, y, z), (tx, ty, tz), (ux, uy, uz), (nx, ny, nz) = self.first
        vx, vy, vz = -k * nx - g * ux, -k * ny - g * uy, -k * nz - g * uz  # T'
        angle = math.hypot(g, k) * along
        first = along * sinc(angle)
        second = 0.5 * (along * sinc(0.5 * angle)) ** 2
        dx, dy, dz = first * tx + second * vx, first * ty + second * vy, first * tz + second * vz
        cosine = math.cos(angle)
        return RulingFrame(
            (x + dx, y + dy, z + dz),
            (cosine * tx + first * vx, cosine * ty + first * vy, cosine * tz + first * vz),
            (ux + g * dx, uy + g * dy, uz + g * dz),
            (nx + k * dx, ny + k * dy, nz + k * dz),
        )

    def feet(self, points: Floats, low: float, high: float) -> tuple[Floats, Floats]:
        """Return where the nearest feet of points lie along end 1 [m], and how far points are from the rulings there.

        Args:
            points: shape (n, 3) [m].
            low: least distance from the first ruling of a foot [m].
            high: largest distance [m].
        """
        import numpy as np

        g, k = self.g, self.k
        at, *axes = self.first
        qt, qu, qn = ((points - at) @ np.array(axes).T).T
        # the foot is where the arc's tangent is square to the way to the point: tan(angle) = omega qT / (1 - qV)
        rest = 1.0 + k * qn + g * qu
        omega = math.hypot(g, k)
        if omega * self.arc > _STRAIGHT_TURN:
            angle = np.arctan2(omega * qt, rest)
            middle = 0.5 * omega * self.arc
            along = (angle - math.tau * np.round((angle - middle) / math.tau)) / omega
        else:
            along = qt / np.where(np.abs(rest) > 1e-12, rest, 1e-12)
        along = np.clip(along, low, high)
        angle = omega * along
        first = along * np.sinc(angle / np.pi)
        second = 0.5 * (along * np.sinc(0.5 * angle / np.pi)) ** 2
        to_t, to_u, to_n = qt - first, qu + second * g, qn + second * k
        out = k * first * to_t - k * g * second * to_u + (1.0 - k * k * second) * to_n
        across = np.cos(angle) * to_t - first * (g * to_u + k * to_n)
        return along, np.hypot(out, across)
