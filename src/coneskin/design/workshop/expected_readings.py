"""Readings that a sheet should give once it is built: ohms for a multimeter, and the frame of the untouched sensor."""

from __future__ import annotations

import tomllib
from typing import NamedTuple

from coneskin.core.errors import GeometryError
from coneskin.design.sheets.sheet_design import SheetDesign
from coneskin.design.sheets.summary import sensor_toml
from coneskin.geometry.drawing.electrode_layout import SurfaceRectangle
from coneskin.geometry.drawing.surface_shape import ShapeCorner, SurfaceShape
from coneskin.geometry.frustum import Frustum
from coneskin.scene.tables.sensor_table import build_sensor
from coneskin.skin.diagnosis.measurements import MEASURED, expected_counts
from coneskin.skin.sensor import sheet_resistances

__all__ = ["PairReading", "expected_frame", "pair_readings"]

_LOWER, _UPPER = 1, 3  # indices of the conductive layers in the stack


class PairReading(NamedTuple):
    """Reading of a multimeter between the two electrodes of a conductive sheet."""

    pair: str  #: "A-B" or "C-D"
    ohms: float  #: of the sheet as it is drawn, without leads
    squares: float  #: the reading over this is the sheet resistance that the sensor file takes [1]
    sheet_ohms: float  #: of the material, for which the reading holds [ohm per square]


def pair_readings(design: SheetDesign) -> tuple[PairReading, PairReading]:
    """Return what a multimeter should read on a sheet, A-B first.

    The sensor's model ends at the inner edges of all four electrodes. The sheets themselves reach further, up to their
    setback from the rim, and what lies there conducts as well: so both read less than the model, and the sheet
    resistance that the model needs is worked out from the reading.
    """
    layout, field = design.layout, design.layout.field
    phi1, phi2 = _span(layout.upper, 0.5 * (field.u1 + field.u2), along=False)
    u1, u2 = _span(layout.lower, 0.5 * (field.phi1 + field.phi2), along=True)
    upper = _part(design, _UPPER, SurfaceRectangle(field.u1, field.u2, phi1, phi2))
    lower = _part(design, _LOWER, SurfaceRectangle(u1, u2, field.phi1, field.phi2))
    radial, angular = sheet_resistances(design.active.frustum, 1.0, 1.0)
    upper_ohms, lower_ohms = (sheet.ohms for sheet in design.conductive)
    return (
        PairReading("A-B", sheet_resistances(upper, upper_ohms, 1.0)[0], radial, upper_ohms),
        PairReading("C-D", sheet_resistances(lower, 1.0, lower_ohms)[1], angular, lower_ohms),
    )


def expected_frame(design: SheetDesign, index: int, frame: str = "mesh") -> dict[str, int]:
    """Return the counts of the untouched sensor, by field of a frame, as ``coneskin monitor`` expects them.

    Args:
        design: the sheet.
        index: sensor number in the wire format.
        frame: frame of the pose, in words.

    Raises:
        GeometryError: a scene would refuse the sensor.
    """
    problems: list[str] = []
    built = build_sensor(tomllib.loads(sensor_toml(design, index, frame)), "sensor.toml", problems)
    if built is None or problems:
        raise GeometryError("; ".join(problems) + " (set by the options of the group electronics)")
    return dict(zip(MEASURED, expected_counts(built[0]), strict=True))


def _part(design: SheetDesign, index: int, box: SurfaceRectangle) -> Frustum:
    """Return a part of a layer as a cone of its own, on the middle surface of the wrapped layer."""
    stack = design.options.stack
    height = stack.face_offset(index) + 0.5 * stack.layers[index].thickness
    side = design.place.parallel(height).frustum
    rise = (box.u2 - box.u1) * side.cos_half_angle
    return Frustum(side.radius_at(box.u1), side.radius_at(box.u2), rise, box.phi2 - box.phi1)


def _span(shape: SurfaceShape, at: float, along: bool) -> tuple[float, float]:
    """Return where a line across a shape enters and leaves it.

    Args:
        shape: closed, of corners.
        at: phi of a line along the sheet [rad], or u of a line around it [m].
        along: True for a line along the sheet.
    """
    corners = [corner for corner in shape if isinstance(corner, ShapeCorner)]
    found = []
    for one, two in zip(corners, corners[1:] + corners[:1], strict=True):
        (a, p), (b, q) = ((one.phi, one.u), (two.phi, two.u)) if along else ((one.u, one.phi), (two.u, two.phi))
        if min(a, b) <= at < max(a, b):
            found.append(0.5 * (p + q))
    return min(found), max(found)
