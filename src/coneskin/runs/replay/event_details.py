"""Differences between the details of two events, in words with units, and how much of a difference counts."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from itertools import zip_longest
from typing import Any, NamedTuple, TypeGuard

from coneskin.core.errors import RecordingError
from coneskin.robot.guard.signals.event_text import describe
from coneskin.robot.guard.signals.journal import GuardEvent

_RAD_PER_DEG = math.pi / 180.0  # rad


class _Quantity(NamedTuple):
    """Kind of number."""

    si_unit: str  #: as in names of columns, such as "m"; empty for a ratio
    factor: float  #: by which a value in SI is multiplied for people
    unit: str  #: of the product
    digits: int  #: after the decimal point
    tolerance: str  #: the field of ``Tolerances`` that holds for it


_LENGTH_QUANTITY = _Quantity("m", 1e3, "mm", 1, "place")
_RATIO_QUANTITY = _Quantity("", 1.0, "", 3, "level")
#: name of a detail -> what it is; an unknown number is compared as a ratio of its size
QUANTITIES: Mapping[str, _Quantity] = {
    **dict.fromkeys(("u", "point", "line", "progress", "braking", "radius", "elongation"), _LENGTH_QUANTITY),
    **dict.fromkeys(("ellipse 1", "ellipse 2"), _LENGTH_QUANTITY),
    **dict.fromkeys(("normal", "level", "slider", "before", "radius_deviation"), _RATIO_QUANTITY),
    "covariance": _Quantity("m2", 1e6, "mm^2", 4, "place"),
    "velocity": _Quantity("m_s", 1e3, "mm/s", 1, "place"),
    "phi": _Quantity("rad", 1.0 / _RAD_PER_DEG, "deg", 1, "angle"),
    "speed": _Quantity("rad_s", 1.0, "rad/s", 4, "speed"),
}


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Largest differences that do not count.

    The defaults let another machine's sine and cosine differ in the last bits, and nothing else.
    """

    place: float = 1e-9  #: of a length [m]
    angle: float = 1e-9  #: [rad]
    level: float = 1e-9  #: of a touch, and of any other ratio
    speed: float = 1e-9  #: of a joint [rad/s]
    time: float = 1e-9  #: of an event [s]
    relative: float = 1e-9  #: of any other number, as a ratio of it

    @classmethod
    def from_words(cls, words: Iterable[str]) -> Tolerances:
        """Return tolerances from words with the unit in the name.

        Args:
            words: such as "place_mm=0.5"; the others are ``angle_deg``, ``level``, ``speed_rad_s``, ``time_ms`` and
                ``relative``.

        Raises:
            RecordingError: a name is another, or a value is negative or not finite.
        """
        values = {}
        for word in words:
            name, _, text = word.partition("=")
            name = name.strip()
            try:
                value = float(text)
            except ValueError:
                raise RecordingError(f"a tolerance is NAME=VALUE, such as place_mm=0.5, got {word!r}") from None
            if name not in _TOLERANCE_UNITS:
                raise RecordingError(f"there is no tolerance {name}; there are {', '.join(_TOLERANCE_UNITS)}")
            if not (math.isfinite(value) and value >= 0.0):
                raise RecordingError(f"the tolerance {name} must be finite and not negative, got {value!r}")
            field, factor = _TOLERANCE_UNITS[name]
            values[field] = value * factor
        return cls(**values)


