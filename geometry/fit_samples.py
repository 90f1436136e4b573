"""Points spread evenly over the surface of a mesh that see the outside of the link."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from coneskin.errors import MeshError

from .mesh import Mesh
from .rays import Rays

__all__ = ["Samples", "surface_samples"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Points of the hull of a link.

    Attributes:
        points: on the mesh [m], shape (n, 3).
        normals: unit normals of the faces they lie on, turned to the side that sees the outside, shape (n, 3).
        faces: index of the face that each lies on, shape (n,).
        area: area that each point stands for [m2].
    """

    points: Floats
    normals: Floats
    faces: NDArray[np.int64]
    area: float

    def __len__(self) -> int:
        return len(self.points)

    def only(self, chosen: NDArray[np.bool_]) -> Samples:
        """The chosen ones of them."""
        return Samples(self.points[chosen], self.normals[chosen], self.faces[chosen], self.area)


def surface_samples(mesh: Mesh, rays: Rays, count: int = 6000, seed: int = 1) -> Samples:
    """Spread points over a mesh by area and keep those from which a ray along the normal leaves the link.

    Inner walls, screws in their holes and flipped faces are settled here: a point is kept if one of the two sides of
    its face sees the outside, and that side becomes its normal.

    Args:
        mesh: the link.
        rays: a ray caster of the same mesh.
        count: points before the selection.
        seed: of the random numbers.

    Raises:
        MeshError: no point sees the outside.
    """
    rng = np.random.default_rng(seed)
    face_normals, areas = mesh.normals_and_areas()
    total = np.cumsum(areas)
    face = np.searchsorted(total, (np.arange(count) + rng.random(count)) / count * total[-1], side="right")
    face = np.minimum(face, len(areas) - 1)
    a, b, c = mesh.triangles[face].transpose(1, 0, 2)
    root, share = np.sqrt(rng.random(count))[:, None], rng.random(count)[:, None]
    points = (1.0 - root) * a + root * (1.0 - share) * b + root * share * c
    normals = face_normals[face]
    lift = 1e-5 * float(mesh.size.max())  # clear of the face itself in float32
    outer = np.isinf(rays.cast(points + lift * normals, normals)[0])
    inner = np.isinf(rays.cast(points - lift * normals, -normals)[0])
    # An open sheet sees the outside on both sides: the one that looks away from the middle is meant.
    away = np.einsum("ij,ij->i", normals, points - points.mean(axis=0)) >= 0.0
    flip = inner & ~(outer & away)
    keep = outer | inner
    if not keep.any():
        raise MeshError(f"{mesh.source}: no face of it sees the outside")
    normals = np.where(flip[:, None], -normals, normals)
    return Samples(points[keep], normals[keep], face[keep], float(total[-1]) / count)
