"""Pictures of one sheet for the report, with the dimensions that a ruler measures.

They show its flat layout, its parts as they are cut and pulled apart in their order, and a section of its seam.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from coneskin.geometry.drawing.cut_sheet import LINE_COLOURS, CutSheet
from coneskin.geometry.drawing.outline import Outline, circle_outline
from coneskin.geometry.drawing.surface_shape import ShapeCorner, SurfaceShape, draw_shape, drawing_point
from coneskin.geometry.frustum import Frustum, unroll

from .sheets.sheet_design import SheetDesign
from .sheets.summary import polar_text
from .workshop.build_figures import WIRE_COLOURS, SheetWire, side_name

INK_COLOUR = "#222222"
FOIL_COLOUR = "#c27c0e"
_ACTIVE_COLOUR = "#9fd3c7"
_NAMED_ELECTRODES = {2: "CD", 3: "CD", 5: "AB", 6: "AB"}  # number of a part -> those on it
_NAME_BOX = {"facecolor": "white", "edgecolor": "none", "pad": 0.5}


def _xy(outline: Outline, tolerance: float = 5e-5) -> tuple[list[float], list[float]]:
    """Return the coordinates of an outline [mm], in lines within a tolerance [m]; a closed one ends where it begins."""
    flat = outline.flattened(tolerance)
    points = [(x * 1e3, y * 1e3) for x, y, _ in flat.vertices]
    points += points[:1] if outline.closed else []
    return [x for x, _ in points], [y for _, y in points]


def _at(cone: Frustum, u: float, phi: float) -> tuple[float, float]:
    """Return where a place of the surface is drawn [mm]."""
    x, y = drawing_point(cone, u, phi)
    return 1e3 * x, 1e3 * y


def draw_layout(figure: Any, design: SheetDesign, wires: Sequence[SheetWire]) -> None:
    """Draw the layout of a sheet on the cone of its upper conductive layer, with dimensions in mm, and its wires.

    Args:
        figure: an empty figure of matplotlib.
        design: the sheet.
        wires: from the tabs to the way of the cable.
    """
    axes = figure.add_subplot()
    layout = design.layout
    cone = design.cuts[4].surface
    box = layout.active
    active = tuple(
        ShapeCorner(u, p) for u, p in ((box.u1, box.phi1), (box.u1, box.phi2), (box.u2, box.phi2), (box.u2, box.phi1))
    )
    axes.fill(*_xy(draw_shape(cone, active)), color=_ACTIVE_COLOUR, alpha=0.6, lw=0, label="active area")
    axes.plot(*_xy(draw_shape(cone, layout.rim)), color=INK_COLOUR, lw=1.4, label="substrates and isolation")
    axes.plot(*_xy(draw_shape(cone, layout.upper)), color=INK_COLOUR, lw=0.8, ls="--", label="upper conductive layer")
    axes.plot(*_xy(draw_shape(cone, layout.lower)), color=INK_COLOUR, lw=0.8, ls=":", label="lower conductive layer")
    for name, foil in layout.foils.items():
        upper = name in "AB"
        label = {"A": "foil of A, B (upper sheet)", "C": "foil of C, D (lower sheet)"}.get(name)
        style = {"facecolor": FOIL_COLOUR, "alpha": 0.45 if upper else 0.8, "edgecolor": INK_COLOUR, "lw": 0.4}
        axes.fill(*_xy(draw_shape(cone, foil)), label=label, **style)
    for u, phi in layout.holes:
        hole = _xy(circle_outline(*drawing_point(cone, u, phi), 0.5 * layout.plan.hole))
        axes.fill(*hole, facecolor="white", edgecolor=INK_COLOUR, lw=0.8)
    if layout.holes:  # the legend would show an area as a rectangle
        label = f"registration holes, diameter {1e3 * layout.plan.hole:g} mm"
        axes.plot([], [], "o", mfc="white", mec=INK_COLOUR, mew=0.8, label=label)
    led = _draw_cable(axes, design, cone, wires)
    _dimensions(axes, design, cone, [y for _, y in led])
    axes.margins(0.08)
    axes.set_aspect("equal")
    axes.axis("off")
    figure.legend(loc="outside lower center", ncols=3, fontsize=8, frameon=False)


def _draw_cable(
    axes: Any, design: SheetDesign, cone: Frustum, wires: Sequence[SheetWire]
) -> Sequence[tuple[float, float]]:
    """Draw the wires as if the link were flat too, on the cable's side of the seam, and return its way there [mm]."""
    way = design.way
    ends = way.side.startswith("end")
    off = {"end1": (-1.0, 0.0), "end2": (1.0, 0.0), "edge0": (0.0, -1.0), "edge1": (0.0, 1.0)}[way.side]
    tab = 0.5 * design.layout.plan.tab
    turned = math.tau * round((float(way.surface[0, 1]) - 0.5 * cone.wrap) / math.tau)

    exit_u, exit_phi = float(way.surface[0, 0]), float(way.surface[0, 1]) - turned
    across, target = [], (exit_u, exit_phi)
    for wire in wires:
        colour = WIRE_COLOURS[wire.electrode]
        style = {"color": "#d4a800" if colour == "yellow" else colour, "lw": 1.2}
        beyond = wire.u + off[0] * tab, wire.phi + off[1] * tab / max(cone.radius_at(wire.u), 1e-3)
        target = (beyond[0], exit_phi) if ends else (exit_u, beyond[1])
        if ends and abs(target[1] - wire.phi) > math.pi:  # the shorter way goes across the seam, or around the link
            edge = cone.wrap if wire.phi > target[1] else 0.0
            axes.plot(
                *zip(_at(cone, wire.u, wire.phi), _at(cone, *beyond), _at(cone, beyond[0], edge), strict=True), **style
            )
            across.append(wire)
            continue
        run = [_at(cone, *(beyond[i] + (target[i] - beyond[i]) * k / 24.0 for i in range(2))) for k in range(25)]
        axes.plot(*zip(_at(cone, wire.u, wire.phi), *run, strict=True), **style)
    if across:  # beside each other there is no room for a word each
        names = ", ".join(wire.electrode for wire in across)
        word = "across\nthe seam" if design.has_seam else f"around the bare link\nin line with {side_name(way.side)}"
        x, y = _at(cone, across[0].u + 3.5 * off[0] * tab, sum(wire.phi for wire in across) / len(across))
        axes.text(x, y, f"{names}, {word}", fontsize=7, ha="center", va="center")
    led = [_at(cone, *target), *(_at(cone, float(u), float(phi) - turned) for u, phi in way.surface)]
    axes.plot(*zip(*led, strict=True), color=INK_COLOUR, lw=2.5)
    for index, marker, word, length in (
        (way.tie + 1, "s", "cable tie", way.tie_length),
        (-1, "D", "connector", way.connector_length),
    ):
        label = f"{word}, {1e3 * length:.0f} mm along the cable"
        axes.plot(*zip(led[index], strict=True), marker, color=INK_COLOUR, ms=6, ls="", label=label)
    return led


