"""A frustum in its place on a link; the two of a double cone."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from coneskin.errors import GeometryError

from .frustum import Frustum
from .pose import Pose, Vector

__all__ = ["PlacedFrustum", "double_cone"]


@dataclass(frozen=True, slots=True)
class PlacedFrustum:
    """A frustum and where it sits.

    Attributes:
        frustum: the shape.
        link_frustum: pose of the frustum's frame in the link's frame.
    """

    frustum: Frustum
    link_frustum: Pose = field(default_factory=Pose)

    def point(self, u: float, phi: float) -> Vector:
        """Point of the side in the link's frame [m]; u [m], phi [rad]."""
        return self.link_frustum.apply(self.frustum.point(u, phi))

    def normal(self, phi: float) -> Vector:
        """Outward unit normal in the link's frame."""
        return self.link_frustum.rotate(self.frustum.normal(phi))

    def locate(self, p_link: Vector) -> Vector:
        """u [m], phi [rad] and signed distance [m] of a point of the link's frame (``Frustum.locate``)."""
        return self.frustum.locate(*self.link_frustum.inverse().apply(p_link))


def double_cone(
    radius1: float,
    belt_radius: float,
    radius2: float,
    height1: float,
    height2: float,
    wrap: float = 2.0 * math.pi,
    link_body: Pose | None = None,
) -> tuple[PlacedFrustum, PlacedFrustum]:
    """The rugby ball of the paper's figure 14: two frusta on one axis that share a belt.

    Args:
        radius1: radius at the first end [m].
        belt_radius: radius where the two meet [m].
        radius2: radius at the far end [m].
        height1: axial length of the first frustum [m].
        height2: axial length of the second [m].
        wrap: angle covered, the same for both [rad].
        link_body: pose in the link's frame of the body, whose z axis runs from the first end to the far one.

    Returns:
        the frustum from the first end to the belt, and the one from the belt to the far end.

    Raises:
        GeometryError: a length is negative or not finite.
    """
    body = link_body or Pose()
    if not belt_radius > 0.0:
        raise GeometryError(f"belt_radius must be above 0 m, got {belt_radius!r} m")
    first = Frustum(radius1, belt_radius, height1, wrap)
    second = Frustum(belt_radius, radius2, height2, wrap)
    return PlacedFrustum(first, body), PlacedFrustum(second, body @ Pose(translation=(0.0, 0.0, height1)))
