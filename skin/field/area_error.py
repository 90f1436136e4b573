"""Closed-form law of the area error: the distance from a round contact's centre to its decoded place.

Truncating the multipole solution at the dipole gives, for a disc of radius a and conductance g per area,

    displacement = -(pi a_eff^2 / (Ru + Rl)) grad gamma,      a_eff^2 = a^2 I_2(ka)/I_0(ka),   k^2 = g (Ru + Rl)

with the Robin function gamma of the *flat* sheet. So the error grows with the area, is a gradient field, vanishes
for a weak contact, and on the middle line of a sector only the taper is left: -a_eff^2/(2r) along r, nothing along
theta.

Valid while the disc is small beside its distance D to the next edge (to the next corner between equal sheets, whose
images in edges cancel) and to the apex: the neglected part is about (a/D)^2 of the result. It describes the
electrical centre, that is the readings taken *at the contact*, not the mean of the guide pair.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .disc import bessel_ratios
from .robin import Robin

if TYPE_CHECKING:
    from .model import FieldModel

__all__ = ["area_error", "effective_area"]

Floats = NDArray[np.float64]


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
