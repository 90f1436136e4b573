"""Place of a sheet on the real link: distances that a ruler and a tape measure, from what the link itself shows.

They are measured from flat faces on which the bare link lies without rocking.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coneskin.core.arrays import Floats
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.placed_frustum import PlacedFrustum

_FLAT_DISTANCE = 0.2e-3  # m; corners so near to a plane lie in it
_ALIGNED_COSINE = math.cos(math.radians(2.0))  # faces of the mesh that are tilted less against a plane belong to it
_NEAR_NORMALS = math.sqrt(2.0 - 2.0 * _ALIGNED_COSINE) + 1e-6  # between unit normals of such faces
_MIN_FACE_WIDTH = 25e-3  # m; on a narrower face a link rocks, and on the line that a round one touches it rolls
_MIN_MATERIAL = 0.3  # of the outline of a face that the link must fill; else nobody sees a face there
_MAX_FACES = 4  # faces; more are a nuisance
_ALIKE_DIRECTIONS = math.cos(math.radians(20.0))  # faces whose normals differ by less say the same of a place
_MAX_COVERED = 0.1  # of a face that a sheet may cover
_MIN_TURN_SLOPE = 0.7  # mm for each mm that a sheet is turned: such a height fixes edge 0
_MIN_PLACE_DISTANCE = 10e-3  # m; measured places of one rim are no nearer


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
class _DatumHeight:
    """Distances of a place (u, phi) of a bare link from the planes of its faces [m].

    ``steep`` tells of each whether turning the sheet changes it by 0.7 of the way at least.
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
        near = np.array(tree.query_ball_point(normal, _NEAR_NORMALS))
        near = near[left[near] & (normals[near] @ normal > _ALIGNED_COSINE)]
        inside = near[np.abs(corners[near] @ normal - offset).max(axis=1) < _FLAT_DISTANCE]
        left[inside] = False
        whole = float(area[inside].sum())
        if whole < 0.5 * _MIN_FACE_WIDTH**2:  # less than a triangle of that width has
            continue
        outline = _outline(np.unique(corners[inside].reshape(-1, 3), axis=0), normal)
        size = _size(outline, normal)
        if size[1] < _MIN_FACE_WIDTH:
            continue
        flat = np.abs(own @ normal - offset).max(axis=1) < _FLAT_DISTANCE
        flat &= np.abs(own_normal @ normal) > _ALIGNED_COSINE * 2.0 * own_area
        if own_area[flat].sum() < _MIN_MATERIAL * whole:
            continue
        x, y, z = (float(value) + 0.0 for value in normal)
        found.append(DatumFace("", (x, y, z), offset, size, outline))
    kept: list[DatumFace] = []
    for face in sorted(found, key=lambda face: -face.size[0] * face.size[1]):
        if len(kept) < _MAX_FACES and all(np.dot(face.normal, other.normal) < _ALIKE_DIRECTIONS for other in kept):
            kept.append(DatumFace(f"F{len(kept) + 1}", face.normal, face.offset, face.size, face.outline))
    return tuple(kept)


def _measured_faces(place: PlacedFrustum, faces: Sequence[DatumFace]) -> tuple[DatumFace, ...]:
    """Return the faces from which the place of a sheet is measured: those that it does not cover itself."""
    side = place.frustum
    kept = []
    for face in faces:
        middle = face.outline.mean(axis=0)
        spread = np.concatenate([middle + share * (face.outline - middle) for share in (0.0, 0.3, 0.6, 0.9)])
        u, phi, above = place.locate_all(spread)
        within = (u > 0.0) & (u < side.slant) & (phi % (2.0 * math.pi) <= side.wrap) & (np.abs(above) < 2e-3)
        if within.mean() < _MAX_COVERED:
            kept.append(face)
    return tuple(kept)


def _datum_heights(place: PlacedFrustum, faces: Sequence[DatumFace]) -> tuple[_DatumHeight, ...]:
    """Return distances from faces for places of a sheet: its corners, and where a height fixes edge 0 best."""
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
            if sign * slopes[steepest, column] >= _MIN_TURN_SLOPE and near > _MIN_PLACE_DISTANCE:
                phis.append(phi)
    rows = []
    for u in (0.0, side.slant):
        for phi in sorted(phis):
            heights = [float(face.height(place.place(u, phi)[0].reshape(3))) for face in faces]
            slope = slopes[round(phi / side.wrap * (len(turns) - 1))]
            rows.append(_DatumHeight(u, phi, tuple(heights), tuple(bool(abs(s) >= _MIN_TURN_SLOPE) for s in slope)))
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


_STANDS_OUT = 3e-3  # m; what stands out less is no feature that a person finds
_OUTERMOST_DEPTH = 1e-3  # m; points so near to the outermost one are its neighbours
_ALIKE_BENDS = 0.01  # bends of two strips that differ by less are alike: they are fitted
_ALIKE_STRIPS = 0.05  # a strip that is bent less than another by less belongs to it
_MIN_AXIS_SLOPE = 0.35  # mm of a height for each mm along the axis: it then fixes the place along the axis
_SQUARE_SINE = math.sin(math.radians(1.0))  # an axis is held square, or along a face, by a try square


@dataclass(frozen=True, slots=True)
class LinkFeature:
    """The point of a link that is furthest from the axis of a sheet: a flange, an elbow, a cover.

    Attributes:
        radius: distance from the axis [m].
        azimuth: from the seam [rad], in [0, 2 pi).
        height: along the axis from end 1 of the sheet, positive towards end 2 [m].
        arc: from the seam to its azimuth, around the sheet at the end nearer to it [m].
        end: that end, 1 or 2.
    """

    radius: float
    azimuth: float
    height: float
    arc: float
    end: int


