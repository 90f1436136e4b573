"""General cylinder or general cone, or a side parallel to one: ruled, and bent along its rulings.

A sheet that is bent along straight rulings keeps every length on it. So the side of a tube with any section, whose
rulings are parallel (a general cylinder) or meet in one point (a general cone), unrolls to the rectangle or the annular
sector of a frustum, and has its surface coordinates (u, phi): u along the rulings, phi in proportion to the arc across
them. Only the points and the normals differ, by how sharply the sheet is bent at each azimuth. The bending is constant
over each of a row of strips (``BentStrip``), where neighbours share a ruling and its tangent plane. A strip of
turn = width cos a is one of the frustum itself.

The parallel side at a height t above a general cone has the same rulings and normals. At a distance r from the point in
which the rulings meet, an arc of the angle dtheta that is bent by dturn is r dtheta + t dturn long there. Where the
bending varies, that is the arc of no sector; the sector with the same arcs from edge to edge, in which each ruling has
its place by the arc in the middle of the slant, misses it by least: by ``mismatch`` at the ends.
"""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from coneskin.core.errors import GeometryError

from .bend import Bend, BentStrip, RulingFrame, bends_between, check_bends, frames_along
from .frustum import Frustum
from .pose import Pose, Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

__all__ = ["Developable"]

_AT_EDGE = 1e-9  # rad; a foot so close to an edge may lie beyond it
_MAX_OPENING = 0.01  # of a turn, and of the way around; a fitted wrap is a hundred times closer


