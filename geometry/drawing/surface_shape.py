"""Shapes in surface coordinates, drawn on the flat pattern of any layer.

A shape is defined once, in slant distance u and azimuth phi, and drawn for each layer on the cone of that layer, so
that its features lie on one normal once the sheet is wrapped. Lines of constant u become true arcs, lines of constant
phi straight lines. The drawing shows the outside face and is symmetric about the y axis; its origin is at u = 0,
phi = wrap / 2.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Literal

from coneskin.core.errors import GeometryError
from coneskin.geometry.frustum import Frustum

from .outline import FlatPoint, Outline, PathSegment

SheetSide = Literal["end1", "end2", "edge0", "edge1"]
_MIN_CHORD = 1e-9  # m; vertices closer than this are merged
_ROUNDING_ERROR = 1e-12  # m or rad; smaller differences of coordinates are rounding errors


@dataclass(frozen=True, slots=True)
class ShapeCorner:
    """A corner of a shape at (u [m], phi [rad]); neighbours share u (joined by an arc) or phi (joined by a line)."""

    u: float
    phi: float


@dataclass(frozen=True, slots=True)
class ShapeTab:
    """A rectangle that extends outwards from a side."""

    u: float  #: slant distance of the middle of its foot [m]
    phi: float  #: azimuth of the middle of its foot [rad]
    width: float  #: along the side [m]
    length: float  #: away from the sheet [m]
    side: SheetSide


_ShapeElement = ShapeCorner | ShapeTab
SurfaceShape = tuple[_ShapeElement, ...]


def drawing_point(frustum: Frustum, u: float, phi: float) -> FlatPoint:
    """Return the point of the drawing [m] at slant distance u [m] and azimuth phi [rad]."""
    return frustum.flat_point(u, phi - 0.5 * frustum.wrap)


def draw_shape(frustum: Frustum, shape: SurfaceShape, closed: bool = True) -> Outline:
    """Draw a shape on the flat pattern.

    Args:
        frustum: the cone for which the layer is cut; its slant and wrap are those of the shape.
        shape: corners and tabs in order; a tab stands between two corners of its side.
        closed: True to join the last corner to the first; a closed outline is returned counter-clockwise.

    Raises:
        GeometryError: two neighbours share neither u nor phi, or the shape reaches beyond the apex.
    """
    segments: list[PathSegment] = []
    last = shape[-1] if closed else shape[0]
    if not isinstance(last, ShapeCorner) or not isinstance(shape[0], ShapeCorner):
        raise GeometryError("a shape must begin and end with a corner")
    for i, step in enumerate(shape):
        if isinstance(step, ShapeCorner):
            segments.extend(_edge(frustum, last, step))
            last = step
            continue
        feet, tips = _rectangle(frustum, step)
        following = shape[i + 1]
        if (following.u - last.u) + (following.phi - last.phi) < 0.0:
            feet, tips = feet[::-1], tips[::-1]
        segments.extend(_edge(frustum, last, feet[0]))
        points = [drawing_point(frustum, feet[0].u, feet[0].phi), *tips, drawing_point(frustum, feet[1].u, feet[1].phi)]
        segments.extend(PathSegment(a, b) for a, b in itertools.pairwise(points))
        last = feet[1]
    kept = [s for s in segments if s.chord > _MIN_CHORD]
    joined = [PathSegment(s.start, after.start, s.bulge) for s, after in itertools.pairwise(kept)]
    end = kept[0].start if closed else kept[-1].end
    outline = Outline.from_segments([*joined, PathSegment(kept[-1].start, end, kept[-1].bulge)], closed)
    if closed and outline.area < 0.0:
        return Outline.from_segments([PathSegment(s.end, s.start, -s.bulge) for s in outline.segments()][::-1])
    return outline


def _edge(frustum: Frustum, a: ShapeCorner, b: ShapeCorner) -> list[PathSegment]:
    """Return the line or the arc from a to b, in pieces of at most a quarter turn; none if they coincide."""
    start, end = drawing_point(frustum, a.u, a.phi), drawing_point(frustum, b.u, b.phi)
    if a == b or start == end:
        return []
    if abs(a.phi - b.phi) < _ROUNDING_ERROR:
        return [PathSegment(start, end)]
    if abs(a.u - b.u) > _ROUNDING_ERROR:
        raise GeometryError(f"neighbours of a shape must share u or phi, got {a} and {b}")
    if frustum.radius_at(a.u) <= 0.0:
        raise GeometryError("a shape cannot reach beyond the apex of its cone")
    sweep = -(b.phi - a.phi) * frustum.sin_half_angle  # a widening cone has its apex below the drawing
    count = max(1, math.ceil(abs(sweep) / (0.5 * math.pi) - 1e-9))
    steps = [a.phi + (b.phi - a.phi) * i / count for i in range(count)] + [b.phi]
    points = [drawing_point(frustum, a.u, phi) for phi in steps]
    bulge = math.tan(0.25 * sweep / count)
    return [PathSegment(p, q, bulge) for p, q in itertools.pairwise(points)]


def _rectangle(frustum: Frustum, tab: ShapeTab) -> tuple[tuple[ShapeCorner, ShapeCorner], tuple[FlatPoint, FlatPoint]]:
    """Return the feet of a tab on its side and its two tips, in the order of growing u or phi."""
    half, turned = 0.5 * tab.width, (tab.phi - 0.5 * frustum.wrap) * frustum.sin_half_angle
    sine, cosine = math.sin(turned), math.cos(turned)
    if tab.side in ("end1", "end2"):
        spread = half / frustum.radius_at(tab.u)
        feet = ShapeCorner(tab.u, tab.phi - spread), ShapeCorner(tab.u, tab.phi + spread)
        out = -tab.length if tab.side == "end1" else tab.length
        dx, dy = out * sine, out * cosine
    else:
        feet = ShapeCorner(tab.u - half, tab.phi), ShapeCorner(tab.u + half, tab.phi)
        out = -tab.length if tab.side == "edge0" else tab.length
        dx, dy = out * cosine, -out * sine
    (ax, ay), (bx, by) = (drawing_point(frustum, foot.u, foot.phi) for foot in feet)
    return feet, ((ax + dx, ay + dy), (bx + dx, by + dy))
