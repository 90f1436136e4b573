"""Patch of a scene file: keys of one sensor, changed in the text, so that comments and order stay."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping

from coneskin.core.errors import SceneError

__all__ = ["diff_texts", "set_sensor_keys"]

_HEADER = re.compile(r"^\s*\[\[\s*link\s*\.\s*sensor\s*\]\]")
_TABLE = re.compile(r"^\s*\[")


def set_sensor_keys(text: str, number: int, keys: Mapping[str, str]) -> str:
    """Return the text of a scene in which a sensor has other keys.

    Args:
        text: of the scene file.
        number: of the ``[[link.sensor]]``, from 0 in the order of the file.
        keys: name -> value, a word; what the sensor's ``file`` says is overruled by it.

    Raises:
        SceneError: the text has no such table; it may be written in another way, as an inline table.
    """
    lines = text.splitlines(keepends=True)
    headers = [at for at, line in enumerate(lines) if _HEADER.match(line)]
    if number >= len(headers):
        wanted = ", ".join(f'{key} = "{value}"' for key, value in keys.items())
        raise SceneError([f"there is no [[link.sensor]] number {number + 1} to change: write {wanted} yourself"])
    start = headers[number]
    end = next((at for at in range(start + 1, len(lines)) if _TABLE.match(lines[at])), len(lines))
    body = [line for line in lines[start + 1 : end] if not any(re.match(rf"\s*{key}\s*=", line) for key in keys)]
    new = [f'{key} = "{value}"\n' for key, value in keys.items()]
    head = lines[start] if lines[start].endswith("\n") else lines[start] + "\n"
    return "".join([*lines[:start], head, *new, *body, *lines[end:]])


def diff_texts(old: str, new: str, name: str) -> str:
    """Return what a patch changes, as ``diff -u`` shows it."""
    lines = difflib.unified_diff(old.splitlines(), new.splitlines(), name, f"{name}, patched", n=2, lineterm="")
    return "\n".join(lines)
