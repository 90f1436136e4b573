"""URScript functions of texts, and values as text.

Source: Universal Robots, "The URScript Programming Language", module internals (str_at to to_str).
"""

from __future__ import annotations

import math
import re
from typing import Any

from .values import PoseValue, ScriptError, show

__all__ = ["StringFunctions", "text_of"]

MAX_TEXT = 1023  #: characters that str_cat and to_str make
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def text_of(value: Any) -> str:
    """Return a value as str_cat and to_str write it: numbers with up to six decimals, lists and poses in brackets.

    Raises:
        ScriptError: it is no text, number, truth value, list or pose, or makes too long a text.
    """
    text = _text_of(value)
    if len(text) > MAX_TEXT:
        raise ScriptError(f"a text made of values has at most {MAX_TEXT} characters, got {len(text)}")
    return text


def _text_of(value: Any) -> str:
    if isinstance(value, str | bool):
        return str(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            return str(value)
        return f"{value:.6f}".rstrip("0").removesuffix(".")
    if isinstance(value, int):
        return str(value)
    if isinstance(value, list):
        return f"{'p' * isinstance(value, PoseValue)}[{', '.join(map(_text_of, value))}]"
    raise ScriptError(f"a value of kind {type(value).__name__} is no text")


class StringFunctions:
    """URScript functions of texts; places in a text are counted from 0."""

    def str_at(self, src: Any, index: int) -> str:
        """Return the character at a place."""
        text = _text(src)
        return text[_place(index, len(text) - 1)]

    def str_cat(self, op1: Any, op2: Any) -> str:
        """Return two values as one text."""
        text = text_of(op1) + text_of(op2)
        if len(text) > MAX_TEXT:
            raise ScriptError(f"str_cat makes at most {MAX_TEXT} characters, got {len(text)}")
        return text

    def str_empty(self, str: Any) -> bool:
        """Return whether a text is empty."""
        return not _text(str)

    def str_find(self, src: Any, target: Any, start_from: int = 0) -> int:
        """Return the first place of one text in another; -1 without one."""
        text = _text(src)
        return text.find(_text(target), _place(start_from, len(text)))

    def str_len(self, str: Any) -> int:
        """Return the number of characters."""
        return len(_text(str))

    def str_sub(self, src: Any, index: int, len: int | None = None) -> str:
        """Return a part of a text."""
        text = _text(src)
        start = _place(index, text.__len__())
        return text[start:] if len is None else text[start : start + _place(len, 2**31)]

    def to_num(self, str: Any) -> int | float:
        """Return the number that a text shows: whole where it has no decimals."""
        text = _text(str).strip()
        if _NUMBER.fullmatch(text) is None:
            raise ScriptError(f"{show(text)!r} is not a number")
        number = float(text)
        whole = text.lstrip("+-").isdigit() and abs(number) < 2**31
        return int(number) if whole else number

    def to_str(self, val: Any) -> str:
        """Return a value as text."""
        return text_of(val)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise ScriptError(f"expected a text, got {show(value)}")
    return value


def _place(value: Any, last: int) -> int:
    if not isinstance(value, int | float) or value != value or not 0 <= int(value) <= last:
        raise ScriptError(f"a place or a length from 0 to {last} was expected, got {show(value)}")
    return int(value)
