"""Layout of a sheet on one of its layers, at the azimuths that the layer's own bends give its rulings."""

from __future__ import annotations

from dataclasses import replace

from coneskin.geometry.placed_frustum import PlacedFrustum

from .electrode_layout import SheetLayout, SurfaceRectangle
from .surface_shape import SurfaceShape

__all__ = ["layout_above"]


def layout_above(layout: SheetLayout, place: PlacedFrustum, height: float) -> SheetLayout:
    """Return a layout for a layer at a height [m] above the link, so that its features lie on the same normals.

    The layers of a cone grow evenly and share their azimuths. Around a link of another section a layer grows at the
    bends only, and each feature moves in the flat pattern by what the bends before it have grown.
    """
    if not place.bends:
        return layout

    def above(phi: float) -> float:
        return place.azimuth_above(height, phi)

    def shape(outline: SurfaceShape) -> SurfaceShape:
        return tuple(replace(element, phi=above(element.phi)) for element in outline)

    def box(area: SurfaceRectangle) -> SurfaceRectangle:
        return replace(area, phi1=above(area.phi1), phi2=above(area.phi2))

    return replace(
        layout,
        field=box(layout.field),
        active=box(layout.active),
        rim=shape(layout.rim),
        upper=shape(layout.upper),
        lower=shape(layout.lower),
        foils={name: shape(outline) for name, outline in layout.foils.items()},
        marks={name: tuple(shape(outline) for outline in outlines) for name, outlines in layout.marks.items()},
        folds={name: shape(outline) for name, outline in layout.folds.items()},
        holes=tuple((u, above(phi)) for u, phi in layout.holes),
    )
