"""Casting of rays at a mesh: embree or a grid finds the face, float64 the depth."""

from __future__ import annotations

import numpy as np

from coneskin.core.arrays import Floats, Ints

from .mesh import Mesh


class RayCaster:
    """A caster of rays at one mesh.

    Embree (the package embreex) is used where it is installed. It works in float32, so it only finds the face and the
    depth is taken from the plane of that face. Without it ``_GridRayCaster`` finds the face, 10 to 50 times slower.

    Attributes:
        engine: "embree" or "grid".
    """

    def __init__(self, mesh: Mesh, engine: str | None = None) -> None:
        found = mesh.embree_intersector if engine in (None, "embree") else None
        self.engine = "embree" if found else "grid"
        self._first_faces = found or _GridRayCaster(mesh).first_faces
        normals = mesh.normals_and_areas[0]
        # a coordinate at a time: numpy is slow with arrays of three columns
        self._normals = tuple(np.ascontiguousarray(column) for column in normals.T)
        self._heights = np.einsum("ij,ij->i", mesh.vertices[mesh.faces[:, 0]], normals)

    def cast(self, origins: Floats, directions: Floats) -> tuple[Floats, Ints]:
        """Find where rays first meet the mesh, from either side of a face.

        Args:
            origins: starts of the rays [m], shape (n, 3).
            directions: unit vectors, shape (n, 3).

        Returns:
            distances [m], infinite where nothing is hit, shape (n,), and the faces hit, -1 where none, shape (n,).
        """
        face = np.asarray(self._first_faces(origins, directions), np.int64)
        hit = face >= 0
        normals = [column[face] for column in self._normals]  # of the last face where nothing is hit
        along = sum(directions[:, i] * normals[i] for i in range(3))
        ahead = self._heights[face] - sum(origins[:, i] * normals[i] for i in range(3))
        with np.errstate(divide="ignore", invalid="ignore"):
            depth = ahead / along
        sound = hit & np.isfinite(depth) & (np.abs(along) > 1e-9)  # a grazing ray has no depth on the plane
        distance = np.where(sound, depth, np.inf)
        face[~sound] = -1
        return distance, face


class _GridRayCaster:
    """A caster of rays through a grid of cells; each ray tests the faces of the cells that it passes."""

    def __init__(self, mesh: Mesh, cells: int = 48) -> None:
        corners = mesh.triangles
        self._a = corners[:, 0]
        self._ab, self._ac = corners[:, 1] - self._a, corners[:, 2] - self._a
        low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
        margin = 1e-6 * float((high - low).max())
        self._low = low - margin
        size = high - low + 2.0 * margin
        self._cell = float(size.max()) / cells
        self._shape = np.maximum(1, np.ceil(size / self._cell).astype(np.int64))
        self._high = self._low + self._shape * self._cell
        first = self._cells_of(corners.min(axis=1) - margin)
        last = self._cells_of(corners.max(axis=1) + margin)
        spans = last - first + 1
        counts = spans.prod(axis=1)
        face = np.repeat(np.arange(len(corners)), counts)
        step = np.arange(len(face)) - np.repeat(np.cumsum(counts) - counts, counts)
        ny, nz = spans[face, 1], spans[face, 2]
        ijk = first[face] + np.stack([step // (ny * nz), step // nz % ny, step % nz], axis=1)
        centre = self._low + (ijk + 0.5) * self._cell
        # the bounding box of a long face holds many cells; only those that its plane crosses can be hit
        normal = np.cross(self._ab, self._ac)
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        off = np.abs(np.einsum("ij,ij->i", centre - self._a[face], normal[face]))
        near = off <= 0.5 * self._cell * np.abs(normal[face]).sum(axis=1) + margin
        face, flat = face[near], self._flat(ijk[near])
        order = np.argsort(flat, kind="stable")
        self._faces = face[order]
        self._starts = np.searchsorted(flat[order], np.arange(int(self._shape.prod()) + 1))

    def _cells_of(self, points: Floats) -> Ints:
        cells = np.floor((points - self._low) / self._cell).astype(np.int64)
        return np.asarray(np.clip(cells, 0, self._shape - 1))

    def _flat(self, ijk: Ints) -> Ints:
        return np.asarray((ijk[:, 0] * self._shape[1] + ijk[:, 1]) * self._shape[2] + ijk[:, 2])

    def first_faces(self, origins: Floats, directions: Floats) -> Ints:
        """Return the index of the first face hit by each ray, -1 for none; shapes as in ``RayCaster.cast``."""
        origins, directions = np.asarray(origins, float), np.asarray(directions, float)
        best = np.full(len(origins), np.inf)
        face = np.full(len(origins), -1, np.int64)
        with np.errstate(divide="ignore", invalid="ignore"):
            t0 = (self._low - origins) / directions
            t1 = (self._high - origins) / directions
        inside = (origins >= self._low) & (origins <= self._high)
        parallel = directions == 0.0
        near = np.where(parallel, np.where(inside, -np.inf, np.inf), np.minimum(t0, t1)).max(axis=1)
        far = np.where(parallel, np.where(inside, np.inf, -np.inf), np.maximum(t0, t1)).min(axis=1)
        now = np.maximum(near, 0.0)
        alive = np.flatnonzero(now <= far)
        cell = self._cells_of(origins + np.where(np.isfinite(now), now, 0.0)[:, None] * directions)
        forward = (directions > 0.0).astype(np.int64)
        while len(alive):
            self._test(alive, cell[alive], origins, directions, best, face)
            wall = self._low + (cell[alive] + forward[alive]) * self._cell
            with np.errstate(divide="ignore", invalid="ignore"):
                leave = (wall - origins[alive]) / directions[alive]
            leave[parallel[alive]] = np.inf
            axis = leave.argmin(axis=1)
            reach = leave[np.arange(len(alive)), axis]
            cell[alive, axis] += 2 * forward[alive, axis] - 1
            within = ((cell[alive] >= 0) & (cell[alive] < self._shape)).all(axis=1)
            alive = alive[within & (reach < best[alive])]
        return face

    def _test(self, rays: Ints, cells: Ints, origins: Floats, directions: Floats, best: Floats, face: Ints) -> None:
        """Test the faces in each ray's cell (Moeller and Trumbore 1997); keep the nearest in best and face."""
        flat = self._flat(cells)
        counts = self._starts[flat + 1] - self._starts[flat]
        ray = np.repeat(rays, counts)
        if len(ray) == 0:
            return
        step = np.arange(len(ray)) - np.repeat(np.cumsum(counts) - counts, counts)
        at = self._faces[np.repeat(self._starts[flat], counts) + step]
        way = directions[ray]
        p = np.cross(way, self._ac[at])
        det = np.einsum("ij,ij->i", self._ab[at], p)
        with np.errstate(divide="ignore", invalid="ignore"):
            s = origins[ray] - self._a[at]
            u = np.einsum("ij,ij->i", s, p) / det
            q = np.cross(s, self._ab[at])
            v = np.einsum("ij,ij->i", way, q) / det
            t = np.einsum("ij,ij->i", self._ac[at], q) / det
            slack = 1e-9  # so that no ray slips between two faces
            hit = (u >= -slack) & (v >= -slack) & (u + v <= 1.0 + slack) & (t >= 0.0) & (det != 0.0)
        ray, at, t = ray[hit], at[hit], t[hit]
        order = np.argsort(-t, kind="stable")  # the nearest is written last
        ray, at, t = ray[order], at[order], t[order]
        closer = t < best[ray]
        best[ray[closer]] = t[closer]
        face[ray[closer]] = at[closer]
