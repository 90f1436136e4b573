"""Dimension drawings of the parts of a sheet: every part as it is cut, with what a ruler measures on it."""

from __future__ import annotations

import math
from typing import Any

from coneskin.geometry.drawing.cut_sheet import LINE_COLOURS
from coneskin.geometry.sector import unroll

from .layout_picture import INK_COLOUR
from .sheets.sector_text import polar_text
from .sheets.sheet_design import SheetDesign
from .workshop.guide_words import side_name

__all__ = ["draw_parts"]


def draw_parts(figure: Any, design: SheetDesign) -> None:
    """Draw all seven cut sheets of a sensor with their dimensions in mm.

    Args:
        figure: an empty figure of matplotlib.
        design: the sheet.
    """
    grid = figure.subplots(4, 2)
    for axes, cut in zip(grid.flat, design.cuts, strict=False):
        for part in cut.parts:
            for stroke in part.strokes:
                flat = stroke.outline.flattened(1e-4)
                xy = [(1e3 * x, 1e3 * y) for x, y, _ in flat.vertices]
                xy += xy[:1] if stroke.outline.closed else []
                colour = tuple(value / 255.0 for value in LINE_COLOURS[stroke.kind])
                axes.plot([x for x, _ in xy], [y for _, y in xy], color=colour, lw=0.7)
        x0, y0, x1, y1 = (1e3 * value for value in cut.bounds)
        off = 0.05 * max(x1 - x0, y1 - y0)
        arrow = {"arrowstyle": "<->", "color": INK_COLOUR, "lw": 0.6, "shrinkA": 0, "shrinkB": 0}
        text = {"textcoords": "offset points", "fontsize": 7, "color": INK_COLOUR}
        axes.annotate("", (x0, y0 - off), (x1, y0 - off), arrowprops=arrow)
        middle = (0.5 * (x0 + x1), y0 - off)
        axes.annotate(f"{x1 - x0:.2f}", middle, xytext=(0, -2), ha="center", va="top", **text)
        axes.annotate("", (x1 + off, y0), (x1 + off, y1), arrowprops=arrow)
        middle = (x1 + off, 0.5 * (y0 + y1))
        axes.annotate(f"{y1 - y0:.2f}", middle, xytext=(3, 0), ha="left", va="center", rotation=90, **text)
        sector = unroll(cut.surface)
        lines = f"{cut.number} {cut.name}, {cut.face} up\nslant {1e3 * sector.slant:.2f}, arcs "
        lines += f"{1e3 * sector.arc1:.2f} (end 1), {1e3 * sector.arc2:.2f} (end 2)"
        lines += f"\n{polar_text(sector)}"
        axes.set_title(lines, fontsize=7)
        axes.plot([x0 - off, x1 + 2 * off], [y0 - 2 * off, y1 + off], lw=0)  # arrows do not extend the axes
        axes.set_aspect("equal")
        axes.axis("off")
    plan = design.layout.plan
    axes = grid.flat[7]
    axes.axis("off")
    holes = [
        f"hole {n}: u {1e3 * u:.2f} mm, phi {math.degrees(phi):.3f} deg"
        for n, (u, phi) in enumerate(design.layout.holes, 1)
    ]
    words = [
        "all dimensions in mm, at the neutral surface",
        "red cut, magenta hole, blue mark, green fold",
        f"holes of {1e3 * plan.hole:g} mm" if holes else "no holes",
        *holes,
        f"electrodes {1e3 * plan.electrode:g} mm, margin {1e3 * plan.margin:g} mm",
        f"tabs {1e3 * plan.lead:g} x {1e3 * plan.tab:g} mm at {side_name(plan.wires)}",
    ]
    axes.text(0.0, 0.95, "\n".join(words), va="top", fontsize=8, transform=axes.transAxes)
