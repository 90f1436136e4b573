"""Free places for a bundle of cables on a link, and the shortest ways between them.

A place of the lattice about the link is free where the bundle lies on the link, or on a sheet where nothing senses, and
meets nothing. The shortest ways from all places to one are a tree (Dijkstra), so cables that meet there stay together.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from coneskin.core.arrays import Bools, Floats, Ints
from coneskin.geometry.fit.surface_samples import sample_surface
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.ray_casting import RayCaster

from .sheets.cable_way import CABLE_RADIUS, MOUNT_REACH, Body, SheetBody
from .sheets.sheet_design import SheetDesign

LATTICE_STEP = 5e-3  # m
_SAMPLE_AREA = 5e-6  # m2; of a link for each of its samples
_STEP_MARGIN = 1e-3  # m; between its places, and between samples of a link, a cable comes nearer
_SUPPORT_DEPTH = 1.5 * LATTICE_STEP  # m; a link or a sheet is at most so far below a place
_BRIDGED_DEPTH = 15e-3  # m; and so far below a cable that is drawn straight
_LINE_STEP = 2e-3  # m
_NEIGHBOR_WAYS = ((0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 1, 1), (0, 1, -1), (1, 0, 1), (1, 0, -1), (1, 1, 0), (1, -1, 0))


def length_of(points: Floats) -> float:
    """Return the length of a line through points, shape (n, 3) [m]."""
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


class CableLattice:
    """Free places about a link for the middle of a bundle.

    Attributes:
        mesh: of the link.
        radius: of the bundle [m].
        places: in the frame of the link [m], shape (n, 3).
        parts: number of the connected part to which each belongs, shape (n,).
    """

    def __init__(
        self,
        mesh: Mesh,
        sheets: Sequence[SheetDesign],
        beside: Sequence[Body],
        radius: float,
        up: Floats | None = None,
    ) -> None:
        """Find the places.

        Args:
            mesh: of the link.
            sheets: on it.
            beside: what moves beside it.
            radius: of the bundle [m].
            up: unit vector away from what the link is bolted to, shape (3,); None of a link that moves.
        """
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import connected_components
        from scipy.spatial import cKDTree

        self.mesh, self.radius, self.rays, self._sheets = mesh, radius, RayCaster(mesh), sheets
        samples = sample_surface(mesh, self.rays, math.ceil(float(mesh.normals_and_areas[1].sum()) / _SAMPLE_AREA))
        self._samples, self._tree = samples, cKDTree(samples.points)
        self._beside = beside
        self._bodies: list[Body] = [SheetBody(sheet.place, sheet.options.stack.thickness) for sheet in sheets]
        self._bodies += [sheet.apron.body() for sheet in sheets]
        self._cables = [sheet.way.body() for sheet in sheets]
        self._up = up
        self._lowest = -math.inf if up is None else float((mesh.vertices @ up).min()) + radius
        reach = (
            radius
            + _SUPPORT_DEPTH
            + _STEP_MARGIN
            + max((sheet.options.stack.thickness for sheet in sheets), default=0.0)
        )
        low, high = mesh.vertices.min(axis=0) - reach, mesh.vertices.max(axis=0) + reach
        shape = np.ceil((high - low) / LATTICE_STEP).astype(int) + 1
        found: list[Ints] = []
        for x in range(shape[0]):  # a layer at a time: of a large link all would not fit in memory
            layer = np.stack(np.meshgrid(x, np.arange(shape[1]), np.arange(shape[2]), indexing="ij"), axis=-1).reshape(
                -1, 3
            )
            layer = layer[np.isfinite(self._tree.query(low + LATTICE_STEP * layer, distance_upper_bound=reach)[0])]
            found.append(layer[self.free(low + LATTICE_STEP * layer, _SUPPORT_DEPTH)])
        cells = np.concatenate(found)
        self.places: Floats = low + LATTICE_STEP * cells
        number = np.full(shape + 2, -1)  # none beyond its borders
        number[tuple(cells.T)] = np.arange(len(cells))
        others = [number[tuple((cells + way).T)] for way in _NEIGHBOR_WAYS]
        a, b = np.concatenate([np.stack([np.flatnonzero(o >= 0), o[o >= 0]]) for o in others], axis=1)
        joined = self.free(0.5 * (self.places[a] + self.places[b]), _BRIDGED_DEPTH)
        self._pairs: tuple[Ints, Ints] = (a[joined], b[joined])
        self._lengths: Floats = np.linalg.norm(self.places[b] - self.places[a], axis=1)[joined]
        graph = coo_matrix((self._lengths, self._pairs), shape=(len(cells), len(cells)))
        self.parts: Ints = connected_components(graph, directed=False)[1]

    @property
    def foot(self) -> Ints:
        """Places beside what the link is bolted to, by their numbers."""
        if self._up is None:
            return np.empty(0, int)
        return np.flatnonzero(self.places @ self._up < self._lowest + 2.0 * LATTICE_STEP)

    def free(self, points: Floats, support: float = _BRIDGED_DEPTH) -> Bools:
        """Return where the middle of the bundle may be, shape (n,).

        Args:
            points: in the frame of the link [m], shape (n, 3).
            support: how far below it link or sheet may be [m].
        """
        free = np.ones(len(points), bool)
        if self._up is not None:
            free = points @ self._up >= self._lowest
        away, nearest = self._tree.query(points, distance_upper_bound=self.radius + support + _STEP_MARGIN)
        on = np.isfinite(away)
        nearest = nearest[on]
        normals = self._samples.normals[nearest]
        outside = np.einsum("ij,ij->i", points[on] - self._samples.points[nearest], normals) > 0.0
        free[on] &= outside & (away[on] >= self.radius + _STEP_MARGIN)
        for sheet in self._sheets:
            above, sensing = self._over(sheet, points, support)
            on |= above
            free &= ~sensing
        free &= on
        for body in (*self._bodies, *self._cables):
            free[free] = ~body.near(points[free], self.radius + _STEP_MARGIN)
        for body in self._beside:
            free[free] = ~body.near(points[free], self.radius)
        return np.asarray(free)

    def _over(self, sheet: SheetDesign, points: Floats, support: float) -> tuple[Bools, Bools]:
        """Return which points are over a sheet, or beside it at a height at which a cable bridges the step of its end;
        and over which a bundle lies on what senses."""
        side, box, radius = sheet.place.frustum, sheet.layout.active, self.radius
        u, phi, height = sheet.place.locate_all(points)
        around = np.maximum(side.radius1 + (side.radius2 - side.radius1) * u / side.slant, 1e-3)
        above = (height > 0.0) & (height < sheet.options.stack.thickness + radius + support + _STEP_MARGIN)
        reach = radius + _SUPPORT_DEPTH
        over = above & (u > -reach) & (u < side.slant + reach)
        over &= (phi > -reach / around) & (phi < side.wrap + reach / around)
        near_u = (u > box.u1 - radius) & (u < box.u2 + radius)
        return over, above & near_u & (phi > box.phi1 - radius / around) & (phi < box.phi2 + radius / around)

    def ways(self, starts: Ints, costs: Floats) -> tuple[Floats, Ints]:
        """Return how far each place is from a start with what that one costs [m], and the place before it.

        Args:
            starts: their numbers.
            costs: of each [m].

        Returns:
            distances, infinite where there is no way, shape (n,); and numbers, beyond the last one before a start.
        """
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import dijkstra

        count = len(self.places)
        rows = np.concatenate([self._pairs[0], np.full(len(starts), count)])
        columns = np.concatenate([self._pairs[1], starts])
        weights = np.concatenate([self._lengths, costs + 1e-9])  # a cost of 0 would be no way
        graph = coo_matrix((weights, (rows, columns)), shape=(count + 1, count + 1)).tocsr()
        away, before = dijkstra(graph, directed=False, indices=count, return_predecessors=True)
        return away[:-1], before

    def taut(self, way: Sequence[int]) -> list[int]:
        """Return those places of a way, by their numbers, between which it can be drawn straight and stays free."""
        kept, at, last = [way[0]], 0, len(way) - 1
        while at < last:
            ahead = min(128, last - at)
            while ahead > 1 and not self._straight(self.places[way[at]], self.places[way[at + ahead]]):
                ahead //= 2
            at += ahead
            kept.append(way[at])
        return kept

    def _straight(self, start: Floats, end: Floats) -> bool:
        count = max(2, math.ceil(float(np.linalg.norm(end - start)) / _LINE_STEP))
        return bool(self.free(start + np.linspace(0.0, 1.0, count)[:, None] * (end - start)).all())

    def led_from(self, sheet: int, place: Floats, clearance: float) -> bool:
        """Tell whether a cable goes straight from the connector of a sheet to a place [m], shape (3,).

        Its middle is at least a clearance [m] from the link, but for the connector itself.
        """
        start = self.connector(sheet)
        way = place - start
        length = float(np.linalg.norm(way))
        line = start + np.linspace(0.0, 1.0, math.ceil(length / _LINE_STEP) + 1)[:, None] * way
        bodies = [*self._bodies, *self._beside, *(cable for k, cable in enumerate(self._cables) if k != sheet)]
        met = float(self.rays.cast(start[None], way[None] / length)[0][0]) < length
        met |= bool((self._tree.query(line[np.linalg.norm(line - start, axis=1) > MOUNT_REACH])[0] < clearance).any())
        return not met and not any(body.near(line, 0.9 * CABLE_RADIUS).any() for body in bodies)

    def connector(self, sheet: int) -> Floats:
        """Return the place of the connector of a sheet, by its index [m], shape (3,)."""
        way = self._sheets[sheet].way
        return np.asarray(way.points[-1] + CABLE_RADIUS * way.normals[-1])

    def clear(self, lines: Floats) -> Bools:
        """Return which loose cables through points [m], shape (n, ..., 3), meet neither the link nor what senses."""
        points = lines.reshape(-1, 3)
        away, nearest = self._tree.query(points)
        off = points - self._samples.points[nearest]
        clear = (np.einsum("ij,ij->i", off, self._samples.normals[nearest]) > 0.0) & (away >= CABLE_RADIUS)
        for sheet in self._sheets:
            clear &= ~self._over(sheet, points, _BRIDGED_DEPTH)[1]
        return np.asarray(clear.reshape(lines.shape[:-1]).all(axis=tuple(range(1, lines.ndim - 1))))

    def met(self, points: Floats) -> list[int]:
        """Return the indices of the sheets that points are over, shape (n, 3) [m]."""
        return [k for k, sheet in enumerate(self._sheets) if self._over(sheet, points, _SUPPORT_DEPTH)[1].any()]
