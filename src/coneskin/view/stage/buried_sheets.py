"""Sheets that the drawn arm would hide: what a part of one is buried in is drawn so that one sees through it.

The solids of an arm are made from its tables (``arm_solids``): their axes are exact, how thick they are is not. Where a
sheet truly lies, its scene says. So a solid that hides one is at fault, and where it was is still shown.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from coneskin.geometry.pose import Pose

from .sheet_surface import SheetSurface
from .solid import Solid

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["CLEAR", "clear_where_buried"]

CLEAR = 0.3  #: opacity of a solid in which part of a sheet is buried
_HIDDEN = 0.005  # share of a sheet from which on it counts
_ROWS, _COLUMNS = 16, 48  # places of a sheet that are looked at


def clear_where_buried(
    solids: Sequence[Solid], sheets: Sequence[SheetSurface], poses: Mapping[int, Pose]
) -> tuple[Solid, ...]:
    """Return solids, those clear in which a sheet on their link or a neighbour is buried.

    Neighbours turn about the axis of their joint, and so does each solid about it: one pose of the arm stands for all.

    Args:
        solids: of the arm; one that is not closed, a mesh of a link, is what it is.
        sheets: on the arm.
        poses: of the links' frames, at any joint positions.
    """
    found = []
    for solid in solids:
        near = [sheet for sheet in sheets if solid.closed and abs(sheet.link - solid.link) <= 1]
        hides = any(_share_inside(solid, _places(sheet, poses, solid.link)) > _HIDDEN for sheet in near)
        found.append(solid._replace(opacity=CLEAR) if hides else solid)
    return tuple(found)


def _places(sheet: SheetSurface, poses: Mapping[int, Pose], link: int) -> NDArray[np.float64]:
    """Return places all over a sheet, in the frame of a link [m], shape (n, 3)."""
    import numpy as np

    cone = sheet.item.frustum.frustum
    u, phi = np.meshgrid(np.linspace(0.0, cone.slant, _ROWS), np.linspace(0.0, cone.wrap, _COLUMNS), indexing="ij")
    points, _ = sheet.item.frustum.place(u, phi)
    here = poses[sheet.link].apply_all(points.reshape(-1, 3))
    return np.asarray(poses[link].inverse().apply_all(here))


def _share_inside(solid: Solid, points: NDArray[np.float64]) -> float:
    """Return which share of points is inside of a solid, which is convex as all that is closed here."""
    import numpy as np

    a, b, c = (solid.vertices[solid.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    behind = points @ normals.T < np.einsum("ij,ij->i", a, normals)
    return float(behind.all(axis=1).mean())
