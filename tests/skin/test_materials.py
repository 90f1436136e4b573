"""Sheets chosen for the shape: one material where it does, two where one current would drown; the given is kept."""

import math
import re
from contextlib import nullcontext

import pytest

from coneskin.core.errors import SensorError
from coneskin.skin.electronics import match_electronics
from coneskin.skin.materials import SHEET_MATERIALS, Padding, match_sheet_materials


def test_an_ordinary_link_gets_one_material_of_a_kiloohm():
    upper, lower = match_sheet_materials(1.05)
    assert upper == lower
    assert upper.ohms == 1000.0


@pytest.mark.parametrize("squares", [0.02, 0.05, 0.1, 0.3, 1.0, 3.0, 10.0, 20.0, 50.0])
def test_every_shape_keeps_100_counts_of_12_bits(squares):
    upper, lower = match_sheet_materials(squares)
    assert {upper, lower} <= set(SHEET_MATERIALS)
    along, around = upper.ohms * squares, lower.ohms / squares
    parts = match_electronics(along, around)
    smallest = parts.supply_volts / (max(along, around) + 2.0)
    assert parts.adc_bits == 12
    assert smallest / parts.current_full_scale * parts.full_count >= 100.0
    # one kilo-ohm for both would not do beyond 1 : 4.3
    assert (upper == lower) == (abs(math.log(squares)) < 0.5 * math.log(15.0))


def test_a_material_has_the_resistance_of_its_name():
    for material in SHEET_MATERIALS:
        figure, thousand = re.search(r"([\d.]+) (k?)ohm per square$", material.name).groups()
        assert material.ohms == float(figure) * (1000.0 if thousand else 1.0)
    assert [material.ohms for material in SHEET_MATERIALS] == sorted(material.ohms for material in SHEET_MATERIALS)


@pytest.mark.parametrize(("force", "taken"), [(19.9, True), (20.1, False)])
def test_the_force_of_a_padding_at_most_doubles_to_the_next_depth(force, taken):
    with nullcontext() if taken else pytest.raises(SensorError, match="at most double to the next depth"):
        Padding(table=((1e-3, 10.0), (2e-3, force)))


def test_what_is_given_is_kept_and_the_other_follows():
    upper, lower = match_sheet_materials(10.0, upper_ohms=70.0)
    assert upper.ohms == 70.0
    assert lower.ohms in {1500.0, 1000.0, 10e3}
    assert match_sheet_materials(10.0, 70.0, 80.0)[1].ohms == 80.0
