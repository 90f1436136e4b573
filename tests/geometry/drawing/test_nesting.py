"""Nesting on a bed: every part is there once, as large as before, and no two overlap."""

import itertools
import math
import re
from collections import Counter

import pytest

from coneskin.core.errors import GeometryError
from coneskin.geometry.drawing.cut_sheet import CutPart, cut_sheets
from coneskin.geometry.drawing.electrode_layout import lay_out_sheet
from coneskin.geometry.drawing.layer_stack import PAPER_STACK
from coneskin.geometry.drawing.nesting import nest_on_beds
from coneskin.geometry.frustum import Frustum

CONE = cut_sheets(lay_out_sheet(Frustum(0.045, 0.060, 0.15)), PAPER_STACK, kerf=0.2e-3)
GAP = 3e-3


def shape(part: CutPart) -> tuple[str, float, float]:
    return part.name, round(1e6 * part.area, 6), round(1e3 * part.cut_length, 6)


def box(part: CutPart) -> tuple[float, float, float, float]:
    boxes = [stroke.outline.bounds for stroke in part.strokes if stroke.kind == "cut"]
    return min(b[0] for b in boxes), min(b[1] for b in boxes), max(b[2] for b in boxes), max(b[3] for b in boxes)


@pytest.mark.parametrize("bed", [(0.6, 0.4), (0.4, 0.6), (1.2, 0.8), (0.42, 0.2)])
def test_every_part_is_nested_once_and_none_overlaps(bed: tuple[float, float]) -> None:
    beds, larger = nest_on_beds(CONE, *bed, GAP)
    assert larger == ()
    drawn = Counter((sheet.material, *shape(part)) for sheet in CONE for part in sheet.parts)
    nested = Counter((b.material, *shape(part)) for b in beds for sheet in b.sheets for part in sheet.parts)
    assert nested == drawn
    for one in beds:
        parts = [part for sheet in one.sheets for part in sheet.parts]
        for x0, y0, x1, y1 in map(box, parts):
            assert min(x0, y0) >= GAP - 1e-9
            assert x1 <= one.used[0] + 1e-9 <= bed[0] + 2e-9
            assert y1 <= one.used[1] + 1e-9 <= bed[1] + 2e-9
        for a, b in itertools.combinations(map(box, parts), 2):
            apart = max(b[0] - a[2], a[0] - b[2], b[1] - a[3], a[1] - b[3])
            assert apart >= GAP - 1e-9
        assert 0.0 < one.waste < 1.0


def test_the_same_parts_are_nested_in_the_same_way() -> None:
    assert nest_on_beds(CONE, 0.6, 0.4) == nest_on_beds(CONE, 0.6, 0.4)


def test_a_slanted_strip_is_turned_until_it_is_narrow() -> None:
    """Foil D lies along a ray: its box as drawn is mostly waste."""
    (foil,) = (sheet for sheet in CONE if sheet.number == 2)
    x0, y0, x1, y1 = box(foil.parts[0])
    beds, _ = nest_on_beds([foil], 0.6, 0.4, GAP)
    (one,) = beds
    for part in (part for sheet in one.sheets for part in sheet.parts):
        a, b, c, d = box(part)
        assert min(c - a, d - b) < 0.5 * min(x1 - x0, y1 - y0)
    assert one.waste < 0.6


def test_what_is_larger_than_the_bed_is_named() -> None:
    beds, larger = nest_on_beds(CONE, 0.3, 0.2)
    assert any(
        "7-upper-substrate, upper substrate: " in text and "does not fit on a bed of 300 x 200 mm" in text
        for text in larger
    )
    sizes = [tuple(map(int, re.findall(r": (\d+) x (\d+) mm", text)[0])) for text in larger]
    widest = max(x1 - x0 for x0, _, x1, _ in (box(part) for sheet in CONE for part in sheet.parts))
    assert max(map(max, sizes)) <= 1e3 * widest + 5.0 < 500.0
    assert all(max(size) > 300 or min(size) > 200 for size in sizes)
    named = sum(len(sheet.parts) for one in beds for sheet in one.sheets) + len(larger)
    assert named == sum(len(sheet.parts) for sheet in CONE)
    with pytest.raises(GeometryError, match=r"a bed is from 50 to 10000 mm wide and deep.* got 1e-09 x 200 mm"):
        nest_on_beds(CONE, 1e-12, 0.2)
    with pytest.raises(GeometryError, match="got nan x 200 mm"):
        nest_on_beds(CONE, math.nan, 0.2)
