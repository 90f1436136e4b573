"""Shapes in surface coordinates: they follow lines and arcs, and stay off the apex."""

import pytest

from coneskin.core.errors import GeometryError
from coneskin.geometry.drawing.surface_shape import ShapeCorner, ShapeTab, draw_shape
from coneskin.geometry.frustum import Frustum

from ..sheet_cases import SHEETS


def test_shapes_must_follow_lines_and_arcs():
    with pytest.raises(GeometryError, match="must share u or phi"):
        draw_shape(SHEETS["widening"], (ShapeCorner(0.0, 0.0), ShapeCorner(0.1, 1.0), ShapeCorner(0.0, 1.0)))
    with pytest.raises(GeometryError, match="begin and end with a corner"):
        draw_shape(SHEETS["widening"], (ShapeTab(0.0, 1.0, 4e-3, 1e-2, "end1"), ShapeCorner(0.1, 1.0)))
    with pytest.raises(GeometryError, match="beyond the apex"):
        draw_shape(
            Frustum(0.0, 0.1, 0.1),
            (ShapeCorner(-0.01, 0.0), ShapeCorner(-0.01, 1.0), ShapeCorner(0.1, 1.0), ShapeCorner(0.1, 0.0)),
        )
