"""Shapes in surface coordinates, drawn on the flat pattern of any layer.

A shape is written once, in slant distance u and azimuth phi, and drawn for each layer on the cone of that layer, so
that its features lie on one normal once the sheet is wrapped. Lines of constant u become true arcs, lines of constant
phi straight lines. The drawing shows the outside face, lies symmetric about the y axis, and u = 0 at phi = wrap / 2 is
its origin.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Literal

from coneskin.errors import GeometryError

from .frustum import Frustum
from .outline import Outline, Point, Segment, circle

__all__ = ["Corner", "Shape", "Side", "Step", "Tab", "draw", "draw_circle", "flat_point"]

Side = Literal["end1", "end2", "edge0", "edge1"]
_TOGETHER = 1e-9  # vertices closer than this are one [m]
_SAME = 1e-12  # coordinates that differ by less are the same, but for rounding [m, rad]


@dataclass(frozen=True, slots=True)
class Corner:
    """A corner of a shape; neighbours share u (joined by an arc) or phi (joined by a line)."""

    u: float
    phi: float


@dataclass(frozen=True, slots=True)
class Tab:
    """A rectangle that sticks out of a side.

    Attributes:
        u: where its foot is centred [m].
        phi: the same [rad].
        width: along the side [m].
        length: away from the sheet [m].
        side: which way it sticks out.
    """

    u: float
    phi: float
    width: float
    length: float
    side: Side


Step = Corner | Tab
Shape = tuple[Step, ...]


def flat_point(frustum: Frustum, u: float, phi: float) -> Point:
    """Point of the drawing [m] for slant distance u [m] and azimuth phi [rad]."""
    return frustum.flat(u, phi - 0.5 * frustum.wrap)


def draw(frustum: Frustum, shape: Shape, closed: bool = True) -> Outline:
    """Draw a shape on the flat pattern.

    Args:
        frustum: the cone for which the layer is cut; its slant and wrap are those of the shape.
        shape: corners and tabs in order; a tab stands between two corners of its side.
        closed: whether the last corner joins the first; a closed outline is returned counter-clockwise.

    Raises:
        GeometryError: two neighbours share neither u nor phi, or the shape reaches beyond the apex.
    """
    segments: list[Segment] = []
    last = shape[-1] if closed else shape[0]
    if not isinstance(last, Corner) or not isinstance(shape[0], Corner):
        raise GeometryError("a shape must begin and end with a corner")
    for i, step in enumerate(shape):
        if isinstance(step, Corner):
            segments.extend(_edge(frustum, last, step))
            last = step
            continue
        feet, tips = _rectangle(frustum, step)
        following = shape[i + 1]
        if (following.u - last.u) + (following.phi - last.phi) < 0.0:
            feet, tips = feet[::-1], tips[::-1]
        segments.extend(_edge(frustum, last, feet[0]))
        points = [flat_point(frustum, feet[0].u, feet[0].phi), *tips, flat_point(frustum, feet[1].u, feet[1].phi)]
        segments.extend(Segment(a, b) for a, b in itertools.pairwise(points))
        last = feet[1]
    kept = [s for s in segments if s.chord > _TOGETHER]
    joined = [Segment(s.start, after.start, s.bulge) for s, after in itertools.pairwise(kept)]
    end = kept[0].start if closed else kept[-1].end
    outline = Outline.of([*joined, Segment(kept[-1].start, end, kept[-1].bulge)], closed)
    if closed and outline.area < 0.0:
        return _reversed(outline)
    return outline


def draw_circle(frustum: Frustum, u: float, phi: float, diameter: float) -> Outline:
    """A hole of a diameter [m] about a point of the surface; a hole is round in the flat pattern."""
    return circle(*flat_point(frustum, u, phi), 0.5 * diameter)


def _edge(frustum: Frustum, a: Corner, b: Corner) -> list[Segment]:
    """The line or the arc from a to b, in pieces of at most a quarter turn; nothing where they coincide."""
    start, end = flat_point(frustum, a.u, a.phi), flat_point(frustum, b.u, b.phi)
    if a == b or start == end:
        return []
    if abs(a.phi - b.phi) < _SAME:
        return [Segment(start, end)]
    if abs(a.u - b.u) > _SAME:
        raise GeometryError(f"neighbours of a shape must share u or phi, got {a} and {b}")
    if frustum.radius_at(a.u) <= 0.0:
        raise GeometryError("a shape cannot reach beyond the apex of its cone")
    sweep = -(b.phi - a.phi) * frustum.sin_half_angle  # a widening cone has its apex below the drawing
    count = max(1, math.ceil(abs(sweep) / (0.5 * math.pi) - 1e-9))
    steps = [a.phi + (b.phi - a.phi) * i / count for i in range(count)] + [b.phi]
    points = [flat_point(frustum, a.u, phi) for phi in steps]
    bulge = math.tan(0.25 * sweep / count)
    return [Segment(p, q, bulge) for p, q in itertools.pairwise(points)]


def _rectangle(frustum: Frustum, tab: Tab) -> tuple[tuple[Corner, Corner], tuple[Point, Point]]:
    """Feet of a tab on its side and its two tips, towards growing u or phi."""
    half, turned = 0.5 * tab.width, (tab.phi - 0.5 * frustum.wrap) * frustum.sin_half_angle
    sine, cosine = math.sin(turned), math.cos(turned)
    if tab.side in ("end1", "end2"):
        spread = half / frustum.radius_at(tab.u)
        feet = Corner(tab.u, tab.phi - spread), Corner(tab.u, tab.phi + spread)
        out = -tab.length if tab.side == "end1" else tab.length
        dx, dy = out * sine, out * cosine
    else:
        feet = Corner(tab.u - half, tab.phi), Corner(tab.u + half, tab.phi)
        out = -tab.length if tab.side == "edge0" else tab.length
        dx, dy = out * cosine, -out * sine
    (ax, ay), (bx, by) = (flat_point(frustum, foot.u, foot.phi) for foot in feet)
    return feet, ((ax + dx, ay + dy), (bx + dx, by + dy))


def _reversed(outline: Outline) -> Outline:
    return Outline.of([Segment(s.end, s.start, -s.bulge) for s in outline.segments()][::-1])
