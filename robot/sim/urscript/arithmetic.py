"""Arithmetic of URScript: numbers are doubles and 32-bit integers, lists add up; no result grows without a bound.

Python's integers and texts have no largest size: ``9 ^ 9 ^ 9``, or a text doubled a hundred times, would never end.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from .values import Array, PoseValue, ScriptError, copy, show

__all__ = ["OPERATIONS", "add", "divide", "make_list", "modulo", "multiply", "negate", "power", "subtract"]

MAX_ITEMS = 200  #: of a list
_MAX_TEXT = 10_000  # characters
_MAX_INTEGER = 2**31


def add(a: Any, b: Any) -> Any:
    """Return a sum of numbers, of texts, or of lists element by element."""
    if isinstance(a, list):
        return _each(add, a, _same(a, b))
    if isinstance(a, str) and isinstance(b, str) and len(a) + len(b) > _MAX_TEXT:
        raise ScriptError(f"a text has at most {_MAX_TEXT} characters, got {len(a) + len(b)}")
    return _bounded(a + b)


def subtract(a: Any, b: Any) -> Any:
    """Return a difference of numbers, or of lists element by element."""
    return _each(subtract, a, _same(a, b)) if isinstance(a, list) else _bounded(a - b)


def multiply(a: Any, b: Any) -> Any:
    """Return a product of numbers, or of a list and a number."""
    if isinstance(a, list):
        return _each(multiply, a, [_number(b)] * len(a))
    if isinstance(b, list):
        return _each(multiply, b, [_number(a)] * len(b))
    return _bounded(_number(a) * _number(b))


def divide(a: Any, b: Any) -> Any:
    """Return a quotient of numbers, or of a list and a number."""
    return _each(divide, a, [_number(b)] * len(a)) if isinstance(a, list) else _number(a) / _number(b)


def modulo(a: Any, b: Any) -> Any:
    """Return the rest of a division."""
    return _number(a) % _number(b)


def power(a: Any, b: Any) -> Any:
    """Return a power: whole where both numbers are and it fits."""
    result = float(_number(a)) ** float(_number(b))
    if isinstance(result, complex):
        raise ScriptError(f"{a!r} ^ {b!r} is not a real number")
    whole = isinstance(a, int) and isinstance(b, int) and b >= 0 and abs(result) < _MAX_INTEGER
    return int(result) if whole else result


def negate(a: Any) -> Any:
    """Return a number, or a list, with the other sign."""
    return type(a)(negate(x) for x in a) if isinstance(a, list) else -_number(a)


def make_list(items: tuple[Any, ...]) -> Array:
    """Return a list of values; lists in it are copied, and hold no lists themselves."""
    for item in items:
        if isinstance(item, list) and any(isinstance(inner, list) for inner in item):
            raise ScriptError("a list may hold lists, and those no further ones")
    return Array(map(copy, items))


def _make_pose(items: tuple[Any, ...]) -> PoseValue:
    return PoseValue(map(_number, items))


def _set_element(values: Any, key: Any, value: Any) -> None:
    """Set an element of a list of values, or of a list of lists."""
    if isinstance(value, list) and (value is values or any(isinstance(inner, list) for inner in value)):
        raise ScriptError("a list may hold lists, and those no further ones")
    values[key] = copy(value)


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
    "_add": add,
    "_subtract": subtract,
    "_multiply": multiply,
    "_divide": divide,
    "_modulo": modulo,
    "_power": power,
    "_negate": negate,
    "_list": make_list,
    "_pose": _make_pose,
    "_set": _set_element,
    "_copy": copy,
}
