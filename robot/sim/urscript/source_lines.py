"""Lines of a program, prepared for the parser: without comments and blank lines, and joined where one goes on."""

from __future__ import annotations

import re

__all__ = ["numbered_lines"]

_UNFINISHED = re.compile(r"(?:,|\b(?:and|or|xor|not))$")  # end of a line that goes on in the next
_NUMBER = re.compile(r"[-+]?[\d.eE]+")
_QUOTED = re.compile(r"\"[^\"]*\"|'[^']*'")


def numbered_lines(text: str) -> list[tuple[int, str]]:
    """Return a program's lines, each with the number of its first one, from 1.

    A line goes on in the next while a bracket is open, or after a comma or a logical operator. What PolyScope writes to
    show where its program is, ``$ 2 "MoveJ"``, is left out. ur_rtde writes the value of ``global offset =`` at the
    start of the next line, before that line's own statement.
    """
    lines: list[tuple[int, str]] = []
    parts: list[str] = []  # of a line that goes on
    first = depth = 0
    for number, raw in enumerate(text.splitlines(), 1):
        line = (raw if "#" not in raw else _without_comment(raw)).strip()
        if not line or line.startswith("$"):
            continue
        if not parts and lines and lines[-1][1].endswith("=") and (value := _NUMBER.match(line)):
            lines[-1] = (lines[-1][0], f"{lines[-1][1]} {value[0]}")
            line = line[value.end() :].strip()
            if not line:
                continue
        first = first if parts else number
        parts.append(line)
        depth = max(0, depth + _opened(line))
        if depth == 0 and not _UNFINISHED.search(line):
            lines.append((first, " ".join(parts)))
            parts = []
    return [*lines, (first, " ".join(parts))] if parts else lines


def _opened(line: str) -> int:
    """Return how many brackets a line opens and does not close."""
    bare = _QUOTED.sub("", line) if '"' in line or "'" in line else line
    return bare.count("(") + bare.count("[") - bare.count(")") - bare.count("]")


def _without_comment(line: str) -> str:
    quote = ""
    for position, letter in enumerate(line):
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "\"'":
            quote = letter
        elif letter == "#":
            return line[:position]
    return line
