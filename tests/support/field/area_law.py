"""The law of the area error, for arrays: a second method beside the exact solution and the live decode's plain floats.

The law is the multipole solution truncated at the dipole (docs/understand/field.md). It holds while the disc is small
beside its distance D to the next edge (to the next corner between equal sheets) and to the apex: the neglected part is
about (a/D)^2 of the result. It describes the electrical centre, not the mean of the guide pair. The series of the Robin
function stands in `skin/sheet_functions.py`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from coneskin.core.arrays import Floats
from coneskin.skin.field.disc import bessel_ratios
from coneskin.skin.field.green import Strip
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.sheet import SectorSheet


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
