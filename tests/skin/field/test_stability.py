"""Rounding of the field solver at the extremes, against 60 digits, with naive formulas beside it."""

from __future__ import annotations

import math

import pytest

from tests.support.field.extremes import extreme_cases, measure, scale_errors
from tests.support.sweep import sweep

pytestmark = pytest.mark.long

CASES = {case.name: case for case in extreme_cases()}

#: Where doubles no longer hold the input: the gap to an edge, and 1 + curvature * width next to an apex.
ILL_POSED = {"a/room = 1 - 1e-06": 1e-10, "a/room = 1 - 1e-12": 1e-3, "narrowing to r2/r1 = 1e-6": 1e-10}


@pytest.mark.parametrize("name", sweep(CASES, short=6))
def test_rounding_at_the_extremes(name: str) -> None:
    result = measure(CASES[name])
    lost = ILL_POSED.get(name, 0.0)
    assert result.volts < 1e-15 + 1e-3 * lost  # a few roundings of the supply
    assert result.conductance < 1e-13 + lost
    assert result.excess < 1e-13 + lost
    assert result.condition < 1e4


def test_the_table_can_tell_a_bad_formula() -> None:
    """Textbook formulas fail in the same table, so its small numbers mean something."""
    bad = {name: measure(CASES[name]) for name in ("ka = 1e-08", "length/breadth = 1e+06", "a/room = 1e-09")}
    assert bad["ka = 1e-08"].naive_y > 1e-3
    assert bad["length/breadth = 1e+06"].naive_y > 1e-6
    assert bad["a/room = 1e-09"].naive_green > 1e-3


@pytest.mark.parametrize("ratio", [1e-12, 1e-9, 1e-6, 1e-3, 1.0, 1e3])
def test_the_scale_of_the_slant(ratio: float) -> None:
    naive, ours = scale_errors(ratio)
    assert ours < 1e-15
    if ratio < 1e-5:
        assert naive > 1e-9 * min(1.0, 1e-6 / ratio)  # equation 20 as printed cancels
    assert math.isfinite(naive)
