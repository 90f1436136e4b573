"""Disc of contact: the places that it may take, and its answer to the sheets around it.

Inside a disc of constant conductance g the difference of the sheets obeys lap d = k^2 d with k^2 = g (Ru + Rl), so
it is sum c_m I_m(k rho) e^(i m phi). Against its own logarithm the m-th multipole moment of the current then meets

    D_0 = rs/(2 pi) I_0(ka) / (ka I_1(ka)),      D_m = rs/(2 pi m) I_(m-1)(ka) / I_(m+1)(ka),      rs = Ru + Rl

(2m/x I_m = I_(m-1) - I_(m+1) joins the two parts of D_m). No contact is D = inf, a perfect bond D_0 = 0, D_m =
rs/(2 pi m).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from coneskin.core.arrays import Floats
from coneskin.core.errors import FieldError

from .sheet import SectorSheet


@dataclass(frozen=True, slots=True, eq=False)
class Discs:
    """n scenes of k discs each; every array of shape (n, k)."""

    u: Floats  #: slant distance of the centres [m]
    phi: Floats  #: azimuth of the centres [rad]
    radius: Floats  #: [m]
    conductance: Floats  #: per area [S/m^2]

    @classmethod
    def of(cls, discs: Sequence[Disc]) -> Discs:
        """Return one scene, unchecked."""
        rows = np.array([[(disc.u, disc.phi, disc.radius, disc.conductance) for disc in discs]], dtype=np.float64)
        return cls(*rows.transpose(2, 0, 1))

    def scenes(self, index: NDArray[np.intp]) -> Discs:
        """Return some of the scenes."""
        return Discs(self.u[index], self.phi[index], self.radius[index], self.conductance[index])


@dataclass(frozen=True, slots=True)
class Disc:
    """A round contact.

    Attributes:
        u: slant distance of the centre from end 1 [m].
        phi: azimuth of the centre [rad].
        radius: in the flat sheet [m].
        conductance: of the contact between the sheets, per area [S/m^2]; 0 is no contact, inf a perfect bond.
    """

    u: float
    phi: float
    radius: float
    conductance: float = math.inf


def check_discs(sheet: SectorSheet, discs: Discs) -> None:
    """Refuse discs that cannot exist.

    Raises:
        FieldError: not finite, a radius not positive, a negative conductance, a disc across an edge, two that overlap.
    """
    u, phi, radius, conductance = discs.u, discs.phi, discs.radius, discs.conductance
    for name, values, unit in (("u", u, "m"), ("phi", phi, "rad"), ("radius", radius, "m")):
        if not np.isfinite(values).all():
            raise FieldError(f"{name} of a contact must be finite [{unit}], got {values[~np.isfinite(values)].flat[0]}")
    if not (radius > 0.0).all():
        raise FieldError(f"radius of a contact must be positive [m], got {radius[~(radius > 0.0)].flat[0]}")
    if not (conductance >= 0.0).all():
        bad = conductance[~(conductance >= 0.0)].flat[0]
        raise FieldError(f"conductance of a contact must be 0 or more [S/m^2], got {bad}")
    inside = (u >= 0.0) & (u <= sheet.width) & (phi >= 0.0) & (phi <= sheet.wrap)
    if not inside.all():
        n = np.flatnonzero(~inside.ravel())[0]
        raise FieldError(
            f"the centre of a contact must lie on the sheet, u in [0, {sheet.width:.6g}] m and phi in"
            f" [0, {sheet.wrap:.6g}] rad, got u={u.flat[n]:.6g}, phi={phi.flat[n]:.6g}"
        )
    room = sheet.edge_distances(u, phi).min(axis=-1)
    # A disc that touches an edge is allowed, and the distance to the edge is itself rounded.
    if not (radius <= room * (1.0 + 1e-12)).all():
        n = np.flatnonzero(~(radius <= room * (1.0 + 1e-12)).ravel())[0]
        raise FieldError(
            f"a disc must lie inside the sheet: at u={u.flat[n]:.6g} m, phi={phi.flat[n]:.6g} rad the nearest edge is"
            f" {room.flat[n]:.6g} m away, the radius is {radius.flat[n]:.6g} m;"
            " make it smaller; of a contact that an edge cuts, give the disc about the middle of the part on the sheet"
        )
    for i in range(u.shape[1]):
        for j in range(i):
            gap = centre_distance(sheet, u[:, i], phi[:, i], u[:, j], phi[:, j]) - radius[:, i] - radius[:, j]
            if not (gap > 0.0).all():
                n = int(np.flatnonzero(~(gap > 0.0))[0])
                raise FieldError(
                    f"discs must not overlap: contacts {j} and {i} of scene {n} lie {-gap[n]:.6g} m inside each other"
                )


def centre_distance(sheet: SectorSheet, u1: Floats, phi1: Floats, u2: Floats, phi2: Floats) -> Floats:
    """Return the distance of two points in the flat sheet [m]; inf beyond half a turn, where the sheet bends back."""
    angle = sheet.curvature * (sheet.across(phi2)[0] - sheet.across(phi1)[0])
    # Beyond half a turn the way inside the sheet is longer than the chord; the discs cannot meet there.
    return np.where(np.abs(angle) < math.pi, np.abs(sheet.flat(u2, phi2, (u1, phi1))), math.inf)


def bessel_ratios(x: ArrayLike, order: int) -> Floats:
    """Compute I_m(x) / I_(m-1)(x) for m = 1..order, shape (..., order), for x from 0 to inf.

    Downward by rho_m = x / (2m + x rho_(m+1)), which damps an error by rho_m^2 in each step: from Amos' bound at an
    order from which 1e-17 of it is left, or from Hankel's series where x is much above order^2. Without scipy, whose
    import takes longer than that of all the rest together, and a virtual skin cannot start before it.
    """
    x = np.asarray(x, dtype=np.float64)
    finite = np.where(np.isfinite(x), x, 1.0)
    top = order + 1
    huge = finite > max(2.0 * top * top, 100.0)
    largest = float(np.max(finite, initial=0.0, where=~huge))
    start = top + 12 + math.isqrt(int(top * top + 40.0 * largest))
    rho = finite / (start - 0.5 + np.hypot(start + 0.5, finite))
    out = np.empty((*x.shape, order))
    for m in range(start - 1, 0, -1):
        rho = finite / (2.0 * m + finite * rho)
        if m == top and huge.any():
            far = np.where(huge, finite, math.inf)
            rho = np.where(huge, _hankel(top, far) / _hankel(top - 1, far), rho)
        if m <= order:
            out[..., m - 1] = rho
    out[~np.isfinite(x)] = 1.0
    return out


def _hankel(order: int, x: Floats) -> Floats:
    """Compute I_order(x) without exp(x)/sqrt(2 pi x), for x much above order^2."""
    term = np.ones_like(x)
    total = np.ones_like(x)
    with np.errstate(divide="ignore"):
        for j in range(1, 14):
            term = -term * ((4.0 * order * order - (2 * j - 1) ** 2) / j) / (8.0 * x)
            total = total + term
    return total
