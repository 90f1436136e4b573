"""Strips over the seams: a narrow sheet on top of a full wrap, whose active area is what the seam leaves blind."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from coneskin.core.errors import GeometryError
from coneskin.geometry.drawing.electrode_layout import lay_out_sheet
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum

from .sheet_design import SheetDesign, design_sheets

__all__ = ["blind_angle", "cover_seams"]

_SEAM_TURN_SHARE = 0.9  # of a turn; from there on a wrap has a seam rather than a side without a sheet


def blind_angle(design: SheetDesign) -> float:
    """Return the angle about the axis in which a sheet locates no touch: its seam, and what it does not wrap [rad]."""
    return math.tau - (design.layout.active.phi2 - design.layout.active.phi1)


def cover_seams(designs: Sequence[SheetDesign]) -> tuple[SheetDesign, ...]:
    """Add a strip over the seam of every full wrap, where the options ask for it.

    A strip is a sensor of its own, with four wires that leave on the same side. It is glued on the outer face of its
    sheet; its electrodes D and C stand exactly where the active area of that sheet ends and begins.

    Args:
        designs: sheets, as ``design_sheets`` makes them.

    Returns:
        the sheets, followed by their strips.

    Raises:
        GeometryError: no sheet wraps a whole turn; a strip would meet itself on the other side of its sheet, or cannot
            be made.
    """
    strips: list[SheetDesign] = []
    for design in designs:
        if design.options.cover_seam and design.place.frustum.wrap > _SEAM_TURN_SHARE * math.tau:
            options = replace(
                design.options, wires=design.layout.plan.wires, seam_gap=0.0, overlap=0.0, cover_seam=False
            )
            number = len(designs) + len(strips) + 1
            place, offset = _strip_place(design)
            (strip,) = design_sheets([place], options, number)
            strips.append(replace(strip, above=design.name, seam_offset=offset))
    if not strips and any(design.options.cover_seam for design in designs):
        widest = max(design.place.frustum.wrap for design in designs)
        raise GeometryError(
            f"no sheet has a seam to cover: the widest wraps {math.degrees(widest):.0f} deg, and a seam needs at least "
            f"{math.degrees(_SEAM_TURN_SHARE * math.tau):.0f}; leave the covered seam out"
        )
    return (*designs, *strips)


def _strip_place(design: SheetDesign) -> tuple[PlacedFrustum, float]:
    """Return the side that the strip of a sheet covers, and the angle from its edge 0 to the middle of the seam."""
    stack, side = design.options.stack, design.place.frustum
    plan = design.layout.plan
    if plan.wires.startswith("edge"):
        raise GeometryError(
            f"{design.name}: its wires leave at the seam, where its strip lies: let them leave at an end"
        )
    above = design.place.parallel(stack.thickness)
    outer = above.frustum
    trial = Frustum(outer.radius1, outer.radius2, outer.height, 0.5 * math.tau)
    inside = lay_out_sheet(trial, plan).active
    before, after = inside.phi1, trial.wrap - inside.phi2
    wrap = before + blind_angle(design) + after
    if wrap > 0.5 * math.tau:
        raise GeometryError(
            f"{design.name}: a strip over its seam would have to wrap {math.degrees(wrap):.0f} deg, at most 180: make "
            "electrodes and margins narrower"
        )
    start = design.layout.active.phi2 - before
    return above.part(0.0, outer.slant, start, start + wrap), 0.5 * (side.wrap + math.tau) - start
