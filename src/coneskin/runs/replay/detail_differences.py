"""Differences between the details of two events, in words with units."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeGuard

from .quantities import QUANTITIES, Quantity, Tolerances

__all__ = ["describe_differences", "distance", "milliseconds"]

#: stamps and counters: they move with the event's time, or with another event that is reported itself
_STAMPS = frozenset({"clock_us", "sequence", "number", "stop", "request", "count"})
_FOLLOWS = frozenset({"point", "normal"})  # from u and phi
_PLAIN = Quantity("", 1.0, "", 4, "relative")
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def describe_differences(
    one: Mapping[str, Any], other: Mapping[str, Any], tolerances: Tolerances, all_of_them: bool = False
) -> list[str]:
    """Return the differences between the details of two events, such as "u 130.0 -> 131.2 mm".

    What only follows from another difference is left out: the point where u or phi has moved, numbers and stamps.

    Args:
        one: details of an event.
        other: of the one that stands for it.
        tolerances: what does not count.
        all_of_them: True for those, too.
    """
    found: dict[str, str] = {}
    for key in dict.fromkeys([*one, *other]):
        if key in _STAMPS and not all_of_them:
            continue
        if key not in one or key not in other:
            found[key] = f"{key} {'is new' if key in other else 'is gone'}"
        else:
            lines = list(_differ(key, one[key], other[key], tolerances, all_of_them))
            if lines:
                found[key] = ", ".join(lines)
    if found.keys() & {"u", "phi"} and not all_of_them:
        found = {key: line for key, line in found.items() if key not in _FOLLOWS}
    return list(found.values())


def milliseconds(seconds: float) -> str:
    """Return a short time [s] in milliseconds, with as many digits as it takes to see it."""
    for digits in range(1, 7):
        if 1e3 * seconds >= 0.5 * 10**-digits:
            return f"{1e3 * seconds:.{digits}f} ms"
    return f"{1e3 * seconds:.1e} ms"


def distance(one: Mapping[str, Any], other: Mapping[str, Any]) -> float | None:
    """Return how far apart the points of two contacts are [m]; None where one has none."""
    a, b = one.get("point"), other.get("point")
    if not (_is_vector(a) and _is_vector(b)) or len(a) != len(b):
        return None
    return math.dist(a, b)


def _is_vector(value: Any) -> TypeGuard[Sequence[float]]:
    return isinstance(value, list | tuple) and bool(value) and all(_is_number(item) for item in value)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _differ(key: str, a: Any, b: Any, tolerances: Tolerances, all_of_them: bool) -> Iterator[str]:
    quantity = QUANTITIES.get(key, _PLAIN)
    if _is_number(a) and _is_number(b):
        if not _close(quantity, a, b, tolerances):
            yield f"{key} {_pair(quantity, a, b)}"
    elif _is_vector(a) and _is_vector(b) and len(a) == len(b):
        if not all(_close(quantity, x, y, tolerances) for x, y in zip(a, b, strict=True)):
            yield _vector(key, quantity, a, b)
    elif isinstance(a, Mapping) and isinstance(b, Mapping):
        yield from (f"{key} {line}" for line in describe_differences(a, b, tolerances, all_of_them))
    elif _is_list(a) and _is_list(b) and len(a) == len(b):
        for number, (x, y) in enumerate(zip(a, b, strict=True), 1):
            yield from _differ(key if len(a) == 1 else f"{key} {number}", x, y, tolerances, all_of_them)
    elif isinstance(a, str) and isinstance(b, str):
        if a != b if all_of_them else _NUMBER.sub("#", a) != _NUMBER.sub("#", b):
            yield f"{key} {a!r} -> {b!r}"
    elif a is None or b is None:
        if a is not b:
            yield f"{key} is {'not known any more' if b is None else 'known now'}"
    elif a != b:
        yield f"{key} {a!r} -> {b!r}"


def _is_list(value: Any) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str)


def _vector(key: str, quantity: Quantity, a: Sequence[float], b: Sequence[float]) -> str:
    if key == "normal":
        cosine = sum(x * y for x, y in zip(a, b, strict=True)) / (math.hypot(*a) * math.hypot(*b) or 1.0)
        return f"normal turned by {math.degrees(math.acos(max(-1.0, min(1.0, cosine)))):.2f} deg"
    moved = quantity.factor * math.dist(a, b)
    return f"{key} moved by {_text(quantity, moved)}{quantity.unit and ' ' + quantity.unit}"


def _close(quantity: Quantity, a: float, b: float, tolerances: Tolerances) -> bool:
    if math.isnan(a) and math.isnan(b):
        return True
    within: float = getattr(tolerances, quantity.tolerance)
    if quantity.tolerance == "relative":
        return math.isclose(a, b, rel_tol=within, abs_tol=1e-12)
    if quantity.tolerance == "angle" and math.isfinite(a) and math.isfinite(b):
        return abs(math.remainder(a - b, math.tau)) <= within
    return math.isclose(a, b, rel_tol=0.0, abs_tol=within)


def _pair(quantity: Quantity, a: float, b: float) -> str:
    """Return two numbers with up to nine digits to tell them apart, or one and by how much the other differs."""
    if isinstance(a, int) and isinstance(b, int) and not quantity.unit:
        return f"{a} -> {b}"
    for digits in range(quantity.digits, 10):
        texts = [f"{quantity.factor * value:.{digits}f}" for value in (a, b)]
        if texts[0] != texts[1]:
            break
    else:
        unit = quantity.unit and " " + quantity.unit
        return f"{quantity.factor * a:.6g}{unit}, by {quantity.factor * (b - a):+.1e}{unit}"
    return f"{texts[0]} -> {texts[1]}{quantity.unit and ' ' + quantity.unit}"


def _text(quantity: Quantity, value: float) -> str:
    return f"{value:.{quantity.digits}f}" if value >= 0.5 * 10**-quantity.digits else f"{value:.1e}"