def _dimensions(axes: Any, design: SheetDesign, cone: Frustum, led: Sequence[float]) -> None:
    """Draw the dimensions of the flat pattern, clear of heights [mm] of its cable, and the names of the electrodes."""
    wrap, slant, layout = cone.wrap, cone.slant, design.layout
    lift = 0.06 * max(slant, 0.3 * wrap * max(cone.radius1, cone.radius2))
    style = {"ha": "center", "va": "center", "fontsize": 9, "color": INK_COLOUR}

    x0, y0, x1, y1 = draw_shape(cone, layout.rim).bounds
    far = 1.5e3 * lift
    tabs = 2e3 * design.layout.plan.tab
    low = y0 * 1e3 - tabs if layout.plan.wires == "end1" else y0 * 1e3
    high = y1 * 1e3 + tabs if layout.plan.wires == "end2" else y1 * 1e3
    bottom, right = min(low, *led) - far, x1 * 1e3 + far
    arrow = {"arrowstyle": "<->", "color": INK_COLOUR, "lw": 0.7, "shrinkA": 0, "shrinkB": 0}
    axes.plot(
        [x0 * 1e3, x1 * 1e3, right], [bottom - 0.6e3 * lift, bottom, bottom], lw=0.0
    )  # arrows do not extend the axes
    axes.annotate("", (x0 * 1e3, bottom), (x1 * 1e3, bottom), arrowprops=arrow)
    axes.text(500.0 * (x0 + x1), bottom, f"{(x1 - x0) * 1e3:.2f} mm", **style, backgroundcolor="white")
    axes.annotate("", (right, y0 * 1e3), (right, y1 * 1e3), arrowprops=arrow)
    axes.text(right, 500.0 * (y0 + y1), f"{(y1 - y0) * 1e3:.2f} mm", rotation=90, **style, backgroundcolor="white")
    flat = unroll(cone)
    lines = [
        f"{design.name}, upper conductive layer",
        f"slant {slant * 1e3:.3f} mm",
        f"arcs {flat.arc1 * 1e3:.3f} mm (end 1), {flat.arc2 * 1e3:.3f} mm (end 2)",
        polar_text(flat),
        f"active area {1e4 * layout.active.area(layout.sheet):.1f} cm2 ({layout.active_share:.0%})",
    ]
    axes.text(500.0 * (x0 + x1), max(high, *led) + 4.0, "\n".join(lines), **{**style, "va": "bottom"})
    for name in "ABCD":
        axes.text(
            *_at(cone, *layout.electrode_middle(name, 0.5 * slant, 0.42 * wrap)), name, **style, fontweight="bold"
        )


