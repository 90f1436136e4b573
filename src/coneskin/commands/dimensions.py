"""Command-line options derived from key tables, and the dimensions of a link that they give."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

from coneskin.core.errors import GeometryError, SceneError
from coneskin.core.keys import Key, check
from coneskin.geometry.frustum import Frustum
from coneskin.scene.tables.sensor_keys import LINK_CONE_KEYS


def option_name(key: Key) -> str:
    """Return the option for a key: ``--radius1-mm`` for ``radius1_mm``."""
    return "--" + key.name.replace("_", "-")


def add_key_options(
    add: Callable[..., Any],
    keys: Sequence[Key],
    required: Collection[str] = (),
    defaults: Mapping[str, str] | None = None,
) -> None:
    """Declare an option for each of some keys, with the ``add_argument`` of a parser or of a group.

    Args:
        required: plain names of those that must be given.
        defaults: plain name -> what holds where the option is missing, in words.
    """
    for key in keys:
        default = (defaults or {}).get(key.plain)
        text = key.meaning.replace("%", "%%") + (f" (default: {default})" if default else "")
        unit = key.suffix.removeprefix("_").upper() or "N"
        add(option_name(key), type=key.kind, metavar=unit, required=key.plain in required, help=text)


def add_cone_options(add: Callable[..., Any]) -> None:
    """Declare the options of the cone of a link, with the ``add_argument`` of a parser."""
    defaults = {"radius2": "radius 1, a cylinder", "wrap": "360"}
    add_key_options(add, LINK_CONE_KEYS, ("radius1", "height"), defaults)


def given_cone(args: argparse.Namespace) -> Frustum:
    """Return the cone of a link that the options give; errors as of ``given_keys``.

    Raises:
        GeometryError: there is no such cone.
    """
    dimensions = given_keys(args, LINK_CONE_KEYS)
    return Frustum(**{"radius2": dimensions["radius1"], **dimensions})


def given_keys(args: argparse.Namespace, keys: Sequence[Key]) -> dict[str, float]:
    """Return the values that were given, in SI, under the plain names of their keys.

    Args:
        args: parsed; options that the command does not have, or that were not given, are left out.

    Raises:
        GeometryError: one is out of range; where it looks like metres, the message says what it would be in mm.
        SceneError: several are out of range; a line for each.
    """
    given = {key.name: value for key in keys if (value := getattr(args, key.name, None)) is not None}
    problems: list[str] = []
    values = check(given, tuple(key for key in keys if key.name in given), "--", problems)
    if problems:
        lines = [line.replace("--.", "--").replace("_", "-", 1) for line in problems]
        raise GeometryError(lines[0]) if len(lines) == 1 else SceneError(lines, "the link")
    return values