@dataclass(frozen=True, slots=True)
class Developable:
    """A side that is bent along rulings, in a frame of its own.

    The frame is that of a frustum which it touches along the ruling phi = 0: that ruling begins at (radius1, 0, 0), and
    its outward normal lies in the plane of x and z.

    Attributes:
        frustum: the frustum to whose side it is isometric, but for ``mismatch``; its u, phi, lengths and areas are
            those of this side.
        bends: strips from phi = 0 to phi = wrap.
        lift: height above the general cone to which this side is parallel [m]; 0 where it is one itself.

    Raises:
        GeometryError: end 1 of the frustum is an apex, the bends do not add up to its wrap, or one is too sharp for the
            lift.
    """

    frustum: Frustum
    bends: tuple[Bend, ...]
    lift: float = 0.0
    _strips: tuple[BentStrip, ...] = field(init=False, repr=False, compare=False)
    _starts: tuple[float, ...] = field(init=False, repr=False, compare=False)  # azimuths

    def __post_init__(self) -> None:
        f = self.frustum
        if not f.radius1 > 0.0:
            raise GeometryError("radius1 must be above 0 m: a bent side is laid out from its end 1, which has no arc")
        check_bends(self.bends, f.wrap)
        if not math.isfinite(self.lift):
            raise GeometryError(f"the lift of a bent side must be finite, got {self.lift!r} m")
        sunk = self.lift * self.growth
        low, middle = f.radius1 - sunk, self._middle - sunk  # of the general cone below
        if min(low, f.radius2 - sunk) <= 0.0:
            raise GeometryError(f"the side lies {self.lift * 1e3:.4g} mm above a general cone beyond its apex")
        strips: list[BentStrip] = []
        starts: list[float] = []
        sa, ca = f.sin_half_angle, f.cos_half_angle
        at = (f.radius1 - self.lift * ca, 0.0, self.lift * sa)
        frame, begin = RulingFrame(at, (0.0, 1.0, 0.0), (sa, 0.0, ca), (ca, 0.0, -sa)), 0.0
        for bend in self.bends:
            below = (bend.width * self._middle - self.lift * bend.turn) / middle
            if below <= 0.0:
                raise GeometryError(f"a bend is too sharp for a side {self.lift * 1e3:.4g} mm above a general cone")
            arc = below * low
            strips.append(BentStrip(arc, sa / low, bend.turn / arc, frame))
            starts.append(begin)
            frame = strips[-1].frame(arc)
            begin += bend.width
        object.__setattr__(self, "_strips", tuple(strips))
        object.__setattr__(self, "_starts", tuple(starts))

    @property
    def turn(self) -> float:
        """Angle by which the normal turns from phi = 0 to phi = wrap [rad]; 2 pi around a closed tube."""
        return math.fsum(bend.turn for bend in self.bends)

    @property
    def growth(self) -> float:
        """Growth of the mean radius per height of a parallel side; cos a of a frustum."""
        return self.turn / self.frustum.wrap

    @property
    def closed(self) -> bool:
        """True where phi goes all around, so that phi and phi + 2 pi are one ruling."""
        return self.frustum.wrap == math.tau

    @property
    def closing_gap(self) -> tuple[float, float]:
        """Distance between the ends of the arc of end 1 [m], and the angle between the normals there [rad]."""
        last, first = self.edge(), self._frame(0, 0.0)
        turned = math.hypot(math.dist(last.n, first.n), math.dist(last.t, first.t)) / math.sqrt(2.0)
        return math.dist(last.at, first.at), 2.0 * math.asin(min(1.0, 0.5 * turned))

    @property
    def _middle(self) -> float:
        """Radius in the middle of the slant [m], where the arcs of this side are those of its frustum."""
        return 0.5 * (self.frustum.radius1 + self.frustum.radius2)

    def check_closed(self) -> None:
        """Refuse a full wrap whose bends do not close, as where a turn is wrong, or in radians.

        Raises:
            GeometryError: with what they add up to.
        """
        if not self.closed:
            return
        gap, angle = self.closing_gap
        around = math.tau * self.frustum.radius1
        if gap > _MAX_OPENING * around or angle > math.tau * _MAX_OPENING or not 0.0 < self.turn < 1.5 * math.tau:
            raise GeometryError(
                f"the bends of a full wrap must close: they turn by {math.degrees(self.turn):.6g} deg in all (360 deg "
                f"around a tube, above 0 outwards), and leave {1e3 * gap:.3g} mm and {math.degrees(angle):.3g} deg open"
            )

    def edge(self) -> RulingFrame:
        """Return the ruling at phi = wrap, in the frame of the side."""
        return self._frame(len(self._strips) - 1, self._strips[-1].arc)

    def _frame(self, number: int, along: float) -> RulingFrame:
        """Return a ruling of this side by its strip and its distance from the first one there, below the lift [m]."""
        (x, y, z), t, u, (nx, ny, nz) = self._strips[number].frame(along)
        lift = self.lift
        return RulingFrame((x + lift * nx, y + lift * ny, z + lift * nz), t, u, (nx, ny, nz))

    def _ruling(self, phi: float) -> RulingFrame:
        """Return the ruling at an azimuth [rad]; beyond the edges the outer strips continue."""
        if self.closed:
            phi %= math.tau
        number = max(0, bisect.bisect_right(self._starts, phi) - 1)
        strip, bend = self._strips[number], self.bends[number]
        return self._frame(number, (phi - self._starts[number]) * strip.arc / bend.width)

    def point(self, u: float, phi: float) -> Vector:
        """Return the point at u [m] and phi [rad], in the frame of the side [m]."""
        (x, y, z), _, (ux, uy, uz), _ = self._ruling(phi)
        return x + u * ux, y + u * uy, z + u * uz

    def normal(self, phi: float) -> Vector:
        """Return the outward unit normal at azimuth phi [rad]; it is the same all along a ruling."""
        return self._ruling(phi).n

    def locate(self, x: float, y: float, z: float) -> tuple[float, float, float]:
        """Return the surface coordinates of the nearest foot of a point, the inverse of ``point``.

        Args:
            x: first coordinate in the frame of the side [m].
            y: second coordinate [m].
            z: third coordinate [m].

        Returns:
            u [m], phi [rad] and the signed distance [m], positive outside. The foot is on the continuation of the
            rulings, so u may lie outside [0, slant]; phi outside [0, wrap] where the outer strips continue.
        """
        u, phi, distance = (float(one[0]) for one in self.locate_all([[x, y, z]]))
        return u, phi, distance

    def rulings(self, phi: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return the points of end 1 [m], the directions of the rulings and the normals: shapes (..., 3).

        Args:
            phi: azimuths [rad].
        """
        import numpy as np

        phi = np.asarray(phi, float)
        if self.closed:
            phi = phi % math.tau
        number = np.clip(np.searchsorted(self._starts, phi, side="right") - 1, 0, None)
        share = np.array([strip.arc / bend.width for strip, bend in zip(self._strips, self.bends, strict=True)])
        at, way, normal = frames_along(self._strips, number, (phi - np.array(self._starts)[number]) * share[number])
        return at + self.lift * normal, way, normal

    def points(self, u: ArrayLike, phi: ArrayLike) -> NDArray[np.float64]:
        """Return the points for arrays u [m] and phi [rad] that broadcast: shape (..., 3) [m]."""
        import numpy as np

        u, phi = np.broadcast_arrays(np.asarray(u, float), np.asarray(phi, float))
        base, way, _ = self.rulings(phi)
        return np.asarray(base + u[..., None] * way)

    def locate_all(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return u [m], phi [rad] and the signed distance [m] of many points, shape (n, 3), as ``locate`` does."""
        import numpy as np

        points = np.asarray(points, float)
        best, phi = np.full(len(points), np.inf), np.zeros(len(points))
        for number, strip in enumerate(self._strips):
            along, gap = strip.feet(points, 0.0, strip.arc)
            better = gap < best
            best[better] = gap[better]
            phi[better] = self._starts[number] + along[better] * self.bends[number].width / strip.arc
        if not self.closed:  # beyond its edges the outer strips go on, but not over the side itself
            for number, edge in ((0, 0.0), (-1, self.frustum.wrap)):
                strip, out = self._strips[number], np.abs(phi - edge) < _AT_EDGE
                along, _ = strip.feet(points[out], *((-np.inf, 0.0) if number == 0 else (0.0, np.inf)))
                phi[out] = self._starts[number] + along * self.bends[number].width / strip.arc
        at, way, normal = self.rulings(phi)
        return np.einsum("ij,ij->i", points - at, way), phi, np.einsum("ij,ij->i", points - at, normal)

    def parallel(self, height: float) -> tuple[Developable, Pose]:
        """Return the side parallel to this one at a height [m] along the normals, and its frame in the frame of this.

        A bend grows by height * turn, a plane does not.

        Raises:
            GeometryError: a bend is sharper than the height allows.
        """
        f, grow = self.frustum, height * self.growth
        middle = self._middle
        widths = [(bend.width * middle + height * bend.turn) / (middle + grow) for bend in self.bends]
        if min(widths) <= 0.0:
            raise GeometryError(f"a bend is too sharp for a parallel side at {height * 1e3:.4g} mm")
        bends = tuple(Bend(width, bend.turn) for width, bend in zip(widths, self.bends, strict=True))
        shift = Pose(translation=(height * (f.cos_half_angle - self.growth), 0.0, -height * f.sin_half_angle))
        frustum = Frustum(f.radius1 + grow, f.radius2 + grow, f.height, f.wrap)
        return Developable(frustum, bends, self.lift + height), shift

    def azimuth_above(self, height: float, phi: float) -> float:
        """Return the azimuth [rad] on the parallel side at a height [m] of the ruling that has the azimuth phi here."""
        middle = self._middle
        turns, left = divmod(phi, math.tau) if self.closed else (0.0, phi)
        arc = 0.0
        for number, bend in enumerate(self.bends):
            width = left if number == len(self.bends) - 1 else min(left, bend.width)
            arc += width * (middle + height * bend.turn / bend.width)
            left -= width
            if left <= 0.0:
                break
        return turns * math.tau + arc / (middle + height * self.growth)

    def mismatch(self, height: float) -> float:
        """Return how far the parallel side at a height [m] is from being a sector, in arc at end 1 or 2 [m]."""
        below, _ = self.parallel(-self.lift)
        f, arc, turned, worst = below.frustum, 0.0, 0.0, 0.0
        lift = self.lift + height
        for bend in below.bends:
            arc += bend.width
            turned += bend.turn
            worst = max(worst, abs(self.growth * arc - turned))
        return abs(0.5 * lift * worst * f.slant * f.sin_half_angle / (below._middle + lift * self.growth))

    def turned(self, turn: float) -> tuple[Developable, Pose]:
        """Return a closed side whose phi = 0 lies where phi was ``turn`` [rad], and its frame in the frame of this.

        Raises:
            GeometryError: the side is not closed.
        """
        if not self.closed:
            raise GeometryError("only a full wrap can be turned: a partial one has edges where it ends")
        turn %= math.tau
        bends = bends_between(self.bends, turn, turn + math.tau, around=True)
        return Developable(self.frustum, bends, self.lift), self._frame_at(0.0, turn)

    def _frame_at(self, u: float, phi: float) -> Pose:
        """Return the frame of a side that begins at u [m], phi [rad], in the frame of this side."""
        f = self.frustum
        at, t, way, n = self._ruling(phi)
        sa, ca = f.sin_half_angle, f.cos_half_angle
        x = tuple(sa * a + ca * b for a, b in zip(way, n, strict=True))
        z = tuple(ca * a - sa * b for a, b in zip(way, n, strict=True))
        rho = f.radius_at(u)
        px, py, pz = (p + u * a - rho * b for p, a, b in zip(at, way, x, strict=True))
        return Pose(((x[0], t[0], z[0]), (x[1], t[1], z[1]), (x[2], t[2], z[2])), (px, py, pz))

    def part(self, u1: float, u2: float, phi1: float, phi2: float) -> tuple[Developable, Pose]:
        """Return the part between two arcs u [m] and two rulings phi [rad], and its frame in the frame of this side.

        The part of a lifted side has the sector of its own arcs, its rulings at their places in its own middle.
        """
        if not 0.0 <= phi1 < phi2:
            raise GeometryError(f"phi1 must not be below 0 and phi2 above it, got {phi1!r} and {phi2!r} rad")
        if self.lift:
            below, down = self.parallel(-self.lift)
            piece, at = below.part(u1, u2, *(self.azimuth_above(-self.lift, phi) for phi in (phi1, phi2)))
            above, up = piece.parallel(self.lift)
            return above, down @ at @ up
        f = self.frustum
        frustum = Frustum(f.radius_at(u1), f.radius_at(u2), (u2 - u1) * f.cos_half_angle, phi2 - phi1)
        return Developable(frustum, bends_between(self.bends, phi1, phi2, self.closed)), self._frame_at(u1, phi1)