@dataclass(frozen=True, slots=True)
class SheetPlacement:
    """Where a sheet belongs on its link.

    Attributes:
        around1: way around the bare link at end 1, from edge 0 to edge wrap [m].
        around2: the same at end 2 [m].
        before: from the outermost point of the link on the side of end 1 to end 1, along the axis [m]; None where
            there is no mesh.
        beyond: from end 2 to the outermost point of the link on its side [m]; None where there is no mesh.
        seam: direction in which edge 0 faces, in the frame of the link.
        feature: what stands out, from which the seam is measured; None where nothing does.
        faces: flat faces of the link from which places are measured.
        heights: distances from these faces; empty where there is none.
        tilted: True where the axis is square to no face and along none, and the heights fix the place along it: what a
            ruler would measure along the axis is then left out.
    """

    around1: float
    around2: float
    before: float | None
    beyond: float | None
    seam: tuple[float, float, float]
    feature: LinkFeature | None
    faces: tuple[DatumFace, ...] = ()
    heights: tuple[_DatumHeight, ...] = ()
    tilted: bool = False

    @property
    def around_fixed(self) -> bool:
        """Whether the heights fix edge 0."""
        return any(any(height.steep) for height in self.heights)


def find_placement(place: PlacedFrustum, mesh: Mesh | None = None, faces: Sequence[DatumFace] = ()) -> SheetPlacement:
    """Measure where a sheet belongs on its link.

    Args:
        place: the side of the link that the sheet covers.
        mesh: of the link; None where it is known by its dimensions only.
        faces: flat faces of the link (``find_datum_faces``).
    """
    side, pose = place.frustum, place.link_frustum
    around = side.wrap * side.radius1, side.wrap * side.radius2
    seam, axis = pose.rotate((1.0, 0.0, 0.0)), pose.rotate((0.0, 0.0, 1.0))
    if mesh is None:
        return SheetPlacement(*around, None, None, seam, None)
    x, y, z = pose.inverse().apply_all(mesh.vertices).T
    radius = np.sqrt(x * x + y * y)
    feature = None
    furthest = int(radius.argmax())
    if not place.bends and radius[furthest] > max(side.radius1, side.radius2) + _STANDS_OUT:
        near = radius > radius[furthest] - _OUTERMOST_DEPTH
        first = math.atan2(y[furthest], x[furthest])
        turns = (np.arctan2(y[near], x[near]) - first + math.pi) % (2.0 * math.pi) - math.pi
        # a collar stands out all around: it has no azimuth
        if float(np.ptp(turns)) < 0.5 * math.pi:
            azimuth = (first + 0.5 * float(turns.min() + turns.max())) % (2.0 * math.pi)
            height = float(np.median(z[near]))
            end = 1 if height < 0.5 * side.height else 2
            arc = azimuth * (side.radius1 if end == 1 else side.radius2)
            feature = LinkFeature(float(radius[furthest]), azimuth, height, arc, end)
    usable = _measured_faces(place, faces)
    along = [abs(math.fsum(a * b for a, b in zip(face.normal, axis, strict=True))) for face in usable]
    held = any(cosine < _SQUARE_SINE or cosine > math.sqrt(1.0 - _SQUARE_SINE**2) for cosine in along)
    return SheetPlacement(
        *around,
        -float(z.min()),
        float(z.max()) - side.height,
        seam,
        feature,
        usable,
        _datum_heights(place, usable) if usable else (),
        max(along, default=0.0) >= _MIN_AXIS_SLOPE and not held,
    )


def sharpest_bends(place: PlacedFrustum) -> list[tuple[float, float]]:
    """Return the places where a side that is not round is bent most around end 1, from edge 0 on.

    A place counts if it is bent a fifth more than a circle of the same arc, and no other within an eighth of the wrap
    is bent more. It reaches as far as it is bent nearly as much.

    Returns:
        radius of the bend, and the way from edge 0 around end 1 to its middle [m].
    """
    side, count = place.frustum, len(place.bends)
    if not count:
        return []
    widths = [bend.width for bend in place.bends]
    rates = [bend.turn / bend.width for bend in place.bends]
    starts = [math.fsum(widths[:k]) for k in range(count)]
    closed = side.wrap > 2.0 * math.pi - 1e-6
    round_rate = math.fsum(bend.turn for bend in place.bends) / side.wrap

    def reached(first: int, way: int) -> tuple[float, bool]:
        """Return how far a bend goes on [rad] one way, and whether it is bent more within an eighth of the wrap."""
        on, away, whole = 0.0, 0.0, True
        for step in range(1, count):
            k = first + way * step
            if (not closed and not 0 <= k < count) or away > side.wrap / 8.0:
                break
            if rates[k % count] > rates[first] * (1.0 + _ALIKE_BENDS):
                return on, True
            whole = whole and rates[k % count] > rates[first] * (1.0 - _ALIKE_STRIPS)
            on += widths[k % count] if whole else 0.0
            away += widths[k % count]
        return on, False

    found: dict[float, float] = {}
    for k, rate in enumerate(rates):
        (after, more), (before, also) = reached(k, 1), reached(k, -1)
        if rate > 1.2 * round_rate and not more and not also:
            middle = starts[k] + 0.5 * (widths[k] + after - before)
            found[round(middle % side.wrap if closed else middle, 4)] = side.radius1 / rate
    return [(radius, middle * side.radius1) for middle, radius in sorted(found.items())]
