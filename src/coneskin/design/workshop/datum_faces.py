"""Flat faces on which a bare link lies without rocking: what a person measures the place of a sheet from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from coneskin.geometry.placed_frustum import PlacedFrustum

if TYPE_CHECKING:
    from coneskin.geometry.mesh import Mesh

__all__ = ["DatumFace", "DatumHeight", "datum_heights", "find_datum_faces", "measured_faces"]

Floats = NDArray[np.float64]

_FLAT = 0.2e-3  # m; corners so near to a plane lie in it
_ALIGNED = math.cos(math.radians(2.0))  # faces of the mesh that are tilted less against a plane belong to it
_NEAR = math.sqrt(2.0 - 2.0 * _ALIGNED) + 1e-6  # between unit normals of such faces
_NARROWEST = 25e-3  # m; on a narrower face a link rocks, and on the line that a round one touches it rolls
_MATERIAL = 0.3  # of the outline of a face that the link must fill; else nobody sees a face there
_MOST = 4  # faces; more are a nuisance
_ALIKE = math.cos(math.radians(20.0))  # faces whose normals differ by less say the same of a place
_COVERED = 0.1  # of a face that a sheet may cover
_STEEP = 0.7  # mm for each mm that a sheet is turned: such a height fixes edge 0
_APART = 10e-3  # m; measured places of one rim are no nearer


@dataclass(frozen=True, slots=True)
class DatumFace:
    """A flat face of a link beyond which nothing of the link stands out.

    Attributes:
        name: F1, F2 and so on, by area.
        normal: outwards, a unit vector in the frame of the link.
        offset: of its plane from the origin of that frame, along the normal [m].
        size: length and width of the area on which the link lies [m].
        outline: corners of that area [m], convex, shape (n, 3).
    """

    name: str
    normal: tuple[float, float, float]
    offset: float
    size: tuple[float, float]
    outline: Floats

    def height(self, points: Floats) -> Floats:
        """Return how far points, shape (..., 3), are from the plane, into the link [m]."""
        return np.asarray(self.offset - points @ np.array(self.normal))


@dataclass(frozen=True, slots=True)
class DatumHeight:
    """Distances of one place of a bare link from the planes of its faces.

    Attributes:
        u: of the place, from end 1 along the surface [m].
        phi: of the place, from edge 0 [rad].
        heights: from each face [m].
        steep: for each face, True where turning the sheet changes the height by 0.7 of the way at least.
    """

    u: float
    phi: float
    heights: tuple[float, ...]
    steep: tuple[bool, ...]


def find_datum_faces(mesh: Mesh) -> tuple[DatumFace, ...]:
    """Find the faces of the convex hull of a link that are flat, wide, and made of the link's own faces.

    Args:
        mesh: of the link.
    """
    from scipy.spatial import ConvexHull, KDTree

    hull = ConvexHull(mesh.outermost)
    corners = mesh.outermost[hull.simplices]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    normals, left = hull.equations[:, :3], np.ones(len(area), bool)
    tree = KDTree(normals)  # a round link has a hundred thousand facets, and nearly as many directions
    own = mesh.vertices[mesh.faces]
    own_normal = np.cross(own[:, 1] - own[:, 0], own[:, 2] - own[:, 0])
    own_area = 0.5 * np.linalg.norm(own_normal, axis=1)
    found: list[DatumFace] = []
    for first in np.argsort(-area):
        if not left[first]:
            continue
        normal, offset = normals[first], -float(hull.equations[first, 3])
        near = np.array(tree.query_ball_point(normal, _NEAR))
        near = near[left[near] & (normals[near] @ normal > _ALIGNED)]
        inside = near[np.abs(corners[near] @ normal - offset).max(axis=1) < _FLAT]
        left[inside] = False
        whole = float(area[inside].sum())
        if whole < 0.5 * _NARROWEST**2:  # less than a triangle of that width has
            continue
        outline = _outline(np.unique(corners[inside].reshape(-1, 3), axis=0), normal)
        size = _size(outline, normal)
        if size[1] < _NARROWEST:
            continue
        flat = np.abs(own @ normal - offset).max(axis=1) < _FLAT
        flat &= np.abs(own_normal @ normal) > _ALIGNED * 2.0 * own_area
        if own_area[flat].sum() < _MATERIAL * whole:
            continue
        x, y, z = (float(value) + 0.0 for value in normal)
        found.append(DatumFace("", (x, y, z), offset, size, outline))
    ranked = sorted(found, key=_area, reverse=True)
    kept: list[DatumFace] = []
    for face in ranked:
        if len(kept) < _MOST and all(np.dot(face.normal, other.normal) < _ALIKE for other in kept):
            kept.append(DatumFace(f"F{len(kept) + 1}", face.normal, face.offset, face.size, face.outline))
    return tuple(kept)


def measured_faces(place: PlacedFrustum, faces: Sequence[DatumFace]) -> tuple[DatumFace, ...]:
    """Return the faces from which the place of a sheet is measured: those that it does not cover itself.

    Args:
        place: the side of the link that the sheet covers.
        faces: of the link.
    """
    side = place.frustum
    kept = []
    for face in faces:
        middle = face.outline.mean(axis=0)
        spread = np.concatenate([middle + share * (face.outline - middle) for share in (0.0, 0.3, 0.6, 0.9)])
        u, phi, above = place.locate_all(spread)
        within = (u > 0.0) & (u < side.slant) & (phi % (2.0 * math.pi) <= side.wrap) & (np.abs(above) < 2e-3)
        if within.mean() < _COVERED:
            kept.append(face)
    return tuple(kept)


def datum_heights(place: PlacedFrustum, faces: Sequence[DatumFace]) -> tuple[DatumHeight, ...]:
    """Return distances from faces for places of a sheet: its corners, and where a height fixes edge 0 best.

    Args:
        place: the side of the link that the sheet covers.
        faces: at least one.
    """
    side = place.frustum
    closed = side.wrap > 2.0 * math.pi - 1e-6
    turns = np.linspace(0.0, side.wrap, 721)
    points = place.place(np.zeros(len(turns)), turns)[0]
    ahead = np.gradient(points, turns, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    slopes = np.stack([ahead @ np.array(face.normal) for face in faces], axis=1)
    phis = [0.0] if closed else [0.0, side.wrap]
    for column in range(len(faces)):
        for sign in (1.0, -1.0):
            steepest = int((sign * slopes[:, column]).argmax())
            phi = float(turns[steepest])
            near = min(abs(math.remainder(phi - other, 2.0 * math.pi)) for other in phis) * side.radius1
            if sign * slopes[steepest, column] >= _STEEP and near > _APART:
                phis.append(phi)
    rows = []
    for u in (0.0, side.slant):
        for phi in sorted(phis):
            heights = [float(face.height(place.place(u, phi)[0].reshape(3))) for face in faces]
            slope = slopes[round(phi / side.wrap * (len(turns) - 1))]
            rows.append(DatumHeight(u, phi, tuple(heights), tuple(bool(abs(s) >= _STEEP) for s in slope)))
    return tuple(rows)


def _outline(points: Floats, normal: Floats) -> Floats:
    """Return the convex outline of points in a plane, in order."""
    from scipy.spatial import ConvexHull

    return np.asarray(points[ConvexHull(points @ _plane(normal)).vertices])


def _plane(normal: Floats) -> Floats:
    """Return two unit vectors that span the plane of a normal, shape (3, 2)."""
    return np.asarray(np.linalg.svd(normal[None])[2][1:].T)


def _size(outline: Floats, normal: Floats) -> tuple[float, float]:
    """Return length and width of a convex outline where it is narrowest, which is along one of its edges [m]."""
    flat = outline @ _plane(normal)
    edges = np.roll(flat, -1, axis=0) - flat
    along = edges / np.linalg.norm(edges, axis=1)[:, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    widths = np.ptp(flat @ across.T, axis=0)
    narrow = int(widths.argmin())
    return float(np.ptp(flat @ along[narrow])), float(widths[narrow])


def _area(face: DatumFace) -> float:
    return face.size[0] * face.size[1]
