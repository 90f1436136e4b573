"""Warning of a sheet that hardly feels touches, because its rims and electrodes take most of it."""

from __future__ import annotations

import math
from dataclasses import replace

from coneskin.core.errors import GeometryError
from coneskin.geometry.drawing.electrode_layout import ElectrodePlan, lay_out_sheet

from .sheet_design import SheetDesign

__all__ = ["LEAST_ACTIVE_SHARE", "small_active_area"]

LEAST_ACTIVE_SHARE = 0.25  #: of a sheet; where less is active, it costs four wires and feels touches hardly anywhere


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
    narrow = _halved(layout.plan)
    try:
        share = lay_out_sheet(side, narrow).active_share
    except GeometryError:  # a width of the user's own that cannot be halved
        return text
    return (
        f"{text}; --margin-mm {1e3 * narrow.margin:g} --electrode-mm {1e3 * narrow.electrode:g} "
        f"--lead-mm {1e3 * narrow.lead:g} --hole-mm {1e3 * narrow.hole:g} would leave {share:.0%}"
    )


def _halved(plan: ElectrodePlan) -> ElectrodePlan:
    """Return a plan with margins and electrodes half as wide; holes do not fit there."""
    margin, electrode = max(0.5 * plan.margin, plan.setback), 0.5 * plan.electrode
    return replace(plan, margin=margin, electrode=electrode, lead=min(plan.lead, electrode), hole=0.0)
