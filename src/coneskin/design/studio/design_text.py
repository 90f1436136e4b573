"""Text of a design for the studio's panel, as HTML: flat layers, sizes, forecast, warnings."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from html import escape

from coneskin.design.sheets.sheet_design import SheetDesign
from coneskin.geometry.drawing.cut_sheet import LINE_COLOURS, CutSheet
from coneskin.geometry.drawing.part_labels import PartLabel
from coneskin.geometry.drawing.svg import to_svg
from coneskin.geometry.sector import unroll

from .deviation_bands import BAND_COLOURS, HOLE_COLOUR
from .electrode_marks import ELECTRODE_COLOURS

__all__ = ["design_facts", "flat_drawing", "legend", "warning_list"]

_PANEL = 340.0  # pixels; of the panel's width, for a drawing
_TALLEST = 230.0  # pixels of a drawing
_READABLE = 9.0  # pixels of capitals; what is cut has smaller ones, to fit on its part
_KINDS = {"cut": "cut", "hole": "hole", "score": "mark", "fold": "fold"}


def legend(tolerance: float) -> str:
    """Return what the colours on the link mean.

    Args:
        tolerance: deviation of the strongest colours [m].
    """
    share = 100.0 / len(BAND_COLOURS)
    bands = "".join(f'<span style="width:{share:.3f}%;background:{_css(colour)}"></span>' for colour in BAND_COLOURS)
    ends = f"{-1e3 * tolerance:g} mm: the link is below", f"it stands out: +{1e3 * tolerance:g} mm"
    chips = [(HOLE_COLOUR, "a hole is spanned"), *((ELECTRODE_COLOURS[name], name) for name in ELECTRODE_COLOURS)]
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
    """Return a layer as it is cut, to fit the width of the panel, with letters and lines that can be seen there."""
    left, low, right, high = sheet.bounds
    pixel = max((right - left) / _PANEL, (high - low) / _TALLEST)  # m
    drawn = to_svg((_with_readable_labels(sheet, _READABLE * pixel),), sheet.name)
    drawn = re.sub(r"^<\?xml[^>]*\?>\s*", "", drawn)
    drawn = re.sub(
        r'width="[^"]*mm" height="[^"]*mm"',
        f'style="display:block;width:100%;max-height:{_TALLEST:g}px"',
        drawn,
        count=1,
    )
    kinds = {stroke.kind for part in sheet.parts for stroke in part.strokes}
    chips = _chips([(LINE_COLOURS[kind], words) for kind, words in _KINDS.items() if kind in kinds])
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
