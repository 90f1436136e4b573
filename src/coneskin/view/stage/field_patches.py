"""Patches of a sheet: flat pieces, each of one colour, that show the potential on it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from coneskin.geometry.pose import Pose

from .rotation import quaternion

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from .sheet_surface import SheetSurface

__all__ = ["SQUARE", "FieldPatches", "field_patches", "linear", "potential_colours"]

#: vertices and faces of a patch before it is placed and scaled
SQUARE = (
    ((-0.5, -0.5, 0.0), (0.5, -0.5, 0.0), (0.5, 0.5, 0.0), (-0.5, 0.5, 0.0)),
    ((0, 1, 2), (0, 2, 3)),
)
_ROWS, _COLUMNS = 32, 48
_ABOVE = 0.0035  # m above the surface that is sensed: over the sheet as it is drawn
_OVERLAP = 1.03  # of a patch's size, so that no gap is seen between two
_BANDS = 20  # colours: the edges between them are lines of equal potential
_LOW_TO_HIGH = ((49, 18, 92), (44, 96, 160), (38, 152, 138), (122, 198, 80), (250, 224, 60))


class FieldPatches(NamedTuple):
    """Patches of a sheet, row by row along u.

    Attributes:
        u: slant distances of their middles [m], shape (n,).
        phi: azimuths of them [rad], shape (n,).
        positions: of the middles in the frame of the link [m], shape (n, 3).
        rotations: w, x, y, z; a patch's x is around, its y along, shape (n, 4).
        sizes: around, along, and 1 [m], shape (n, 3).
    """

    u: NDArray[np.float64]
    phi: NDArray[np.float64]
    positions: NDArray[np.float32]
    rotations: NDArray[np.float32]
    sizes: NDArray[np.float32]


def field_patches(sheet: SheetSurface) -> FieldPatches:
    """Return the patches of a sheet."""
    import numpy as np

    placed = sheet.item.frustum
    cone = placed.frustum
    edges_u, edges_phi = np.linspace(0.0, cone.slant, _ROWS + 1), np.linspace(0.0, cone.wrap, _COLUMNS + 1)
    rows, columns = np.meshgrid(
        0.5 * (edges_u[:-1] + edges_u[1:]), 0.5 * (edges_phi[:-1] + edges_phi[1:]), indexing="ij"
    )
    u, phi = rows.ravel(), columns.ravel()
    points, normals = placed.place(u, phi)
    if sheet.item.surface is not None:
        points = np.array([sheet.item.surface.point(a, b) for a, b in zip(u.tolist(), phi.tolist(), strict=True)])
    points = points + _ABOVE * normals
    step = 1e-4 * cone.slant
    along = placed.place(u + step, phi)[0] - placed.place(u - step, phi)[0]
    along /= np.linalg.norm(along, axis=1)[:, None]
    around = np.cross(along, normals)
    turned = []
    for (x0, x1, x2), (y0, y1, y2), (z0, z1, z2) in zip(around.tolist(), along.tolist(), normals.tolist(), strict=True):
        turned.append(quaternion(Pose.trusted(((x0, y0, z0), (x1, y1, z1), (x2, y2, z2)), (0.0, 0.0, 0.0))))
    radius = cone.radius1 + (cone.radius2 - cone.radius1) * u / cone.slant + _ABOVE
    widths = 2.0 * radius * math.tan(0.5 * cone.wrap / _COLUMNS) * _OVERLAP
    sizes = np.column_stack([widths, np.full_like(u, _OVERLAP * cone.slant / _ROWS), np.ones_like(u)])
    return FieldPatches(u, phi, points.astype("float32"), np.array(turned, dtype="float32"), sizes.astype("float32"))


def potential_colours(volts: NDArray[np.float64], low: float, high: float) -> NDArray[np.uint8]:
    """Return the colour of each potential, in bands from low to high.

    Args:
        volts: potentials [V], shape (n,).
        low: that has the first colour [V].
        high: that has the last one.
    """
    import numpy as np

    share = np.clip((volts - low) / max(high - low, 1e-12), 0.0, 1.0)
    band = np.minimum(np.floor(share * _BANDS), _BANDS - 1) / (_BANDS - 1)
    knots = np.linspace(0.0, 1.0, len(_LOW_TO_HIGH))
    columns = [np.interp(band, knots, [colour[k] for colour in _LOW_TO_HIGH]) for k in range(3)]
    return np.column_stack(columns).round().astype(np.uint8)


def linear(colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return colours of a screen (sRGB, IEC 61966-2-1) as light, which is how viser 1.1 takes those of patches."""
    import numpy as np

    share = colours / 255.0
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return (255.0 * light).round().astype(np.uint8)
