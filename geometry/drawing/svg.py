"""Cut sheets as SVG at 1:1: one user unit is a millimetre, arcs are true arcs, one group per layer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from xml.sax.saxutils import escape, quoteattr

from .cut_sheet import LINE_COLOURS, CutSheet
from .outline import Outline, joint_bounds
from .part_labels import CAP_HEIGHT, PartLabel

_BORDER_WIDTH = 5e-3  # m; of the empty space around the drawing
_MAX_ARC_RADIUS = 10.0  # m; beyond it a renderer in single precision misplaces the centre by more than 1 um


def to_svg(sheets: Sequence[CutSheet], title: str = "coneskin") -> str:
    """Write cut sheets as one SVG text."""
    x0, y0, x1, y1 = joint_bounds(sheet.bounds for sheet in sheets)
    left, top = x0 - _BORDER_WIDTH, y1 + _BORDER_WIDTH
    width, height = (x1 + _BORDER_WIDTH - left) * 1e3, (top - y0 + _BORDER_WIDTH) * 1e3
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" '
        f'width="{_number(width)}mm" height="{_number(height)}mm" '
        f'viewBox="0 0 {_number(width)} {_number(height)}">',
        f"<title>{escape(title)}</title>",
    ]
    for sheet in sheets:
        lines.append(
            f'<g id={quoteattr(sheet.slug)} inkscape:groupmode="layer" inkscape:label={quoteattr(sheet.slug)}>'
        )
        for kind, colour in LINE_COLOURS.items():
            marks = list(_marks(sheet, kind, left, top))
            if marks:
                hue = "#{:02x}{:02x}{:02x}".format(*colour)
                fill, stroke = (hue, "none") if kind == "label" else ("none", hue)
                paint = f'fill="{fill}" stroke="{stroke}"'
                lines.append(f'<g id="{sheet.slug}_{kind}" {paint} stroke-width="0.1">')
                lines.extend(marks)
                lines.append("</g>")
        lines.append("</g>")
    lines.append("</svg>")
    return "\n".join(lines) + "\n"


def _marks(sheet: CutSheet, kind: str, left: float, top: float) -> list[str]:
    if kind == "label":
        return [_text(label, left, top) for part in sheet.parts for label in part.labels]
    strokes = [stroke for part in sheet.parts for stroke in part.strokes if stroke.kind == kind]
    return [f'<path d="{_path(stroke.outline, left, top)}"/>' for stroke in strokes]


def _path(outline: Outline, left: float, top: float) -> str:
    """Return the path data; y points down in SVG, so an arc that turns left has the sweep flag 0."""

    def at(x: float, y: float) -> str:
        return f"{_number((x - left) * 1e3)} {_number((top - y) * 1e3)}"

    x0, y0, _ = outline.vertices[0]
    words = [f"M {at(x0, y0)}"]
    for segment in outline.segments():
        end = at(*segment.end)
        if segment.bulge == 0.0:
            words.append(f"L {end}")
        elif segment.radius > _MAX_ARC_RADIUS:  # on so flat an arc one cubic is exact to 1e-9 mm
            first, second = segment.controls
            words.append(f"C {at(*first)} {at(*second)} {end}")
        else:
            radius, large = _number(segment.radius * 1e3), int(abs(segment.sweep) > math.pi)
            words.append(f"A {radius} {radius} 0 {large} {int(segment.bulge < 0.0)} {end}")
    return " ".join(words) + (" Z" if outline.closed else "")


def _text(label: PartLabel, left: float, top: float) -> str:
    x, y = (label.x - left) * 1e3, (top - label.y) * 1e3
    height = label.height * 1e3
    return (
        f'<text transform="translate({_number(x)} {_number(y)}) rotate({_number(-math.degrees(label.angle))})" '
        f'y="{_number(0.5 * height)}" font-family="Helvetica, Arial, sans-serif" '
        f'font-size="{_number(height / CAP_HEIGHT)}" text-anchor="middle">{escape(label.text)}</text>'
    )


def _number(value: float) -> str:
    """Return a number in millimetres with the digits down to a nanometre."""
    text = f"{value:.6f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text
