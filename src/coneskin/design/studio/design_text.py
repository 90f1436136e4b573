"""Drawings of a design for the studio: its panel as HTML, bands of deviation, electrodes on the link."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from html import escape
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coneskin.core.arrays import Floats, Ints
from coneskin.design.sheets.sheet_design import SheetDesign
from coneskin.design.workshop.build_figures import side_name
from coneskin.geometry.displacement_map import heights_by_ray
from coneskin.geometry.drawing.cut_sheet import LINE_COLOURS, CutSheet
from coneskin.geometry.drawing.part_labels import PartLabel
from coneskin.geometry.drawing.svg import to_svg
from coneskin.geometry.frustum import unroll
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.ray_casting import RayCaster

#: of a deviation, from the mesh far below the side, over on it, to far above
_BAND_COLOURS = (
    (33, 102, 172),
    (103, 169, 207),
    (176, 214, 205),
    (164, 205, 150),
    (236, 200, 140),
    (239, 138, 98),
    (178, 24, 43),
)
_HOLE_COLOUR = (90, 90, 90)  #: of what spans a hole
_GRID_ROWS, _GRID_COLUMNS = 40, 96
_PATCH_LIFT = 0.0004  # m; so that the mesh does not shine through


class _DeviationBand(NamedTuple):
    """Patches of a side with about the same deviation.

    Attributes:
        low: from this height of the mesh above the side on [m]; -inf for the lowest.
        high: up to this one; inf for the highest. Both NaN where the side spans a hole.
        colour: red, green and blue, 0 to 255.
        vertices: of the patches [m], shape (n, 3).
        faces: indices of vertices, shape (m, 3).
    """

    low: float
    high: float
    colour: tuple[int, int, int]
    vertices: Floats
    faces: Ints


def deviation_bands(rays: RayCaster, placed: PlacedFrustum, tolerance: float) -> list[_DeviationBand]:
    """Return the bands of a sheet; one without a patch is left out.

    Args:
        rays: of the mesh.
        placed: the sheet.
        tolerance: deviation of the strongest colours; what lies deeper is a hole [m].
    """
    side = placed.frustum
    edges_u, edges_phi = np.linspace(0.0, side.slant, _GRID_ROWS + 1), np.linspace(0.0, side.wrap, _GRID_COLUMNS + 1)
    u, phi = 0.5 * (edges_u[:-1] + edges_u[1:]), 0.5 * (edges_phi[:-1] + edges_phi[1:])
    heights = heights_by_ray(rays, placed, u, phi, tolerance)
    points, normals = placed.place(edges_u[:, None], edges_phi[None, :])
    corners = (points + _PATCH_LIFT * normals).reshape(-1, 3)
    index = np.arange(len(corners)).reshape(_GRID_ROWS + 1, _GRID_COLUMNS + 1)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    limits = tolerance * np.linspace(-1.0, 1.0, len(_BAND_COLOURS) + 1)
    hole = ~np.isfinite(heights) | (heights < -tolerance)
    band = np.clip(np.searchsorted(limits, heights) - 1, 0, len(_BAND_COLOURS) - 1)
    band[hole] = len(_BAND_COLOURS)
    found = []
    for number, colour in enumerate((*_BAND_COLOURS, _HOLE_COLOUR)):
        here = band == number
        if not here.any():
            continue
        low, high = (np.nan, np.nan) if number == len(_BAND_COLOURS) else (limits[number], limits[number + 1])
        faces = np.concatenate(
            [np.column_stack([a[here], b[here], c[here]]), np.column_stack([a[here], c[here], d[here]])]
        )
        used, again = np.unique(faces, return_inverse=True)
        found.append(_DeviationBand(float(low), float(high), colour, corners[used], again.reshape(faces.shape)))
    return found


ELECTRODE_COLOURS = {"A": (220, 38, 38), "B": (217, 119, 6), "C": (37, 99, 235), "D": (13, 148, 136)}
_LINE_ABOVE = 0.001  # m above the side
_LETTER_ABOVE = 0.006  # m: in front of its line from wherever the line is seen
_LINE_PIECES = {"A": 89, "B": 89, "C": 19, "D": 19}
_LETTER_PLACES = {"A": (0.1, 0.43, 0.76), "B": (0.1, 0.43, 0.76), "C": (0.5,), "D": (0.5,)}  # shares of the line


class _ElectrodeMark(NamedTuple):
    """Mark of one electrode.

    Attributes:
        letter: its name, A to D.
        segments: of its middle line [m], shape (n, 2, 3).
        letters: where its letter stands [m], shape (k, 3); of a ring more than once, so that one is in front.
    """

    letter: str
    segments: NDArray[np.float32]
    letters: Floats


def electrode_marks(design: SheetDesign) -> list[_ElectrodeMark]:
    """Return the marks of a sheet's electrodes, on the side that it covers."""
    side, box, half = design.place.frustum, design.layout.field, 0.5 * design.layout.plan.electrode
    turn = half / min(side.radius1, side.radius2)
    found = []
    for letter, pieces in _LINE_PIECES.items():
        share = np.linspace(0.0, 1.0, pieces + 1)
        stands = np.array(_LETTER_PLACES[letter])

        def place(at: Floats, above: float, letter: str = letter) -> Floats:
            u = {"A": box.u2 + half, "B": box.u1 - half}.get(letter, box.u1 + at * (box.u2 - box.u1))
            phi = {"C": box.phi2 + turn, "D": box.phi1 - turn}.get(letter, box.phi1 + at * (box.phi2 - box.phi1))
            points, normals = design.place.place(*np.broadcast_arrays(u, phi + 0.0 * at))
            return np.asarray(points + above * normals)

        line = place(share, _LINE_ABOVE).astype("float32")
        found.append(_ElectrodeMark(letter, np.stack([line[:-1], line[1:]], axis=1), place(stands, _LETTER_ABOVE)))
    return found


