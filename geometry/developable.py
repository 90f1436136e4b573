"""General cylinder or general cone: a ruled developable side, isometric to that of a frustum.

A sheet that is bent along straight rulings keeps every length on it. So the side of a tube with any section, whose
rulings are parallel (a general cylinder) or meet in one point (a general cone), unrolls to the rectangle or the annular
sector of a frustum, and has its surface coordinates (u, phi): u along the rulings, phi in proportion to the arc across
them. Only the points and the normals differ, by how sharply the sheet is bent at each azimuth.

The bending is constant over each of a row of strips: each strip is a part of a circular cone, a cylinder or a plane,
and neighbours share a ruling and its tangent plane. With the unit vectors T along the arc, U along the ruling and N
outwards, and with g = sin a / rho1 of the frustum and k = turn / arc of the strip, along the arc at end 1

    T' = -g U - k N        U' = g T        N' = k T

so that within a strip T, U, N turn about the fixed vector k U - g N, and all points have closed forms that hold for
planes, cylinders and cones alike. A strip of turn = width cos a is one of the frustum itself.
"""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from coneskin.errors import GeometryError

from .frustum import Frustum
from .pose import Pose, Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

__all__ = ["Bend", "Developable"]

_TURN = 2.0 * math.pi
_SLACK = 1e-6  # rad; the widths of the bends add up to the wrap but for rounding
_OPEN = 0.01  # of a turn, and of the way around; a fitted wrap is a hundred times closer


@dataclass(frozen=True, slots=True)
class Bend:
    """A strip between two rulings, bent evenly.

    Attributes:
        width: azimuth that it takes [rad], above 0.
        turn: angle by which its normal turns from one ruling to the other [rad]; 0 for a plane, negative for a hollow.
    """

    width: float
    turn: float


@dataclass(frozen=True, slots=True)
class _Strip:
    """A bend with the frame at its first ruling, on the arc of end 1."""

    start: float  # m; along the arc
    arc: float  # m
    k: float  # 1/m
    at: Vector
    t: Vector
    u: Vector
    n: Vector


