"""Values of URScript and their arithmetic: numbers, texts, lists and poses p[x, y, z, rx, ry, rz].

A pose's rotation is a rotation vector: the axis times the angle [rad] (Universal Robots calls it axis-angle).

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
    """URScript list."""


class PoseValue(Array):
    """URScript pose: position [m] and rotation vector [rad], six numbers."""


def _copy(value: Any) -> Any:
    """Return a copy of a list, or the value itself: URScript assigns lists by value."""
    return type(value)(value) if isinstance(value, list) else value


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


MAX_ITEMS = 200  #: of a list
_MAX_TEXT = 10_000  # characters
_MAX_INTEGER = 2**31


def _add(a: Any, b: Any) -> Any:
    """Return a sum of numbers, of texts, or of lists element by element."""
    if isinstance(a, list):
        return _each(_add, a, _same(a, b))
    if isinstance(a, str) and isinstance(b, str) and len(a) + len(b) > _MAX_TEXT:
        raise ScriptError(f"a text has at most {_MAX_TEXT} characters, got {len(a) + len(b)}")
    return _bounded(a + b)


def _subtract(a: Any, b: Any) -> Any:
    """Return a difference of numbers, or of lists element by element."""
    return _each(_subtract, a, _same(a, b)) if isinstance(a, list) else _bounded(a - b)


def _multiply(a: Any, b: Any) -> Any:
    """Return a product of numbers, or of a list and a number."""
    if isinstance(a, list):
        return _each(_multiply, a, [_number(b)] * len(a))
    if isinstance(b, list):
        return _each(_multiply, b, [_number(a)] * len(b))
    return _bounded(_number(a) * _number(b))


def _divide(a: Any, b: Any) -> Any:
    """Return a quotient of numbers, or of a list and a number."""
    return _each(_divide, a, [_number(b)] * len(a)) if isinstance(a, list) else _number(a) / _number(b)


def _modulo(a: Any, b: Any) -> Any:
    """Return the rest of a division."""
    return _number(a) % _number(b)


def _power(a: Any, b: Any) -> Any:
    """Return a power: whole where both numbers are and it fits."""
    result = float(_number(a)) ** float(_number(b))
    if isinstance(result, complex):
        raise ScriptError(f"{a!r} ^ {b!r} is not a real number")
    whole = isinstance(a, int) and isinstance(b, int) and b >= 0 and abs(result) < _MAX_INTEGER
    return int(result) if whole else result


def _negate(a: Any) -> Any:
    """Return a number, or a list, with the other sign."""
    return type(a)(_negate(x) for x in a) if isinstance(a, list) else -_number(a)


def make_list(items: tuple[Any, ...]) -> Array:
    """Return a list of values; lists in it are copied, and hold no lists themselves."""
    for item in items:
        if isinstance(item, list) and any(isinstance(inner, list) for inner in item):
            raise ScriptError("a list may hold lists, and those no further ones")
    return Array(map(_copy, items))


def _make_pose(items: tuple[Any, ...]) -> PoseValue:
    return PoseValue(map(_number, items))


def _set_element(values: Any, key: Any, value: Any) -> None:
    """Set an element of a list of values, or of a list of lists."""
    if isinstance(value, list) and (value is values or any(isinstance(inner, list) for inner in value)):
        raise ScriptError("a list may hold lists, and those no further ones")
    values[key] = _copy(value)


def _each(operation: Callable[[Any, Any], Any], a: list[Any], b: Sequence[Any]) -> Any:
    return type(a)(operation(x, y) for x, y in zip(a, b, strict=True))


def _same(values: Sequence[Any], other: Any) -> Sequence[Any]:
    if not isinstance(other, list) or len(other) != len(values):
        raise ScriptError(f"a list of {len(values)} needs another of the same length, got {show(other)}")
    return other


def _number(value: Any) -> Any:
    if not isinstance(value, int | float):
        raise ScriptError(f"expected a number, got {show(value)}")
    return value


def _bounded(value: Any) -> Any:
    """Return a whole number that does not fit 32 bits as a double."""
    return float(value) if isinstance(value, int) and not -_MAX_INTEGER <= value < _MAX_INTEGER else value


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
    "_pose": _make_pose,
    "_set": _set_element,
    "_copy": _copy,
}
