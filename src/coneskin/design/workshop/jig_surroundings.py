"""What a jig has to keep clear of beside the link: sheets that are on it already."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from coneskin.design.sheets.sheet_design import SheetDesign
from coneskin.geometry.drawing.layer_stack import parallel_frustum
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.mesh import Mesh

__all__ = ["meets_neighbour", "with_sheets"]

Floats = NDArray[np.float64]

_COLUMN = math.radians(2.0)  # step around the axis
_RINGS = 9  # along a sheet


def with_sheets(mesh: Mesh, others: Sequence[SheetDesign]) -> Mesh:
    """Return the mesh of the link with the outer faces of the sheets that it bears already."""
    corners, faces = [mesh.vertices], [mesh.faces]
    for other in others:
        outer = parallel_frustum(other.place.frustum, other.options.stack.thickness)
        shift = -other.options.stack.thickness * outer.sin_half_angle
        phi = np.linspace(0.0, outer.wrap, max(8, math.ceil(outer.wrap / _COLUMN)) + 1)
        rings = [_ring(outer, u, phi, shift) for u in np.linspace(0.0, outer.slant, _RINGS)]
        start = sum(len(block) for block in corners)
        index = start + np.arange(len(rings) * len(phi)).reshape(len(rings), len(phi))
        a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
        corners.append(other.place.link_frustum.apply_all(np.concatenate(rings)))
        faces.append(np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3))
    if not others:
        return mesh
    return Mesh(np.concatenate(corners), np.concatenate(faces), mesh.source, mesh.unit)


def _ring(outer: Frustum, u: float, phi: Floats, shift: float) -> Floats:
    radius = outer.radius_at(float(u))
    return np.column_stack(
        [radius * np.cos(phi), radius * np.sin(phi), np.full(len(phi), u * outer.cos_half_angle + shift)]
    )


def meets_neighbour(design: SheetDesign, others: Sequence[SheetDesign], end: int) -> bool:
    """Tell whether another sheet begins where this one ends."""
    if end == 2:
        return design.next_joint is not None
    start = design.place.link_frustum.translation
    for other in others:
        if other.next_joint is not None and not other.above:
            far = other.place.link_frustum.apply((0.0, 0.0, other.place.frustum.height))
            if math.dist(far, start) < other.next_joint.inner + 1e-6:
                return True
    return False
