"""Text of a design for the studio's panel, as HTML: flat layers, sizes, forecast, warnings."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from html import escape

from coneskin.design.sheets import SheetDesign
from coneskin.geometry.drawing.cut_sheet import CutSheet
from coneskin.geometry.drawing.svg import to_svg
from coneskin.geometry.sector import unroll

__all__ = ["design_facts", "flat_drawing", "warning_list"]


def design_facts(designs: Sequence[SheetDesign]) -> str:
    """Return r1, r2, theta0, area and the forecast of each sheet."""
    parts = []
    for design in designs:
        sector, cone = unroll(design.place.frustum), design.place.frustum
        coarse = [max(item.along, item.around) for item in design.forecasts()]
        r1 = "infinite" if math.isinf(sector.r1) else f"{1e3 * sector.r1:.1f} mm"
        r2 = "infinite" if math.isinf(sector.r2) else f"{1e3 * sector.r2:.1f} mm"
        rows = (
            ("side", design.place.kind),
            ("r1, r2", f"{r1}, {r2}"),
            ("theta0", f"{math.degrees(sector.theta0):.2f} deg"),
            ("radii", f"{1e3 * cone.radius1:.2f} and {1e3 * cone.radius2:.2f} mm"),
            ("height, wrap", f"{1e3 * cone.height:.1f} mm, {math.degrees(cone.wrap):.1f} deg"),
            ("active area on the link", f"{1e4 * design.layout.active.area(cone):.1f} cm2"),
            ("one count", f"{1e3 * min(coarse):.3f} to {1e3 * max(coarse):.3f} mm"),
        )
        body = "".join(f"<tr><td>{escape(name)}</td><td>{escape(value)}</td></tr>" for name, value in rows)
        parts.append(f"<b>{escape(design.name)}</b><table style='font-size:12px'>{body}</table>")
    return f'<div id="coneskin-facts" style="font-size:13px;margin:4px 10px">{"".join(parts) or "no sheet"}</div>'


def flat_drawing(sheet: CutSheet) -> str:
    """Return a layer as it is cut, to fit the width of the panel."""
    drawn = to_svg((sheet,), sheet.name)
    drawn = re.sub(r"^<\?xml[^>]*\?>\s*", "", drawn)
    drawn = re.sub(
        r'width="[^"]*mm" height="[^"]*mm"', 'style="display:block;width:100%;max-height:230px"', drawn, count=1
    )
    return (
        '<div id="coneskin-flat" style="margin:4px 10px;background:white;border:1px solid #d1d5db">'
        f'<div style="font-size:12px;padding:2px 6px">{escape(sheet.name)}, {escape(sheet.material)}</div>{drawn}</div>'
    )


def warning_list(lines: Sequence[str]) -> str:
    """Return warnings, one a line."""
    rows = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return (
        f'<ul id="coneskin-warnings" style="font-size:12px;color:#b45309;margin:4px 10px;padding-left:16px">{rows}</ul>'
    )
