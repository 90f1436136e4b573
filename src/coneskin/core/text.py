"""Text that anybody may have written, or reads: JSON of files, lines for a terminal, times on a command line.

Whatever is wrong with a JSON is a ValueError. What came from a file must not move a terminal's cursor or change its
title.
"""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TextIO

_MAX_DIGITS = 100  # a longer whole number is none that anything counts; as int it would overflow where it meets a float
_HALF_PAIR = re.compile(rb"\\u[dD][89a-fA-F]")
_COLOR_CODES = {"red": 31, "green": 32, "yellow": 33, "blue": 34}


def suggest(name: str, known: Iterable[str]) -> str:
    """Return the end of "there is no such name; ...": the known name that was probably meant, or all of them."""
    import difflib  # where something is wrong, and not at each start

    names = list(known)
    near = difflib.get_close_matches(name, names, 1, 0.5)
    return f"did you mean {near[0]}?" if near else f"known: {', '.join(names)}" if names else "there is none at all"


def read_json(data: bytes) -> Any:
    r"""Return the value of a JSON text, in which each string can be written as UTF-8.

    Half a pair of UTF-16, as in the name of a file that is no UTF-8, is written out: six letters such as ``\udcff``.
    Whole numbers of over 100 digits are floats, infinite above 1.8e308.

    Raises:
        ValueError: it is no JSON, no UTF-8, or nested too deep.
    """
    try:
        value = json.loads(data.decode("utf-8-sig"), parse_int=_whole)
        return _encodable(value) if _HALF_PAIR.search(data) else value
    except RecursionError as error:
        raise ValueError("nested too deep") from error


def _whole(digits: str) -> int | float:
    return int(digits) if len(digits.lstrip("-")) <= _MAX_DIGITS else float(digits)


def _encodable(value: Any) -> Any:
    if isinstance(value, str):
        return value.encode("utf-8", "backslashreplace").decode()
    if isinstance(value, list):
        return [_encodable(item) for item in value]
    if isinstance(value, dict):
        return {_encodable(name): _encodable(item) for name, item in value.items()}
    return value


def finite(value: Any) -> Any:
    """Return a value for JSON, which has neither NaN nor infinity: None stands in the place of each."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): finite(item) for key, item in value.items()}
    return [finite(item) for item in value] if isinstance(value, list | tuple) else value


def painted(text: str, color: str, stream: TextIO) -> str:
    """Return a text in red, green, yellow or blue on a terminal, but not where NO_COLOR (no-color.org) says so."""
    if os.environ.get("NO_COLOR") or not stream.isatty():
        return text
    return f"\033[{_COLOR_CODES[color]}m{text}\033[0m"


def printable(text: str) -> str:
    """Return a text with its control characters written out; line feeds stay."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c == "\n" else c.encode("unicode_escape").decode("ascii") for c in text)


def positive_seconds(text: str) -> float:
    """Return the time in a word [s]; for ``type`` of an option.

    Raises:
        ArgumentTypeError: it is no number above 0; the message says so.
    """
    import argparse

    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not value > 0.0:
        raise argparse.ArgumentTypeError(f"must be a number of seconds above 0, such as 2.5, got {text!r}")
    return value


def html_card(title: str, rows: Sequence[tuple[str, str]], next_step: str, picture: str = "") -> str:
    """Return what a notebook shows of a value: a picture, a table, and what to do next.

    Args:
        title: of the table.
        rows: names and values; all that is text here is escaped.
        next_step: a call or a command.
        picture: HTML or SVG, as it is.
    """
    from html import escape  # for a notebook alone, and it takes a while to import

    lines = "".join(f"<tr><th style='text-align:left'>{escape(a)}</th><td>{escape(b)}</td></tr>" for a, b in rows)
    shown = f"<div style='max-width:480px'>{picture}</div>" if picture else ""
    return f"{shown}<b>{escape(title)}</b><table>{lines}</table><div>next: <code>{escape(next_step)}</code></div>"
