"""Flat annular sector of a truncated cone (paper, figure 1).

A drawing needs r1, r2 and theta0, but these cannot represent a cylinder (r infinite, theta0 0). So a sector keeps its
slant, its two arc lengths and theta0; r1 and r2 follow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from coneskin.core.errors import GeometryError

from .frustum import Frustum


@dataclass(frozen=True, slots=True)
class Sector:
    """An annular sector; a rectangle where theta0 is 0.

    Attributes:
        slant: distance between the arcs [m].
        arc1: length of the arc that becomes end 1 [m].
        arc2: length of the arc that becomes end 2 [m].
        theta0: central angle [rad], 0 for a rectangle.

    Raises:
        GeometryError: a value is negative or not finite, or the four do not belong together.
    """

    slant: float
    arc1: float
    arc2: float
    theta0: float

    def __post_init__(self) -> None:
        for name in ("slant", "arc1", "arc2", "theta0"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise GeometryError(f"{name} must be finite and not negative, got {value!r}")
            object.__setattr__(self, name, float(value))
        if self.slant == 0.0 or self.arc1 == self.arc2 == 0.0:
            raise GeometryError(f"a sector needs a slant and an arc above 0 m, got slant {self.slant!r} m")
        if self.theta0 > 2.0 * math.pi:
            raise GeometryError(f"theta0 must be at most a full turn (2 pi rad), got {self.theta0!r} rad")
        gap = abs(abs(self.arc2 - self.arc1) - self.theta0 * self.slant)
        if gap > 1e-9 * max(self.arc1, self.arc2):  # rounding of the arcs stays below 1e-15
            raise GeometryError(
                f"arc1, arc2, theta0 and slant must satisfy |arc2 - arc1| = theta0 * slant, they differ by {gap!r} m"
            )

    @property
    def r1(self) -> float:
        """Polar radius of end 1 [m]; infinite for a rectangle."""
        return self.arc1 / self.theta0 if self.theta0 else math.inf

    @property
    def r2(self) -> float:
        """Polar radius of end 2 [m]; smaller than r1 where the cone narrows; infinite for a rectangle."""
        return self.arc2 / self.theta0 if self.theta0 else math.inf

    @property
    def area(self) -> float:
        """Area [m2], the same as that of the wrapped side."""
        return 0.5 * (self.arc1 + self.arc2) * self.slant


def unroll(frustum: Frustum) -> Sector:
    """Return the flat sector of a frustum: r = rho s / |d| at both ends, theta0 = wrap |d| / s."""
    return Sector(
        slant=frustum.slant,
        arc1=frustum.wrap * frustum.radius1,
        arc2=frustum.wrap * frustum.radius2,
        theta0=frustum.wrap * abs(frustum.sin_half_angle),
    )


def roll_up(sector: Sector, wrap: float = 2.0 * math.pi) -> Frustum:
    """Return the frustum that a sector forms when it is wrapped through an angle, the inverse of ``unroll``.

    Args:
        sector: the flat sector.
        wrap: angle about the axis that the sheet covers [rad], in (0, 2 pi].

    Raises:
        GeometryError: wrap is out of range, or smaller than theta0 (a sheet cannot cover less than it measures).
    """
    if not 0.0 < wrap <= 2.0 * math.pi:
        raise GeometryError(f"wrap must be above 0 and at most a full turn (2 pi rad), got {wrap!r} rad")
    q = sector.theta0 / wrap
    if q > 1.0 + 1e-12:
        raise GeometryError(f"wrap must be at least theta0 = {sector.theta0!r} rad, got {wrap!r} rad")
    # (1 - q)(1 + q), not 1 - q * q: near a flat disc the latter keeps only half of the digits
    height = sector.slant * math.sqrt(max(0.0, (1.0 - q) * (1.0 + q)))
    return Frustum(sector.arc1 / wrap, sector.arc2 / wrap, height, wrap)