@dataclass(frozen=True, slots=True)
class Developable:
    """A side that is bent along rulings, in a frame of its own.

    The frame is that of a frustum which it touches along the ruling phi = 0: that ruling begins at (radius1, 0, 0), and
    its outward normal lies in the plane of x and z.

    Attributes:
        frustum: the frustum to whose side it is isometric; its u, phi, lengths and areas are those of this side.
        bends: strips from phi = 0 to phi = wrap.

    Raises:
        GeometryError: end 1 of the frustum is an apex, or the bends do not add up to its wrap.
    """

    frustum: Frustum
    bends: tuple[Bend, ...]
    _strips: tuple[_Strip, ...] = field(init=False, repr=False, compare=False)
    _starts: tuple[float, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        f = self.frustum
        if not f.radius1 > 0.0:
            raise GeometryError("radius1 must be above 0 m: a bent side is laid out from its end 1, which has no arc")
        for bend in self.bends:
            if not (math.isfinite(bend.width) and bend.width > 0.0 and math.isfinite(bend.turn)):
                raise GeometryError(f"a bend needs a width above 0 rad and a finite turn, got {bend}")
            if abs(bend.turn) > _TURN:
                raise GeometryError(f"a bend turns by a full turn (2 pi rad) at most, got {bend.turn!r} rad")
        width = math.fsum(bend.width for bend in self.bends)
        if abs(width - f.wrap) > _SLACK:
            raise GeometryError(
                f"the widths of the bends must add up to the wrap of {math.degrees(f.wrap):.6g} deg, they are "
                f"{math.degrees(width):.6g} deg"
            )
        strips: list[_Strip] = []
        sa, ca = f.sin_half_angle, f.cos_half_angle
        at, t, u, n = (f.radius1, 0.0, 0.0), (0.0, 1.0, 0.0), (sa, 0.0, ca), (ca, 0.0, -sa)
        begin = 0.0
        for bend in self.bends:
            arc = bend.width * f.radius1
            strips.append(_Strip(begin, arc, bend.turn / arc, at, t, u, n))
            at, t, u, n = self._frame(strips[-1], arc)
            begin += arc
        object.__setattr__(self, "_strips", tuple(strips))
        object.__setattr__(self, "_starts", tuple(strip.start for strip in strips))

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
        return self.frustum.wrap == _TURN

    @property
    def closing_gap(self) -> tuple[float, float]:
        """Distance between the ends of the arc of end 1 [m], and the angle between the normals there [rad]."""
        strip = self._strips[-1]
        at, t, _, n = self._frame(strip, strip.arc)
        first = self._strips[0]
        gap = math.dist(at, first.at)
        turned = math.hypot(math.dist(n, first.n), math.dist(t, first.t)) / math.sqrt(2.0)
        return gap, 2.0 * math.asin(min(1.0, 0.5 * turned))

    def check_closed(self) -> None:
        """Refuse a full wrap whose bends do not close, as where a turn is wrong, or in radians.

        Raises:
            GeometryError: with what they add up to.
        """
        if not self.closed:
            return
        gap, angle = self.closing_gap
        around = _TURN * self.frustum.radius1
        if gap > _OPEN * around or angle > _TURN * _OPEN or not 0.0 < self.turn < 1.5 * _TURN:
            raise GeometryError(
                f"the bends of a full wrap must close: they turn by {math.degrees(self.turn):.6g} deg in all (360 deg "
                f"around a tube, above 0 outwards), and leave {1e3 * gap:.3g} mm and {math.degrees(angle):.3g} deg open"
            )

    def edge(self) -> tuple[Vector, Vector, Vector, Vector]:
        """Return the point of end 1 at phi = wrap, and T, U and N there, in the frame of the side."""
        strip = self._strips[-1]
        return self._frame(strip, strip.arc)

    def _geodesic(self) -> float:
        return self.frustum.sin_half_angle / self.frustum.radius1

    def _frame(self, strip: _Strip, along: float) -> tuple[Vector, Vector, Vector, Vector]:
        """Return the point of end 1, and T, U and N there, at a distance [m] from the first ruling of a strip."""
        g, k = self._geodesic(), strip.k
        (tx, ty, tz), (ux, uy, uz), (nx, ny, nz) = strip.t, strip.u, strip.n
        vx, vy, vz = -k * nx - g * ux, -k * ny - g * uy, -k * nz - g * uz  # T'
        angle = math.hypot(g, k) * along
        first = along * _sinc(angle)
        second = 0.5 * (along * _sinc(0.5 * angle)) ** 2
        dx, dy, dz = first * tx + second * vx, first * ty + second * vy, first * tz + second * vz
        cosine = math.cos(angle)
        x, y, z = strip.at
        return (
            (x + dx, y + dy, z + dz),
            (cosine * tx + first * vx, cosine * ty + first * vy, cosine * tz + first * vz),
            (ux + g * dx, uy + g * dy, uz + g * dz),
            (nx + k * dx, ny + k * dy, nz + k * dz),
        )

    def _strip(self, phi: float) -> tuple[_Strip, float]:
        """Return the strip of an azimuth and the distance from its first ruling [m]; the outer ones continue."""
        if self.closed:
            phi %= _TURN
        arc = phi * self.frustum.radius1
        strip = self._strips[max(0, bisect.bisect_right(self._starts, arc) - 1)]
        return strip, arc - strip.start

    def point(self, u: float, phi: float) -> Vector:
        """Return the point at u [m] and phi [rad], in the frame of the side [m]."""
        (x, y, z), _, (ux, uy, uz), _ = self._frame(*self._strip(phi))
        return x + u * ux, y + u * uy, z + u * uz

    def normal(self, phi: float) -> Vector:
        """Return the outward unit normal at azimuth phi [rad]; it is the same all along a ruling."""
        return self._frame(*self._strip(phi))[3]

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
        import numpy as np

        u, phi, distance = self.locate_all(np.array([[x, y, z]]))
        return float(u[0]), float(phi[0]), float(distance[0])

    def rulings(self, phi: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return the points of end 1 [m], the directions of the rulings and the normals: shapes (..., 3).

        Args:
            phi: azimuths [rad].
        """
        import numpy as np

        phi = np.asarray(phi, float)
        if self.closed:
            phi = phi % _TURN
        arc = phi * self.frustum.radius1
        number = np.clip(np.searchsorted(self._starts, arc, side="right") - 1, 0, None)
        k, start, at, t, u, n = self._columns()
        g, k = self._geodesic(), k[number][..., None]
        along = (arc - start[number])[..., None]
        angle = np.hypot(g, k) * along
        first = along * np.sinc(angle / np.pi)
        second = 0.5 * (along * np.sinc(0.5 * angle / np.pi)) ** 2
        step = first * t[number] - second * (k * n[number] + g * u[number])
        return at[number] + step, u[number] + g * step, n[number] + k * step

    def points(self, u: ArrayLike, phi: ArrayLike) -> NDArray[np.float64]:
        """Return the points for arrays u [m] and phi [rad] that broadcast: shape (..., 3) [m]."""
        import numpy as np

        u, phi = np.broadcast_arrays(np.asarray(u, float), np.asarray(phi, float))
        base, way, _ = self.rulings(phi)
        return np.asarray(base + u[..., None] * way)

    def normals(self, phi: ArrayLike) -> NDArray[np.float64]:
        """Return the outward unit normals for an array of azimuths [rad]: shape (..., 3)."""
        return self.rulings(phi)[2]

    def locate_all(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return u [m], phi [rad] and the signed distance [m] of many points, shape (n, 3), as ``locate`` does."""
        import numpy as np

        points = np.asarray(points, float)
        best = np.full(len(points), np.inf)
        arc, g = np.zeros(len(points)), self._geodesic()
        last = len(self._strips) - 1
        for number, strip in enumerate(self._strips):
            k = strip.k
            qt, qu, qn = ((points - strip.at) @ np.array((strip.t, strip.u, strip.n)).T).T
            # the foot is where the arc's tangent is square to the way to the point: tan(angle) = omega qT / (1 - qV)
            rest = 1.0 + k * qn + g * qu
            omega = math.hypot(g, k)
            if omega * strip.arc > 1e-9:
                angle = np.arctan2(omega * qt, rest)
                middle = 0.5 * omega * strip.arc
                along = (angle - _TURN * np.round((angle - middle) / _TURN)) / omega
            else:
                along = qt / np.where(np.abs(rest) > 1e-12, rest, 1e-12)
            low = 0.0 if number or self.closed else -np.inf
            high = strip.arc if number < last or self.closed else np.inf
            along = np.clip(along, low, high)
            angle = omega * along
            first = along * np.sinc(angle / np.pi)
            second = 0.5 * (along * np.sinc(0.5 * angle / np.pi)) ** 2
            to_t, to_u, to_n = qt - first, qu + second * g, qn + second * k
            out = k * first * to_t - k * g * second * to_u + (1.0 - k * k * second) * to_n
            across = np.cos(angle) * to_t - first * (g * to_u + k * to_n)
            gap = np.hypot(out, across)
            better = gap < best
            best[better] = gap[better]
            arc[better] = strip.start + along[better]
        phi = arc / self.frustum.radius1
        base, way, normal = self.rulings(phi)
        to = points - base
        return np.einsum("ij,ij->i", to, way), phi, np.einsum("ij,ij->i", to, normal)

    def _columns(self) -> tuple[NDArray[np.float64], ...]:
        import numpy as np

        strips = self._strips
        return (
            np.array([strip.k for strip in strips]),
            np.array([strip.start for strip in strips]),
            *(np.array([getattr(strip, name) for strip in strips]) for name in ("at", "t", "u", "n")),
        )

    def parallel(self, height: float) -> tuple[Developable, Pose]:
        """Return the side parallel to this one at a height [m] along the normals, and its frame in the frame of this.

        A bend grows by height * turn, a plane does not. Where the rulings meet and the bending varies, the parallel
        side is no general cone any more: ``mismatch`` is what its sector then misses.

        Raises:
            GeometryError: a bend is sharper than the height allows.
        """
        f, grow = self.frustum, height * self.growth
        frustum = Frustum(f.radius1 + grow, f.radius2 + grow, f.height, f.wrap)
        widths = [(bend.width * f.radius1 + height * bend.turn) / frustum.radius1 for bend in self.bends]
        if min(widths) <= 0.0:
            raise GeometryError(f"a bend is too sharp for a parallel side at {height * 1e3:.4g} mm")
        bends = tuple(Bend(width, bend.turn) for width, bend in zip(widths, self.bends, strict=True))
        shift = Pose(translation=(height * (f.cos_half_angle - self.growth), 0.0, -height * f.sin_half_angle))
        return Developable(frustum, bends), shift

    def mismatch(self, height: float) -> float:
        """Return how far the parallel side at a height [m] is from being a sector, in arc at end 1 or 2 [m]."""
        f, arc, turned, worst = self.frustum, 0.0, 0.0, 0.0
        for bend in self.bends:
            arc += bend.width
            turned += bend.turn
            worst = max(worst, abs(self.growth * arc - turned))
        return abs(height * worst * f.slant * f.sin_half_angle / (f.radius1 + height * self.growth))

    def turned(self, turn: float) -> tuple[Developable, Pose]:
        """Return a closed side whose phi = 0 lies where phi was ``turn`` [rad], and its frame in the frame of this.

        Raises:
            GeometryError: the side is not closed.
        """
        if not self.closed:
            raise GeometryError("only a full wrap can be turned: a partial one has edges where it ends")
        turn %= _TURN
        first: list[Bend] = []  # from the new seam on
        second: list[Bend] = []
        begin = 0.0
        for bend in self.bends:
            before = min(max(turn - begin, 0.0), bend.width)
            for width, pieces in ((before, second), (bend.width - before, first)):
                if width > 1e-9:
                    pieces.append(Bend(width, bend.turn * width / bend.width))
            begin += bend.width
        moved = Developable(self.frustum, (*first, *second))
        return moved, self._frame_at(0.0, turn)

    def _frame_at(self, u: float, phi: float) -> Pose:
        """Return the frame of a side that begins at u [m], phi [rad], in the frame of this side."""
        f = self.frustum
        at, t, way, n = self._frame(*self._strip(phi))
        sa, ca = f.sin_half_angle, f.cos_half_angle
        x = tuple(sa * a + ca * b for a, b in zip(way, n, strict=True))
        z = tuple(ca * a - sa * b for a, b in zip(way, n, strict=True))
        rho = f.radius_at(u)
        px, py, pz = (p + u * a - rho * b for p, a, b in zip(at, way, x, strict=True))
        return Pose(((x[0], t[0], z[0]), (x[1], t[1], z[1]), (x[2], t[2], z[2])), (px, py, pz))

    def part(self, u1: float, u2: float, phi1: float, phi2: float) -> tuple[Developable, Pose]:
        """Return the part between two arcs u [m] and two rulings phi [rad], and its frame in the frame of this side."""
        if not 0.0 <= phi1 < phi2:
            raise GeometryError(f"phi1 must not be below 0 and phi2 above it, got {phi1!r} and {phi2!r} rad")
        f = self.frustum
        frustum = Frustum(f.radius_at(u1), f.radius_at(u2), (u2 - u1) * f.cos_half_angle, phi2 - phi1)
        bends, begin = [], 0.0
        for bend in self._unwound(phi2):
            low, high = max(begin, phi1), min(begin + bend.width, phi2)
            if high - low > 1e-9:
                bends.append(Bend(high - low, bend.turn * (high - low) / bend.width))
            begin += bend.width
        return Developable(frustum, tuple(bends)), self._frame_at(u1, phi1)

    def _unwound(self, phi2: float) -> tuple[Bend, ...]:
        """Return the bends from phi = 0 on as far as phi2: a closed side goes on, the last bend of an open one does."""
        if self.closed:
            return self.bends * math.ceil(phi2 / _TURN + 1e-12)
        last, beyond = self.bends[-1], phi2 - self.frustum.wrap
        if beyond <= 1e-9:
            return self.bends
        return (*self.bends, Bend(beyond, last.turn * beyond / last.width))


def _sinc(x: float) -> float:
    return math.sin(x) / x if x else 1.0