EXACT = Tolerances(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  #: every bit counts
_TOLERANCE_UNITS: Mapping[str, tuple[str, float]] = {
    "place_mm": ("place", 1e-3),
    "angle_deg": ("angle", _RAD_PER_DEG),
    "level": ("level", 1.0),
    "speed_rad_s": ("speed", 1.0),
    "time_ms": ("time", 1e-3),
    "relative": ("relative", 1.0),
}
#: stamps and counters: they move with the event's time, or with another event that is reported itself
_COUNTER_DETAILS = frozenset({"clock_us", "sequence", "number", "stop", "request", "count"})
_DERIVED_DETAILS = frozenset({"point", "normal"})  # from u and phi
_PLAIN_QUANTITY = _Quantity("", 1.0, "", 4, "relative")
_NUMBER_PATTERN = re.compile(r"-?\d+(?:\.\d+)?")


def describe_differences(
    one: Mapping[str, Any], other: Mapping[str, Any], tolerances: Tolerances, all_of_them: bool = False
) -> list[str]:
    """Return the differences between the details of two events, such as "u 130.0 -> 131.2 mm".

    What only follows from another difference is left out: the point where u or phi has moved, numbers and stamps.

    Args:
        all_of_them: True for those, too.
    """
    found: dict[str, str] = {}
    for key in dict.fromkeys([*one, *other]):
        if key in _COUNTER_DETAILS and not all_of_them:
            continue
        if key not in one or key not in other:
            found[key] = f"{key} {'is new' if key in other else 'is gone'}"
        else:
            lines = list(_differ(key, one[key], other[key], tolerances, all_of_them))
            if lines:
                found[key] = ", ".join(lines)
    if found.keys() & {"u", "phi"} and not all_of_them:
        found = {key: line for key, line in found.items() if key not in _DERIVED_DETAILS}
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
    if not (is_vector(a) and is_vector(b)) or len(a) != len(b):
        return None
    return math.dist(a, b)


def is_vector(value: Any) -> TypeGuard[Sequence[float]]:
    """Tell whether a detail is a list of numbers, and not empty."""
    return isinstance(value, list | tuple) and bool(value) and all(map(is_number, value))


def is_number(value: Any) -> bool:
    """Tell whether a detail is a number; true and false are none."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def _differ(key: str, a: Any, b: Any, tolerances: Tolerances, all_of_them: bool) -> Iterator[str]:
    quantity = QUANTITIES.get(key, _PLAIN_QUANTITY)
    if is_number(a) and is_number(b):
        if not _close(quantity, a, b, tolerances):
            yield f"{key} {_pair(quantity, a, b)}"
    elif is_vector(a) and is_vector(b) and len(a) == len(b):
        if not all(_close(quantity, x, y, tolerances) for x, y in zip(a, b, strict=True)):
            yield _vector(key, quantity, a, b)
    elif isinstance(a, Mapping) and isinstance(b, Mapping):
        yield from (f"{key} {line}" for line in describe_differences(a, b, tolerances, all_of_them))
    elif _is_list(a) and _is_list(b) and len(a) == len(b):
        for number, (x, y) in enumerate(zip(a, b, strict=True), 1):
            yield from _differ(key if len(a) == 1 else f"{key} {number}", x, y, tolerances, all_of_them)
    elif isinstance(a, str) and isinstance(b, str):
        if a != b if all_of_them else _NUMBER_PATTERN.sub("#", a) != _NUMBER_PATTERN.sub("#", b):
            yield f"{key} {a!r} -> {b!r}"
    elif a is None or b is None:
        if a is not b:
            yield f"{key} is {'not known any more' if b is None else 'known now'}"
    elif a != b:
        yield f"{key} {a!r} -> {b!r}"


def _is_list(value: Any) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str)


def _vector(key: str, quantity: _Quantity, a: Sequence[float], b: Sequence[float]) -> str:
    if key == "normal":
        cosine = sum(x * y for x, y in zip(a, b, strict=True)) / (math.hypot(*a) * math.hypot(*b) or 1.0)
        return f"normal turned by {math.degrees(math.acos(max(-1.0, min(1.0, cosine)))):.2f} deg"
    moved = quantity.factor * math.dist(a, b)
    text = f"{moved:.{quantity.digits}f}" if moved >= 0.5 * 10**-quantity.digits else f"{moved:.1e}"
    return f"{key} moved by {text}{quantity.unit and ' ' + quantity.unit}"


def _close(quantity: _Quantity, a: float, b: float, tolerances: Tolerances) -> bool:
    if math.isnan(a) and math.isnan(b):
        return True
    within: float = getattr(tolerances, quantity.tolerance)
    if quantity.tolerance == "relative":
        return math.isclose(a, b, rel_tol=within, abs_tol=1e-12)
    if quantity.tolerance == "angle" and math.isfinite(a) and math.isfinite(b):
        return abs(math.remainder(a - b, math.tau)) <= within
    return math.isclose(a, b, rel_tol=0.0, abs_tol=within)


def _pair(quantity: _Quantity, a: float, b: float) -> str:
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


def event_differences(recorded: Sequence[GuardEvent], replayed: Sequence[GuardEvent], start: float) -> Iterator[str]:
    """Yield a line for each event that is not the same, bit by bit, or has no partner; times count from start [s]."""
    bits = [_bits(event) for event in recorded], [_bits(event) for event in replayed]
    if bits[0] == bits[1]:
        return
    for same, i, end, j, other_end in SequenceMatcher(None, *bits, autojunk=False).get_opcodes():
        if same != "equal":
            for old, new in zip_longest(recorded[i:end], replayed[j:other_end]):
                yield _describe(old, new, start)


def _bits(event: GuardEvent) -> tuple[str, str, str]:
    """Return an event as text with every bit of its floats."""
    return event.time.hex(), event.name, json.dumps(event.details)


def _describe(old: GuardEvent | None, new: GuardEvent | None, start: float) -> str:
    if old is None or new is None:
        event, word = (old, "was recorded, and is not replayed") if new is None else (new, "is new")
        assert event is not None
        return f"{describe(event, start).strip()}: {word}"
    if old.name != new.name:
        return f"{describe(old, start).strip()}: replayed as {describe(new, start).strip()}"
    words = describe_differences(old.details, new.details, EXACT, all_of_them=True)
    if new.time != old.time:
        words.append(f"{milliseconds(abs(new.time - old.time))} {'later' if new.time > old.time else 'earlier'}")
    said = "; ".join(words) or "other words for the same"  # the order of its details
    return f"{old.time - start:.4f} s, {old.name}: {said}"
