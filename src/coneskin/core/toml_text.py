"""TOML that people write: a mistake names its line, and what was meant."""

from __future__ import annotations

import re
import tomllib
from typing import Any

_MAX_SHOWN = 60  # letters of a line that a message shows
#: what a mistaken line looks like -> what was meant; the first that fits is said
_LINE_MISTAKES = (
    (r"[“”„‘’]", 'quotation marks are straight: "text"'),
    (r"^\s*(//|;|--|/\*)", "a remark begins with #"),
    (r"^\s*[\w.-]+\s*:", 'write "=" between a key and its value'),
    (r"=\s*(True|False)\b", "write true or false, without a capital letter"),
    (r"=\s*(None|null|nil)\b", "leave out a key that has no value"),
    (r"=\s*[\d]+(\.\d+){2,}", 'a text needs quotation marks: "10.0.0.2"'),
    (r"=\s*[-+]?(\.\d|\d+\.(\D|$))", "a number has digits on both sides of its point: 0.5"),
    (r"=\s*[-+]?\d+,\d", "a number has a point: 1.5"),
    (r"=\s*[-+]?0\d", "a whole number begins with no 0"),
    (r"=\s*[-+]?[\d.]+\s*[^\W\d_°%]", "a value has no unit: the key's name says it, as height_mm does"),
    (r"\\", r'in quotation marks "\" begins an escape: write "/"'),
    (r"=\s*[^\W\d]|=\s*[/~]", 'a text needs quotation marks: "UR5e"'),
    (r"=\s*(#|$)", 'write a value behind "="'),
    (r"^\s*\[", "a table begins with [name], and each of several with [[name]]"),
    (r"^[^=]*$", "write a line as: key = value"),
)
#: how tomllib's words begin, which say enough of the place, and what was meant
_WHOLE_MISTAKES = (
    (r"Cannot |Duplicate", "a key or table stands once; each of several tables begins with [[name]]"),
    (r"Unclosed", "separate values by commas, and close the bracket"),
    (r"Unterminated|Expected \"'\"|Illegal character '\\n'", "close the text by a quotation mark in its line"),
)


def parse_toml(text: str) -> dict[str, Any]:
    """Return the tables of a TOML text.

    Raises:
        ValueError: it is none; the message shows the line and, where it is a common mistake, what was meant.
    """
    try:
        return tomllib.loads(text)
    except RecursionError as exc:
        raise ValueError("nested too deep") from exc
    except ValueError as exc:  # a whole number of 5000 digits is a plain one
        raise ValueError(_explain(text, str(exc))) from exc


def _explain(text: str, error: str) -> str:
    if whole := next((said for pattern, said in _WHOLE_MISTAKES if re.match(pattern, error)), ""):
        return f"{error}: {whole}"
    place = re.search(r"at line (\d+)", error)
    lines = text.splitlines() or [""]
    number = int(place[1]) if place and int(place[1]) <= len(lines) else len(lines)
    line = lines[number - 1].strip()
    meant = next((said for pattern, said in _LINE_MISTAKES if re.search(pattern, line)), "")
    shown = line if len(line) <= _MAX_SHOWN else f"{line[:_MAX_SHOWN]}..."
    return f"line {number}, {shown!r}: {meant} ({error.partition(' (at')[0]})" if meant else error
