"""Flat sheet of the sensor and the rectangle that it maps to.

Symbols: u slant distance from end 1, phi azimuth, W slant width, kappa signed curvature of the arc at end 1 (1/r1 where
the link widens, -1/r1 where it narrows, 0 on a cylinder), T arc length of end 1. The map

    w = x + i y = log1p(kappa Z) / kappa,      Z = flat coordinate along (e_u, e_phi), from end 1

is conformal, so it leaves sheet resistance alone, and makes the sector the rectangle [0, L] x [0, T] with
L = log1p(kappa W) / kappa and y = T phi / wrap. Nothing here computes with r, which is infinite on a cylinder.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from coneskin.core.arrays import Floats
from coneskin.core.errors import FieldError


class _ConeShape(Protocol):
    """The dimensions of a link that a sheet needs; `coneskin.geometry.frustum.Frustum` has them."""

    @property
    def radius1(self) -> float: ...
    @property
    def wrap(self) -> float: ...
    @property
    def slant(self) -> float: ...
    @property
    def sin_half_angle(self) -> float: ...


def _log1p_over(kappa: float, distance: ArrayLike) -> Floats:
    """Compute log1p(kappa d) / kappa, and d where kappa is zero [m]."""
    d = np.asarray(distance, dtype=np.float64)
    return d.copy() if kappa == 0.0 else np.log1p(kappa * d) / kappa


@dataclass(frozen=True, slots=True)
class SectorSheet:
    """An annular sector (a rectangle where the curvature is zero), wrapped on a link.

    Raises:
        FieldError: a length is not positive and finite, the sheet reaches the apex, the sector exceeds a full turn.
    """

    width: float  #: slant width between the arcs [m]
    curvature: float  #: signed curvature of the arc at end 1 [1/m]; positive where the link widens towards end 2
    arc: float  #: length of the arc at end 1, between the straight edges [m]
    wrap: float  #: azimuth that the arc covers on the link [rad]; for a sheet that lies flat, its own sector angle

    def __post_init__(self) -> None:
        for name, unit in (("width", "m"), ("arc", "m"), ("wrap", "rad")):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise FieldError(f"{name} of the sheet must be positive and finite [{unit}], got {value!r}")
        if not math.isfinite(self.curvature) or self.curvature * self.width <= -1.0:
            raise FieldError(
                f"curvature of the sheet must be above -1/width = {-1.0 / self.width:.6g} 1/m (the apex lies outside),"
                f" got {self.curvature!r}"
            )
        if self.angle > 2.0 * math.pi * (1.0 + 1e-12):
            raise FieldError(f"the sector angle must be at most a full turn (6.2832 rad), got {self.angle:.6g} rad")

    @classmethod
    def of_frustum(cls, frustum: _ConeShape) -> SectorSheet:
        """Make the sheet that covers a truncated cone or a cylinder."""
        return cls(
            width=frustum.slant,
            curvature=frustum.sin_half_angle / frustum.radius1,
            arc=frustum.radius1 * frustum.wrap,
            wrap=frustum.wrap,
        )

    @classmethod
    def of_sector(cls, r1: float, width: float, theta0: float) -> SectorSheet:
        """Make a flat sector as the paper draws it: electrode B on the arc r1, A on the arc r1 + width.

        Args:
            r1: radius of the arc of end 1 [m].
            width: difference of the two radii [m].
            theta0: sector angle [rad]; phi is then the paper's theta.
        """
        if not (math.isfinite(r1) and r1 > 0.0):
            raise FieldError(f"r1 must be positive and finite [m], got {r1!r}; a cylinder is SectorSheet(curvature=0)")
        return cls(width=width, curvature=1.0 / r1, arc=r1 * theta0, wrap=theta0)

    @property
    def angle(self) -> float:
        """Sector angle theta0 of the flat sheet [rad], 0 on a cylinder."""
        return abs(self.curvature) * self.arc

    @property
    def length(self) -> float:
        """Side L of the rectangle between the arcs A and B [m]."""
        # numpy's log1p, as in `along`: the two libraries differ by one rounding, and a far edge lay off the sheet.
        return float(np.log1p(self.curvature * self.width)) / self.curvature if self.curvature else self.width

    @property
    def breadth(self) -> float:
        """Side T of the rectangle between the straight edges C and D [m]."""
        return self.arc

    def stretch(self, u: ArrayLike) -> Floats:
        """Return the flat length per length in the rectangle, r/r1, at slant distance u."""
        return 1.0 + self.curvature * np.asarray(u, dtype=np.float64)

    def along(self, u: ArrayLike) -> tuple[Floats, Floats]:
        """Return x and L - x at slant distance u [m], each without cancellation."""
        u = np.asarray(u, dtype=np.float64)
        rest = (self.width - u) / self.stretch(u)
        return _log1p_over(self.curvature, u), _log1p_over(self.curvature, rest)

    def across(self, phi: ArrayLike) -> tuple[Floats, Floats]:
        """Return y and T - y at azimuth phi [m]."""
        phi = np.asarray(phi, dtype=np.float64)
        return self.arc * (phi / self.wrap), self.arc * ((self.wrap - phi) / self.wrap)

    def locate(self, x: ArrayLike, y: ArrayLike) -> tuple[Floats, Floats]:
        """Return (u, phi) of the point (x, y) of the rectangle."""
        x = np.asarray(x, dtype=np.float64)
        kappa = self.curvature
        u = x.copy() if kappa == 0.0 else np.expm1(kappa * x) / kappa
        return u, self.wrap * (np.asarray(y, dtype=np.float64) / self.arc)

    def polar(self, u: ArrayLike, phi: ArrayLike) -> tuple[Floats, Floats]:
        """Return (r, theta) of the paper for (u, phi); r is infinite on a cylinder."""
        u = np.asarray(u, dtype=np.float64)
        theta = np.asarray(phi, dtype=np.float64) * (self.angle / self.wrap)
        if self.curvature == 0.0:
            return np.full_like(u, math.inf), theta
        return self.stretch(u) / abs(self.curvature), theta

    def from_polar(self, r: ArrayLike, theta: ArrayLike) -> tuple[Floats, Floats]:
        """Return (u, phi) for the paper's (r, theta).

        Raises:
            FieldError: the sheet is a rectangle, which has no r.
        """
        if self.curvature == 0.0:
            raise FieldError("a cylinder has no polar radius: give the contact as (u, phi)")
        u = np.asarray(r, dtype=np.float64) * math.copysign(1.0, self.curvature) - 1.0 / self.curvature
        return u, np.asarray(theta, dtype=np.float64) * (self.wrap / self.angle)

    def edge_distances(self, u: ArrayLike, phi: ArrayLike) -> Floats:
        """Return flat distances from a point to the arcs u=0, u=W and the edges phi=0, phi=wrap [m], shape (..., 4)."""
        u, phi = np.broadcast_arrays(np.asarray(u, dtype=np.float64), np.asarray(phi, dtype=np.float64))
        out = np.empty((*u.shape, 4))
        out[..., 0] = u
        out[..., 1] = self.width - u
        out[..., 2], out[..., 3] = self.across(phi)
        if self.curvature != 0.0:
            angle = self.curvature * out[..., 2:]
            # Beyond a right angle the nearest point of the edge is its narrow end, farther than the narrow arc.
            straight = np.sin(angle) * (self.stretch(u) / self.curvature)[..., None]
            out[..., 2:] = np.where(np.abs(angle) < 0.5 * math.pi, straight, math.inf)
        return out

    def flat(self, u: ArrayLike, phi: ArrayLike, at: tuple[ArrayLike, ArrayLike]) -> NDArray[np.complex128]:
        """Return flat coordinates along (e_u, e_phi) of the point `at`, measured from it [m], complex."""
        w = (self.along(u)[0] - self.along(at[0])[0]) + 1j * (self.across(phi)[0] - self.across(at[1])[0])
        kappa = self.curvature
        return np.asarray(w if kappa == 0.0 else self.stretch(at[0]) * np.expm1(kappa * w) / kappa, dtype=np.complex128)
