"""Run-time map from the surface coordinates (u, phi) of a sheet to points of the mesh: a cone and a grid of heights.

A cone alone misses the mesh by the residual of the fit. Heights above the side, along its normal and interpolated
between the nodes of a grid, bring the error under 0.1 mm on smooth links for a few multiplications; no ray is cast
while the arm moves. A sheet spans holes and narrow grooves, so the grid does too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from coneskin.core.arrays import Floats, frozen
from coneskin.core.errors import GeometryError

from .mesh import Mesh
from .placed_frustum import PlacedFrustum
from .pose import Vector
from .ray_casting import RayCaster


def bridge_holes(height: Floats, step: float, arc: float, max_bridge: float, around: bool = True) -> Floats:
    """Fill holes and grooves that are narrower than a bridge, in length or in arc, up to their rims.

    This is a grey-scale closing by a rectangle.

    Args:
        height: not negative, 0 where there is no surface, shape (k, p).
        step: distance between rows [m].
        arc: distance between columns [m].
        max_bridge: side of the square that must fit into a hole for the hole to remain [m].
        around: True where the last column is followed by the first.

    Returns:
        the heights with the holes filled, shape (k, p).
    """
    from scipy.ndimage import maximum_filter, minimum_filter

    rows, columns = height.shape
    # a window of all rows already reaches the highest on either side of a row: a longer one changes nothing
    tall = min(2 * int(min(max_bridge / step, 2.0 * rows) / 2.0) + 1, rows + 1 - rows % 2)
    wide = min(2 * int(min(max_bridge / arc, columns) / 2.0) + 1, columns - 1 + columns % 2)
    if tall == wide == 1:
        return height
    padded = np.pad(height, ((tall, tall), (0, 0)))
    padded = np.pad(padded, ((0, 0), (wide, wide)), mode="wrap" if around else "constant")
    closed = minimum_filter(maximum_filter(padded, (tall, wide)), (tall, wide))
    return np.asarray(closed[tall : tall + rows, wide : wide + columns])


@dataclass(frozen=True, slots=True, eq=False)
class DisplacementMap:
    """A placed frustum and the heights of the mesh over it.

    Attributes:
        heights: above the side, along its outward normal [m]; rows at equal steps of u from 0 to slant, columns at
            equal steps of phi from 0 to wrap, shape (k, p) with k and p at least 2. Of a full wrap the last column
            repeats the first.

    Raises:
        GeometryError: fewer than two rows or columns, or a full wrap that does not close.
    """

    placed: PlacedFrustum
    heights: Floats
    _rows: list[list[float]] = field(init=False, repr=False)  # plain floats, for the live loop

    def __post_init__(self) -> None:
        heights = frozen(self.heights, (None, None), "heights")
        if min(heights.shape) < 2:
            raise GeometryError(f"heights must have at least 2 rows and 2 columns, got {heights.shape}")
        if self.placed.frustum.wrap == math.tau and not np.array_equal(heights[:, 0], heights[:, -1]):
            raise GeometryError("heights of a full wrap must end with the column they begin with")
        object.__setattr__(self, "heights", heights)
        object.__setattr__(self, "_rows", heights.tolist())

    def point(self, u: float, phi: float) -> Vector:
        """Return the point of the mesh at (u [m], phi [rad]), in the link's frame [m].

        Beyond the ends and the edges of the sheet the cone continues with the height at the rim.
        """
        (x, y, z), (nx, ny, nz), height = self.placed.point(u, phi), self.placed.normal(phi), self._height(u, phi)
        return x + height * nx, y + height * ny, z + height * nz

    def _height(self, u: float, phi: float) -> float:
        f, rows = self.placed.frustum, self._rows
        last_row, last_column = len(rows) - 2, len(rows[0]) - 2
        x, y = u * (last_row + 1) / f.slant, phi * (last_column + 1) / f.wrap
        if f.wrap == math.tau:
            y %= last_column + 1
        i, j = min(max(int(x), 0), last_row), min(max(int(y), 0), last_column)
        x, y = min(max(x, 0.0), last_row + 1) - i, min(max(y, 0.0), last_column + 1) - j
        near, far = rows[i], rows[i + 1]
        a, b = near[j], far[j]
        a += (near[j + 1] - a) * y
        return a + (b + (far[j + 1] - b) * y - a) * x


def measure_displacement(
    mesh: Mesh,
    placed: PlacedFrustum,
    along: int = 128,
    around: int = 256,
    limit: float = 0.001,
    max_bridge: float = 0.010,
    rays: RayCaster | None = None,
) -> DisplacementMap:
    """Measure the heights of a mesh over a sheet, by rays along the sheet's normals.

    Args:
        along: steps of u.
        around: steps of phi.
        limit: depth beyond which a node lies in a hole [m]; the tolerance of the fit. Heights are clamped to it.
        max_bridge: width of the widest hole that is spanned at the height of its rim [m]; wider ones are clamped.
        rays: a ray caster of the same mesh; None to make one.

    Raises:
        GeometryError: fewer than one step, or no part of the mesh lies near the sheet.
    """
    if along < 1 or around < 1:
        raise GeometryError(f"along and around must be at least 1 step, got {along} and {around}")
    if not limit > 0.0:
        raise GeometryError(f"limit must be above 0 m, got {limit!r}")
    f = placed.frustum
    full = f.wrap == math.tau
    u = np.linspace(0.0, f.slant, along + 1)
    phi = np.linspace(0.0, f.wrap, around + 1)[: around if full else around + 1]
    # A mesh may end at the rim itself, so the rays of the nodes there start slightly inside.
    inset = 1e-6 * f.slant
    height = heights_by_ray(rays or RayCaster(mesh), placed, np.clip(u, inset, f.slant - inset), phi, limit)
    if not (np.abs(height) <= limit).any():
        raise GeometryError(
            f"{mesh.source}: no part of it lies within {limit * 1e3:g} mm of the sheet: is it another link's, or is "
            "the sheet placed elsewhere?"
        )
    # the closing needs values that grow outwards from 0, where there is no surface
    depth = 4.0 * limit + 0.05 * max(f.radius1, f.radius2)
    shown = np.where(height > -depth, height + depth, 0.0)
    arc = 0.5 * (f.radius1 + f.radius2) * f.wrap / around
    closed = bridge_holes(shown, f.slant / along, arc, max_bridge, full) - depth
    height = np.clip(np.where(height < -limit, closed, height), -limit, limit)
    return DisplacementMap(placed, np.concatenate([height, height[:, :1]], axis=1) if full else height)


def heights_by_ray(rays: RayCaster, placed: PlacedFrustum, u: Floats, phi: Floats, limit: float) -> Floats:
    """Return the heights of the mesh over the nodes u x phi of a sheet [m], shape (k, p); -inf without a surface.

    The rays start ten limits (at least 5 mm) above the side, so that parts further out do not block them.
    """
    us, phis = np.meshgrid(u, phi, indexing="ij")
    points, normals = placed.place(us.ravel(), phis.ravel())
    lift = max(10.0 * limit, 0.005)
    return np.asarray((lift - rays.cast(points + lift * normals, -normals)[0]).reshape(us.shape))
