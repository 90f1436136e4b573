"""Bands of deviation: the side of a sheet in patches of one colour each, by how far the mesh is above or below it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from coneskin.geometry.displacement_map import heights_by_ray

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from coneskin.geometry.placed_frustum import PlacedFrustum
    from coneskin.geometry.ray_casting import RayCaster

__all__ = ["BAND_COLOURS", "HOLE_COLOUR", "DeviationBand", "deviation_bands"]

#: of a deviation, from the mesh far below the side, over on it, to far above
BAND_COLOURS = (
    (33, 102, 172),
    (103, 169, 207),
    (176, 214, 205),
    (164, 205, 150),
    (236, 200, 140),
    (239, 138, 98),
    (178, 24, 43),
)
HOLE_COLOUR = (90, 90, 90)  #: of what spans a hole
_ROWS, _COLUMNS = 40, 96
_ABOVE = 0.0004  # m; so that the mesh does not shine through


class DeviationBand(NamedTuple):
    """Patches of a side with about the same deviation.

    Attributes:
        low: from this height of the mesh above the side on [m]; -inf for the lowest.
        high: up to this one; inf for the highest. Both NaN where the side spans a hole.
        colour: red, green and blue, 0 to 255.
        vertices: of the patches [m], shape (n, 3).
        faces: indices of vertices, shape (m, 3).
    """

    low: float
    high: float
    colour: tuple[int, int, int]
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]


def deviation_bands(rays: RayCaster, placed: PlacedFrustum, tolerance: float) -> list[DeviationBand]:
    """Return the bands of a sheet; one without a patch is left out.

    Args:
        rays: of the mesh.
        placed: the sheet.
        tolerance: deviation of the strongest colours; what lies deeper is a hole [m].
    """
    import numpy as np

    side = placed.frustum
    edges_u, edges_phi = np.linspace(0.0, side.slant, _ROWS + 1), np.linspace(0.0, side.wrap, _COLUMNS + 1)
    u, phi = 0.5 * (edges_u[:-1] + edges_u[1:]), 0.5 * (edges_phi[:-1] + edges_phi[1:])
    heights = heights_by_ray(rays, placed, u, phi, tolerance)
    points, normals = placed.place(edges_u[:, None], edges_phi[None, :])
    corners = (points + _ABOVE * normals).reshape(-1, 3)
    index = np.arange(len(corners)).reshape(_ROWS + 1, _COLUMNS + 1)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    limits = tolerance * np.linspace(-1.0, 1.0, len(BAND_COLOURS) + 1)
    hole = ~np.isfinite(heights) | (heights < -tolerance)
    band = np.clip(np.searchsorted(limits, heights) - 1, 0, len(BAND_COLOURS) - 1)
    band[hole] = len(BAND_COLOURS)
    found = []
    for number, colour in enumerate((*BAND_COLOURS, HOLE_COLOUR)):
        here = band == number
        if not here.any():
            continue
        low, high = (np.nan, np.nan) if number == len(BAND_COLOURS) else (limits[number], limits[number + 1])
        faces = np.concatenate(
            [np.column_stack([a[here], b[here], c[here]]), np.column_stack([a[here], c[here], d[here]])]
        )
        used, again = np.unique(faces, return_inverse=True)
        found.append(DeviationBand(float(low), float(high), colour, corners[used], again.reshape(faces.shape)))
    return found
