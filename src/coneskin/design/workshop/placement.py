"""Place of a sheet on the real link: distances that a ruler and a tape measure, from what the link itself shows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from coneskin.geometry.placed_frustum import PlacedFrustum

from .datum_faces import DatumFace, DatumHeight, datum_heights, measured_faces

if TYPE_CHECKING:
    from coneskin.geometry.mesh import Mesh

__all__ = ["LinkFeature", "SheetPlacement", "find_placement", "sharpest_bends"]

_CABLE = 4e-3  # m; height at which a cable on the link must not meet another part of it
_STANDS_OUT = 3e-3  # m; what stands out less is no feature that a person finds
_ALIKE = 0.01  # bends of two strips that differ by less are alike: they are fitted
_NEARLY = 0.05  # a strip that is bent less than another by less belongs to it
_OUTERMOST = 1e-3  # m; points so near to the outermost one are its neighbours
_ALONG = 0.35  # mm of a height for each mm along the axis: it then fixes the place along the axis
_SQUARE = math.sin(math.radians(1.0))  # an axis is held square, or along a face, by a try square


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
        free: from end 1 and from end 2, along the side and outwards at edge 0, to another part of the link [m];
            infinite where there is none.
    """

    around1: float
    around2: float
    before: float | None
    beyond: float | None
    seam: tuple[float, float, float]
    feature: LinkFeature | None
    faces: tuple[DatumFace, ...] = ()
    heights: tuple[DatumHeight, ...] = ()
    tilted: bool = False
    free: tuple[float, float] = (math.inf, math.inf)

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
    import numpy as np

    x, y, z = pose.inverse().apply_all(mesh.vertices).T
    radius = np.sqrt(x * x + y * y)
    feature = None
    furthest = int(radius.argmax())
    if not place.bends and radius[furthest] > max(side.radius1, side.radius2) + _STANDS_OUT:
        near = radius > radius[furthest] - _OUTERMOST
        first = math.atan2(y[furthest], x[furthest])
        turns = (np.arctan2(y[near], x[near]) - first + math.pi) % (2.0 * math.pi) - math.pi
        # a collar stands out all around: it has no azimuth
        if float(np.ptp(turns)) < 0.5 * math.pi:
            azimuth = (first + 0.5 * float(turns.min() + turns.max())) % (2.0 * math.pi)
            height = float(np.median(z[near]))
            end = 1 if height < 0.5 * side.height else 2
            arc = azimuth * (side.radius1 if end == 1 else side.radius2)
            feature = LinkFeature(float(radius[furthest]), azimuth, height, arc, end)
    usable = measured_faces(place, faces)
    along = [abs(math.fsum(a * b for a, b in zip(face.normal, axis, strict=True))) for face in usable]
    held = any(cosine < _SQUARE or cosine > math.sqrt(1.0 - _SQUARE**2) for cosine in along)
    return SheetPlacement(
        *around,
        -float(z.min()),
        float(z.max()) - side.height,
        seam,
        feature,
        usable,
        datum_heights(place, usable) if usable else (),
        max(along, default=0.0) >= _ALONG and not held,
        _free_ways(place, mesh),
    )


def _free_ways(place: PlacedFrustum, mesh: Mesh) -> tuple[float, float]:
    """Return how far a cable at edge 0 can go on beyond end 1 and end 2 before it meets the link [m]."""
    import numpy as np

    from coneskin.geometry.ray_casting import RayCaster

    side = place.frustum
    u = np.array([0.0, side.slant])
    points, normals = place.place(u, np.zeros(2))
    way = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
    distances, _ = RayCaster(mesh).cast(points + _CABLE * normals, np.array([-way, way]))
    return float(distances[0]), float(distances[1])


def sharpest_bends(place: PlacedFrustum) -> list[tuple[float, float]]:
    """Return the places where a side that is not round is bent most around end 1, from edge 0 on.

    A place counts if it is bent a tenth more than a circle of the same arc, and no other within an eighth of the wrap
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
            if rates[k % count] > rates[first] * (1.0 + _ALIKE):
                return on, True
            whole = whole and rates[k % count] > rates[first] * (1.0 - _NEARLY)
            on += widths[k % count] if whole else 0.0
            away += widths[k % count]
        return on, False

    found: dict[float, float] = {}
    for k, rate in enumerate(rates):
        (after, more), (before, also) = reached(k, 1), reached(k, -1)
        if rate > 1.1 * round_rate and not more and not also:
            middle = starts[k] + 0.5 * (widths[k] + after - before)
            found[round(middle % side.wrap if closed else middle, 4)] = side.radius1 / rate
    return [(radius, middle * side.radius1) for middle, radius in sorted(found.items())]
