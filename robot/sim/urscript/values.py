"""Values of URScript and their arithmetic: numbers, texts, lists, matrices, structs, poses p[x, y, z, rx, ry, rz].

A pose's rotation is a rotation vector: the axis times the angle [rad] (Universal Robots calls it axis-angle). A matrix
is a list of rows. No value ever changes: an assignment to an element makes a new list, so that no two variables share.

Numbers are doubles and 32-bit integers, and no result grows without a bound. Python's integers and texts have no
largest size: ``9 ^ 9 ^ 9``, or a text doubled a hundred times, would never end.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from coneskin.geometry.pose import Pose, Vector

_MAX_NUMBER = 1e6  # of a position, a speed, a time, an acceleration
_MAX_ITEMS_SHOWN, _MAX_TEXT_SHOWN = 50, 1000  # elements of a list, characters of a text


class ScriptError(Exception):
    """Program that cannot be understood, or that has failed: the controller logs it and stops the program.

    Args:
        message: what is wrong, for a person.
        title: the same in the controller's own words, which its clients compare; empty where it has none.
        line: of the program, from 1; 0 where it is not known.
        column: in that line, from 1; 0 where it is not known.
    """

    def __init__(self, message: str, *, title: str = "", line: int = 0, column: int = 0) -> None:
        super().__init__(message)
        self.title, self.line, self.column = title or message, line, column


class Array(list[Any]):
    """URScript list.

    Attributes:
        capacity: greatest number of elements, where it is not the number that the list has.
        size: number of values in it, and in all that it holds; 0 until it is asked for.
        depth: of lists in lists, likewise.
    """

    capacity: int | None = None
    size = depth = 0


class PoseValue(Array):
    """URScript pose: position [m] and rotation vector [rad], six numbers."""


class Struct(dict[str, Any]):
    """URScript struct: names of members -> values."""

    size = depth = 0


def numbers(values: Any, count: int, name: str) -> list[float]:
    """Return the values of a program as finite numbers.

    Raises:
        ScriptError: their count is not ``count``, or one is not a finite number.
    """
    if not isinstance(values, list) or len(values) != count or not all(isinstance(v, int | float) for v in values):
        raise ScriptError(f"{name} must be {count} numbers, got {show(values)}")
    return [number(value, name) for value in values]


def number(value: Any, name: str) -> float:
    """Return a value of a program as a number that an arm may have to do with.

    Raises:
        ScriptError: it is no number, or not from -1e6 to 1e6.
    """
    if not isinstance(value, int | float) or not abs(value) <= _MAX_NUMBER:
        raise ScriptError(f"{name} must be finite, at most {_MAX_NUMBER:g}, got {show(value)}")
    return float(value)


def show(value: Any) -> str:
    """Return a value as text for the log, shortened where it is long."""
    if isinstance(value, Struct):
        return f"struct({', '.join(f'{name}={show(item)}' for name, item in value.items())})"
    if isinstance(value, list):
        rest = ", ..." if len(value) > _MAX_ITEMS_SHOWN else ""
        shown = (repr(item)[:99] if isinstance(item, str) else show(item) for item in value[:_MAX_ITEMS_SHOWN])
        return f"{'p' * isinstance(value, PoseValue)}[{', '.join(shown)}{rest}]"
    return str(value)[:_MAX_TEXT_SHOWN]


def pose_of(values: Iterable[float]) -> Pose:
    """Return the rigid motion of x, y, z [m], rx, ry, rz [rad]."""
    x, y, z, *rotation_vector = (float(value) for value in values)
    return Pose.from_rotation_vector(rotation_vector, (x, y, z))


def values_of(pose: Pose) -> PoseValue:
    """Return x, y, z [m], rx, ry, rz [rad] of a rigid motion."""
    return PoseValue((*pose.translation, *pose.rotation_vector))


def interpolate(start: Pose, shift: Vector, turn: Vector, share: float) -> Pose:
    """Return a pose on the straight path: start moved by share * shift [m] and turned by share * turn [rad]."""
    p = start.translation
    here = (p[0] + share * shift[0], p[1] + share * shift[1], p[2] + share * shift[2])
    turned = Pose(start.rotation) @ Pose.from_rotation_vector([share * angle for angle in turn])
    return Pose(turned.rotation, here)


def solve_linear(rows: Sequence[Sequence[float]], right: Sequence[float], smallest: float) -> list[float] | None:
    """Solve linear equations (Gauss, partial pivoting); return None where a pivot is below the smallest allowed one."""
    m = [[*row, value] for row, value in zip(rows, right, strict=True)]
    n = len(m)
    for k in range(n):
        lead = max(range(k, n), key=lambda i: abs(m[i][k]))
        if abs(m[lead][k]) < smallest:
            return None
        m[k], m[lead] = m[lead], m[k]
        pivot = m[k]
        for i in range(k + 1, n):
            factor = m[i][k] / pivot[k]
            if factor:
                row = m[i]
                for j in range(k + 1, n + 1):
                    row[j] -= factor * pivot[j]
    x = [0.0] * n
    for k in range(n - 1, -1, -1):
        x[k] = (m[k][n] - sum(m[k][j] * x[j] for j in range(k + 1, n))) / m[k][k]
    return x


MAX_ITEMS = 200  #: of a list
_MAX_SIZE, _MAX_DEPTH = 20_000, 8  # values in a value, and lists or structs inside each other
_MAX_TEXT = 10_000  # characters
_MAX_INTEGER = 2**31


def is_matrix(value: Any) -> bool:
    """Return whether a value is a list of lists."""
    return isinstance(value, list) and bool(value) and all(isinstance(row, list) for row in value)


def _elementwise(operation: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """Return an operation of numbers as one of lists too: element by element, or with one number for all."""

    def apply(a: Any, b: Any) -> Any:
        if isinstance(a, list):
            if not isinstance(b, list):
                return type(a)([apply(x, b) for x in a])
            if len(a) != len(b):
                raise ScriptError(f"a list of {len(a)} needs another of the same length, got {show(b)}")
            return type(a)(map(apply, a, b))
        return type(b)([apply(a, y) for y in b]) if isinstance(b, list) else operation(a, b)

    return apply


def _plus(a: Any, b: Any) -> Any:
    if isinstance(a, str) and isinstance(b, str):
        if len(a) + len(b) > _MAX_TEXT:
            raise ScriptError(f"a text has at most {_MAX_TEXT} characters, got {len(a) + len(b)}")
        return a + b
    return _bounded(_number(a) + _number(b))


_add = _elementwise(_plus)
_subtract = _elementwise(lambda a, b: _bounded(_number(a) - _number(b)))
_divide = _elementwise(lambda a, b: _number(a) / _number(b))
_modulo = _elementwise(lambda a, b: _number(a) % _number(b))
_times = _elementwise(lambda a, b: _bounded(_number(a) * _number(b)))


def _multiply(a: Any, b: Any) -> Any:
    """Return a product: of matrices, of a matrix and a list as its column, or element by element."""
    if not (is_matrix(a) and isinstance(b, list)):
        return _times(a, b)
    if any(len(row) != len(b) for row in a):
        raise ScriptError(f"a matrix with rows of {len(a[0])} needs {len(a[0])} rows or elements, got {len(b)}")
    if is_matrix(b):
        return Array(Array(sum(map(_times, row, column)) for column in zip(*b, strict=True)) for row in a)
    return Array(sum(map(_times, row, b)) for row in a)


def _power(a: Any, b: Any) -> Any:
    """Return a power: whole where both numbers are and it fits."""
    result = float(_number(a)) ** float(_number(b))
    if isinstance(result, complex):
        raise ScriptError(f"{a!r} ^ {b!r} is not a real number")
    whole = isinstance(a, int) and isinstance(b, int) and b >= 0 and abs(result) < _MAX_INTEGER
    return int(result) if whole else result


def _negate(a: Any) -> Any:
    """Return a number, or a list, with the other sign."""
    return type(a)(map(_negate, a)) if isinstance(a, list) else -_number(a)


def _measured(value: Any) -> tuple[int, int]:
    """Return how many values a value holds, and how deep."""
    if not isinstance(value, Array | Struct):
        return 1, 0
    if not value.size:
        inner = [_measured(item) for item in (value.values() if isinstance(value, Struct) else value)]
        value.size = 1 + sum(size for size, _ in inner)
        value.depth = 1 + max((depth for _, depth in inner), default=0)
        if value.size > _MAX_SIZE or value.depth > _MAX_DEPTH:
            raise ScriptError(f"a value holds at most {_MAX_SIZE} values, and lists to a depth of {_MAX_DEPTH}")
    return value.size, value.depth


def _held(value: Any) -> Any:
    """Return a value that is not too large for a program."""
    _measured(value)
    return value


def make_list(items: Iterable[Any], capacity: int | None = None) -> Array:
    """Return a list of values.

    Raises:
        ScriptError: it is longer than its capacity, or holds too many values.
    """
    made = Array(items)
    made.capacity = capacity
    if len(made) > (MAX_ITEMS if capacity is None else capacity):
        raise ScriptError(f"a list has at most {capacity or MAX_ITEMS} elements here, got {len(made)}")
    return _held(made)  # type: ignore[no-any-return]


def _element(value: Any, *keys: Any) -> Any:
    """Return an element of a list, of a matrix, or a member of a struct."""
    for key in keys:
        if isinstance(value, Struct) and key in value:
            value = value[key]
        else:
            value = value[_index(value, key)]
    return value


def _index(value: Any, key: Any) -> int:
    if isinstance(key, str):
        raise ScriptError(f"{show(value)} has no member {key}")
    if not isinstance(value, list):
        raise ScriptError(f"only a list has elements, got {show(value)}")
    if not 0 <= (index := int(_number(key))) < len(value):
        raise ScriptError(f"a list of {len(value)} has no element {show(key)}")
    return index


def _with_element(item: Any, keys: tuple[Any, ...], value: Any) -> Any:
    """Return a value with another element or member; a struct may get a new one."""
    if not keys:
        return item
    key, *rest = keys
    made: Any
    if isinstance(value, Struct) and isinstance(key, str):
        made = Struct(value)
        made[key] = _with_element(item, tuple(rest), value.get(key))
        return _held(made)
    index = _index(value, key)
    made = _like(value, value)
    made[index] = _with_element(item, tuple(rest), value[index])
    return _held(made)


def _like(value: Any, items: Iterable[Any]) -> Any:
    made = type(value)(items)
    made.capacity = value.capacity
    return made


def call_method(value: Any, name: str, arguments: tuple[Any, ...]) -> tuple[Any, Any]:
    """Return a list, matrix or struct after one of its methods, and what the method returns.

    Source: Universal Robots, "The URScript Programming Language" 5.15 and later, types list and matrix.

    Raises:
        ScriptError: there is no such method, or its arguments do not fit.
    """
    if name == "to_string" and not arguments:
        return value, show(value)
    if not isinstance(value, Array) or name not in _METHODS:
        raise ScriptError(f"{show(value)} has no method {name}")
    items, capacity = list(value), len(value) if value.capacity is None else value.capacity
    try:
        result = _METHODS[name](items, capacity, *arguments)
    except TypeError as exc:
        raise ScriptError(f"{name}: {exc}") from exc
    if items == value and len(items) == len(value):
        return value, result
    if len(items) > capacity:
        raise ScriptError(f"{name}: the list has a capacity of {capacity} elements; make_list gives it another")
    made = _like(value, items)
    made.capacity = capacity
    return _held(made), result


#: methods that change the list
CHANGING_METHODS = frozenset(("append", "clear", "extend", "insert", "pop", "remove"))


#: method -> what it does with the elements and the capacity of a list
_METHODS: dict[str, Callable[..., Any]] = {
    "append": lambda items, _, value: items.append(value),
    "capacity": lambda _, capacity: capacity,
    "clear": lambda items, _: items.clear(),
    "excess_capacity": lambda items, capacity: capacity - len(items),
    "extend": lambda items, _, other: items.extend(other),
    "get_column": lambda items, _, index: Array(_element(row, index) for row in items),
    "get_row": lambda items, _, index: _element(Array(items), index),
    "insert": lambda items, _, index, value: items.insert(_index([*items, None], index), value),
    "length": lambda items, _: len(items),
    "pop": lambda items, _: items.pop(_index(items, len(items) - 1)),
    "remove": lambda items, _, index: items.__delitem__(_index(items, index)),
    "shape": lambda items, _: Array((len(items), len(items[0]) if is_matrix(items) else 1)),
    "slice": lambda items, _, begin, end: Array(items[_index([*items, None], begin) : _index([*items, None], end)]),
}


def _number(value: Any) -> Any:
    if not isinstance(value, int | float):
        raise ScriptError(f"expected a number, got {show(value)}")
    return value


def _bounded(value: Any) -> Any:
    """Return a whole number that does not fit 32 bits as a double."""
    return float(value) if isinstance(value, int) and not -_MAX_INTEGER <= value < _MAX_INTEGER else value


def _assert_true(value: Any, problem: str = "assertion failed") -> None:
    if not value:
        raise ScriptError(problem)


#: name in a translated program -> operation
OPERATIONS: dict[str, Callable[..., Any]] = {
    "_add": _add,
    "_subtract": _subtract,
    "_multiply": _multiply,
    "_divide": _divide,
    "_modulo": _modulo,
    "_power": _power,
    "_negate": _negate,
    "_list": make_list,
    "_pose": lambda items: PoseValue(map(_number, items)),
    "_struct": lambda members: _held(Struct(members)),
    "_at": _element,
    "_with": _with_element,
    "_assert": _assert_true,
}