def _electrode_names(design: SheetDesign, cut: CutSheet) -> list[tuple[str, float, float]]:
    """Return the names of the electrodes on a part, and where they are in its drawing [mm]."""
    cone, way = cut.surface, -1.0 if cut.face == "inside" else 1.0
    found = []
    for name in _NAMED_ELECTRODES.get(cut.number, ""):
        x, y = _at(cone, *design.layout.electrode_middle(name, 0.5 * cone.slant, 0.42 * cone.wrap))
        found.append((name, way * x, y))
    return found


def draw_parts(figure: Any, design: SheetDesign) -> None:
    """Draw the seven cut sheets with their dimensions in mm, each with the face up that its drawing has up.

    Args:
        figure: an empty figure of matplotlib.
        design: the sheet.
    """
    grid = figure.subplots(4, 2)
    for axes in grid.flat:
        axes.axis("off")
    for axes, cut in zip(grid.flat, design.cuts, strict=False):
        for stroke in (stroke for part in cut.parts for stroke in part.strokes):
            axes.plot(*_xy(stroke.outline, 1e-4), color=[c / 255.0 for c in LINE_COLOURS[stroke.kind]], lw=0.7)
        for name, x, y in _electrode_names(design, cut):
            axes.text(x, y, name, fontsize=7, ha="center", va="center", bbox=_NAME_BOX)
        x0, y0, x1, y1 = (1e3 * value for value in cut.bounds)
        flat = unroll(cut.surface)
        title = f"{cut.number} {cut.name}, {cut.face} up: {x1 - x0:.1f} mm wide, {y1 - y0:.1f} mm deep\n"
        title += f"slant {1e3 * flat.slant:.1f} mm, arcs {1e3 * flat.arc1:.1f} mm (end 1), {1e3 * flat.arc2:.1f} mm"
        axes.set_title(title, fontsize=8)
        axes.set_aspect("equal")
    words = (
        f"sizes with tabs{' and flap' if design.options.overlap else ''}\nred cut, magenta hole, blue mark, green fold"
    )
    grid.flat[7].text(0.5, 0.5, words, ha="center", fontsize=9, transform=grid.flat[7].transAxes)


_LAYER_COLOURS = ("#e8d9c0", "#55585e", "#cfe3f1", "#55585e", "#e8d9c0")


