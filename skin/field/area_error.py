"""Area error, from a round contact's centre to its decoded place: exact, over a grid of places, and as a law.

Truncating the multipole solution at the dipole gives, for a disc of radius a and conductance g per area,

    displacement = -(pi a_eff^2 / (Ru + Rl)) grad gamma,      a_eff^2 = a^2 I_2(ka)/I_0(ka),   k^2 = g (Ru + Rl)

with the Robin function gamma of the *flat* sheet. So the error grows with the area, is a gradient field, vanishes
for a weak contact, and on the middle line of a sector only the taper is left: -a_eff^2/(2r) along r, nothing along
theta.

Valid while the disc is small beside its distance D to the next edge (to the next corner between equal sheets, whose
images in edges cancel) and to the apex: the neglected part is about (a/D)^2 of the result. It describes the
electrical centre, that is the readings taken *at the contact*, not the mean of the guide pair.

The Robin function gamma(z), what a point of contact feels of the edges and of the taper, is the value at z' = z of Ru
G_u + Rl G_l without its logarithm. In the strip of `green`,

    gamma = (1/2 pi) [ (Ra+Rb) ln|theta(2w)| - (Ra-Rb) ln|theta(2s)/theta(2ip)| ] - Rb s^2/(pi Sigma) + const

with w = s + ip and the odd theta(z) = 2 sinh(z/2) prod (1 - q^2n e^z)(1 - q^2n e^-z), q = exp(-Sigma). In the flat
sheet the stretch adds (Ru+Rl)/(2 pi) ln(r/r1). Only its gradient matters; the live decode has its own in plain
floats (`skin/sheet_functions.py`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from coneskin.core.arrays import Floats

from .disc import bessel_ratios
from .fourport import angular_phase, radial_phase
from .green import Strip
from .sheet import SectorSheet

if TYPE_CHECKING:
    from .model import FieldModel

__all__ = ["ErrorMap", "Robin", "area_error", "decode_errors", "effective_area"]


class Robin:
    """Gradient of the Robin function of a sheet, in the rectangle (x, y), without the stretch.

    Args:
        sheet: the sheet.
        upper_resistance: of the sheet with A and B [ohm per square].
        lower_resistance: of the sheet with C and D [ohm per square].
    """

    __slots__ = ("_a", "_b", "_powers", "_strip")

    def __init__(self, sheet: SectorSheet, upper_resistance: float, lower_resistance: float) -> None:
        self._strip = strip = Strip.of(sheet.length, sheet.breadth)
        upper, lower = upper_resistance, lower_resistance
        self._a, self._b = (lower, upper) if strip.along_x else (upper, lower)
        count = next(n for n in range(16) if (2 * n + 1) * strip.sigma > 39.0)
        self._powers = tuple(math.exp(-2.0 * n * strip.sigma) for n in range(1, count + 1))

    def gradients(self, sheet: SectorSheet, u: ArrayLike, phi: ArrayLike) -> tuple[Floats, Floats]:
        """Return (d gamma/dx, d gamma/dy) [ohm/m] at (u, phi) [m, rad], arrays too."""
        x, x_far = sheet.along(u)
        y, y_far = sheet.across(phi)
        strip = self._strip
        s, s_far, p, p_far = (x, x_far, y, y_far) if strip.along_x else (y, y_far, x, x_far)
        flip_s, flip_p = s > s_far, p > p_far
        k = strip.scale
        s, p = k * np.where(flip_s, s_far, s), k * np.where(flip_p, p_far, p)
        along, across = self._quarter(s, np.exp(-2.0 * (s + 1j * p)), np.exp(-2.0 * s), np.exp(-2j * p))
        along, across = k * np.where(flip_s, -along, along), k * np.where(flip_p, -across, across)
        return (along, across) if strip.along_x else (across, along)

    def _quarter(self, s: Any, corner: Any, end: Any, edge: Any) -> tuple[Any, Any]:
        """In the quarter next to the corner; corner, end, edge are exp(-2w), exp(-2s), exp(-2ip)."""
        both, differ = self._a + self._b, self._a - self._b
        at_corner = self._slope(corner)
        along = both * at_corner.real - 2.0 * self._b * s / self._strip.sigma
        across = -both * at_corner.imag
        if differ != 0.0:
            along = along - differ * self._slope(end)
            across = across - differ * self._slope(edge).imag
        return along / math.pi, across / math.pi

    def _slope(self, inverse: Any) -> Any:
        """d ln theta(z)/dz at exp(-z)."""
        total = 0.5 * (1.0 + inverse) / (1.0 - inverse)
        for power in self._powers:
            low, high = power * inverse, power / inverse
            total = total + low / (1.0 - low) - high / (1.0 - high)
        return total


def effective_area(radius: ArrayLike, conductance: ArrayLike, resistance: float) -> Floats:
    """Return a_eff^2 [m^2] of a disc: its radius squared times I_2(ka)/I_0(ka).

    Args:
        radius: [m].
        conductance: per area [S/m^2]; inf is a perfect bond, whose a_eff is its radius.
        resistance: Ru + Rl [ohm per square].
    """
    a = np.asarray(radius, dtype=np.float64)
    ratios = bessel_ratios(a * np.sqrt(np.asarray(conductance, dtype=np.float64) * resistance), 2)
    return np.asarray(a * a * ratios[..., 0] * ratios[..., 1])


def area_error(
    model: FieldModel, u: ArrayLike, phi: ArrayLike, radius: ArrayLike, conductance: ArrayLike = math.inf
) -> tuple[Floats, Floats]:
    """Compute the displacement of the decoded place of round contacts to first order in their area.

    Args:
        model: the sensor.
        u: slant distance of the centres from end 1 [m].
        phi: azimuth of the centres [rad].
        radius: of the discs [m].
        conductance: per area [S/m^2].

    Returns:
        error along the slant [m] and around, on the flat sheet [m].
    """
    sheet = model.sheet
    rs = model.upper_resistance + model.lower_resistance
    robin = Robin(sheet, model.upper_resistance, model.lower_resistance)
    along, across = robin.gradients(sheet, u, phi)
    stretch = sheet.stretch(u)
    factor = -math.pi * effective_area(radius, conductance, rs) / rs / stretch
    return factor * (along + rs / (2.0 * math.pi) * sheet.curvature), factor * across


@dataclass(frozen=True, slots=True, eq=False)
class ErrorMap:
    """Errors of the decoded place over a grid of round contacts; NaN where the disc would not fit.

    Attributes:
        u: slant distances of the contacts [m], shape (n,).
        phi: azimuths of the contacts [rad], shape (m,).
        u_error: decoded minus true slant distance [m], shape (n, m).
        phi_error: decoded minus true azimuth [rad], shape (n, m).
    """

    u: Floats
    phi: Floats
    u_error: Floats
    phi_error: Floats

    @classmethod
    def of(cls, model: FieldModel, radius: float, u: Floats, phi: Floats, conductance: float = math.inf) -> ErrorMap:
        """Compute the errors over a grid of discs of a radius [m]; conductance per area [S/m^2]."""
        at_u, at_phi = (values.ravel() for values in np.meshgrid(u, phi, indexing="ij"))
        fits = model.sheet.edge_distances(at_u, at_phi).min(axis=1) >= radius * (1.0 - 1e-13)
        out = np.full((2, at_u.size), math.nan)
        if fits.any():
            out[:, fits] = decode_errors(model, at_u[fits], at_phi[fits], radius, conductance)
        return cls(u, phi, *out.reshape(2, u.size, phi.size))


def decode_errors(
    model: FieldModel, u: Floats, phi: Floats, radius: ArrayLike, conductance: ArrayLike = math.inf
) -> tuple[Floats, Floats]:
    """Return decoded minus true (u [m], phi [rad]) by the paper's equations 20 and 24 from each guide pair's mean.

    Args:
        model: the sensor.
        u: slant distance of the centres from end 1 [m].
        phi: azimuth of the centres [rad].
        radius: of the discs [m].
        conductance: per area [S/m^2]; inf is a perfect bond.
    """
    sheet = model.sheet
    coupling = model.contacts(u, phi, radius, conductance)
    radial = model.read(coupling, radial_phase()).terminals[:, 2:].mean(axis=1)
    angular = model.read(coupling, angular_phase()).terminals[:, :2].mean(axis=1)
    seen_u, seen_phi = sheet.locate((1.0 - radial) * sheet.length, angular * sheet.breadth)
    return seen_u - u, seen_phi - phi
