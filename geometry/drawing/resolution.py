"""Forecast of the resolution: the step on the sheet for one count of the A/D converter (paper, eq. 25 and 26).

Eq. 25, dU/dr = U0 / (r ln(r1/r2)), is regular in the link's radii, because r is proportional to rho along the side:
a step dU of the potential moves the location by rho(u) L / |sin a| * dU/U0 with L = |ln(rho2/rho1)|, and L / |sin a|
tends to slant / rho on a cylinder. Eq. 26, dU/dtheta = U0 / theta0, gives wrap * dU/U0 of azimuth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from coneskin.core.errors import GeometryError
from coneskin.geometry.frustum import Frustum

__all__ = ["AdConverter", "ResolutionForecast", "forecast_resolution"]


@dataclass(frozen=True, slots=True)
class AdConverter:
    """A/D converter that reads the potentials.

    Attributes:
        bits: resolution.
        range_volts: potential of the highest count [V].
        supply_volts: potential of the positive electrode, U0 [V].

    Raises:
        GeometryError: a value is out of range.
    """

    bits: int = 12
    range_volts: float = 3.3
    supply_volts: float = 2.5

    def __post_init__(self) -> None:
        if not 1 <= self.bits <= 32:
            raise GeometryError(f"bits of the converter must be from 1 to 32, got {self.bits!r}")
        for name in ("range_volts", "supply_volts"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise GeometryError(f"{name} must be finite and above 0 V, got {value!r} V")

    @property
    def step(self) -> float:
        """One count as a fraction of U0."""
        return self.range_volts / ((1 << self.bits) - 1) / self.supply_volts


@dataclass(frozen=True, slots=True)
class ResolutionForecast:
    """Change of the location for one count of the A/D converter, at one slant distance.

    Attributes:
        u: slant distance from end 1 of the active area [m].
        along: change of the slant distance [m].
        azimuth: change of the azimuth about the axis [rad].
        around: the change of azimuth as a length on the sheet [m].
        theta: the change of azimuth as a polar angle on the flat sheet [rad]; 0 on a cylinder.
    """

    u: float
    along: float
    azimuth: float
    around: float
    theta: float


def forecast_resolution(active: Frustum, converter: AdConverter, u: float) -> ResolutionForecast:
    """Forecast the resolution at a slant distance on the active area; it is the same for all azimuths.

    Args:
        active: the cone between the inner edges of the four electrodes, on the conductive sheet.
        converter: A/D converter that reads the potentials.
        u: slant distance from end 1 of the active cone [m].

    Raises:
        GeometryError: an end is an apex, where no current can flow.
    """
    if min(active.radius1, active.radius2) <= 0.0:
        raise GeometryError("a forecast needs both radii above 0 m: no current flows to an apex")
    rho, step = active.radius_at(u), converter.step
    growth = (active.radius2 - active.radius1) / active.radius1
    stretch = math.log1p(growth) / growth if growth else 1.0
    along = rho / active.radius1 * active.slant * stretch * step
    azimuth = active.wrap * step
    return ResolutionForecast(u, along, azimuth, rho * azimuth, azimuth * abs(active.sin_half_angle))
