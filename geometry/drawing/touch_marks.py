"""Numbered marks on the cover of a sensor: where a person touches it to calibrate it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from coneskin.geometry.frustum import Frustum

from .electrode_layout import SheetLayout, SurfaceRectangle
from .part_labels import PartLabel
from .surface_shape import ShapeCorner, SurfaceShape, drawing_point

__all__ = ["TouchMark", "between_marks", "mark_labels", "mark_lines", "mark_parts", "touch_marks"]

_FIRST, _LAST = 0.1, 0.9  # of the slant and of the wrap; beyond, a touch is cut off by the rim
_PRINTED = 3  # marks along and around
_ARM = 2e-3  # m; half of a line of the cross
_NUMBER = 2e-3  # m; height of a mark's number


class TouchMark(NamedTuple):
    """A mark, by its place between the inner edges of the electrodes; a sensor's places are measured from there."""

    number: int
    u: float  #: slant distance from end 1 [m]
    phi: float  #: azimuth from electrode D [rad]


def mark_parts(side: int) -> Iterator[tuple[float, float]]:
    """Yield the places of a grid as parts along and around, row by row from end 1, each from the end of the one before.

    Args:
        side: marks along, and around.
    """
    parts = [_FIRST + (_LAST - _FIRST) * k / (side - 1) for k in range(side)]
    for row, along in enumerate(parts):
        for around in parts if row % 2 == 0 else reversed(parts):
            yield along, around


def touch_marks(layout: SheetLayout) -> tuple[TouchMark, ...]:
    """Return the marks that are drawn on the cover of a sheet."""
    field = layout.field
    return tuple(
        TouchMark(number, along * (field.u2 - field.u1), around * (field.phi2 - field.phi1))
        for number, (along, around) in enumerate(mark_parts(_PRINTED), 1)
    )


def between_marks(layout: SheetLayout) -> SurfaceRectangle:
    """Return the part of a sheet between the first two rows of marks, free for text."""
    field, marks = layout.field, touch_marks(layout)
    low, high = field.u1 + marks[0].u + 2.0 * _ARM, field.u1 + marks[_PRINTED].u - 2.0 * _ARM
    return SurfaceRectangle(low, high, layout.active.phi1, layout.active.phi2)


def mark_lines(layout: SheetLayout) -> Iterator[SurfaceShape]:
    """Yield the two lines of each mark's cross."""
    for _, u, phi in touch_marks(layout):
        u, phi = layout.field.u1 + u, layout.field.phi1 + phi
        turn = _ARM / layout.sheet.radius_at(u)
        yield ShapeCorner(u - _ARM, phi), ShapeCorner(u + _ARM, phi)
        yield ShapeCorner(u, phi - turn), ShapeCorner(u, phi + turn)


def mark_labels(layout: SheetLayout, surface: Frustum) -> Iterator[PartLabel]:
    """Yield the number of each mark, beside its cross.

    Args:
        layout: of the sheet.
        surface: the cone for which the cover is cut.
    """
    for number, u, phi in touch_marks(layout):
        u, phi = layout.field.u1 + u, layout.field.phi1 + phi
        turn = 1.5 * (_ARM + _NUMBER) / surface.radius_at(u)
        x, y = drawing_point(surface, u + 0.5 * _NUMBER, phi + turn)
        yield PartLabel(str(number), x, y, _NUMBER, -(phi - 0.5 * surface.wrap) * surface.sin_half_angle)
