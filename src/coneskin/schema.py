"""Keys of a TOML table: their units, ranges and defaults, checked all at once.

A file writes the unit in the name of the key (``height_mm``); what comes out is SI and radians under the plain name.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

__all__ = ["Key", "check"]

_UNITS: Mapping[str, tuple[float, str]] = {
    "_mm_s": (1e-3, "mm/s"),
    "_deg_s2": (math.pi / 180.0, "deg/s2"),
    "_deg_s": (math.pi / 180.0, "deg/s"),
    "_rad_s2": (1.0, "rad/s2"),
    "_rad_s": (1.0, "rad/s"),
    "_mm": (1e-3, "mm"),
    "_deg": (math.pi / 180.0, "deg"),
    "_ms": (1e-3, "ms"),
    "_hz": (1.0, "Hz"),
    "_ma": (1e-3, "mA"),
    "_ohm": (1.0, "ohm"),
    "_v": (1.0, "V"),
    "_n": (1.0, "N"),
    "_s": (1.0, "s"),
}


@dataclass(frozen=True, slots=True)
class Key:
    """One key of a table.

    Attributes:
        name: as it stands in the file, its unit included.
        kind: float, int, str or bool; list for a list of numbers, dict for a list of tables.
        default: value where the key is missing, already in SI; ``...`` where it must be there.
        low: smallest value allowed, in the unit of the file.
        high: largest value allowed, in the unit of the file.
        choices: the words allowed.
        length: how many numbers a list has.
        above: whether low itself is forbidden.
        or_zero: whether 0 is allowed below low.
    """

    name: str
    kind: type = float
    default: Any = ...
    low: float = -math.inf
    high: float = math.inf
    choices: Sequence[str] = ()
    length: int | None = None
    above: bool = False
    or_zero: bool = False

    @property
    def suffix(self) -> str:
        """The part of the name that is its unit."""
        return next((s for s in _UNITS if self.name.endswith(s)), "") if self.kind in (float, list) else ""

    @property
    def plain(self) -> str:
        """The name without its unit."""
        return self.name.removesuffix(self.suffix)


def check(table: Mapping[str, Any], keys: Sequence[Key], where: str, problems: list[str]) -> dict[str, Any]:
    """Check a table and convert it.

    Args:
        table: from the file.
        keys: what may stand in it.
        where: its name in the file, for the messages.
        problems: every mistake is added here.

    Returns:
        the values in SI under their plain names; a key with a mistake has its default, or is missing.
    """
    known = {key.name: key for key in keys}
    for name in table:
        if name not in known:
            near = _nearest(name, known)
            problems.append(f"{where}: unknown key {name}; " + (f"did you mean {near}?" if near else _list(known)))
    values: dict[str, Any] = {}
    for key in keys:
        if key.default is not ...:
            values[key.plain] = key.default
        if key.name not in table:
            if key.default is ...:
                problems.append(f"{where}: the key {key.name} is missing")
            continue
        found = _convert(key, table[key.name], f"{where}.{key.name}", problems.append)
        if found is not None:
            values[key.plain] = found
    return values


def _nearest(name: str, known: Mapping[str, Key]) -> str | None:
    stem = name.rsplit("_", 1)[0]
    same = [other for other, key in known.items() if key.plain == stem or key.plain == name]
    return next(iter(same or difflib.get_close_matches(name, known, 1, 0.6)), None)


def _list(known: Mapping[str, Key]) -> str:
    return "known here: " + ", ".join(known)


def _convert(key: Key, value: Any, where: str, complain: Callable[[str], None]) -> Any:
    """The value in SI, or None with a complaint."""
    if key.kind is list:
        if not isinstance(value, list) or (key.length is not None and len(value) != key.length):
            complain(f"{where} must be a list of {key.length or 'some'} numbers, got {_show(value)}")
            return None
        numbers = [_number(key, item, f"{where}[{i}]", complain) for i, item in enumerate(value)]
        return None if None in numbers else tuple(numbers)
    if key.kind is float:
        return _number(key, value, where, complain)
    if key.kind is int:
        if isinstance(value, bool) or not isinstance(value, int) or not key.low <= value <= key.high:
            complain(f"{where} must be a whole number {_range(key, '')}, got {_show(value)}")
            return None
        return value
    if key.kind is dict:
        if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
            complain(f"{where} must be a list of tables, in double brackets, got {_show(value)}")
            return None
        return value
    if not isinstance(value, key.kind):
        complain(f"{where} must be {'text' if key.kind is str else 'true or false'}, got {_show(value)}")
        return None
    if key.choices and value not in key.choices:
        complain(f"{where} must be one of {', '.join(key.choices)}, got {_show(value)}")
        return None
    return value


def _number(key: Key, value: Any, where: str, complain: Callable[[str], None]) -> float | None:
    factor, unit = _UNITS.get(key.suffix, (1.0, ""))
    if isinstance(value, bool) or not isinstance(value, int | float):
        complain(f"{where} must be a number{f' [{unit}]' if unit else ''}, got {_show(value)}")
        return None
    try:
        value = float(value)
    except OverflowError:  # TOML's whole numbers have no largest
        complain(f"{where} must be {_range(key, unit)}, got {_show(value)}")
        return None
    inside = math.isfinite(value) and key.low <= value <= key.high and not (key.above and value == key.low)
    inside = inside or (key.or_zero and value == 0.0)
    if not inside:
        hint = ""
        if unit in ("mm", "mm/s") and math.isfinite(value) and key.low <= 1e3 * value <= key.high:
            hint = f": is that in metres? Then write {1e3 * value:g}"
        complain(f"{where} must be {_range(key, unit)}, got {_show(value)}{f' {unit}' if unit else ''}{hint}")
        return None
    return value * factor if factor != math.pi / 180.0 else math.radians(value)


def _show(value: Any) -> str:
    """A value as it stands in a message: whoever wrote it shall recognise it, not read all of it."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # Python does not print whole numbers of more than 4300 digits
        return "something too large to print"
    return text if len(text) <= 80 else f"{text[:77]}..."


def _range(key: Key, unit: str) -> str:
    unit = f" {unit}" if unit else ""
    low, high = math.isfinite(key.low), math.isfinite(key.high)
    if low and high:
        start = "above" if key.above else "0 or from" if key.or_zero else "from"
        return f"{start} {key.low:g} to {key.high:g}{unit}"
    if low:
        return f"{'above' if key.above else 'at least'} {key.low:g}{unit}"
    return f"at most {key.high:g}{unit}" if high else f"finite{unit and f' [{unit.strip()}]'}"
