"""First view of the studio: from where most of the sheets and of their seams is seen, with nothing before them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from coneskin.geometry.pose import Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from coneskin.design.sheets.sheet_design import SheetDesign
    from coneskin.geometry.ray_casting import RayCaster

__all__ = ["first_view", "seen_shares"]

_AROUND = 24  # directions at each height
_HEIGHTS = (20.0, 45.0, -15.0)  # deg above the horizon, the preferred one first
_FIRST = -40.0  # deg; azimuth that is taken where none is better
_ROWS, _COLUMNS = 4, 14  # places of a sheet that are looked at
_ABOVE = 0.001  # m above the sheet, from where a place is looked for
_FACING = 0.15  # cosine; what is turned away by more is seen as a line
_SEAM = 0.3  # worth of seeing all of a seam, beside 1 for all of a sheet
_PREFERRED = 0.1  # by which another height has to be better
_AWAY = 1.55  # of the link's largest side


def first_view(designs: Sequence[SheetDesign], rays: RayCaster, corners: NDArray[np.float64]) -> tuple[Vector, Vector]:
    """Return from where to look, and at what [m].

    Args:
        designs: the sheets.
        rays: of the link's mesh.
        corners: vertices of the mesh [m], shape (n, 3).
    """
    import numpy as np

    low, high = corners.min(axis=0), corners.max(axis=0)
    middle, size = 0.5 * (low + high), float((high - low).max())
    ways = _directions()
    worth = np.array([-_PREFERRED * (row // _AROUND > 0) for row in range(len(ways))])
    for design in designs:
        sheet, seam = seen_shares(design, rays, ways)
        worth += sheet + _SEAM * seam
    way = ways[int(np.argmax(worth))]  # the first of several that are as good
    x, y, z = (middle + _AWAY * size * way).tolist()
    at_x, at_y, at_z = middle.tolist()
    return (x, y, z), (at_x, at_y, at_z)


def seen_shares(
    design: SheetDesign, rays: RayCaster, ways: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return how much of a sheet, and of its two edges along the seam, is seen from far off.

    1 is all of it, looked at along its normal; what is seen obliquely counts by the cosine.

    Args:
        design: the sheet.
        rays: of the link's mesh.
        ways: unit vectors towards the eye, shape (n, 3).

    Returns:
        of the sheet and of its seam, each of shape (n,).
    """
    import numpy as np

    box = design.layout.field
    u = np.linspace(box.u1, box.u2, _ROWS)
    rows, columns = np.meshgrid(u, np.linspace(box.phi1, box.phi2, _COLUMNS), indexing="ij")
    points, normals = (found.reshape(-1, 3) for found in design.place.place(rows, columns))
    cosine = normals @ ways.T  # places, ways
    seen = np.zeros_like(cosine)
    at, way = np.nonzero(cosine > _FACING)
    depth, _ = rays.cast(points[at] + _ABOVE * normals[at], ways[way])
    seen[at, way] = np.where(np.isfinite(depth), 0.0, cosine[at, way])
    grid = seen.reshape(_ROWS, _COLUMNS, len(ways))
    return seen.mean(axis=0), grid[:, [0, -1]].mean(axis=(0, 1))


def _directions() -> NDArray[np.float64]:
    import numpy as np

    found = []
    for height in map(math.radians, _HEIGHTS):
        for step in range(_AROUND):
            turn = math.radians(_FIRST) + 2.0 * math.pi * step / _AROUND
            found.append((math.cos(height) * math.cos(turn), math.cos(height) * math.sin(turn), math.sin(height)))
    return np.array(found)
