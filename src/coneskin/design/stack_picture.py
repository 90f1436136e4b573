"""Pictures of how a sheet is built: its parts pulled apart in their order, and a section through its seam."""

from __future__ import annotations

import math
from typing import Any

from coneskin.geometry.drawing.outline import Outline

from .layout_picture import FOIL_COLOUR, INK_COLOUR
from .sheets.sheet_design import SheetDesign
from .workshop.build_figures import BuildFigures
from .workshop.guide_words import side_name

__all__ = ["draw_seam", "draw_stack"]

_ORDER = (1, 3, 2, 4, 6, 5, 7)  # numbers of the parts, from the link outwards
_FACES = ("#e8d9c0", "#55585e", FOIL_COLOUR, "#cfe3f1", FOIL_COLOUR, "#55585e", "#e8d9c0")


def draw_stack(figure: Any, design: SheetDesign) -> None:
    """Draw the seven parts above each other in their order on the link, all seen from outside.

    Args:
        figure: an empty figure of matplotlib.
        design: the sheet.
    """
    axes = figure.add_subplot()
    width = max(cut.bounds[2] - cut.bounds[0] for cut in design.cuts) * 1e3
    depth = max(cut.bounds[3] - cut.bounds[1] for cut in design.cuts) * 1e3
    squeeze, lean = 0.38, 0.30
    pitch = squeeze * depth * 0.62 + 0.05 * width
    right = 0.0
    stacked = sorted(design.cuts, key=lambda cut: _ORDER.index(cut.number))
    for level, cut in enumerate(stacked):
        lift = level * pitch

        def slanted(outline: Outline, lift: float = lift, mirrored: bool = cut.face == "inside") -> Any:
            flat = outline.flattened(2e-4)
            points = [((-x if mirrored else x) * 1e3, y * 1e3) for x, y, _ in flat.vertices]
            points += points[:1] if outline.closed else []
            return [x + lean * y for x, y in points], [squeeze * y + lift for _, y in points]

        for part in cut.parts:
            for stroke in part.strokes:
                if stroke.kind == "cut":
                    x, y = slanted(stroke.outline)
                    right = max(right, *x)
                    axes.fill(x, y, facecolor=_FACES[level], edgecolor=INK_COLOUR, lw=0.7, alpha=0.92)
            for stroke in part.strokes:
                colour = {"hole": "#b3007a", "score": "#2040c0", "fold": "#0a7d24"}.get(stroke.kind)
                if colour:
                    axes.plot(*slanted(stroke.outline), color=colour, lw=0.5)
    for level, cut in enumerate(stacked):  # beside the parts, however far the last of them lean
        label = f"{cut.number}  {cut.name}\n    {cut.material}\n    drawing: {cut.face} up"
        axes.text(right + 0.03 * width, level * pitch + 0.2 * squeeze * depth, label, fontsize=8, va="center")
    axes.annotate(
        "", (-0.62 * width, 6 * pitch), (-0.62 * width, 0), arrowprops={"arrowstyle": "->", "color": INK_COLOUR}
    )
    axes.text(
        -0.65 * width, 3 * pitch, "outwards, away from the link", rotation=90, ha="right", va="center", fontsize=9
    )
    axes.plot([-0.7 * width] * 2, [-0.1 * pitch, 6.5 * pitch], lw=0)  # arrows and text do not extend the axes
    axes.margins(0.04)
    axes.set_aspect("equal")
    axes.axis("off")


