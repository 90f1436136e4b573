"""Developable side with its pose on a link, in the place of a placed frustum."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from .bend import Bend
from .developable import Developable
from .placed_frustum import PlacedFrustum
from .pose import Pose, Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

__all__ = ["PlacedDevelopable"]

_NORMAL_COUNT = 360  # by which the middle of a section is found


@dataclass(frozen=True, slots=True)
class PlacedDevelopable(PlacedFrustum):
    """A general cylinder or cone and its pose on a link; what is flat of it is that of its frustum.

    Attributes:
        frustum: the frustum to which the side is isometric.
        link_frustum: pose of the side's frame in the link's frame; the frustum there touches it along phi = 0.
        bends: strips from phi = 0 to phi = wrap.
        lift: height above the general cone to which the side is parallel [m].
    """

    bends: tuple[Bend, ...] = ()
    lift: float = 0.0
    _side: Developable = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_side", Developable(self.frustum, self.bends, self.lift))

    @classmethod
    def of(cls, side: Developable, pose: Pose) -> PlacedDevelopable:
        """Place a side."""
        return cls(side.frustum, pose, side.bends, side.lift)

    @property
    def side(self) -> Developable:
        """The side in its own frame."""
        return self._side

    @property
    def kind(self) -> str:
        """Kind of the side, in words."""
        return f"general {'cylinder' if self.is_straight else 'cone'}"

    @property
    def growth(self) -> float:
        """Growth of the mean radius per height above the side."""
        return self._side.growth

    def mismatch(self, height: float) -> float:
        """Return how far the parallel side at a height [m] is from being a sector, in arc at end 1 or 2 [m]."""
        return self._side.mismatch(height)

    @property
    def closing_gap(self) -> float:
        """Distance between the ends of the arc of end 1 of a full wrap [m]."""
        return self._side.closing_gap[0]

    @property
    def sharpest_bend(self) -> float:
        """Largest turn of the normal per azimuth."""
        return max(abs(bend.turn) / bend.width for bend in self.bends)

    def point(self, u: float, phi: float) -> Vector:
        """Return the point at (u [m], phi [rad]), in the link's frame [m]."""
        return self.link_frustum.apply(self._side.point(u, phi))

    def normal(self, phi: float) -> Vector:
        """Return the outward unit normal at azimuth phi [rad], in the link's frame."""
        return self.link_frustum.rotate(self._side.normal(phi))

    def locate(self, p_link: Vector) -> Vector:
        """Return u [m], phi [rad] and the signed distance [m] of a point of the link's frame."""
        return self._side.locate(*self.link_frustum.inverse().apply(p_link))

    def place(self, u: ArrayLike, phi: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return points [m] and outward unit normals in the link's frame, shapes (..., 3)."""
        import numpy as np

        u, phi = np.broadcast_arrays(np.asarray(u, float), np.asarray(phi, float))
        base, way, normal = self._side.rulings(phi)
        return self.link_frustum.apply_all(base + u[..., None] * way), normal @ np.array(self.link_frustum.rotation).T

    def locate_all(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return u [m], phi [rad] and the signed distance [m] of many points, the inverse of ``place``."""
        import numpy as np

        points = np.asarray(points, float)
        back = self.link_frustum.inverse()
        u, phi, distance = self._side.locate_all(back.apply_all(points.reshape(-1, 3)))
        shape = points.shape[:-1]
        return u.reshape(shape), phi.reshape(shape), distance.reshape(shape)

    def centre(self, u: float) -> Vector:
        """Return the middle of the section at u [m], in the link's frame [m]: the point nearest to its normals.

        It is the centre of an oval, and that of the circle where a part of one is covered.
        """
        import numpy as np

        phi = (np.arange(_NORMAL_COUNT) + 0.5) * self.frustum.wrap / _NORMAL_COUNT
        base, way, normal = self._side.rulings(phi)
        along = way.sum(axis=0) / np.linalg.norm(way.sum(axis=0))
        level = normal - np.outer(normal @ along, along)
        level /= np.linalg.norm(level, axis=1)[:, None]
        across = np.eye(3) - level[:, :, None] * level[:, None, :]
        points = base + u * way
        x, y, z = np.linalg.lstsq(across.sum(axis=0), np.einsum("ijk,ik->j", across, points), rcond=1e-9)[0].tolist()
        return self.link_frustum.apply((x, y, z))

    def moved(self, frame: Pose) -> PlacedDevelopable:
        """Return the side in another frame, in which ``frame`` is the pose of the link's."""
        return PlacedDevelopable(self.frustum, frame @ self.link_frustum, self.bends, self.lift)

    def turned(self, turn: float) -> PlacedDevelopable:
        """Return a full wrap whose seam lies at the azimuth that was ``turn`` [rad]."""
        side, shift = self._side.turned(turn)
        return self.of(side, self.link_frustum @ shift)

    def parallel(self, height: float) -> PlacedDevelopable:
        """Return the side at a height [m] above this one."""
        side, shift = self._side.parallel(height)
        return self.of(side, self.link_frustum @ shift)

    def azimuth_above(self, height: float, phi: float) -> float:
        """Return the azimuth [rad] on the parallel side at a height [m] of the ruling that has the azimuth phi here.

        A bend grows with the height and a plane does not, so that they take other shares of the wrap there.
        """
        return self._side.azimuth_above(height, phi)

    def part(self, u1: float, u2: float, phi1: float, phi2: float) -> PlacedDevelopable:
        """Return the part between two arcs u [m] and two rulings phi [rad]."""
        side, shift = self._side.part(u1, u2, phi1, phi2)
        return self.of(side, self.link_frustum @ shift)
