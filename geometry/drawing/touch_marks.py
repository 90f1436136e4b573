"""Numbered marks on the cover of a sensor: where a person touches it to calibrate it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum

from .electrode_layout import SheetLayout, SurfaceRectangle
from .layer_stack import LayerStack
from .part_labels import PartLabel
from .surface_shape import ShapeCorner, SurfaceShape, drawing_point

_FIRST_SHARE, _LAST_SHARE = 0.1, 0.9  # of the slant and of the wrap; beyond, a touch is cut off by the rim
_MARKS_PER_SIDE = 3  # marks along and around
_READ_LAYER = 3  # the upper conductive one, on which touches are located
_ARM_LENGTH = 2e-3  # m; half of a line of the cross
_NUMBER_HEIGHT = 2e-3  # m; height of a mark's number


def mark_parts(side: int = _MARKS_PER_SIDE) -> Iterator[tuple[float, float]]:
    """Yield the places of a grid, so many a side, as parts of both; each row from the end of the one before."""
    parts = [_FIRST_SHARE + (_LAST_SHARE - _FIRST_SHARE) * k / (side - 1) for k in range(side)]
    for row, along in enumerate(parts):
        for around in parts if row % 2 == 0 else reversed(parts):
            yield along, around


def marks_on_link(layout: SheetLayout, stack: LayerStack, place: PlacedFrustum) -> tuple[tuple[float, float], ...]:
    """Return slant distance [m] and azimuth [rad] on the link of each mark, in the order of their numbers."""
    height, field = stack.middle(_READ_LAYER), layout.field
    read = place.parallel(height)
    first, last = (place.azimuth_above(height, phi) for phi in (field.phi1, field.phi2))
    return tuple(
        (
            field.u1 + along * (field.u2 - field.u1),
            read.azimuth_above(-height, first + around * (last - first)),
        )
        for along, around in mark_parts()
    )


@dataclass(frozen=True, slots=True)
class CoverMarks:
    """Marks where they are drawn on the cover: on the normals of their places on the upper conductive layer.

    On a cone both have the same azimuth. A bend grows with the height and a plane does not, so on another section the
    cover has other shares of its arc there.

    Attributes:
        layout: of the sheet, on its cover.
        surface: the cone for which the cover is cut.
        places: slant distance [m] and azimuth [rad] of each mark on the cover, in the order of the numbers.
    """

    layout: SheetLayout
    surface: Frustum
    places: Sequence[tuple[float, float]]

    @property
    def clear(self) -> SurfaceRectangle:
        """Part of the cover between the first two rows of marks, free for text."""
        low, high = self.places[0][0] + 2.0 * _ARM_LENGTH, self.places[_MARKS_PER_SIDE][0] - 2.0 * _ARM_LENGTH
        return SurfaceRectangle(low, high, self.layout.active.phi1, self.layout.active.phi2)

    def lines(self) -> Iterator[SurfaceShape]:
        """Yield the two lines of each mark's cross."""
        for u, phi in self.places:
            turn = _ARM_LENGTH / self.surface.radius_at(u)
            yield ShapeCorner(u - _ARM_LENGTH, phi), ShapeCorner(u + _ARM_LENGTH, phi)
            yield ShapeCorner(u, phi - turn), ShapeCorner(u, phi + turn)

    def labels(self) -> Iterator[PartLabel]:
        """Yield the number of each mark, beside its cross."""
        surface = self.surface
        for number, (u, phi) in enumerate(self.places, 1):
            turn = 1.5 * (_ARM_LENGTH + _NUMBER_HEIGHT) / surface.radius_at(u)
            x, y = drawing_point(surface, u + 0.5 * _NUMBER_HEIGHT, phi + turn)
            yield PartLabel(str(number), x, y, _NUMBER_HEIGHT, -(phi - 0.5 * surface.wrap) * surface.sin_half_angle)
