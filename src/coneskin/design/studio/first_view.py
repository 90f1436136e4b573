"""First view of a link: from where most of its sheets and of their seams is visible, with nothing before them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from coneskin.geometry.pose import Vector
from coneskin.geometry.ray_casting import RayCaster

if TYPE_CHECKING:
    from coneskin.core.arrays import Floats
    from coneskin.design.sheets.sheet_design import SheetDesign

_AZIMUTH_COUNT = 24  # directions at each height
_VIEW_HEIGHTS = (20.0, 45.0, -15.0)  # deg above the horizon, the preferred one first
_FIRST_AZIMUTH = -40.0  # deg; azimuth that is taken where none is better
_PLACE_ROWS, _PLACE_COLUMNS = 4, 14  # places of a sheet that are looked at
_EYE_LIFT = 0.001  # m above the sheet, from where a place is looked for
_MIN_FACING = 0.15  # cosine; what is turned away by more is seen as a line
_SEAM_WORTH = 0.3  # worth of seeing all of a seam, beside 1 for all of a sheet
_HEIGHT_PREFERENCE = 0.1  # by which another height has to be better
_VIEW_DISTANCE = 1.55  # of the link's largest side


def first_view(designs: Sequence[SheetDesign], rays: RayCaster | None, corners: Floats) -> tuple[Vector, Vector]:
    """Return from where to look, and at what [m]."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle, size = 0.5 * (low + high), float((high - low).max())
    ways = _directions()
    worth = np.array([-_HEIGHT_PREFERENCE * (row // _AZIMUTH_COUNT > 0) for row in range(len(ways))])
    if rays is not None:
        for design in designs:
            sheet, seam = _seen_shares(design, rays, ways)
            worth += sheet + _SEAM_WORTH * seam
    way = ways[int(np.argmax(worth))]  # the first of several that are as good
    x, y, z = (middle + _VIEW_DISTANCE * size * way).tolist()
    at_x, at_y, at_z = middle.tolist()
    return (x, y, z), (at_x, at_y, at_z)


def _seen_shares(design: SheetDesign, rays: RayCaster, ways: Floats) -> tuple[Floats, Floats]:
    """Return how much of a sheet, and of its two edges along the seam, is seen from far off.

    1 is all of it, looked at along its normal; what is seen obliquely counts by the cosine.

    Args:
        design: the sheet.
        rays: of the link's mesh.
        ways: unit vectors towards the eye, shape (n, 3).

    Returns:
        of the sheet and of its seam, each of shape (n,).
    """
    box = design.layout.field
    u = np.linspace(box.u1, box.u2, _PLACE_ROWS)
    rows, columns = np.meshgrid(u, np.linspace(box.phi1, box.phi2, _PLACE_COLUMNS), indexing="ij")
    points, normals = (found.reshape(-1, 3) for found in design.place.place(rows, columns))
    cosine = normals @ ways.T  # places, ways
    seen = np.zeros_like(cosine)
    at, way = np.nonzero(cosine > _MIN_FACING)
    depth, _ = rays.cast(points[at] + _EYE_LIFT * normals[at], ways[way])
    seen[at, way] = np.where(np.isfinite(depth), 0.0, cosine[at, way])
    grid = seen.reshape(_PLACE_ROWS, _PLACE_COLUMNS, len(ways))
    return seen.mean(axis=0), grid[:, [0, -1]].mean(axis=(0, 1))


def _directions() -> Floats:
    found = []
    for height in map(math.radians, _VIEW_HEIGHTS):
        for step in range(_AZIMUTH_COUNT):
            turn = math.radians(_FIRST_AZIMUTH) + 2.0 * math.pi * step / _AZIMUTH_COUNT
            found.append((math.cos(height) * math.cos(turn), math.cos(height) * math.sin(turn), math.sin(height)))
    return np.array(found)
