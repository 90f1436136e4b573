"""Text for a terminal: what came from a file must not move its cursor or change its title."""

from __future__ import annotations

import os
from typing import TextIO

__all__ = ["painted", "printable"]

_COLORS = {"red": 31, "green": 32, "yellow": 33, "blue": 34}


def painted(text: str, color: str, stream: TextIO) -> str:
    """Return a text in a colour where the stream is a terminal, and NO_COLOR (no-color.org) is empty or not set.

    Args:
        text: to be printed.
        color: red, green, yellow or blue.
        stream: on which it is printed.
    """
    if os.environ.get("NO_COLOR") or not stream.isatty():
        return text
    return f"\033[{_COLORS[color]}m{text}\033[0m"


def printable(text: str) -> str:
    """Return a text with its control characters written out; line feeds stay."""
    if text.isprintable():
        return text
    return "".join(letter if letter.isprintable() or letter == "\n" else _written_out(letter) for letter in text)


def _written_out(letter: str) -> str:
    return letter.encode("unicode_escape").decode("ascii")
