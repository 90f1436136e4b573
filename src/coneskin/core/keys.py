"""Keys of a TOML table: name, type, unit, range, default and meaning, checked all at once.

In a file the unit is part of the name of the key (``height_mm``); checked values are in SI and radians under the plain
name. The same keys give the options of commands, and the reference pages: ``unit``, ``bounds`` and ``default_words``
are their columns.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from .text import suggest

_RAD_PER_DEG = math.pi / 180.0  # rad
_KEY_UNITS: Mapping[str, tuple[float, str]] = {
    "_n_per_mm": (1e3, "N/mm"),
    "_n_per_cm2": (1e4, "N/cm2"),
    "_cm2": (1e-4, "cm2"),
    "_kg": (1.0, "kg"),
    "_mm_s": (1e-3, "mm/s"),
    "_deg_s2": (_RAD_PER_DEG, "deg/s2"),
    "_deg_s": (_RAD_PER_DEG, "deg/s"),
    "_rad_s2": (1.0, "rad/s2"),
    "_rad_s": (1.0, "rad/s"),
    "_mm": (1e-3, "mm"),
    "_deg": (_RAD_PER_DEG, "deg"),
    "_ppm": (1e-6, "ppm"),
    "_days": (86400.0, "days"),
    "_s_per_m": (1.0, "s/m"),
    "_per_s": (1.0, "1/s"),
    "_siemens": (1.0, "S"),
    "_ms": (1e-3, "ms"),
    "_hz": (1.0, "Hz"),
    "_ma": (1e-3, "mA"),
    "_ohm": (1.0, "ohm"),
    "_v": (1.0, "V"),
    "_mb": (1e6, "MB"),
    "_mpa": (1e6, "MPa"),
    "_n": (1.0, "N"),
    "_s": (1.0, "s"),
}
_MEANING_LINE = re.compile(r"^(\w+): (.*(?:\n .*)*)", re.MULTILINE)
_TYPE_WORDS = {float: "ratio", int: "whole number", str: "text", bool: "true or false", dict: "tables", tuple: "texts"}


@dataclass(frozen=True, slots=True)
class Key:
    """One key of a table: its type, unit, range and default.

    Attributes:
        name: in the file, with its unit.
        kind: float, int, str or bool; list for a list of numbers, tuple for one of texts, dict for one of tables.
        default: value of a missing key, in SI; ``...`` for a mandatory key.
        low: smallest value allowed, in the unit of the file.
        high: largest value allowed, in the unit of the file.
        choices: words or whole numbers allowed.
        length: number of items in a list.
        above: True if low itself is not allowed.
        or_zero: True if 0 is allowed below low.
        one_for_all: True if one number may stand for a list of equal ones.
        meaning: what it is, without a full stop: for help, for a message that it is missing, and for the reference.
        unset: what holds where the key is missing and its default is no value, in words: "none", "any".
    """

    name: str
    kind: type = float
    default: Any = ...
    low: float = -math.inf
    high: float = math.inf
    choices: Sequence[str | int] = ()
    length: int | None = None
    above: bool = False
    or_zero: bool = False
    one_for_all: bool = False
    meaning: str = ""
    unset: str = ""

    @property
    def suffix(self) -> str:
        """Unit at the end of the name, with its underscore; empty without a unit."""
        return next((s for s in _KEY_UNITS if self.name.endswith(s)), "") if self.kind in (float, list) else ""

    @property
    def plain(self) -> str:
        """Name without the unit."""
        return self.name.removesuffix(self.suffix)

    @property
    def unit(self) -> str:
        """Unit or type for people: "mm", "deg, 3 numbers", "whole number", "text", "ratio"."""
        named = _KEY_UNITS.get(self.suffix, (1.0, ""))[1]
        if self.kind is list:
            numbers = f"{self.length} numbers" if self.length else "numbers"
            return ", ".join([*([named] if named else []), f"1 or {numbers}" if self.one_for_all else numbers])
        return named or _TYPE_WORDS[self.kind]

    @property
    def bounds(self) -> str:
        """Range for people: "1 to 500", "above 0 to 360", "A, B"; empty without one."""
        if self.choices:
            return ", ".join(map(str, self.choices))
        low, high = math.isfinite(self.low), math.isfinite(self.high)
        start = "above " if self.above else "0 or " if self.or_zero else "" if high else "at least "
        end = f"{self.high}" if self.kind is int else f"{self.high:g}"
        return f"{start}{self.low:g}{f' to {end}' if high else ''}" if low else f"at most {end}" if high else ""

    @property
    def default_words(self) -> str:
        """Default for people, in the unit of the file; "-" where the key must be there."""
        if self.default is ...:
            return "-"
        if self.unset or self.default is None or self.kind is dict:
            return self.unset or "none"
        if self.kind is tuple:
            return ", ".join(self.default)
        if self.kind is list:
            numbers = [f"{self.in_file_unit(value):g}" for value in self.default]
            return numbers[0] if self.one_for_all and len(set(numbers)) == 1 else f"[{', '.join(numbers)}]"
        if self.kind is bool:
            return str(self.default).lower()
        return f"{self.in_file_unit(self.default):g}" if self.kind is float else str(self.default) or "none"

    def in_file_unit(self, value: float) -> float:
        """Convert a value from SI to the unit of the key."""
        factor = _KEY_UNITS.get(self.suffix, (1.0, ""))[0]
        return value * (1.0 / factor) if factor != _RAD_PER_DEG else math.degrees(value)  # 1 / 1e-3 is 1000 exactly


def with_meanings(text: str, *keys: Key) -> tuple[Key, ...]:
    """Return keys with their meanings.

    Args:
        text: "name: meaning" for each key that has none yet; further lines of a meaning are indented.
        keys: without meanings.

    Raises:
        ValueError: the text has another name, or a key none.
    """
    meanings = {name: " ".join(words.split()) for name, words in _MEANING_LINE.findall(inspect.cleandoc(text))}
    if extra := meanings.keys() - {key.name for key in keys}:
        raise ValueError(f"there is no key {', '.join(sorted(extra))}")
    found = tuple(replace(key, meaning=meanings.get(key.name, key.meaning)) for key in keys)
    if bare := [key.name for key in found if not key.meaning]:
        raise ValueError(f"no meaning is given for {', '.join(bare)}")
    return found


def check(table: Mapping[str, Any], keys: Sequence[Key], where: str, problems: list[str]) -> dict[str, Any]:
    """Check a table and convert its values to SI.

    Args:
        keys: keys that it may have.
        problems: every mistake is added here.

    Returns:
        the values in SI under their plain names; a key with a mistake has its default, or is missing.
    """
    known = {key.name: key for key in keys}
    for name in table:
        if name not in known:
            stem = name.rsplit("_", 1)[0]
            same = [key.name for key in keys if key.plain in (stem, name)]  # with another unit, or with none
            problems.append(f"{where}: unknown key {name}; {suggest(name, same[:1] or known)}")
    values: dict[str, Any] = {}
    for key in keys:
        if key.default is not ...:
            values[key.plain] = key.default
        if key.name not in table:
            if key.default is ...:
                problems.append(f"{where}: the key {key.name} is missing" + (f": {key.meaning}" if key.meaning else ""))
            continue
        found = _convert(key, table[key.name], f"{where}.{key.name}", problems.append)
        if found is not None:
            values[key.plain] = found
    return values


def _convert(key: Key, value: Any, where: str, report: Callable[[str], None]) -> Any:
    """Return the value in SI; report a mistake and return None."""
    if key.kind is list:
        if key.one_for_all and not isinstance(value, list):
            number = _number(key, value, where, report)
            return None if number is None else (number,) * (key.length or 1)
        if not isinstance(value, list) or (key.length is not None and len(value) != key.length):
            report(f"{where} must be a list of {key.length or 'some'} numbers, got {_show(value)}")
            return None
        numbers = [_number(key, item, f"{where}[{i}]", report) for i, item in enumerate(value)]
        return None if None in numbers else tuple(numbers)
    if key.kind is tuple:
        if isinstance(value, list) and len(value) == key.length and all(isinstance(item, str) for item in value):
            return tuple(value)
        report(f"{where} must be a list of {key.length} texts, got {_show(value)}")
        return None
    if key.kind is float:
        return _number(key, value, where, report)
    if key.kind is int:
        if isinstance(value, bool) or not isinstance(value, int) or not key.low <= value <= key.high:
            report(f"{where} must be a whole number {_range(key, '')}, got {_show(value)}")
            return None
    elif key.kind is dict:
        if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
            report(f"{where} must be a list of tables, in double brackets, got {_show(value)}")
            return None
    elif not key.choices and not isinstance(value, key.kind):
        report(f"{where} must be {'text' if key.kind is str else 'true or false'}, got {_show(value)}")
        return None
    if key.choices and value not in key.choices:
        report(f"{where} must be one of {', '.join(map(str, key.choices))}, got {_show(value)}")
        return None
    return value


def _number(key: Key, value: Any, where: str, report: Callable[[str], None]) -> float | None:
    factor, unit = _KEY_UNITS.get(key.suffix, (1.0, ""))
    if isinstance(value, bool) or not isinstance(value, int | float):
        report(f"{where} must be a number{f' [{unit}]' if unit else ''}, got {_show(value)}")
        return None
    try:
        value = float(value)
    except OverflowError:  # integers of TOML have no upper limit
        report(f"{where} must be {_range(key, unit)}, got {_show(value)}")
        return None
    inside = math.isfinite(value) and key.low <= value <= key.high and not (key.above and value == key.low)
    inside = inside or (key.or_zero and value == 0.0)
    if not inside:
        hint = ""
        if unit in ("mm", "mm/s") and math.isfinite(value) and key.low <= 1e3 * value <= key.high:
            hint = f": is that in metres? Then write {1e3 * value:g}"
        report(f"{where} must be {_range(key, unit)}, got {_show(value)}{f' {unit}' if unit else ''}{hint}")
        return None
    return value * factor if factor != _RAD_PER_DEG else math.radians(value)


def _show(value: Any) -> str:
    """Return the text of a value for a message, shortened if it is long."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # Python does not print integers of more than 4300 digits
        return "something too large to print"
    return text if len(text) <= 80 else f"{text[:77]}..."


def _range(key: Key, unit: str) -> str:
    """Return the bounds of a key for a message: "from 1 to 500 mm", "0 or from 1 to 5000 mm", "at most 20 %"."""
    if not (bounds := key.bounds):
        return f"finite{unit and f' [{unit}]'}"
    if key.choices:
        return f"among {bounds}"
    if bounds[0] in "-0123456789":
        bounds = bounds.replace("0 or ", "0 or from ") if key.or_zero else f"from {bounds}"
    return f"{bounds} {unit}".rstrip()
