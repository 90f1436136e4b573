"""Cut sheets as DXF (R2010, millimetres). The only importer of ezdxf."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from typing import Any, Literal, get_args

from coneskin.core.errors import GeometryError, needed_package

from .cut_sheet import CutSheet
from .outline import Outline, PathSegment, joint_bounds

ArcStyle = Literal["bulge", "arc-line", "flattened"]
#: AutoCAD colour numbers nearest to LINE_COLOURS; text is dark grey, because 7 is white on some screens
_COLOR_INDEX = {"cut": 1, "hole": 6, "score": 5, "fold": 3, "label": 250}


def to_dxf(sheets: Sequence[CutSheet], arcs: ArcStyle = "bulge", tolerance: float = 1e-5) -> str:
    """Write cut sheets as one DXF text.

    Each sheet has those of the layers <slug>_CUT, _HOLE, _SCORE, _FOLD and _LABEL that it uses.

    Args:
        arcs: "bulge" for closed polylines with true arcs; "arc-line" for separate LINE and ARC entities, for readers
            that ignore bulges; "flattened" for polylines of straight lines.
        tolerance: largest distance of flattened lines from the arcs [m].

    Raises:
        MissingExtra: ezdxf is not installed.
        GeometryError: an unknown style of arcs, or a tolerance that is not above 0.
    """
    if arcs not in get_args(ArcStyle):
        raise GeometryError(f"arcs must be one of {', '.join(get_args(ArcStyle))}, got {arcs!r}")
    with needed_package("ezdxf", "writing DXF files", "design"):
        import ezdxf
        from ezdxf.enums import TextEntityAlignment

    document = ezdxf.new("R2010", units=4)  # 4: millimetres
    document.header["$MEASUREMENT"] = 1
    space = document.modelspace()

    def layer(sheet: CutSheet, kind: str) -> dict[str, str]:
        name = f"{sheet.slug}_{kind.upper()}"
        if name not in document.layers:
            document.layers.add(name, color=_COLOR_INDEX[kind])
        return {"layer": name}

    for sheet in sheets:
        for part in sheet.parts:
            for stroke in part.strokes:
                _add(space, stroke.outline, layer(sheet, stroke.kind), arcs, tolerance)
            for label in part.labels:
                text = space.add_text(
                    label.text,
                    height=label.height * 1e3,
                    rotation=math.degrees(label.angle),
                    dxfattribs=layer(sheet, "label"),
                )
                text.set_placement((label.x * 1e3, label.y * 1e3), align=TextEntityAlignment.MIDDLE_CENTER)
    x0, y0, x1, y1 = joint_bounds(sheet.bounds for sheet in sheets)
    low, high = (x0 * 1e3, y0 * 1e3, 0.0), (x1 * 1e3, y1 * 1e3, 0.0)
    space.reset_extents(low, high)  # what a reader shows first, and some cutters check against their bed
    document.header["$EXTMIN"], document.header["$EXTMAX"] = low, high  # ezdxf leaves a corner at the origin out
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue()


def _add(space: Any, outline: Outline, attributes: dict[str, str], arcs: ArcStyle, tolerance: float) -> None:
    if arcs == "arc-line":
        for segment in outline.segments():
            _add_segment(space, segment, attributes)
        return
    lines = outline.flattened(tolerance) if arcs == "flattened" else outline
    points = [(x * 1e3, y * 1e3, bulge) for x, y, bulge in lines.vertices]
    space.add_lwpolyline(points, format="xyb", close=outline.closed, dxfattribs=attributes)


def _add_segment(space: Any, segment: PathSegment, attributes: dict[str, str]) -> None:
    (x0, y0), (x1, y1) = segment.start, segment.end
    if segment.bulge == 0.0:
        space.add_line((x0 * 1e3, y0 * 1e3), (x1 * 1e3, y1 * 1e3), dxfattribs=attributes)
        return
    turn = -math.copysign(0.5 * math.pi, segment.bulge)  # from the heading to the radius
    first, last = (math.degrees(segment.heading(end) + turn) for end in (0.0, 1.0))
    if segment.bulge < 0.0:  # an ARC always runs counter-clockwise
        first, last = last, first
    x, y = segment.centre
    space.add_arc((x * 1e3, y * 1e3), segment.radius * 1e3, first, last, dxfattribs=attributes)