def draw_seam(figure: Any, design: SheetDesign, figures: BuildFigures) -> None:
    """Draw a section across the edges of a sheet, thickness enlarged, as it is seen from end 1.

    Args:
        figure: an empty figure of matplotlib.
        design: the sheet.
        figures: for building it.
    """
    axes = figure.add_subplot()
    layout, stack, plan = design.layout, design.options.stack, design.layout.plan
    side = design.place.frustum
    u = 0.5 * side.slant
    radius = side.radius_at(u)
    reach = 2.6 * (plan.margin + plan.electrode) * 1e3
    scale = 0.28 * reach / (stack.thickness * 1e3)  # how much thickness is enlarged
    open_gap = (2.0 * math.pi - side.wrap) * radius * 1e3
    shown_gap = min(open_gap, 0.5 * reach)
    heights = [stack.face_offset(i) * 1e3 * scale for i in range(6)]
    colours = ("#e8d9c0", "#55585e", "#cfe3f1", "#55585e", "#e8d9c0")
    axes.fill_between([-reach - shown_gap, reach], -0.12 * reach, 0.0, color="#c4c8ce")
    axes.text(0.0, -0.06 * reach, "link", ha="center", va="center", fontsize=9)
    arc = 1e3 * radius
    set_lower = 1e3 * plan.setback
    spans = {  # from the edge inwards [mm]: lower conductive, then upper conductive near D and near C
        0: (0.0, 0.0),
        1: _insets(layout.lower, layout.sheet.wrap, u, arc),
        2: (0.0, 0.0),
        3: _insets(layout.upper, layout.sheet.wrap, u, arc),
        4: (0.0, 0.0),
    }
    for index in range(5):
        first, last = spans[index]
        low, high = heights[index], heights[index + 1]
        high = max(high, low + 0.02 * reach)  # a thin sheet stays visible
        axes.fill_between([first, reach], low, high, facecolor=colours[index], edgecolor=INK_COLOUR, lw=0.5)
        axes.fill_between(
            [-reach - shown_gap, -shown_gap - last], low, high, facecolor=colours[index], edgecolor=INK_COLOUR, lw=0.5
        )
        at = 0.5 * (low + high) + {1: -0.02, 3: 0.02}.get(index, 0.0) * reach  # names of thin layers beside each other
        axes.text(reach * 1.03, at, _layer_name(design, index), fontsize=8, va="center")
    margin = (layout.field.phi1 - _turn(plan.electrode, side)) * arc
    width = _turn(plan.electrode, side) * arc
    thick = 0.012 * reach
    foils = [("D", margin, width, 1.0), ("C", -shown_gap - margin - width, width, 1.0)]
    if plan.wires.startswith("end"):  # of the electrode at the other end, on its way to the wires
        foils.append((f"lead of {plan.led_across}", *_lead(layout, arc), -1.0))
    for name, start, wide, way in foils:  # on the faces of the conductive sheets, towards each other
        face, beyond = (heights[2], heights[1]) if way > 0.0 else (heights[3], heights[4])
        axes.fill_between([start, start + wide], face, face + way * thick, color=FOIL_COLOUR)
        style = {"ha": "center", "va": "center", "fontsize": 9, "fontweight": "bold"}
        axes.text(start + 0.5 * wide, beyond - 0.04 * way * reach, name, **style)
    top = heights[5]
    if design.options.overlap:
        flap = 1e3 * design.options.overlap
        axes.plot([-shown_gap, flap], [top + 0.03 * reach] * 2, color="#a07840", lw=3)
        axes.text(0.5 * flap, top + 0.05 * reach, f"flap {flap:g} mm", ha="center", fontsize=8)
    blind1, blind2 = layout.active.phi1 * arc, (side.wrap - layout.active.phi2) * arc
    y = top + 0.14 * reach
    axes.plot([0.0], [y + 0.1 * reach], lw=0)  # arrows and text do not extend the axes
    arrow = {"arrowstyle": "<->", "color": "#b00020", "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (-shown_gap - blind2, y), (blind1, y), arrowprops=arrow)
    blind = blind1 + blind2 + open_gap
    axes.text(
        0.5 * (blind1 - shown_gap - blind2),
        y + 0.02 * reach,
        f"no touch is located here: {blind:.1f} mm, {math.degrees(blind / arc):.1f} deg",
        ha="center",
        fontsize=9,
        color="#b00020",
    )
    for x, text in ((0.6 * reach, "edge 0 (phi = 0)"), (-0.6 * reach - shown_gap, "edge of C (phi = wrap)")):
        axes.text(x, -0.16 * reach, text, ha="center", va="top", fontsize=9)
    note = f"seen from end 1, at the middle of the slant; thickness enlarged {scale:.1f} times"
    if open_gap > shown_gap:
        note += f"; {open_gap:.0f} mm of the link between the edges are left out"
    cable = f"setback {set_lower:g} mm, wires leave at {side_name(figures.cable.side)}"
    what = "its two edges, between which the link is bare" if not design.has_seam else "the seam"
    axes.set_title(f"{design.name}: section of {what}\n{note}; {cable}", fontsize=9)
    axes.axis("off")


def _turn(width: float, side: Any) -> float:
    return width / float(min(side.radius1, side.radius2))


def _insets(shape: Any, wrap: float, u: float, arc: float) -> tuple[float, float]:
    """Return how far a conductive sheet ends before edge 0 and before the other edge at a slant distance [mm]."""
    from coneskin.geometry.drawing.surface_shape import ShapeCorner

    corners = [corner for corner in shape if isinstance(corner, ShapeCorner)]
    at = [
        a.phi
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True)
        if min(a.u, b.u) <= u < max(a.u, b.u) and abs(a.phi - b.phi) < 1e-12
    ]
    return min(at) * arc, (wrap - max(at)) * arc


def _lead(layout: Any, arc: float) -> tuple[float, float]:
    """Return where the lead along edge 0 begins, and its width [mm]."""
    from coneskin.geometry.drawing.surface_shape import ShapeCorner

    foil = layout.foils[layout.plan.led_across]
    start, end, *_ = sorted({round(corner.phi, 9) for corner in foil if isinstance(corner, ShapeCorner)})
    return start * arc, (end - start) * arc


def _layer_name(design: SheetDesign, index: int) -> str:
    layer = design.options.stack.layers[index]
    return f"{layer.name}, {layer.thickness * 1e3:g} mm"
