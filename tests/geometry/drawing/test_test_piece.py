"""Test piece: its lines have the sizes that the guide names, whatever the kerf of the parts."""

import pytest

from coneskin.geometry.drawing.cut_sheet import TEST_HOLE, TEST_SQUARE, make_test_piece
from coneskin.geometry.drawing.nesting import nest_on_beds


def test_a_square_with_a_square_hole() -> None:
    piece = make_test_piece("foam 2.50 mm")
    (part,) = piece.parts
    assert part.area == pytest.approx(TEST_SQUARE**2 - TEST_HOLE**2)
    assert piece.bounds == pytest.approx((-0.02, -0.02, 0.02, 0.02))
    for label in part.labels:
        for x, y in label.corners():
            assert 0.5 * TEST_HOLE < max(abs(x), abs(y)) < 0.5 * TEST_SQUARE, "the letters are on the material"
            assert abs(x) < 0.5 * TEST_SQUARE


def test_it_is_nested_on_the_bed_of_its_material() -> None:
    (bed,), larger = nest_on_beds([make_test_piece("foam 2.50 mm")], 0.1, 0.1)
    assert larger == ()
    assert bed.material == "foam 2.50 mm"
