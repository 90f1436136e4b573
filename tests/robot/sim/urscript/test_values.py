"""Rotation vectors and the lists of URScript."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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
    rotation_of,
    rotvec_of,
    values_of,
)

LAW = settings(max_examples=300)
ANGLE = st.floats(0.0, math.pi)
PART = st.floats(-1.0, 1.0)


@LAW
@given(st.tuples(PART, PART, PART), ANGLE)
def test_a_rotation_vector_survives_its_matrix(axis: tuple[float, float, float], angle: float) -> None:
    length = math.hypot(*axis)
    if length < 1e-3:
        return
    x, y, z = (angle * part / length for part in axis)
    matrix = rotation_of((x, y, z))
    again = rotation_of(rotvec_of(matrix))
    # near a half turn the axis is known to the square root of rounding at worst, its matrix to rounding
    for row, other in zip(matrix, again, strict=True):
        assert row == pytest.approx(other, abs=1e-11)


@pytest.mark.parametrize("angle", [0.0, 1e-13, 1e-9, 1e-5, 1.0, math.pi - 1e-5, math.pi - 1e-9])
def test_small_and_almost_half_turns(angle: float) -> None:
    vector = (angle / math.sqrt(3.0),) * 3
    # 1e-8: the sine of a turn that is 1e-9 short of a half one has eight digits less than the angle
    assert rotvec_of(rotation_of(vector)) == pytest.approx(vector, abs=1e-8)


@pytest.mark.parametrize("short", [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("axis", [(0.3, -0.5, 0.8), (-0.9, 0.1, 0.2), (0.1, -0.9, -0.3)])
def test_the_axis_is_not_lost_near_a_half_turn(axis: tuple[float, float, float], short: float) -> None:
    angle = (math.pi - short) / math.hypot(*axis)
    matrix = rotation_of((angle * axis[0], angle * axis[1], angle * axis[2]))
    for row, other in zip(matrix, rotation_of(rotvec_of(matrix)), strict=True):
        assert row == pytest.approx(other, abs=1e-14)  # from the sine alone it would be off by 1e-16 / short


def test_a_quarter_turn_about_z_is_what_it_is_called() -> None:
    assert rotation_of((0.0, 0.0, math.pi / 2))[1] == pytest.approx((1.0, 0.0, 0.0))


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
