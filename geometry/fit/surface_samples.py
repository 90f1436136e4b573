"""Points spread evenly over the outer surface of a mesh."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from coneskin.core.arrays import Bools, Floats, Ints
from coneskin.core.errors import MeshError
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.ray_casting import RayCaster

_MIN_NORMAL_COSINE = 0.9  # cosine between the normals of the hull and of a sheet on it
_NEIGHBOR_COUNT = 8  # samples, half of which must face one way where the hull is flat: beside an edge no more do
_FLAT_COSINE = math.cos(math.radians(2.0))


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceSamples:
    """Points on the hull of a link: the surface that is visible from outside.

    Attributes:
        points: on the mesh [m], shape (n, 3).
        normals: unit outward normals of the faces of the points, shape (n, 3).
        faces: index of the face of each point, shape (n,).
        area: area that each point represents [m2].
    """

    points: Floats
    normals: Floats
    faces: Ints
    area: float

    def __len__(self) -> int:
        return len(self.points)

    def subset(self, chosen: Bools) -> SurfaceSamples:
        """Return the chosen points; ``chosen`` has the shape (n,)."""
        return SurfaceSamples(self.points[chosen], self.normals[chosen], self.faces[chosen], self.area)

    def below(self, placed: PlacedFrustum, distance: float) -> Bools:
        """Return whether a side lies on each sample, at most a distance [m] from it, shape (n,)."""
        side = placed.frustum
        u, phi, off = placed.locate_all(self.points)
        inside = (np.abs(off) <= distance) & (u >= 0.0) & (u <= side.slant)
        if side.wrap < math.tau - 1e-9:
            inside &= (phi >= 0.0) & (phi <= side.wrap)
        normals = placed.place(np.zeros(len(phi)), phi)[1]
        return np.asarray(inside & (np.einsum("ij,ij->i", normals, self.normals) > _MIN_NORMAL_COSINE))

    def flat(self) -> Bools:
        """Return whether the hull is flat about each sample, shape (n,)."""
        from scipy.spatial import cKDTree

        near = cKDTree(self.points).query(self.points, min(_NEIGHBOR_COUNT, len(self)))[1]
        cosines = np.einsum("ijk,ik->ij", self.normals[near], self.normals)
        return np.asarray(np.quantile(cosines, 0.5, axis=1) >= _FLAT_COSINE)


def sample_surface(mesh: Mesh, rays: RayCaster, count: int = 6000, seed: int = 1) -> SurfaceSamples:
    """Spread points over a mesh by area and keep those from which a ray along the normal leaves the link.

    This removes inner walls and screws in their holes, and corrects flipped faces: a point is kept if a ray leaves the
    link from one of the two sides of its face, and that side gives its normal.

    Args:
        mesh: the link.
        rays: a ray caster of the same mesh.
        count: number of points before the selection.
        seed: seed of the random numbers.

    Raises:
        MeshError: no point is visible from outside.
    """
    rng = np.random.default_rng(seed)
    face_normals, areas = mesh.normals_and_areas
    total = np.cumsum(areas)
    face = np.searchsorted(total, (np.arange(count) + rng.random(count)) / count * total[-1], side="right")
    face = np.minimum(face, len(areas) - 1)
    a, b, c = mesh.triangles[face].transpose(1, 0, 2)
    root, share = np.sqrt(rng.random(count))[:, None], rng.random(count)[:, None]
    points = (1.0 - root) * a + root * (1.0 - share) * b + root * share * c
    normals = face_normals[face]
    lift = 1e-5 * float(mesh.size.max())  # m; the ray must not hit its own face in float32
    outer = np.isinf(rays.cast(points + lift * normals, normals)[0])
    inner = np.isinf(rays.cast(points - lift * normals, -normals)[0])
    # both sides of an open surface are outer ones: the normal points away from the middle
    away = np.einsum("ij,ij->i", normals, points - points.mean(axis=0)) >= 0.0
    flip = inner & ~(outer & away)
    keep = outer | inner
    if not keep.any():
        raise MeshError(f"{mesh.source}: no face is visible from outside")
    normals = np.where(flip[:, None], -normals, normals)
    return SurfaceSamples(points[keep], normals[keep], face[keep], float(total[-1]) / count)
