"""Radii and heights of a link that stand on the command line, within the limits that a scene has for them."""

from __future__ import annotations

import argparse

from .errors import GeometryError, SceneError
from .schema import Key, check

__all__ = ["check_numbers"]

_KEYS = (
    *(Key(f"{name}_mm", low=1.0, high=5000.0, or_zero=True) for name in ("radius1", "radius2", "radius3")),
    *(Key(f"{name}_mm", low=1.0, high=10_000.0, or_zero=True) for name in ("height", "height2")),
    Key("wrap_deg", low=0.0, high=360.0, above=True),
)


def check_numbers(args: argparse.Namespace) -> dict[str, float]:
    """The numbers that were given, in SI, under the plain names of their options.

    Args:
        args: those of ``--radius1-mm``, ``--height-mm``, ``--wrap-deg`` and so on that the command has.

    Raises:
        GeometryError: one is out of range; where it looks like metres, the message says what it would be in mm. A
            radius of 0 is an apex and a height of 0 a flat ring.
        SceneError: several are; a line for each.
    """
    given = {key.name: getattr(args, key.name, None) for key in _KEYS}
    given = {name: value for name, value in given.items() if value is not None}
    problems: list[str] = []
    values = check(given, tuple(key for key in _KEYS if key.name in given), "--", problems)
    if problems:
        lines = [line.replace("--.", "--").replace("_", "-", 1) for line in problems]
        raise GeometryError(lines[0]) if len(lines) == 1 else SceneError(lines, "the link")
    return values
