"""Words and numbers that the sections of a build guide share."""

from __future__ import annotations

import math

from coneskin.design.sheets.sheet_design import SheetDesign

from .build_figures import BuildFigures

__all__ = ["ROLLING", "SETTING", "SPREAD", "TAPE", "WIRE_COLOURS", "in_mm", "in_ohms", "side_name", "tie_place"]

#: of the insulation, by electrode
WIRE_COLOURS = {"A": "red", "B": "black", "C": "yellow", "D": "green"}
SPREAD = 0.2  # of the expected ohms: conductive sheets vary by as much
TAPE = "double-sided tape"
#: the roller is that of the peel test of ASTM D3330: 2 kg on a width of 45 mm
ROLLING = (
    "a hand roller with a rubber face, pressed as hard as a weight of 2 kg presses (test it on kitchen scales), once "
    "forth and once back, from the middle outwards, at the speed of a slow step of the hand (5 mm in a second)."
)
#: makers of silicone adhesives test their bonds after three days; their strength grows until then
SETTING = "Leave it for 72 hours at room temperature (18 to 25 degrees Celsius) before anybody presses it hard."


def in_ohms(ohms: float) -> str:
    """Return a resistance with its unit."""
    return f"{ohms / 1e3:.3g} kohm" if ohms >= 1e3 else f"{ohms:.3g} ohm"


def in_mm(metres: float) -> str:
    """Return a length with its unit."""
    return f"{1e3 * metres:.1f} mm"


def side_name(side: str) -> str:
    """Return the name of a side of a sheet as the guide has it."""
    return {"end1": "end 1", "end2": "end 2", "edge0": "edge 0", "edge1": "the edge of C"}[side]


def tie_place(design: SheetDesign, figures: BuildFigures) -> str:
    """Return where along its side the cable leaves a sheet."""
    cable, side = figures.cable, design.place.frustum
    if cable.side.startswith("edge"):
        return f"{in_mm(cable.u)} from end 1"
    radius = side.radius_at(cable.u)
    arc = cable.phi * radius
    if arc > math.pi * radius:
        return f"{in_mm(2.0 * math.pi * radius - arc)} from edge 0, against the direction of the wrap"
    return f"{in_mm(arc)} from edge 0, in the direction of the wrap"
