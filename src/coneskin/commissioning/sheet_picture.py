"""Flat sheet of a sensor in a picture: its outline, and the names of its electrodes beside it."""

from __future__ import annotations

import math
from typing import Any

from coneskin.geometry.frustum import Frustum

OUTLINE = "#222222"  #: colour of lines and letters
_SHEET_COLOR = "#9fd3c7"
_CURVE_POINTS = 61  # of a curve
_NAME_DISTANCE = 0.07  # of the slant, from the edge to the name of its electrode


def draw_sheet(axes: Any, cone: Frustum) -> None:
    """Draw the flat sheet as it is seen from outside the link, end 2 up."""
    along = [cone.wrap * k / (_CURVE_POINTS - 1) for k in range(_CURVE_POINTS)]
    rim = [*((0.0, phi) for phi in along), *((cone.slant, phi) for phi in reversed(along)), (0.0, 0.0)]
    xs, ys = zip(*(cone.flat_point(u, phi) for u, phi in rim), strict=True)
    axes.fill([1e3 * x for x in xs], [1e3 * y for y in ys], color=_SHEET_COLOR, alpha=0.5, lw=0)
    axes.plot([1e3 * x for x in xs], [1e3 * y for y in ys], color=OUTLINE, lw=1.2)
    side = _NAME_DISTANCE * cone.slant / max(cone.wrap * cone.radius_at(0.5 * cone.slant), _NAME_DISTANCE * cone.slant)
    for name, u, phi in (
        ("B (end 1)", -_NAME_DISTANCE * cone.slant, 0.5 * cone.wrap),
        ("A (end 2)", (1.0 + _NAME_DISTANCE) * cone.slant, 0.5 * cone.wrap),
        ("D", 0.5 * cone.slant, -side * cone.wrap),
        ("C", 0.5 * cone.slant, (1.0 + side) * cone.wrap),
    ):
        x, y = cone.flat_point(u, phi)
        axes.text(1e3 * x, 1e3 * y, name, rotation=_along(cone, u, phi) if len(name) > 1 else 0.0, **_TEXT_STYLE)
    axes.set_xlabel("flat x: around the link, seen from outside [mm]")
    axes.set_ylabel("flat y: along the link, towards end 2 [mm]")
    axes.set_aspect("equal")
    axes.margins(0.14)


_TEXT_STYLE = {"ha": "center", "va": "center", "fontsize": 10, "fontweight": "bold", "color": OUTLINE}


def _along(cone: Frustum, u: float, phi: float) -> float:
    """Return the direction of the rim at a place [deg], so that a name beside it does not lie across it."""
    step = 0.01 * cone.wrap
    (x0, y0), (x1, y1) = cone.flat_point(u, phi - step), cone.flat_point(u, phi + step)
    turned = math.degrees(math.atan2(y1 - y0, x1 - x0))
    return turned - 180.0 * round(turned / 180.0)
