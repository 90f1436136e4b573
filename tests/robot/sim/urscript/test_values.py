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
    _divide,
    _modulo,
    _multiply,
    _negate,
    _power,
    _subtract,
    call_method,
    make_list,
    numbers,
    pose_of,
    values_of,
)

LAW = settings(max_examples=300)


def test_poses_go_both_ways() -> None:
    values = PoseValue((0.1, 0.2, 0.3, 0.4, -0.5, 0.6))
    assert values_of(pose_of(values)) == pytest.approx(values)
    assert isinstance(values_of(pose_of(values)), PoseValue)


def test_lists_add_element_by_element() -> None:
    first, second = Array((1, 2)), Array((3, 5))
    assert _add(first, second) == [4, 7]
    assert _subtract(second, first) == [2, 3]
    assert _multiply(first, 2) == _multiply(2, first) == [2, 4]
    assert _negate(first) == [-1, -2]
    assert _divide(second, 2) == [1.5, 2.5]
    assert isinstance(_add(PoseValue((0,) * 6), PoseValue((1,) * 6)), PoseValue)
    with pytest.raises(ScriptError, match="needs another of the same length"):
        _add(first, Array((1, 2, 3)))


def test_no_result_grows_without_a_bound() -> None:
    """Whole numbers have 32 bits, beyond them they are doubles; a text and a list have a longest length."""
    assert _power(2, 10) == 1024
    assert isinstance(_power(2, 10), int)
    assert [repr(_power(7, exponent)) for exponent in (1, 0)] == ["7", "1"]
    assert _power(2, -1) == 0.5
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


def test_matrices_and_lists_compute_as_the_manual_says() -> None:
    """The examples of its chapter "Matrix and Array Expressions"."""
    tall, wide = (
        make_list([Array((1, 2)), Array((3, 4)), Array((5, 6))]),
        make_list([Array((10, 20, 30)), Array((40, 50, 60))]),
    )
    assert _multiply(tall, wide) == [[90, 120, 150], [190, 260, 330], [290, 400, 510]]
    assert _multiply(tall, Array((10, 20))) == [50, 110, 170]
    assert _multiply(Array((1, 2, 3)), Array((10, 20, 30))) == [10, 40, 90]
    assert _divide(Array((10, 20, 30)), Array((1, 2, 3))) == [10, 10, 10]
    assert _modulo(Array((11, 22, 33)), 5) == [1, 2, 3]
    assert _modulo(121, make_list([Array((10, 20)), Array((30, 40))])) == [[1, 1], [1, 1]]
    assert _divide(10, Array((10, 20, 40))) == [1, 0.5, 0.25]
    assert _add(10, Array((1, 2))) == _add(Array((1, 2)), 10) == [11, 12]
    assert _subtract(5, make_list([Array((10, 20))])) == [[-5, -15]]
    with pytest.raises(ScriptError, match="a matrix with rows of 2 needs 2 rows or elements, got 3"):
        _multiply(tall, tall)


def test_a_value_is_bounded_in_size_and_depth() -> None:
    wide = make_list([0] * 200)
    for _ in range(2):
        with pytest.raises(ScriptError, match="at most 20000 values"):
            make_list([wide] * 150)
    deep = make_list([1])
    for _ in range(7):
        deep = make_list([deep])
    with pytest.raises(ScriptError, match="to a depth of 8"):
        make_list([deep])


def test_a_method_returns_the_list_after_it() -> None:
    values = make_list([1, 2], 4)
    assert call_method(values, "append", (3,)) == ([1, 2, 3], None)
    assert call_method(values, "pop", ()) == ([1], 2)
    assert call_method(values, "insert", (0, 9)) == ([9, 1, 2], None)
    assert call_method(values, "remove", (0,)) == ([2], None)
    assert call_method(values, "extend", (Array((3, 4)),)) == ([1, 2, 3, 4], None)
    assert call_method(values, "clear", ()) == ([], None)
    assert [call_method(values, name, ())[1] for name in ("length", "capacity", "excess_capacity")] == [2, 4, 2]
    assert call_method(values, "slice", (1, 2)) == (values, [2])
    assert call_method(values, "to_string", ())[1] == "[1, 2]"
    matrix = make_list([Array((1, 2)), Array((3, 4)), Array((5, 6))])
    assert call_method(matrix, "get_row", (1,))[1] == [3, 4]
    assert call_method(matrix, "get_column", (1,))[1] == [2, 4, 6]
    assert call_method(matrix, "shape", ())[1] == [3, 2]
    assert values == [1, 2]
    with pytest.raises(ScriptError, match="a capacity of 2 elements; make_list gives it another"):
        call_method(make_list([1, 2]), "append", (3,))
    for name, arguments in (("sort", ()), ("append", ()), ("pop", (1,))):
        with pytest.raises(ScriptError, match=name):
            call_method(values, name, arguments)
    with pytest.raises(ScriptError, match="has no element"):
        call_method(make_list([], 3), "pop", ())
