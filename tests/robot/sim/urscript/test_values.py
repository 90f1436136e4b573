"""Rotation vectors and the lists of URScript."""

from __future__ import annotations

import math

import pytest
from hypothesis import settings

from coneskin.robot.sim.urscript.values import (
    Array,
    PoseValue,
    ScriptError,
    _add,
    _copy,
    _divide,
    _modulo,
    _multiply,
    _negate,
    _power,
    _subtract,
    numbers,
    pose_of,
    values_of,
)

LAW = settings(max_examples=300)


def test_poses_go_both_ways() -> None:
    values = PoseValue((0.1, 0.2, 0.3, 0.4, -0.5, 0.6))
    assert values_of(pose_of(values)) == pytest.approx(values)
    assert isinstance(values_of(pose_of(values)), PoseValue)


def test_lists_add_element_by_element_and_copy_by_value() -> None:
    first, second = Array((1, 2)), Array((3, 5))
    assert _add(first, second) == [4, 7]
    assert _subtract(second, first) == [2, 3]
    assert _multiply(first, 2) == _multiply(2, first) == [2, 4]
    assert _negate(first) == [-1, -2]
    assert _divide(second, 2) == [1.5, 2.5]
    assert isinstance(_add(PoseValue((0,) * 6), PoseValue((1,) * 6)), PoseValue)
    other = _copy(first)
    other[0] = 9
    assert first == [1, 2]
    assert isinstance(_copy(PoseValue((0,) * 6)), PoseValue)
    with pytest.raises(ScriptError, match="needs another of the same length"):
        _add(first, Array((1, 2, 3)))


def test_no_result_grows_without_a_bound() -> None:
    """Whole numbers have 32 bits, beyond them they are doubles; a text and a list have a longest length."""
    assert _power(2, 10) == 1024
    assert isinstance(_power(2, 10), int)
    assert _power(9, 100) == pytest.approx(9.0**100)
    assert isinstance(_multiply(2**30, 2**30), float)
    assert isinstance(_add(2**31 - 1, 1), float)
    with pytest.raises(OverflowError):
        _power(9, _power(9, 9))
    with pytest.raises(ScriptError, match="not a real number"):
        _power(-8, 0.5)
    with pytest.raises(ScriptError, match="at most 10000 characters, got 12000"):
        _add("x" * 6000, "x" * 6000)
    for operation in (_multiply, _modulo):
        with pytest.raises(ScriptError, match="expected a number"):
            operation("%1000000000d", 10**9)


@pytest.mark.parametrize("values", [[1, 2], [1, 2, math.nan], [1, 2, math.inf], [1, 2, "x"], 3])
def test_what_is_not_a_list_of_finite_numbers_is_refused(values: object) -> None:
    with pytest.raises(ScriptError, match="joint positions must be"):
        numbers(values, 3, "joint positions")
