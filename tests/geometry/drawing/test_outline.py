"""Lines and arcs: lengths, areas, offsets, against closed forms and against dense polygons."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coneskin.core.errors import GeometryError
from coneskin.geometry.drawing.outline import Outline, PathSegment, circle_outline

SQUARE = Outline(((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.1, 0.1, 0.0), (0.0, 0.1, 0.0)))
bulges = st.one_of(st.sampled_from([0.0, 5e-324, -1e-300, 2e-10]), st.floats(-1.0, 1.0), st.floats(-1e-8, 1e-8))


def sector(r1, r2, angle):
    """An annular sector about the origin, counter-clockwise."""
    b = math.tan(angle / 4)
    turn = (math.cos(angle), math.sin(angle))
    corners = (r1, 0.0, 0.0), (r2, 0.0, b), (r2 * turn[0], r2 * turn[1], 0.0), (r1 * turn[0], r1 * turn[1], -b)
    return Outline(corners)


def polygon_area(points):
    x, y = np.array(points).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


@given(bulges)
def test_segment_agrees_with_its_circle(bulge):
    segment = PathSegment((0.1, 0.2), (0.4, -0.1), bulge)
    points = [segment.at(i / 64) for i in range(65)]
    assert segment.along(64) == pytest.approx(np.array(points), abs=1e-15)
    assert points[0] == pytest.approx(segment.start)
    assert points[-1] == pytest.approx(segment.end)
    if abs(bulge) > 1e-6:
        distances = [math.dist(point, segment.centre) for point in points]
        assert distances == pytest.approx([segment.radius] * 65, rel=1e-9)
        assert segment.length == pytest.approx(segment.radius * abs(segment.sweep), rel=1e-12)
        middle = segment.at(0.5)
        side = 0.3 * (middle[1] - 0.05) - (-0.3) * (middle[0] - 0.25)
        assert math.copysign(1.0, side) == -math.copysign(1.0, bulge)  # a left turn bulges to the right
    steps = [math.dist(a, b) for a, b in pairwise(points)]
    assert max(steps) == pytest.approx(min(steps), rel=1e-6)
    assert sum(steps) == pytest.approx(segment.length, rel=3e-4)  # 64 chords of a half circle: 1 - 1e-4
    assert segment.length >= segment.chord


@given(st.floats(0.01, 1.0), st.floats(0.01, 1.0), st.floats(1e-9, 3.1))
def test_area_and_length_of_a_sector(inner, width, angle):
    outline = sector(inner, inner + width, angle)
    outer = inner + width
    assert outline.area == pytest.approx(0.5 * angle * (outer**2 - inner**2), rel=1e-6 if angle < 1e-6 else 1e-12)
    assert outline.length == pytest.approx(angle * (inner + outer) + 2 * width, rel=1e-12)


def test_area_of_a_slender_sector_keeps_its_digits():
    """A rim of 3900 m radius; the difference to the rectangle is 1e-8 of it."""
    chord, bulge = 0.3, 1.1e-5
    outline = Outline(((0.0, 0.0, bulge), (chord, 0.0, 0.0), (chord, 0.4, 0.0), (0.0, 0.4, 0.0)))
    sweep = 4 * math.atan(bulge)
    assert outline.area - 0.12 == pytest.approx(chord**2 * sweep / 12, rel=1e-9)


def test_circle():
    ring = circle_outline(0.3, -0.2, 0.05)
    assert ring.area == pytest.approx(math.pi * 0.05**2, rel=1e-13)
    assert ring.length == pytest.approx(2 * math.pi * 0.05, rel=1e-13)
    assert ring.bounds == pytest.approx((0.25, -0.25, 0.35, -0.15), rel=1e-12)


@given(st.floats(0.05, 1.0), st.floats(0.1, 3.0), st.floats(-3.0, 3.0))
def test_bounds_and_area_agree_with_a_dense_polygon(inner, angle, turned):
    c, s = math.cos(turned), math.sin(turned)
    flat = sector(inner, inner + 0.2, angle)
    outline = Outline(tuple((c * x - s * y, s * x + c * y, b) for x, y, b in flat.vertices))
    dense = outline.flattened(1e-6)
    xs, ys = [x for x, _, _ in dense.vertices], [y for _, y, _ in dense.vertices]
    assert outline.bounds == pytest.approx((min(xs), min(ys), max(xs), max(ys)), abs=2e-6)
    assert outline.area == pytest.approx(polygon_area([v[:2] for v in dense.vertices]), abs=1e-5)


@given(st.floats(1e-9, 3.0), st.floats(-4e-3, 4e-3))
def test_offset_of_a_sector_is_the_sector_with_straight_edges_moved(angle, distance):
    """Rims of r -+ t; the new edges are parallel to the old ones, at the distance t."""
    if abs(distance) < 1e-12:
        return
    outline = sector(0.1, 0.2, angle)
    if distance < 0 and 0.1 * math.sin(min(angle, math.pi / 2)) < 2.1 * abs(distance):
        return  # nothing left between the edges
    if angle * 0.1 < 2.1 * abs(distance):
        return
    grown = outline.offset(distance)
    corners = [complex(x, y) for x, y, _ in grown.vertices]
    r1, r2 = 0.1 - distance, 0.2 + distance
    assert [abs(z) for z in corners] == pytest.approx([r1, r2, r2, r1], rel=1e-9)
    assert [z.imag for z in corners[:2]] == pytest.approx([-distance] * 2, abs=1e-12)
    back = complex(math.cos(angle), -math.sin(angle))
    assert [(z * back).imag for z in corners[2:]] == pytest.approx([distance] * 2, abs=1e-12)
    for segment, radius in zip(list(grown.segments())[1::2], (r2, r1), strict=True):
        if angle > 1e-3:
            assert segment.radius == pytest.approx(radius, rel=1e-6 / angle)
            assert math.hypot(*segment.at(0.5)) == pytest.approx(radius, rel=1e-8)


def test_offset_there_and_back():
    outline = sector(0.1, 0.2, 1.2)
    again = outline.offset(2e-3).offset(-2e-3)
    for a, b in zip(outline.vertices, again.vertices, strict=True):
        assert a == pytest.approx(b, abs=1e-13)


def test_offset_follows_smooth_joints_and_orientation():
    ring = circle_outline(0.0, 0.0, 0.01)
    assert ring.offset(1e-3).area == pytest.approx(math.pi * 0.011**2, rel=1e-12)
    clockwise = Outline(((0.0, 0.0, 0.0), (0.0, 0.1, 0.0), (0.1, 0.1, 0.0), (0.1, 0.0, 0.0)))
    assert clockwise.area < 0.0
    assert clockwise.offset(1e-3).area == pytest.approx(-(0.102**2))
    assert SQUARE.offset(0.0) is SQUARE


def test_offset_refuses_to_swallow_a_detail():
    with pytest.raises(GeometryError, match=r"offset of -60 mm is larger than a detail of 100 mm: reduce the kerf"):
        SQUARE.offset(-0.06)
    with pytest.raises(GeometryError, match="is larger than"):
        circle_outline(0.0, 0.0, 1e-3).offset(-1.1e-3)
    with pytest.raises(GeometryError, match="only a closed outline"):
        Outline(((0.0, 0.0, 0.0), (0.1, 0.0, 0.0)), closed=False).offset(1e-3)
    with pytest.raises(GeometryError, match="turns back on itself"):
        Outline(((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.05, 0.0, 0.0), (0.05, 0.1, 0.0))).offset(1e-3)


def test_mirror_image():
    outline = sector(0.1, 0.2, 1.2)
    mirror = outline.mirrored()
    assert mirror.area == pytest.approx(outline.area)
    x0, y0, x1, y1 = outline.bounds
    assert mirror.bounds == pytest.approx((-x1, y0, -x0, y1))
    assert {round(s.radius, 9) for s in mirror.segments()} == {round(s.radius, 9) for s in outline.segments()}


def test_moved():
    assert SQUARE.moved(1.0, -2.0).bounds == (1.0, -2.0, 1.1, -1.9)


def test_mistakes_are_said():
    with pytest.raises(GeometryError, match="at least 2 vertices, got 1"):
        Outline(((0.0, 0.0, 0.0),))
    with pytest.raises(GeometryError, match="must be finite"):
        Outline(((0.0, 0.0, 0.0), (math.nan, 0.0, 0.0)))
    with pytest.raises(GeometryError, match="must not repeat a vertex"):
        Outline(((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)))
