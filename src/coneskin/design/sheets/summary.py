"""Summary of a design as plain data, for --json and design.json, and the text of the sensor file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from coneskin.geometry.developable import Developable
from coneskin.geometry.drawing.cut_sheet import CutSheet
from coneskin.geometry.drawing.electrode_layout import (
    LEAST_ACTIVE_SHARE,
    SurfaceRectangle,
    best_layout,
)
from coneskin.geometry.drawing.touch_marks import mark_parts
from coneskin.geometry.frustum import Frustum, Sector, unroll
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.scene.tables.sensor_keys import CONE_KEYS
from coneskin.skin.electronics import shunt_ohms

from .sheet_design import SheetDesign


def design_summary(design: SheetDesign) -> dict[str, Any]:
    """Return the figures of one sheet as plain data; lengths in mm, angles in degrees, None for infinite."""
    layout, stack, active = design.layout, design.options.stack, design.active.frustum
    data: dict[str, Any] = {
        "name": design.name,
        "link_cone": _shape(design.place.frustum) | _pose(design.place),
        "active_cone": _shape(design.active.frustum) | _pose(design.active),
        **_bends(design),
        "active_share": round(layout.active_share, 6),
        "active_area_cm2": _round(1e4 * layout.active.area(design.place.frustum)),
        "active_patch": _patch(layout.active),
        "field_patch": _patch(layout.field),
        "touch_marks": [
            {
                "number": number,
                "u_mm": _round(1e3 * u * active.slant),
                "phi_deg": _round(math.degrees(phi * active.wrap)),
            }
            for number, (u, phi) in enumerate(mark_parts(), 1)  # from the inner edges of B and D
        ],
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
        "thickness_mm": _round(1e3 * stack.thickness),
        "ignored_gap_mm": {
            layer.name: _round(1e3 * stack.ignored_gap(design.place, i)) for i, layer in enumerate(stack.layers)
        },
        "electronics": _electronics(design),
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
    if design.above:
        data["above"] = design.above
    data["gaps_mm"] = {other: _round(1e3 * gap) for other, gap in design.gaps.items()}
    if design.fit is not None:
        fit = design.fit
        data["fit"] = {
            "max_deviation_mm": _round(1e3 * fit.max_deviation),
            "rms_deviation_mm": _round(1e3 * fit.rms_deviation),
            "facet_height_mm": _round(1e3 * fit.facet_height),
            "length_share": round(fit.length_share, 4),
            "area_share": round(fit.area_share, 4),
            "touch_share": round(fit.touch_share, 4),
            "bridged_share": round(fit.bridged_share, 4),
            "bridged_depth_mm": _round(1e3 * fit.bridged_depth),
        }
    return data


def material_rows(designs: tuple[SheetDesign, ...]) -> list[dict[str, Any]]:
    """Return the list of materials, a row for each cut sheet."""
    return [
        {"sheet": design.name, "layer": cut.slug, "material": cut.material, **_sizes(cut)}
        for design in designs
        for cut in design.cuts
    ]


def sensor_toml(design: SheetDesign, index: int, frame: str) -> str:
    """Return the text of the sensor file that a scene refers to, for the decoder and the guard.

    Args:
        design: the sheet.
        index: sensor number in the wire format.
        frame: frame of the pose, in words.
    """
    cone, stack, parts = design.active.frustum, design.options.stack, design.electronics
    pose = _pose(design.active)
    height = _round(design.place.frustum.height * 1e3)
    shape = "\n".join(f"{key.name} = {key.in_file_unit(getattr(cone, key.plain))!r}" for key in CONE_KEYS)
    cover = sum(layer.thickness for layer in stack.layers[4:]) + 0.5 * stack.layers[3].thickness
    bends = "".join(
        f"{key} = {[math.degrees(getattr(bend, name)) for bend in design.active.bends]!r}\n"
        for key, name in (("bend_wrap_deg", "width"), ("bend_turn_deg", "turn"))
        if design.active.bends
    )
    if bends:
        lift = f"bend_lift_mm = {1e3 * design.active.lift!r}  # above the side whose rulings meet in a point\n"
        what = "# the link is not round: shares of the wrap, and the angle by which each turns the normal"
        bends = f"\n{what}\n{bends}{lift}"
    radius1, radius2 = _round(design.place.frustum.radius1 * 1e3), _round(design.place.frustum.radius2 * 1e3)
    return f"""\
# Sensor of {design.name}, written by `coneskin design`. A scene refers to it; keys in the scene take precedence.
#
# The cone is the ACTIVE area: the upper conductive layer between the inner edges of the electrodes B (end 1),
# A (end 2), D (phi = 0) and C (phi = wrap). The whole sheet covers the link from radius {radius1} to {radius2} mm over
# a height of {height} mm. The outer face lies {_round(cover * 1e3)} mm above this cone.
{shape}
{bends}
# pose of its end 1, p_link = R(rpy) p_active + xyz; frame: {frame}
xyz_mm = {pose["xyz_mm"]!r}
rpy_deg = {pose["rpy_deg"]!r}

id = {index}
name = "{design.name}"

# B and C at the supply, A and D at ground (paper, eq. 13 and 21)
radial_positive = "B"
angular_positive = "C"

# chosen for these sheets, as far as it was not given (report.md): build them, or write here what yours have
supply_v = {parts.supply_volts!r}
adc_v = {parts.adc_volts!r}
adc_bits = {parts.adc_bits}
pulldown_ohm = {parts.pulldown_ohms!r}
current_full_scale_ma = {_round(1e3 * parts.current_full_scale)!r}
lead_ohm = {[_round(ohms) for ohms in parts.lead_ohms]!r}  # wire and switch of A, B, C, D