_PANEL_WIDTH = 340.0  # pixels; of the panel's width, for a drawing
_MAX_DRAWING_HEIGHT = 230.0  # pixels of a drawing
_MIN_LETTER_HEIGHT = 9.0  # pixels of capitals; what is cut has smaller ones, to fit on its part
_STROKE_CLASSES = {"cut": "cut", "hole": "hole", "score": "mark", "fold": "fold"}


def legend(tolerance: float) -> str:
    """Return what the colours on the link mean.

    Args:
        tolerance: deviation of the strongest colours [m].
    """
    share = 100.0 / len(_BAND_COLOURS)
    bands = "".join(f'<span style="width:{share:.3f}%;background:{_css(colour)}"></span>' for colour in _BAND_COLOURS)
    ends = f"{-1e3 * tolerance:g} mm: the link is below", f"it stands out: +{1e3 * tolerance:g} mm"
    chips = [(_HOLE_COLOUR, "a hole is spanned"), *((ELECTRODE_COLOURS[name], name) for name in ELECTRODE_COLOURS)]
    return (
        '<div id="coneskin-legend" style="font-size:12px;margin:4px 10px">'
        f'<div style="display:flex;height:12px">{bands}</div>'
        f'<div style="display:flex;justify-content:space-between"><span>{ends[0]}</span><span>{ends[1]}</span></div>'
        f"<div>{_chips(chips)}<span>(electrodes)</span></div></div>"
    )


def _chips(chips: Sequence[tuple[tuple[int, int, int], str]]) -> str:
    return "".join(
        f'<span style="display:inline-block;width:11px;height:11px;background:{_css(colour)};vertical-align:-1px">'
        f'</span><span style="margin:0 9px 0 3px">{escape(words)}</span>'
        for colour, words in chips
    )


def _css(colour: tuple[int, int, int]) -> str:
    return "rgb({},{},{})".format(*colour)


def design_facts(designs: Sequence[SheetDesign]) -> str:
    """Return size, area and forecast of each sheet, and r1, r2 and theta0 of each of its layers as they are cut."""
    parts = []
    for design in designs:
        cone = design.place.frustum
        coarse = [max(item.along, item.around) for item in design.forecasts()]
        rows = [
            ("side", design.place.kind),
            ("radii on the link", f"{1e3 * cone.radius1:.2f} and {1e3 * cone.radius2:.2f} mm"),
            ("height, wrap", f"{1e3 * cone.height:.1f} mm, {math.degrees(cone.wrap):.1f} deg"),
            ("active area on the link", f"{1e4 * design.layout.active.area(cone):.1f} cm2"),
            ("wires", f"4, at {side_name(design.layout.plan.wires)}"),
            ("one ADC count", f"{1e3 * min(coarse):.3f} to {1e3 * max(coarse):.3f} mm"),
        ]
        layers = [("layer", "r1 [mm]", "r2 [mm]", "theta0 [deg]", "size [mm]")]
        for cut in design.cuts:
            sector = unroll(cut.surface)
            theta0 = f"{math.degrees(sector.theta0):.2f}"
            left, low, right, high = (1e3 * value for value in cut.bounds)
            size = f"{right - left:.0f} x {high - low:.0f}"
            layers.append((cut.name, _radius(sector.r1), _radius(sector.r2), theta0, size))
        parts.append(f"<b>{escape(design.name)}</b>{_table(rows)}{_table(layers)}")
    count = f"<b>{4 * len(designs)} wires</b><br>" if designs else ""
    parts = parts or ["no sheet"]
    return f'<div id="coneskin-facts" style="font-size:13px;margin:4px 10px">{count}{"".join(parts)}</div>'


