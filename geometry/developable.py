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
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from coneskin.core.errors import GeometryError

from .bend import Bend, BentStrip, RulingFrame
from .frustum import Frustum
from .placed_frustum import PlacedFrustum
from .pose import Pose, Vector

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from coneskin.core.arrays import Floats, Ints

_WRAP_ROUNDING = 1e-6  # rad; the widths of the bends add up to the wrap but for rounding
_MIN_BEND_WIDTH = 1e-9  # rad; what is left of a bend that is cut is at least so wide
_AT_EDGE = 1e-9  # rad; a foot so close to an edge may lie beyond it
_MAX_ONE_FOOT = 3.0  # rad; a strip that turns by less than half a turn has one foot at most
_NORMAL_COUNT = 360  # by which the middle of a section is found
_MAX_OPENING = 0.01  # of a turn, and of the way around; a fitted wrap is a hundred times closer


@dataclass(frozen=True, slots=True)
class Developable(PlacedFrustum):
    """A side that is bent along rulings, and its pose on a link; what is flat of it is that of its frustum.

    Its frame is that of a frustum which it touches along the ruling phi = 0: that ruling begins at (radius1, 0, 0), and
    its outward normal lies in the plane of x and z.

    Attributes:
        frustum: the frustum to whose side it is isometric, but for ``mismatch``; its u, phi, lengths and areas are
            those of this side.
        link_frustum: pose of the side's frame in the link's frame.
        bends: strips from phi = 0 to phi = wrap.
        lift: height above the general cone to which this side is parallel [m]; 0 where it is one itself.

    Raises:
        GeometryError: end 1 of the frustum is an apex, the bends do not add up to its wrap, or one is too sharp for the
            lift.
    """

    bends: tuple[Bend, ...] = ()
    lift: float = 0.0
    _strips: tuple[BentStrip, ...] = field(init=False, repr=False, compare=False)
    _starts: tuple[float, ...] = field(init=False, repr=False, compare=False)  # azimuths

    def __post_init__(self) -> None:
        f = self.frustum
        if not f.radius1 > 0.0:
            raise GeometryError("radius1 must be above 0 m: a bent side is laid out from its end 1, which has no arc")
        _check_bends(self.bends, f.wrap)
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
    def kind(self) -> str:
        """Kind of the side, in words."""
        return f"general {'cylinder' if self.is_straight else 'cone'}"

    @property
    def growth(self) -> float:
        """Growth of the mean radius per height above the side; cos a of a frustum."""
        return self.turn / self.frustum.wrap

    @property
    def closed(self) -> bool:
        """True where phi goes all around, so that phi and phi + 2 pi are one ruling."""
        return self.frustum.wrap == math.tau

    @property
    def closing_gap(self) -> float:
        """Distance between the ends of the arc of end 1 of a full wrap [m]."""
        return self._opening[0]

    @property
    def sharpest_bend(self) -> float:
        """Largest turn of the normal per azimuth."""
        return max(abs(bend.turn) / bend.width for bend in self.bends)

    @property
    def _opening(self) -> tuple[float, float]:
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
        gap, angle = self._opening
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
        """Return the point at u [m] and phi [rad], in the link's frame [m]."""
        (x, y, z), _, (ux, uy, uz), _ = self._ruling(phi)
        return self.link_frustum.apply((x + u * ux, y + u * uy, z + u * uz))

    def normal(self, phi: float) -> Vector:
        """Return the outward unit normal at azimuth phi [rad] in the link's frame; the same all along a ruling."""
        return self.link_frustum.rotate(self._ruling(phi).n)

    def locate(self, p_link: Vector) -> Vector:
        """Return u [m], phi [rad] and the signed distance [m] of the nearest foot of a point of the link's frame.

        The foot is on the continuation of the rulings, so u may lie outside [0, slant]; phi outside [0, wrap] where the
        outer strips continue.
        """
        import numpy as np

        u, phi, distance = self._feet(np.array([self.link_frustum.inverse().apply(p_link)]))
        return float(u[0]), float(phi[0]), float(distance[0])

    def rulings(self, phi: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Return the points of end 1 [m], the rulings' directions and the normals at azimuths [rad], shape (..., 3)."""
        import numpy as np

        phi = np.asarray(phi, float)
        if self.closed:
            phi = phi % math.tau
        number = np.clip(np.searchsorted(self._starts, phi, side="right") - 1, 0, None)
        share = np.array([strip.arc / bend.width for strip, bend in zip(self._strips, self.bends, strict=True)])
        at, way, normal = _frames_along(self._strips, number, (phi - np.array(self._starts)[number]) * share[number])
        return at + self.lift * normal, way, normal

    def place(self, u: ArrayLike, phi: ArrayLike) -> tuple[Floats, Floats]:
        """Return points [m] and outward unit normals in the link's frame, shapes (..., 3)."""
        import numpy as np

        u, phi = np.broadcast_arrays(np.asarray(u, float), np.asarray(phi, float))
        base, way, normal = self.rulings(phi)
        return self.link_frustum.apply_all(base + u[..., None] * way), normal @ np.array(self.link_frustum.rotation).T

    def locate_all(self, points: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Return u [m], phi [rad] and the signed distance [m] of many points, the inverse of ``place``."""
        import numpy as np

        points = np.asarray(points, float)
        u, phi, distance = self._feet(self.link_frustum.inverse().apply_all(points.reshape(-1, 3)))
        shape = points.shape[:-1]
        return u.reshape(shape), phi.reshape(shape), distance.reshape(shape)

    def _feet(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Return u, phi and the distance of points in the frame of the side, shape (n, 3).

        The nearest foot lies on a ruling between two strips, or in a strip along which it comes nearer, then goes away.
        """
        import numpy as np

        rulings = [*(strip.first for strip in self._strips), self.edge()]
        at, t, n = (np.array([getattr(ruling, name) for ruling in rulings]) for name in ("at", "t", "n"))
        ahead, above = (points @ way.T - (at * way).sum(axis=1) for way in (t, n))
        square = ahead**2 + above**2
        nearest = square.argmin(axis=1)
        best = np.sqrt(square[np.arange(len(points)), nearest])
        phi = np.array([*self._starts, self._starts[-1] + self.bends[-1].width])[nearest]
        for number, strip in enumerate(self._strips):
            passed = (ahead[:, number] > 0.0) & (ahead[:, number + 1] < 0.0)
            some = np.flatnonzero(passed | (math.hypot(strip.g, strip.k) * strip.arc > _MAX_ONE_FOOT))
            along, gap = strip.feet(points[some], 0.0, strip.arc)
            better = gap < best[some]
            best[some[better]] = gap[better]
            phi[some[better]] = self._starts[number] + along[better] * self.bends[number].width / strip.arc
        if not self.closed:  # beyond its edges the outer strips go on, but not over the side itself
            for number, edge in ((0, 0.0), (-1, self.frustum.wrap)):
                strip, out = self._strips[number], np.abs(phi - edge) < _AT_EDGE
                along, _ = strip.feet(points[out], *((-np.inf, 0.0) if number == 0 else (0.0, np.inf)))
                phi[out] = self._starts[number] + along * self.bends[number].width / strip.arc
        at, way, normal = self.rulings(phi)
        return np.einsum("ij,ij->i", points - at, way), phi, np.einsum("ij,ij->i", points - at, normal)

    def centre(self, u: float) -> Vector:
        """Return the middle of the section at u [m], in the link's frame [m]: the point nearest to its normals.

        It is the centre of an oval, and that of the circle where a part of one is covered.
        """
        import numpy as np

        phi = (np.arange(_NORMAL_COUNT) + 0.5) * self.frustum.wrap / _NORMAL_COUNT
        base, way, normal = self.rulings(phi)
        along = way.sum(axis=0) / np.linalg.norm(way.sum(axis=0))
        level = normal - np.outer(normal @ along, along)
        level /= np.linalg.norm(level, axis=1)[:, None]
        across = np.eye(3) - level[:, :, None] * level[:, None, :]
        points = base + u * way
        x, y, z = np.linalg.lstsq(across.sum(axis=0), np.einsum("ijk,ik->j", across, points), rcond=1e-9)[0].tolist()
        return self.link_frustum.apply((x, y, z))

    def moved(self, frame: Pose) -> Developable:
        """Return the side in another frame, in which ``frame`` is the pose of the link's."""
        return Developable(self.frustum, frame @ self.link_frustum, self.bends, self.lift)

    def parallel(self, height: float) -> Developable:
        """Return the side parallel to this one at a height [m] along the normals.

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
        return Developable(frustum, self.link_frustum @ shift, bends, self.lift + height)

    def azimuth_above(self, height: float, phi: float) -> float:
        """Return the azimuth [rad] on the parallel side at a height [m] of the ruling that has the azimuth phi here.

        A bend grows with the height and a plane does not, so that they take other shares of the wrap there.
        """
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
        below = self.parallel(-self.lift)
        f, arc, turned, worst = below.frustum, 0.0, 0.0, 0.0
        lift = self.lift + height
        for bend in below.bends:
            arc += bend.width
            turned += bend.turn
            worst = max(worst, abs(self.growth * arc - turned))
        return abs(0.5 * lift * worst * f.slant * f.sin_half_angle / (below._middle + lift * self.growth))

    def turned(self, turn: float) -> Developable:
        """Return a full wrap whose seam lies at the azimuth that was ``turn`` [rad].

        Raises:
            GeometryError: the side is not closed.
        """
        if not self.closed:
            raise GeometryError("only a full wrap can be turned: a partial one has edges where it ends")
        turn %= math.tau
        bends = _bends_between(self.bends, turn, turn + math.tau, around=True)
        return Developable(self.frustum, self.link_frustum @ self._frame_at(0.0, turn), bends, self.lift)

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

    def part(self, u1: float, u2: float, phi1: float, phi2: float) -> Developable:
        """Return the part between two arcs u [m] and two rulings phi [rad].

        The part of a lifted side has the sector of its own arcs, its rulings at their places in its own middle.
        """
        if not 0.0 <= phi1 < phi2:
            raise GeometryError(f"phi1 must not be below 0 and phi2 above it, got {phi1!r} and {phi2!r} rad")
        if self.lift:
            own = Developable(self.frustum, Pose(), self.bends, self.lift)
            phis = (self.azimuth_above(-self.lift, phi) for phi in (phi1, phi2))
            return own.parallel(-self.lift).part(u1, u2, *phis).parallel(self.lift).moved(self.link_frustum)
        f = self.frustum
        frustum = Frustum(f.radius_at(u1), f.radius_at(u2), (u2 - u1) * f.cos_half_angle, phi2 - phi1)
        pose = self.link_frustum @ self._frame_at(u1, phi1)
        return Developable(frustum, pose, _bends_between(self.bends, phi1, phi2, self.closed))


def _bends_between(bends: Sequence[Bend], phi1: float, phi2: float, around: bool = False) -> tuple[Bend, ...]:
    """Return the bends between two azimuths [rad], those at the edges cut; beyond the last they repeat, or it does."""
    parts, begin = [], 0.0
    wrap = math.fsum(bend.width for bend in bends)
    beyond = phi2 - wrap
    if around:
        bends = tuple(bends) * max(1, math.ceil(phi2 / wrap - _MIN_BEND_WIDTH))
    elif beyond > _MIN_BEND_WIDTH:
        bends = (*bends, Bend(beyond, bends[-1].turn * beyond / bends[-1].width))
    for bend in bends:
        low, high = max(begin, phi1), min(begin + bend.width, phi2)
        if high - low > _MIN_BEND_WIDTH:
            parts.append(Bend(high - low, bend.turn * (high - low) / bend.width))
        begin += bend.width
    return tuple(parts)


def _frames_along(strips: Sequence[BentStrip], number: Ints, along: Floats) -> tuple[Floats, Floats, Floats]:
    """Return points of end 1 [m], rulings and normals at places along strips [m], by their numbers: shapes (..., 3)."""
    import numpy as np

    at, t, u, n = (np.array([getattr(strip.first, name) for strip in strips])[number] for name in ("at", "t", "u", "n"))
    g = np.array([strip.g for strip in strips])[number][..., None]
    k = np.array([strip.k for strip in strips])[number][..., None]
    along = along[..., None]
    angle = np.hypot(g, k) * along
    first = along * np.sinc(angle / np.pi)
    second = 0.5 * (along * np.sinc(0.5 * angle / np.pi)) ** 2
    step = first * t - second * (k * n + g * u)
    return at + step, u + g * step, n + k * step


def _check_bends(bends: Sequence[Bend], wrap: float) -> None:
    """Check that bends are possible and add up to a wrap [rad]."""
    for bend in bends:
        if not (math.isfinite(bend.width) and bend.width > 0.0 and math.isfinite(bend.turn)):
            raise GeometryError(f"a bend needs a width above 0 rad and a finite turn, got {bend}")
        if abs(bend.turn) > math.tau:
            raise GeometryError(f"a bend turns by a full turn (2 pi rad) at most, got {bend.turn!r} rad")
    width = math.fsum(bend.width for bend in bends)
    if abs(width - wrap) > _WRAP_ROUNDING:
        raise GeometryError(
            f"the widths of the bends must add up to the wrap of {math.degrees(wrap):.6g} deg, they are "
            f"{math.degrees(width):.6g} deg"
        )
