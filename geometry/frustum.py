"""Truncated cone, the surface coordinates (u, phi) on its side, and its flat annular sector (paper, figure 1).

Symbols (docs/understand/conventions.md): rho1, rho2 radii, h height, s slant, a half angle;
d = rho2 - rho1 = s sin a, h = s cos a.
A method in the singular takes numbers, one place, and loads no numpy: the live loop calls it. ``points`` and
``normals`` take arrays; ``PlacedFrustum.locate_all`` is the inverse for arrays.
Everything is written in the surface coordinates (u, phi), not in the polar coordinates (r, theta) of the flat sector,
because r grows without bound as a cone becomes a cylinder and real links are mostly cylinders. In (u, phi) the
cylinder, the cone with its apex, the disc and the narrowing cone are ordinary values of one formula.
A drawing needs r1, r2 and theta0, but these cannot represent a cylinder (r infinite, theta0 0). So a sector keeps its
slant, its two arc lengths and theta0; r1 and r2 follow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from coneskin.core.errors import GeometryError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from coneskin.core.arrays import Floats


def _take_sizes(shape: object, names: tuple[str, ...], unit: str = "") -> None:
    """Make sizes of a shape plain floats, and refuse what is negative or not finite."""
    for name in names:
        value = getattr(shape, name)
        if not (math.isfinite(value) and value >= 0.0):
            raise GeometryError(f"{name} must be finite and not negative, got {value!r}{unit}")
        object.__setattr__(shape, name, float(value))


@dataclass(frozen=True, slots=True)
class Frustum:
    """The side of a truncated cone about the z axis: end 1 at z = 0, end 2 at z = height.

    Attributes:
        radius1: radius at end 1 [m]; 0 puts the apex there.
        radius2: radius at end 2 [m]; smaller than radius1 where the link narrows.
        height: distance between the ends along the axis [m]; 0 makes a flat ring.
        wrap: angle about the axis that is covered [rad], in (0, 2 pi], from phi = 0 (the x axis) on.

    Raises:
        GeometryError: a value is not finite or negative, the side has no area, or wrap exceeds a full turn.
    """

    radius1: float
    radius2: float
    height: float
    wrap: float = math.tau

    def __post_init__(self) -> None:
        _take_sizes(self, ("radius1", "radius2", "height"), " m")
        if not 0.0 < self.wrap <= math.tau:
            raise GeometryError(f"wrap must be above 0 and at most a full turn (2 pi rad), got {self.wrap!r} rad")
        object.__setattr__(self, "wrap", float(self.wrap))
        if self.radius1 == self.radius2 == 0.0:
            raise GeometryError("radius1 and radius2 must not both be 0: the side has no area")
        if self.slant == 0.0:
            raise GeometryError("height must be above 0 where both radii are equal: the side has no length")

    @property
    def slant(self) -> float:
        """Length of the side from end 1 to end 2 [m]."""
        return math.hypot(self.height, self.radius2 - self.radius1)

    @property
    def half_angle(self) -> float:
        """Angle between side and axis [rad], in [-pi/2, pi/2]; positive where the cone widens towards end 2."""
        return math.atan2(self.radius2 - self.radius1, self.height)

    @property
    def sin_half_angle(self) -> float:
        """Sine of the half angle, from the lengths; a detour by the angle would lose digits."""
        return (self.radius2 - self.radius1) / self.slant

    @property
    def cos_half_angle(self) -> float:
        """Cosine of the half angle."""
        return self.height / self.slant

    @property
    def area(self) -> float:
        """Area of the wrapped side [m2]."""
        return 0.5 * self.wrap * (self.radius1 + self.radius2) * self.slant

    def radius_at(self, u: float) -> float:
        """Return the distance from the axis [m] at slant distance u [m] from end 1."""
        s = self.slant  # both terms are positive on the side, so nothing cancels near the apex
        return ((s - u) * self.radius1 + u * self.radius2) / s

    def point(self, u: float, phi: float) -> tuple[float, float, float]:
        """Return the point of the side at surface coordinates, which are numbers; ``points`` takes arrays.

        Args:
            u: slant distance from end 1 [m].
            phi: azimuth about the axis [rad].

        Returns:
            x, y, z in the frame of the frustum [m].
        """
        rho = self.radius_at(u)
        return rho * math.cos(phi), rho * math.sin(phi), u * self.cos_half_angle

    def normal(self, phi: float) -> tuple[float, float, float]:
        """Return the outward unit normal of the side at azimuth phi [rad], a number; u does not matter."""
        ca = self.cos_half_angle
        return ca * math.cos(phi), ca * math.sin(phi), -self.sin_half_angle

    def locate(self, x: float, y: float, z: float) -> tuple[float, float, float]:
        """Return the surface coordinates of the foot of a point, the inverse of ``point``; of one point, not of arrays.

        Many points at once: ``PlacedFrustum.locate_all``.

        Args:
            x: first coordinate in the frame of the frustum [m].
            y: second coordinate [m].
            z: coordinate along the axis [m].

        Returns:
            u [m], phi [rad] and the signed distance from the side [m], positive outside. The foot is on the straight
            continuation of the side, so u may lie outside [0, slant]; phi lies within half a turn of wrap / 2.
        """
        sa, ca = self.sin_half_angle, self.cos_half_angle
        out, angle = math.hypot(x, y) - self.radius1, math.atan2(y, x)
        phi = angle - math.tau * round((angle - 0.5 * self.wrap) / math.tau)
        return out * sa + z * ca, phi, out * ca - z * sa

    def polar(self, u: float, phi: float) -> tuple[float, float]:
        """Return the polar coordinates (r [m], theta [rad]) on the flat sector; (infinity, 0) on a cylinder."""
        q = abs(self.sin_half_angle)
        return (self.radius_at(u) / q if q else math.inf), phi * q

    def flat_point(self, u: float, phi: float) -> tuple[float, float]:
        """Return the point of the flat pattern, isometric to the side and regular for every half angle.

        Args:
            u: slant distance from end 1 [m].
            phi: azimuth [rad].

        Returns:
            x, y [m]: the origin is at (u, phi) = (0, 0), y runs along that edge, x into the sheet as seen from outside.
        """
        sa = self.sin_half_angle
        rho = self.radius_at(u)
        half = 0.5 * phi * sa
        return rho * phi * sinc(phi * sa), u - rho * phi * math.sin(half) * sinc(half)

    def points(self, u: ArrayLike, phi: ArrayLike) -> Floats:
        """Return the points of the side for arrays u [m] and phi [rad] that broadcast: shape (..., 3) [m]."""
        import numpy as np

        u, phi = np.broadcast_arrays(np.asarray(u, float), np.asarray(phi, float))
        s = self.slant
        rho = ((s - u) * self.radius1 + u * self.radius2) / s
        return np.stack([rho * np.cos(phi), rho * np.sin(phi), u * self.cos_half_angle], axis=-1)

    def normals(self, phi: ArrayLike) -> Floats:
        """Return the outward unit normals for an array of azimuths [rad]: shape (..., 3)."""
        import numpy as np

        phi = np.asarray(phi, float)
        ca = self.cos_half_angle
        return np.stack([ca * np.cos(phi), ca * np.sin(phi), np.full_like(phi, -self.sin_half_angle)], axis=-1)


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
        _take_sizes(self, ("slant", "arc1", "arc2", "theta0"))
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


def sinc(x: float) -> float:
    """Return sin(x) / x [x in rad], 1 at 0."""
    return math.sin(x) / x if x else 1.0