# of the conductive layers, per square: measure yours, because the normal drive currents follow from them
upper_sheet_ohm = {design.conductive[0].ohms!r}
lower_sheet_ohm = {design.conductive[1].ohms!r}
"""


def _bends(design: SheetDesign) -> dict[str, Any]:
    """Return how a side is bent that is not round, and what its layers then miss of a sector."""
    place = design.place
    if not isinstance(place, Developable):
        return {}
    stack = design.options.stack
    height = max(stack.offset(index) for index in range(5))
    return {
        "bends": [
            {"width_deg": _round(math.degrees(bend.width), 6), "turn_deg": _round(math.degrees(bend.turn), 6)}
            for bend in place.bends
        ],
        "bend_lift_mm": _round(1e3 * place.lift, 6),
        "sector_error_mm": _round(1e3 * place.mismatch(height)),
        "closing_gap_mm": _round(1e3 * place.closing_gap) if place.frustum.wrap > 2.0 * math.pi - 1e-9 else None,
    }


def _electronics(design: SheetDesign) -> dict[str, Any]:
    """Return the conductive sheets and the parts, given or chosen, and the drive currents that follow."""
    parts, (upper, lower), (radial, angular) = design.electronics, design.conductive, design.drive_currents
    return {
        "upper_sheet": upper.name,
        "lower_sheet": lower.name,
        "upper_sheet_ohm": upper.ohms,
        "lower_sheet_ohm": lower.ohms,
        "supply_v": parts.supply_volts,
        "adc_v": parts.adc_volts,
        "adc_bits": parts.adc_bits,
        "pulldown_ohm": parts.pulldown_ohms,
        "shunt_ohm": _round(shunt_ohms(parts)),
        "current_full_scale_ma": _round(1e3 * parts.current_full_scale),
        "radial_ma": _round(1e3 * radial),
        "angular_ma": _round(1e3 * angular),
    }


def _patch(box: SurfaceRectangle) -> dict[str, float]:
    return {
        "u1_mm": _round(1e3 * box.u1),
        "u2_mm": _round(1e3 * box.u2),
        "phi1_deg": _round(math.degrees(box.phi1)),
        "phi2_deg": _round(math.degrees(box.phi2)),
    }


def _shape(cone: Frustum) -> dict[str, Any]:
    flat = unroll(cone)
    return {
        **{key.name: _round(key.in_file_unit(getattr(cone, key.plain))) for key in CONE_KEYS},
        "slant_mm": _round(1e3 * cone.slant),
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
    """Return a value rounded for readers; drawings and cones keep all digits, and no sheet is placed so exactly."""
    return round(value, digits) + 0.0


_FLAT_RADIUS = 1e4  # m; an arc of such a radius is a straight line within a micrometre
_MAX_COMPASS = 5.0  # m; no compass draws a larger radius: how far the arc rises says more


def sector_text(cone: Frustum) -> str:
    """Return what a flat pattern is."""
    flat = unroll(cone)
    if flat.r1 > _FLAT_RADIUS:
        return f"rectangle {flat.arc1 * 1e3:.3f} x {flat.slant * 1e3:.3f} mm"
    return polar_text(flat)


def polar_text(flat: Sector) -> str:
    """Return radii and angle of a sector; of a nearly straight one how far its arcs rise above their chords."""
    if flat.r1 > _FLAT_RADIUS:
        return "a rectangle"
    theta = f"theta0 {math.degrees(flat.theta0):.4f} deg"
    if max(flat.r1, flat.r2) < _MAX_COMPASS:
        return f"r1 {flat.r1 * 1e3:.3f} mm, r2 {flat.r2 * 1e3:.3f} mm, {theta}"
    rises = [2.0 * radius * math.sin(0.25 * flat.theta0) ** 2 for radius in (flat.r1, flat.r2)]
    return (
        f"r1 {flat.r1:.3f} m, r2 {flat.r2:.3f} m, {theta}: the arcs rise by {rises[0] * 1e3:.3f} and "
        f"{rises[1] * 1e3:.3f} mm"
    )


def small_active_area(design: SheetDesign) -> str:
    """Return a sentence that says how little of a sheet is active, and what would leave more; empty where it is enough.

    The strip over a seam is meant to be narrow, and nothing is said of it.
    """
    layout, side = design.layout, design.layout.sheet
    if design.above or layout.active_share >= LEAST_ACTIVE_SHARE:
        return ""
    active = layout.active
    text = (
        f"only {layout.active_share:.1%} of {design.name} is active, {1e4 * active.area(side):.1f} of "
        f"{1e4 * side.area:.1f} cm2: rims and electrodes leave {1e3 * (active.u2 - active.u1):.1f} of "
        f"{1e3 * side.slant:.1f} mm along and {math.degrees(active.phi2 - active.phi1):.0f} of "
        f"{math.degrees(side.wrap):.0f} deg around"
    )
    share = best_layout(side).active_share
    if share <= layout.active_share:
        return text
    return f"{text}; without a table of electrodes their widths are chosen, and leave {share:.0%}"


def sheet_folder(designs: tuple[SheetDesign, ...], index: int) -> Path:
    """Return the folder of a sheet, relative to the output folder; a single sheet has no folder of its own."""
    return Path() if len(designs) == 1 else Path(f"sheet-{index + 1}")