def draw_seam(figure: Any, design: SheetDesign) -> None:
    """Draw a section across the two edges of a sheet at its middle, thickness enlarged, as it is seen from end 1.

    Args:
        figure: an empty figure of matplotlib.
        design: the sheet.
    """
    axes, layout, stack, wrap = figure.add_subplot(), design.layout, design.options.stack, design.place.frustum.wrap
    u = 0.5 * design.place.frustum.slant
    arc = 1e3 * design.place.frustum.radius_at(u)
    edges = layout.active.phi1 * arc, (wrap - layout.active.phi2) * arc
    reach, bare = 1.5 * max(edges), (math.tau - wrap) * arc
    gap = min(bare, 0.4 * reach)  # a wider one is drawn as wide
    heights = [0.3 * reach * stack.face_offset(index) / stack.thickness for index in range(6)]
    foil = 0.012 * reach

    def fill(shape: SurfaceShape, low: float, high: float, colour: str) -> list[float]:
        """Fill the shape where the section meets it, and return the middles of what is drawn."""
        corners = [corner for corner in shape if isinstance(corner, ShapeCorner)]
        pairs = [(a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True) if (a.u > u) != (b.u > u)]
        met = sorted(a.phi + (b.phi - a.phi) * (u - a.u) / (b.u - a.u) for a, b in pairs)
        drawn = []
        for first, last in zip(met[::2], met[1::2], strict=True):
            right = first * arc, min(last * arc, reach)
            left = max((first - wrap) * arc, -reach) - gap, (last - wrap) * arc - gap
            for start, end in (right, left):
                if start < end:
                    axes.fill_between([start, end], low, high, facecolor=colour, edgecolor=INK_COLOUR, lw=0.5)
                    drawn.append(0.5 * (start + end))
        return drawn

    axes.fill_between([-reach - gap, reach], -0.1 * reach, 0.0, color="#c4c8ce")
    axes.text(-0.5 * gap, -0.05 * reach, "link", ha="center", va="center", fontsize=9)
    for index, (layer, colour) in enumerate(zip(stack.layers, _LAYER_COLOURS, strict=True)):
        low, high = heights[index], max(heights[index + 1], heights[index] + foil)  # a thin sheet stays visible
        fill({1: layout.lower, 3: layout.upper}.get(index, layout.rim), low, high, colour)
        text = f"{layer.name}, {1e3 * layer.thickness:g} mm"
        axes.text(1.03 * reach, 0.5 * (low + high) + (index - 2) * foil, text, fontsize=8, va="center")
    for name, shape in layout.foils.items():
        low, beside = (heights[2], 0.5 * heights[1]) if name in "CD" else (heights[3] - foil, 0.5 * sum(heights[4:]))
        for x in fill(shape, low, low + foil, FOIL_COLOUR):
            text = name if name in "CD" else f"lead of {name}"
            style = {"ha": "center", "va": "center", "fontweight": "bold", "arrowprops": {"arrowstyle": "-", "lw": 0.7}}
            axes.annotate(text, (x, low + 0.5 * foil), (x, beside), **style)
    top, red = 1.15 * heights[5], "#b00020"
    axes.plot([0.0], [1.2 * top], lw=0)  # arrows and text do not extend the axes
    arrow = {"arrowstyle": "<->", "color": red, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (-gap - edges[1], top), (edges[0], top), arrowprops=arrow)
    blind = sum(edges) + bare
    text = f"no touch is located here: {blind:.1f} mm, {math.degrees(blind / arc):.1f} deg"
    axes.text(0.5 * (edges[0] - edges[1] - gap), 1.05 * top, text, ha="center", fontsize=9, color=red)
    for x, text, side in ((0.0, " edge 0", "left"), (-gap, "edge of C ", "right")):
        axes.plot([x, x], [-0.19 * reach, heights[5]], color=INK_COLOUR, lw=0.8)
        axes.text(x, -0.13 * reach, text, ha=side, va="top", fontsize=9)
    if bare > gap:
        axes.text(
            -0.5 * gap, 0.5 * heights[5], f"{bare:.0f} mm bare", rotation=90, ha="center", va="center", fontsize=8
        )
    if design.options.overlap:
        flap = 1e3 * design.options.overlap
        axes.plot([-gap, flap], [heights[5] + 2.0 * foil] * 2, color="#a07840", lw=3)
        axes.text(flap, heights[5] + 2.0 * foil, f" flap {flap:g} mm", fontsize=8, va="center")
    axes.margins(0.1)
    axes.axis("off")


_PART_ORDER = (1, 3, 2, 4, 6, 5, 7)  # numbers of the parts, from the link outwards
_FACE_COLORS = ("#e8d9c0", "#55585e", FOIL_COLOUR, "#cfe3f1", FOIL_COLOUR, "#55585e", "#e8d9c0")


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
    pitch = squeeze * depth + 0.02 * width  # so no part hides the one below
    right = 0.0
    stacked = sorted(design.cuts, key=lambda cut: _PART_ORDER.index(cut.number))
    for level, cut in enumerate(stacked):
        lift = level * pitch

        def slanted(outline: Outline, lift: float = lift, way: float = -1.0 if cut.face == "inside" else 1.0) -> Any:
            points = list(zip(*_xy(outline, 2e-4), strict=True))
            return [way * x + lean * y for x, y in points], [squeeze * y + lift for _, y in points]

        for part in cut.parts:
            for stroke in part.strokes:
                if stroke.kind == "cut":
                    x, y = slanted(stroke.outline)
                    right = max(right, *x)
                    axes.fill(x, y, facecolor=_FACE_COLORS[level], edgecolor=INK_COLOUR, lw=0.7, alpha=0.92)
            for stroke in part.strokes:
                colour = {"hole": "#b3007a", "score": "#2040c0", "fold": "#0a7d24"}.get(stroke.kind)
                if colour:
                    axes.plot(*slanted(stroke.outline), color=colour, lw=0.5)
        way = -1.0 if cut.face == "inside" else 1.0
        for name, x, y in _electrode_names(design, cut):
            axes.text(
                way * x + lean * y, squeeze * y + lift, name, fontsize=7, ha="center", va="center", bbox=_NAME_BOX
            )
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
