"""Frustum with its pose on a link, and the two frusta of a double cone."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from coneskin.core.errors import GeometryError

from .frustum import Frustum
from .pose import Pose, Vector

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from coneskin.core.arrays import Floats

    from .bend import Bend

MAX_LENGTH = 5.0  # m; what is longer is no link, or in another unit
_STRAIGHT_DISTANCE = 1e-6  # m


@dataclass(frozen=True, slots=True)
class PlacedFrustum:
    """A frustum and its pose on a link.

    Attributes:
        link_frustum: pose of the frustum's frame in the link's frame.
    """

    frustum: Frustum
    link_frustum: Pose = field(default_factory=Pose)

    def point(self, u: float, phi: float) -> Vector:
        """Return the point of the side at (u [m], phi [rad]), numbers, in the link's frame [m]; ``place``: arrays."""
        return self.link_frustum.apply(self.frustum.point(u, phi))

    def normal(self, phi: float) -> Vector:
        """Return the outward unit normal at azimuth phi [rad], a number, in the link's frame; ``place``: of arrays."""
        return self.link_frustum.rotate(self.frustum.normal(phi))

    def locate(self, p_link: Vector) -> Vector:
        """Return u [m], phi [rad] and the signed distance [m] of one point of the link; ``locate_all``: of many."""
        return self.frustum.locate(*self.link_frustum.inverse().apply(p_link))

    def place(self, u: ArrayLike, phi: ArrayLike) -> tuple[Floats, Floats]:
        """Return points and outward unit normals in the link's frame, for numbers or arrays.

        Args:
            u: slant distance from end 1 [m], any shape.
            phi: azimuth [rad], of a shape that broadcasts with u.

        Returns:
            points [m] and normals, each of shape (..., 3).
        """
        import numpy as np

        points = self.link_frustum.apply_all(self.frustum.points(u, phi))
        normals = np.broadcast_to(self.frustum.normals(phi) @ np.array(self.link_frustum.rotation).T, points.shape)
        return points, normals.copy()

    def locate_all(self, points: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Return u [m], phi [rad] and the signed distance [m] of many points, the inverse of ``place``.

        Args:
            points: in the link's frame [m], shape (..., 3).

        Returns:
            three arrays of shape (...), as ``Frustum.locate`` returns them for one point.
        """
        import numpy as np

        x, y, z = np.moveaxis(self.link_frustum.inverse().apply_all(np.asarray(points, float)), -1, 0)
        sa, ca = self.frustum.sin_half_angle, self.frustum.cos_half_angle
        out = np.sqrt(x * x + y * y) - self.frustum.radius1
        azimuth, middle = np.arctan2(y, x), 0.5 * self.frustum.wrap
        phi = azimuth - math.tau * np.round((azimuth - middle) / math.tau)
        return out * sa + z * ca, phi, out * ca - z * sa

    def centre(self, u: float) -> Vector:
        """Return the middle of the section at u [m], in the link's frame [m]."""
        return self.link_frustum.apply((0.0, 0.0, u * self.frustum.cos_half_angle))

    @property
    def bends(self) -> tuple[Bend, ...]:
        """Strips of a side that is not round; none of a cone."""
        return ()

    @property
    def lift(self) -> float:
        """Height above the general cone to which a side that is not round is parallel [m]; 0 of a cone."""
        return 0.0

    @property
    def is_straight(self) -> bool:
        """True where the radii differ by less than a micrometre: no mesh and no cutter knows it from a cylinder."""
        return abs(self.frustum.radius2 - self.frustum.radius1) < _STRAIGHT_DISTANCE

    @property
    def kind(self) -> str:
        """Kind of the side, in words."""
        return "cylinder" if self.is_straight else "cone"

    @property
    def growth(self) -> float:
        """Growth of the mean radius per height above the side."""
        return self.frustum.cos_half_angle

    @property
    def sharpest_bend(self) -> float:
        """Largest turn of the normal per azimuth; cos a all around a cone."""
        return self.frustum.cos_half_angle

    def moved(self, frame: Pose) -> PlacedFrustum:
        """Return the side in another frame, in which ``frame`` is the pose of the link's."""
        return PlacedFrustum(self.frustum, frame @ self.link_frustum)

    def turned(self, turn: float) -> PlacedFrustum:
        """Return a full wrap whose seam lies at the azimuth that was ``turn`` [rad]."""
        return PlacedFrustum(self.frustum, self.link_frustum @ Pose.from_xyz_rpy(rpy=(0.0, 0.0, turn)))

    def parallel(self, height: float) -> PlacedFrustum:
        """Return the parallel side at a height [m] above this one: same half angle, slant and theta0."""
        f = self.frustum
        grow = height * f.cos_half_angle
        shape = Frustum(f.radius1 + grow, f.radius2 + grow, f.height, f.wrap)
        return PlacedFrustum(shape, self.link_frustum @ Pose(translation=(0.0, 0.0, -height * f.sin_half_angle)))

    def azimuth_above(self, height: float, phi: float) -> float:
        """Return the azimuth [rad] on the parallel side at a height [m] of the ruling that has the azimuth phi here."""
        del height  # a cone grows evenly
        return phi

    def part(self, u1: float, u2: float, phi1: float, phi2: float) -> PlacedFrustum:
        """Return the part between two arcs u [m] and two azimuths phi [rad]."""
        f = self.frustum
        shape = Frustum(f.radius_at(u1), f.radius_at(u2), (u2 - u1) * f.cos_half_angle, phi2 - phi1)
        shift = Pose.from_xyz_rpy((0.0, 0.0, u1 * f.cos_half_angle), (0.0, 0.0, phi1))
        return PlacedFrustum(shape, self.link_frustum @ shift)


def double_cone(
    radius1: float,
    belt_radius: float,
    radius2: float,
    height1: float,
    height2: float,
    wrap: float = 2.0 * math.pi,
) -> tuple[PlacedFrustum, PlacedFrustum]:
    """Return two frusta on one axis that share a belt, the rugby ball of the paper's figure 14.

    Args:
        radius1: radius at the first end [m].
        belt_radius: radius at the belt, where the two meet [m].
        radius2: radius at the far end [m].
        height1: axial length of the first frustum [m].
        height2: axial length of the second [m].
        wrap: angle covered, the same for both [rad].

    Returns:
        the frustum from the first end to the belt, and the one from the belt to the far end.

    Raises:
        GeometryError: a length is negative or not finite.
    """
    if not belt_radius > 0.0:
        raise GeometryError(f"belt_radius must be above 0 m, got {belt_radius!r} m")
    first = Frustum(radius1, belt_radius, height1, wrap)
    second = Frustum(belt_radius, radius2, height2, wrap)
    return PlacedFrustum(first), PlacedFrustum(second, Pose(translation=(0.0, 0.0, height1)))


def check_place(place: object) -> None:
    """Refuse what is no place of a sheet on a link.

    Raises:
        GeometryError: it is no ``PlacedFrustum``, or larger than any link, as where millimeters were meant.
    """
    if not isinstance(place, PlacedFrustum):
        raise GeometryError(f"a place must be a PlacedFrustum, got {place!r}: give the pose of each Frustum")
    for name in ("radius1", "radius2", "height"):
        value = getattr(place.frustum, name)
        if value > MAX_LENGTH:
            what = f"got {value:g} m: lengths are in meters, {value:g} mm is {1e-3 * value:g}"
            raise GeometryError(f"{name} must be at most {MAX_LENGTH:g} m, {what}")