def robot_facts(links: Sequence[tuple[str, Sequence[SheetDesign] | str]]) -> str:
    """Return sheets, wires and active area of each link of a robot, or why there is nothing to say of it."""
    rows = [("link", "sheets", "wires", "active [cm2]")]
    counts, area = 0, 0.0
    for name, designs in links:
        if isinstance(designs, str):
            rows.append((name, designs, "", ""))
            continue
        active = sum(design.layout.active.area(design.place.frustum) for design in designs)
        counts, area = counts + len(designs), area + active
        rows.append((name, str(len(designs)), str(4 * len(designs)), f"{1e4 * active:.1f}"))
    rows.append(("all", str(counts), str(4 * counts), f"{1e4 * area:.1f}"))
    note = "Unlike coneskin design, the studio does not check what the joints sweep: a sheet may meet the next link."
    return f'<div id="coneskin-facts" style="font-size:12px;margin:4px 10px">{_table(rows)}<p>{note}</p></div>'


def _radius(value: float) -> str:
    return "infinite" if math.isinf(value) else f"{1e3 * value:.1f}"


def _table(rows: Sequence[tuple[str, ...]]) -> str:
    cells = ("".join(f"<td style='padding-right:8px'>{escape(value)}</td>" for value in row) for row in rows)
    return f"<table style='font-size:12px'>{''.join(f'<tr>{row}</tr>' for row in cells)}</table>"


def flat_drawing(sheet: CutSheet) -> str:
    """Return a layer as it is cut, to fit the width of the panel, with letters and lines that can be seen there."""
    left, low, right, high = sheet.bounds
    pixel = max((right - left) / _PANEL_WIDTH, (high - low) / _MAX_DRAWING_HEIGHT)  # m
    drawn = to_svg((_with_readable_labels(sheet, _MIN_LETTER_HEIGHT * pixel),), sheet.name)
    drawn = re.sub(r"^<\?xml[^>]*\?>\s*", "", drawn)
    drawn = re.sub(
        r'width="[^"]*mm" height="[^"]*mm"',
        f'style="display:block;width:100%;max-height:{_MAX_DRAWING_HEIGHT:g}px"',
        drawn,
        count=1,
    )
    kinds = {stroke.kind for part in sheet.parts for stroke in part.strokes}
    chips = _chips([(LINE_COLOURS[kind], words) for kind, words in _STROKE_CLASSES.items() if kind in kinds])
    return (
        '<div id="coneskin-flat" style="margin:4px 10px;background:white;border:1px solid #d1d5db">'
        "<style>#coneskin-flat path{stroke-width:1.5px;vector-effect:non-scaling-stroke}</style>"
        f'<div style="font-size:12px;padding:2px 6px">{escape(sheet.name)}, {escape(sheet.material)}, '
        f"{escape(sheet.face)} face up<br>{chips}</div>{drawn}</div>"
    )


def _with_readable_labels(sheet: CutSheet, height: float) -> CutSheet:
    """Return a sheet for the eye: labels at least so high [m], lines of one block as far apart as they then need."""
    parts = []
    for part in sheet.parts:
        blocks: dict[tuple[float, float, float], list[PartLabel]] = {}
        for label in part.labels:
            along = label.x * math.cos(label.angle) + label.y * math.sin(label.angle)
            blocks.setdefault((round(label.angle, 6), round(label.height, 6), round(along, 6)), []).append(label)
        labels: list[PartLabel] = []
        for block in blocks.values():
            grown = max(1.0, height / block[0].height)
            x0, y0 = (sum(values) / len(block) for values in zip(*((one.x, one.y) for one in block), strict=True))
            labels += [
                replace(one, x=x0 + grown * (one.x - x0), y=y0 + grown * (one.y - y0), height=grown * one.height)
                for one in block
            ]
        parts.append(replace(part, labels=tuple(labels)))
    return replace(sheet, parts=tuple(parts))


def warning_list(lines: Sequence[str]) -> str:
    """Return warnings, one a line."""
    rows = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return (
        f'<ul id="coneskin-warnings" style="font-size:12px;color:#b45309;margin:4px 10px;padding-left:16px">{rows}</ul>'
    )
