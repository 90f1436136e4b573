"""Test piece of a material: a square with a square hole, cut first, by which cutter and kerf are set."""

from __future__ import annotations

import itertools

from coneskin.geometry.frustum import Frustum

from .cut_sheet import CutPart, CutSheet, Stroke, StrokeKind
from .outline import Outline, PathSegment
from .part_labels import PartLabel

__all__ = ["TEST_HOLE", "TEST_SQUARE", "make_test_piece"]

TEST_SQUARE = 40e-3  #: side of the square [m], drawn without a kerf
TEST_HOLE = 20e-3  #: side of its hole [m]
_TICK = 2e-3  # m; from the border to the marked square
_LETTERS = 3e-3  # m


def make_test_piece(material: str) -> CutSheet:
    """Draw the test piece of a material; its lines have no kerf, so that the kerf can be measured on it."""
    half, inner = 0.5 * TEST_SQUARE, 0.5 * TEST_HOLE
    strokes = (_square("score", half - _TICK), _square("hole", inner), _square("cut", half))
    side, hole = f"{TEST_SQUARE * 1e3:g} mm", f"hole {TEST_HOLE * 1e3:g} mm"
    middle = 0.5 * (half - _TICK + inner)
    labels = (PartLabel(f"TEST {side}", 0.0, middle, _LETTERS), PartLabel(hole, 0.0, -middle, _LETTERS))
    flat = Frustum(half, half, TEST_SQUARE)
    return CutSheet(0, "test piece", material, "outside", flat, (CutPart("test piece", strokes, labels),))


def _square(kind: StrokeKind, half: float) -> Stroke:
    corners = [(-half, -half), (half, -half), (half, half), (-half, half)]
    sides = [PathSegment(a, b) for a, b in itertools.pairwise([*corners, corners[0]])]
    return Stroke(kind, Outline.from_segments(sides, True))
