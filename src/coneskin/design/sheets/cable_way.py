"""Way of a cable from the tabs of a sheet to its connector, on the link and clear of every other body.

The link is seen from the side of the sheet, continued beyond its rims: a lattice of heights above it. Two places of the
lattice are neighbors where a cable that lies on the one reaches the other without going through the link. The way is
the shortest one (Dijkstra) at whose end there is room for the connector, and on which there is room for the cable tie.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from coneskin.core.arrays import Bools, Floats, Ints
from coneskin.geometry.drawing.electrode_layout import SheetLayout
from coneskin.geometry.drawing.surface_shape import ShapeTab, SheetSide
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.ray_casting import RayCaster

CABLE_RADIUS = 2e-3  # m; of four wires together
_CABLE_LIFT = CABLE_RADIUS + 0.5e-3  # m; of its middle, which nothing must come nearer to than its radius
MOUNT_REACH = 8.5e-3  # m; half of the diagonal of the mount of a cable tie, and of a connector
BODY_CLEARANCE = 1e-3  # m; least distance between two bodies
_LATTICE_STEP = 4e-3  # m
_VIEW_HEIGHT = 0.04  # m; what stands out further is met from the side
_AIR_DEPTH = 15e-3  # m; where the link lies deeper below the side, a cable does not follow it
_FLAT_RISE = 3e-3  # m; between neighbors under a mount
_MOUNT_RISE = 0.6e-3  # m; of the link above the plane under a mount
_SAG_HEIGHT = 1e-3  # m; nothing between two places of a cable stands out further
_MAX_TAB_RISE = 0.3e-3  # m; of the link above the height at which tabs leave
_TIE_SPACE = 14e-3  # m; between the middles of tie and connector
_LEAST_WAY = 32e-3  # m; from the rim to the connector, with room for the tie
_SHORTER_WAYS = (1.0, 0.8, 0.65)  # of the wished length
_BOX_COUNT = 64  # azimuths by which the box around a sheet is found
_MAX_ENDS = 60  # places for the connector that are tried


def _ways_around(normals: Floats) -> list[Floats]:
    """Return twelve ways across normals, shape (n, 3), evenly around each."""
    first = np.cross(normals, [0.3, 0.5, 0.8])
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    second = np.cross(normals, first)
    return [math.cos(turn) * first + math.sin(turn) * second for turn in np.arange(12) * math.tau / 12]


@dataclass(frozen=True, slots=True, eq=False)
class SheetBody:
    """The space of a sheet above the side that it covers, up to its thickness [m]."""

    place: PlacedFrustum
    thickness: float

    def distances(self, points: Floats) -> Floats:
        """Return the distance of points, shape (n, 3) [m], from the sheet along its side; 0 inside."""
        side = self.place.frustum
        u, phi, height = self.place.locate_all(points)
        along = np.maximum(np.maximum(-u, u - side.slant), 0.0)
        off = np.maximum(np.maximum(-height, height - self.thickness), 0.0)
        beside = np.zeros(len(u))
        if side.wrap < math.tau - 1e-9:
            radius = np.maximum(side.radius1 + (side.radius2 - side.radius1) * u / side.slant, 1e-3)
            beside = np.maximum(np.maximum(-phi, phi - side.wrap), 0.0) * radius
        return np.asarray(np.sqrt(along**2 + off**2 + beside**2))

    def near(self, points: Floats, distance: float) -> Bools:
        """Return whether each point, shape (n, 3) [m], is at most a distance away [m]."""
        side = self.place.frustum
        phi = np.linspace(0.0, side.wrap, _BOX_COUNT)
        rims, normals = self.place.place([[0.0], [side.slant]], phi)
        box = np.concatenate([rims, rims + self.thickness * normals]).reshape(-1, 3)
        # between two of these the sheet stands out by less than half the way around
        slack = distance + 0.5 * phi[1] * (max(side.radius1, side.radius2) + self.thickness)
        close = ((points > box.min(axis=0) - slack) & (points < box.max(axis=0) + slack)).all(axis=1)
        close[close] = self.distances(points[close]) <= distance
        return np.asarray(close)


@dataclass(frozen=True, eq=False)
class SphereBody:
    """Spheres about points: tabs, wires, a cable with its tie and its connector, or the space that a link sweeps."""

    points: Floats
    radius: float

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self.points)

    def distances(self, points: Floats) -> Floats:
        """Return the distance of points, shape (n, 3) [m], from the spheres; infinite where there are none."""
        return np.asarray(self._tree.query(points)[0] - self.radius)

    def near(self, points: Floats, distance: float) -> Bools:
        """Return whether each point is nearer than a distance to a sphere."""
        return np.asarray(np.isfinite(self._tree.query(points, distance_upper_bound=self.radius + distance)[0]))


Body = SheetBody | SphereBody  #: something in the way of a cable


def tab_foot(layout: SheetLayout, name: str) -> tuple[float, float]:
    """Return the place (u [m], phi [rad]) at the rim where an electrode is reached."""
    foil, side = layout.foils[name], layout.plan.wires
    tab = next((step for step in foil if isinstance(step, ShapeTab)), None)
    if tab is not None:
        return tab.u, tab.phi
    slant, wrap = layout.sheet.slant, layout.sheet.wrap
    if side.startswith("end"):
        u = 0.0 if side == "end1" else slant
        nearest = min(abs(corner.u - u) for corner in foil)
        near = [corner.phi for corner in foil if abs(corner.u - u) <= nearest + 1e-9]
        return u, min(near, key=lambda phi: abs(math.remainder(phi, math.tau)))  # beside the seam
    phi = 0.0 if side == "edge0" else wrap
    nearest = min(abs(corner.phi - phi) for corner in foil)
    return min(corner.u for corner in foil if abs(corner.phi - phi) <= nearest + 1e-9), phi


@dataclass(frozen=True, slots=True, eq=False)
class TabApron:
    """Strip beyond the rim that the tabs cover, and the wires that run along the rim to where they leave together.

    Attributes:
        u: of the middle of the four feet [m].
        phi: the same [rad].
        feet: points of the strip above the link [m], shape (n, 3).
        tips: number of the point at the tip of the tab for each point at the rim, shape (m, 2).
        way_out: unit vectors in which rays find the link below each point, shape (n, 3).
        slope: rise of the tabs over their length, where the link stands out beyond the rim; infinite where they stand
            up from a seam.
    """

    u: float
    phi: float
    feet: Floats
    tips: Ints
    way_out: Floats
    slope: float

    @classmethod
    def of(cls, place: PlacedFrustum, layout: SheetLayout, height: float, slope: float) -> TabApron:
        """Return the strip of a sheet whose tabs leave at a height [m] above the link."""
        side, plan, sheet = layout.plan.wires, layout.plan, layout.sheet
        roots = [tab_foot(layout, name) for name in "ABCD"]
        out = np.array([0.02, 0.3, 0.5, 0.75, 1.0]) * max(plan.tab, 4e-3)
        ahead = -out if side in ("end1", "edge0") else out
        at_end = side.startswith("end")
        if at_end:
            u, phi = roots[0][0], math.atan2(*(math.fsum(f(phi) for _, phi in roots) for f in (math.sin, math.cos)))
        else:
            u, phi = math.fsum(u for u, _ in roots) / 4.0, roots[0][1]
        radius = max(sheet.radius_at(u), 1e-3)
        off = (
            [math.remainder(at - phi, math.tau) * radius for _, at in roots] if at_end else [at - u for at, _ in roots]
        )
        low, high = min(off) - 0.5 * plan.lead, max(off) + 0.5 * plan.lead
        beside = np.linspace(low, high, max(2, math.ceil((high - low) / 2e-3)))
        if at_end:
            us, phis = np.meshgrid(u + ahead, phi + beside / radius, indexing="ij")
        else:
            phis, us = np.meshgrid(phi + ahead / radius, u + beside, indexing="ij")
        rim, far = np.arange(len(beside)), np.repeat(out, len(beside))
        tips = np.stack([rim, rim + len(far) - len(beside)], axis=1)
        if math.isinf(slope):
            points, normals = place.place(us.ravel(), np.full(us.size, phi))
            return cls(u, phi, points + (height + far)[:, None] * normals, tips, normals, slope)
        points, normals = place.place(us.ravel(), phis.ravel())
        return cls(u, phi, points + (height + slope * far)[:, None] * normals, tips, normals, slope)

    def body(self) -> SphereBody:
        """Return the space that the tabs take."""
        return SphereBody(self.feet, 1.5e-3)

    def stands_in(self, rays: RayCaster | None) -> bool:
        """Tell whether the link stands out where the tabs leave."""
        if rays is None:
            return False
        start = self.feet + _VIEW_HEIGHT * self.way_out
        above = _VIEW_HEIGHT - rays.cast(start, -self.way_out)[0]
        tabs = self.feet[self.tips[:, 1]] - self.feet[self.tips[:, 0]]
        length = np.linalg.norm(tabs, axis=1)
        met = rays.cast(self.feet[self.tips[:, 0]], tabs / length[:, None])[0] < length
        return bool((above > _MAX_TAB_RISE).any() or met.any())


@dataclass(frozen=True, slots=True, eq=False)
class CableWay:
    """Way of the wires of a sheet from its rim to the connector.

    Attributes:
        side: of the sheet.
        u: of the place at the rim where the wires leave together [m].
        phi: the same [rad].
        surface: (u [m], phi [rad]) of the way on the side of the sheet, continued beyond its rims, shape (n, 2).
        points: the way on the link, in its frame [m], shape (n, 3).
        normals: outward unit normals there, shape (n, 3).
        lengths: from the rim along the way [m], shape (n,).
        tie: number of the point at which the cable tie is.
        hangs: True where the link ends before: tie and connector are on what is bolted to it there.
        on_sheet: True where the wires stand up from a seam and lie on the sheet, over the seam.
    """

    side: SheetSide
    u: float
    phi: float
    surface: Floats
    points: Floats
    normals: Floats
    lengths: Floats
    tie: int
    hangs: bool = False
    on_sheet: bool = False

    def __post_init__(self) -> None:
        for array in (self.surface, self.points, self.normals, self.lengths):
            array.setflags(write=False)

    @classmethod
    def over_seam(cls, apron: TabApron, side: SheetSide, own: SheetBody, wished: float) -> CableWay | None:
        """Return the way of wires that stand up from a seam, towards the farther end; None where it is too short."""
        slant = own.place.frustum.slant
        ahead = 1.0 if apron.u < 0.5 * slant else -1.0
        room = (slant - apron.u if ahead > 0.0 else apron.u) - MOUNT_REACH
        length = min(wished, room)
        if length < min(wished, _LEAST_WAY):
            return None
        gone = np.linspace(0.0, length, max(9, math.ceil(length / _LATTICE_STEP)))
        at = np.stack([apron.u + ahead * gone, np.full(len(gone), apron.phi)], axis=1)
        points, normals = own.place.place(*at.T)
        points = points + own.thickness * normals
        return cls(side, apron.u, apron.phi, at, points, normals, gone, len(gone) // 2, on_sheet=True)

    @property
    def connector_length(self) -> float:
        """Length of the way from the rim to the connector [m]."""
        return float(self.lengths[-1])

    @property
    def tie_length(self) -> float:
        """Length of the way from the rim to the cable tie [m]."""
        return float(self.lengths[self.tie])

    def body(self) -> SphereBody:
        """Return the space of the cable with its tie and its connector."""
        lifted = self.points + CABLE_RADIUS * self.normals
        ends = [self.tie, len(lifted) - 1]
        ring = [lifted[ends] + (MOUNT_REACH - CABLE_RADIUS) * way for way in _ways_around(self.normals[ends])]
        return SphereBody(np.concatenate([lifted, *ring]), CABLE_RADIUS)


@dataclass(frozen=True, eq=False)
class LinkSurface:
    """A link as it is seen from the side of a sheet, as far as a cable may go.

    Attributes:
        place: the side of the sheet.
        rays: a ray caster of the link; None where it is known by its dimensions, and goes on as the side does.
        reach: how far beyond the rims [m].
    """

    place: PlacedFrustum
    rays: RayCaster | None
    reach: float

    @cached_property
    def _axes(self) -> tuple[Floats, Floats, bool]:
        """Coordinates u [m] and phi [rad] of the lattice, and whether phi goes around."""
        side = self.place.frustum
        out = _LATTICE_STEP * np.arange(1, math.ceil(self.reach / _LATTICE_STEP) + 1)
        inside = np.linspace(0.0, side.slant, max(2, math.ceil(side.slant / _LATTICE_STEP)) + 1)
        u = np.concatenate([-out[::-1], inside, side.slant + out])
        radius = 0.5 * (side.radius1 + side.radius2)
        across = np.linspace(0.0, side.wrap, max(8, math.ceil(side.wrap * radius / _LATTICE_STEP)) + 1)
        if side.wrap > math.tau - 1e-9:
            return u, across[:-1], True
        if self.place.bends:
            beside = out / radius
            return u, np.concatenate([-beside[::-1], across, side.wrap + beside]), False
        open_angle = math.tau - side.wrap
        count = max(1, math.ceil(open_angle * radius / _LATTICE_STEP))
        return u, np.concatenate([across, side.wrap + open_angle * np.arange(1, count) / count]), True

    @cached_property
    def _cells(self) -> tuple[Floats, Floats, Floats, Bools, Bools]:
        """Points on the link, normals, heights above the side, which cells can be used, and which hang in the air."""
        u, phi, _ = self._axes
        side = self.place.frustum
        grid = np.meshgrid(u, phi, indexing="ij")
        points, normals = (array.reshape(-1, 3) for array in self.place.place(*grid))
        radius = side.radius1 + (side.radius2 - side.radius1) * grid[0].ravel() / side.slant
        usable = radius > 3e-3
        height = np.zeros(len(points))
        if self.rays is not None:
            height = _VIEW_HEIGHT - self.rays.cast(points + _VIEW_HEIGHT * normals, -normals)[0]
        air = height < -_AIR_DEPTH
        height = np.where(air, 0.0, height)
        usable &= height < _VIEW_HEIGHT - 1e-3
        points = points + height[:, None] * normals
        if self.rays is not None:
            normals = self._tilted(points.reshape(*grid[0].shape, 3), normals.reshape(*grid[0].shape, 3))
            for way in _ways_around(normals)[::2]:  # nothing stands beside a cable
                usable &= self.rays.cast(points + _CABLE_LIFT * normals, way)[0] > CABLE_RADIUS
        return points, normals, height, usable, air

    def _tilted(self, points: Floats, normals: Floats) -> Floats:
        """Return the normals of the link over the width of a mount, shape (n, 3)."""
        reach = 2
        along = np.gradient(points, axis=0)
        across = np.roll(points, -reach, axis=1) - np.roll(points, reach, axis=1)
        if not self._axes[2]:
            across = np.gradient(points, axis=1)
        along[reach:-reach] = points[2 * reach :] - points[: -2 * reach]
        local = np.cross(along, across)
        size = np.linalg.norm(local, axis=-1, keepdims=True)
        local = np.where(size > 0.0, local / np.where(size > 0.0, size, 1.0), normals)
        local *= np.sign(np.einsum("ijk,ijk->ij", local, normals))[..., None]
        steep = np.einsum("ijk,ijk->ij", local, normals)[..., None] < 0.5
        return np.asarray(np.where(steep, normals, local).reshape(-1, 3))

    def _level(self, cells: Ints) -> Bools:
        """Return whether a mount on each cell stands on the link without meeting it."""
        points, normals = (array[cells] for array in self._cells[:2])
        level = np.ones(len(cells), bool)
        if self.rays is None or not len(cells):
            return level
        for ring in (0.55 * MOUNT_REACH, MOUNT_REACH):
            for way in _ways_around(normals):
                at = points + ring * way + 8e-3 * normals
                level &= self.rays.cast(at, -normals)[0] > 8e-3 - _MOUNT_RISE
        return level

    @cached_property
    def _edges(self) -> tuple[Ints, Ints, Floats, Bools]:
        """Neighbors that a cable joins: numbers of both, distance [m]; and the cells on which a mount lies flat."""
        u, phi, around = self._axes
        points, normals, height, usable, _ = self._cells
        lifted = points + _CABLE_LIFT * normals
        index = np.arange(len(points)).reshape(len(u), len(phi))
        ones, others = [], []
        for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
            there = np.roll(index, (-down, -right), (0, 1))
            keep = np.ones(index.shape, bool)
            keep[len(u) - down :] = False
            if not around and right:
                keep[:, -1 if right == 1 else 0] = False
            ones.append(index[keep])
            others.append(there[keep])
        a, b = np.concatenate(ones), np.concatenate(others)
        ok = usable[a] & usable[b]
        a, b = a[ok], b[ok]
        way = lifted[b] - lifted[a]
        length = np.linalg.norm(way, axis=1)
        if self.rays is not None:
            clear = self.rays.cast(lifted[a], way / length[:, None])[0] > length
            low = points + _SAG_HEIGHT * normals
            way = low[b] - low[a]
            clear &= self.rays.cast(low[a], way / np.linalg.norm(way, axis=1)[:, None])[0] > length
            a, b, length = a[clear], b[clear], length[clear]
        level = np.abs(height[a] - height[b]) < _FLAT_RISE
        count = np.bincount(a[level], minlength=len(points)) + np.bincount(b[level], minlength=len(points))
        return a, b, length, np.asarray(count == 8)

    def find_way(
        self, apron: TabApron, side: SheetSide, own: SheetBody, others: Sequence[Body], wished: float
    ) -> CableWay | None:
        """Return the way of the cable of a sheet; None where there is none.

        Args:
            apron: strip of its tabs.
            side: on which they are.
            own: the sheet.
            others: bodies to keep clear of.
            wished: length of the way from the rim to the connector [m]; a shorter one is taken where there is no room.
        """
        points, normals, _, usable, air = self._cells
        lifted = points + CABLE_RADIUS * normals
        free, roomy = usable.copy(), usable.copy()
        for body in (own, *others):
            inner = 0.0 if body is own else BODY_CLEARANCE
            free &= ~body.near(lifted, CABLE_RADIUS + inner)
            roomy &= ~body.near(lifted, MOUNT_REACH + inner)
        sources, offsets = self._sources(apron, own)
        for hangs in (False, True):
            open_cells = free if hangs else free & ~air
            if not open_cells[sources].any():
                continue
            tied = roomy & open_cells & self._edges[3]
            if hangs:
                tied |= roomy & air
            for share in _SHORTER_WAYS:
                length = max(share * wished, min(wished, _LEAST_WAY))
                found = self._traced(apron, side, (sources, offsets), open_cells, tied, length, hangs)
                if found is not None:
                    return found
        return None

    def _sources(self, apron: TabApron, own: SheetBody) -> tuple[Ints, Floats]:
        """Return the cells just beyond the rim at which wires may leave, and how far from their middle each is [m]."""
        from scipy.spatial import cKDTree

        points, rim = self._cells[0], apron.feet[apron.tips[:, 0]]
        near = np.isfinite(cKDTree(rim).query(points, distance_upper_bound=1.5 * _LATTICE_STEP)[0])
        cells = np.flatnonzero(near & ~own.near(points, 0.0))
        return cells, np.linalg.norm(points[cells] - self.place.place([apron.u], [apron.phi])[0], axis=1)

    def _traced(
        self,
        apron: TabApron,
        side: SheetSide,
        sources: tuple[Ints, Floats],
        free: Bools,
        tied: Bools,
        length: float,
        hangs: bool,
    ) -> CableWay | None:
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import dijkstra

        a, b, weight, _ = self._edges
        keep = free[a] & free[b]
        count = len(free)
        starts, offsets = sources
        start_ok = free[starts]
        if not start_ok.any():
            return None
        starts, offsets = starts[start_ok], offsets[start_ok]
        rows = np.concatenate([a[keep], np.full(len(starts), count)])
        columns = np.concatenate([b[keep], starts])
        # the rim is a step away; a way out beside the middle of the tabs costs a little
        weights = np.concatenate([weight[keep], _LATTICE_STEP + 0.3 * offsets])
        graph = coo_matrix((weights, (rows, columns)), shape=(count + 1, count + 1)).tocsr()
        away, before = dijkstra(graph, directed=False, indices=count, return_predecessors=True, limit=length + 0.01)
        ends = np.flatnonzero(tied & (np.abs(away[:-1] - length) < 1.5 * _LATTICE_STEP))
        if not len(ends):
            return None
        points, normals = self._cells[:2]
        u, phi, _ = self._axes
        off_u = u[ends // len(phi)] - apron.u
        turned = (phi[ends % len(phi)] - apron.phi + math.pi) % math.tau - math.pi
        off_phi = turned * max(self.place.frustum.radius_at(apron.u), 1e-3)
        beyond, beside = (off_u, off_phi) if side.startswith("end") else (off_phi, off_u)
        # straight away from the rim is easiest to follow
        straight = np.abs(beyond) - np.abs(beside) - 2.0 * np.abs(away[ends] - length)
        ends = ends[np.argsort(-straight, kind="stable")][:_MAX_ENDS]
        for end in ends[self._level(ends)]:
            cells = [int(end)]
            while before[cells[-1]] != count:
                cells.append(int(before[cells[-1]]))
            cells = cells[::-1]
            gone = np.concatenate([[0.0], np.linalg.norm(np.diff(points[cells], axis=0), axis=1)]).cumsum()
            gone = gone + _LATTICE_STEP
            may = (
                tied[cells]
                & self._level(np.array(cells))
                & (gone <= gone[-1] - _TIE_SPACE)
                & (gone >= min(0.3 * length, 0.015))
            )
            if not may.any():
                continue
            tie = int(np.flatnonzero(may)[np.abs(gone[may] - 0.5 * gone[-1]).argmin()])
            at = np.stack([u[np.array(cells) // len(phi)], np.unwrap(phi[np.array(cells) % len(phi)])], axis=1)
            first = at[0]
            out_u, out_phi = (apron.u, float(first[1])) if side.startswith("end") else (float(first[0]), apron.phi)
            return CableWay(side, out_u, out_phi % math.tau, at, points[cells], normals[cells], gone, tie, hangs)
        return None
