"""A design as plain data: what --json prints, what design.json holds, and the sensor file."""

from __future__ import annotations

import math
from typing import Any

from .design import SheetDesign
from .geometry.cut_sheet import CutSheet
from .geometry.electrodes import Patch
from .geometry.frustum import Frustum
from .geometry.placed import PlacedFrustum
from .geometry.sector import unroll

__all__ = ["materials", "sensor_toml", "summary"]


def summary(design: SheetDesign) -> dict[str, Any]:
    """Everything about one sheet that a program may want; lengths in mm, angles in degrees, None for infinite."""
    layout, stack = design.layout, design.choices.stack
    data: dict[str, Any] = {
        "name": design.name,
        "link_cone": _shape(design.place.frustum) | _pose(design.place),
        "active_cone": _shape(design.active.frustum) | _pose(design.active),
        "active_share": round(layout.active_share, 6),
        "active_area_cm2": _round(1e4 * layout.active.area(design.place.frustum)),
        "active_patch": _patch(layout.active),
        "field_patch": _patch(layout.field),
        "layers": [
            {
                "number": cut.number,
                "name": cut.name,
                "material": cut.material,
                "face_up": cut.face,
                **_shape(cut.surface),
                **_sizes(cut),
            }
            for cut in design.cuts
        ],
        "ignored_gap_mm": {
            layer.name: _round(1e3 * stack.ignored_gap(design.place.frustum, i)) for i, layer in enumerate(stack.layers)
        },
        "forecast": [
            {
                "u_mm": _round(1e3 * step.u),
                "along_mm": _round(1e3 * step.along, 6),
                "around_mm": _round(1e3 * step.around, 6),
                "azimuth_deg": _round(math.degrees(step.azimuth), 6),
                "theta_deg": _round(math.degrees(step.theta), 6),
            }
            for step in design.forecasts()
        ],
    }
    if design.next_seam is not None:
        seam = design.next_seam
        data["gap_to_next_mm"] = {"inner": _round(1e3 * seam.inner), "outer": _round(1e3 * seam.outer)}
    if design.fit is not None:
        fit = design.fit
        data["fit"] = {
            "worst_mm": _round(1e3 * fit.worst),
            "rms_mm": _round(1e3 * fit.rms),
            "length_share": round(fit.length_share, 4),
            "area_share": round(fit.area_share, 4),
            "bridged_share": round(fit.bridged, 4),
            "deepest_bridged_mm": _round(1e3 * fit.deepest),
        }
    return data


def materials(designs: tuple[SheetDesign, ...]) -> list[dict[str, Any]]:
    """What to buy and cut, a row for each part of each sheet."""
    return [
        {"sheet": design.name, "layer": cut.slug, "material": cut.material, **_sizes(cut)}
        for design in designs
        for cut in design.cuts
    ]


def sensor_toml(design: SheetDesign, index: int, frame: str) -> str:
    """The sensor file that a scene names: what the decode and the guard need to know of the sheet.

    Args:
        design: the sheet.
        index: its number on the wire.
        frame: what its pose refers to, in words.
    """
    cone, choices = design.active.frustum, design.choices
    pose, stack, converter = _pose(design.active), choices.stack, choices.converter
    height = _round(design.place.frustum.height * 1e3)
    cover = sum(layer.thickness for layer in stack.layers[4:]) + 0.5 * stack.layers[3].thickness
    radius1, radius2 = _shape(design.place.frustum)["radius1_mm"], _shape(design.place.frustum)["radius2_mm"]
    return f"""\
# Sensor of {design.name}, written by `coneskin design`. A scene names this file; a key in the scene wins over it.
#
# The cone is the ACTIVE area: the upper conductive layer between the inner edges of the electrodes B (end 1),
# A (end 2), D (phi = 0) and C (phi = wrap). It is not the sheet: that covers radius {radius1} to {radius2} mm and
# {height} mm of height on the link. The outer face is {_round(cover * 1e3)} mm further out.
radius1_mm = {cone.radius1 * 1e3!r}
radius2_mm = {cone.radius2 * 1e3!r}
height_mm = {cone.height * 1e3!r}
wrap_deg = {math.degrees(cone.wrap)!r}

# where its end 1 is, p_link = R(rpy) p_active + xyz, in the frame of {frame}
xyz_mm = {pose["xyz_mm"]!r}
rpy_deg = {pose["rpy_deg"]!r}

id = {index}
name = "{design.name}"

# B and C at the supply, A and D at ground (paper, eq. 13 and 21)
radial_positive = "B"
angular_positive = "C"

# what the accuracy forecast was made for: check against your electronics
supply_v = {converter.supply_volts!r}
adc_v = {converter.range_volts!r}
adc_bits = {converter.bits}
current_full_scale_ma = {1e3 * choices.current_full_scale!r}

# of the conductive layers: measure yours, the normal drive currents follow from them
upper_sheet_ohm = {choices.upper_sheet_ohms!r}
lower_sheet_ohm = {choices.lower_sheet_ohms!r}
"""


def _patch(box: Patch) -> dict[str, float]:
    return {
        "u1_mm": _round(1e3 * box.u1),
        "u2_mm": _round(1e3 * box.u2),
        "phi1_deg": _round(math.degrees(box.phi1)),
        "phi2_deg": _round(math.degrees(box.phi2)),
    }


def _shape(cone: Frustum) -> dict[str, Any]:
    flat = unroll(cone)
    return {
        "radius1_mm": _round(1e3 * cone.radius1),
        "radius2_mm": _round(1e3 * cone.radius2),
        "height_mm": _round(1e3 * cone.height),
        "slant_mm": _round(1e3 * cone.slant),
        "wrap_deg": _round(math.degrees(cone.wrap)),
        "half_angle_deg": _round(math.degrees(cone.half_angle), 6),
        "r1_mm": _round(1e3 * flat.r1) if math.isfinite(flat.r1) else None,
        "r2_mm": _round(1e3 * flat.r2) if math.isfinite(flat.r2) else None,
        "theta0_deg": _round(math.degrees(flat.theta0), 6),
    }


def _pose(placed: PlacedFrustum) -> dict[str, list[float]]:
    pose = placed.link_frustum
    return {
        "xyz_mm": [_round(1e3 * value) for value in pose.translation],
        "rpy_deg": [_round(math.degrees(value)) for value in pose.rpy],
    }


def _sizes(cut: CutSheet) -> dict[str, float]:
    x0, y0, x1, y1 = cut.bounds
    return {
        "area_cm2": _round(1e4 * sum(part.area for part in cut.parts)),
        "width_mm": _round(1e3 * (x1 - x0)),
        "depth_mm": _round(1e3 * (y1 - y0)),
        "cut_length_mm": _round(1e3 * sum(part.cut_length for part in cut.parts)),
    }


def _round(value: float, digits: int = 4) -> float:
    """Rounded for people; the drawings keep every digit, and so does the shape in the sensor file.

    The pose does not: a tenth of a micrometre, or of a thousandth of a degree, is less than anybody can place a sheet.
    """
    return round(value, digits) + 0.0
