"""Arguments of ``coneskin design`` that describe the link: dimensions, packages, seam."""

from __future__ import annotations

import argparse
import math

from coneskin.core.errors import GeometryError
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum, double_cone
from coneskin.scene.tables.cone_keys import DOUBLE_CONE_KEYS

from .dimensions import given_dimensions, option_name

__all__ = [
    "links_from_dimensions",
    "package_folders",
    "refuse_dimensions",
    "requested_wrap",
    "seam_direction",
    "xacro_arguments",
]


def package_folders(args: argparse.Namespace) -> dict[str, str]:
    """Return the folders of ROS packages that were named.

    Raises:
        GeometryError: one is not NAME=DIR.
    """
    return _pairs(args.package, "--package takes NAME=DIR, as in --package ur_description=src/ur_description")


def xacro_arguments(args: argparse.Namespace) -> dict[str, str]:
    """Return the arguments of a xacro file.

    Raises:
        GeometryError: one is not NAME=VALUE.
    """
    return _pairs(args.xacro_arg, "--xacro-arg takes NAME=VALUE, as in --xacro-arg ur_type=ur5e")


def _pairs(texts: list[str], rule: str) -> dict[str, str]:
    pairs = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not (name and equals and value):
            raise GeometryError(f"{rule}: {text}")
        pairs[name] = value
    return pairs


def requested_wrap(args: argparse.Namespace) -> float | None:
    """Return the wrap angle asked for [rad]; None for the widest that fits."""
    return given_dimensions(args, [key for key in DOUBLE_CONE_KEYS if key.plain == "wrap"]).get("wrap")


def seam_direction(args: argparse.Namespace) -> tuple[float, float, float] | None:
    """Return the direction in which the seam of a full wrap faces; None for where the link shields it most.

    Raises:
        GeometryError: it was given twice.
    """
    if args.seam is not None and args.touch_side is not None:
        raise GeometryError("--seam and --touch-side cannot go together: the seam faces away from the touch side")
    for option, way in (("--seam", args.seam), ("--touch-side", args.touch_side)):
        if way is not None and not 0.0 < math.hypot(*way) < math.inf:
            raise GeometryError(
                f"{option} takes a direction X Y Z, finite and not 0 0 0, got {' '.join(map(str, way))}"
            )
    if args.seam is None and args.touch_side is None:
        return None
    x, y, z = args.seam or (-value for value in args.touch_side)
    return x, y, z


def links_from_dimensions(args: argparse.Namespace) -> tuple[PlacedFrustum, ...]:
    """Return the one or two places on a link that its radii and heights describe, in order along the axis.

    Raises:
        GeometryError: a dimension is missing or out of range.
    """
    values = given_dimensions(args, DOUBLE_CONE_KEYS)
    for option in ("seam", "touch_side"):
        if getattr(args, option) is not None:
            raise GeometryError(
                f"--{option.replace('_', '-')} is for a mesh: by its dimensions a link has no directions, and its seam "
                "is at phi = 0"
            )
    if args.weights is not None or args.exposure:
        option = "--exposure" if args.exposure else "--weights"
        raise GeometryError(f"{option} is for a mesh: a link by its dimensions is covered whole")
    if not {"radius1", "height"} <= values.keys():
        raise GeometryError("name a mesh file, or give --radius1-mm and --height-mm")
    if ("radius3" in values) != ("height2" in values):
        raise GeometryError("a second cone needs both --radius3-mm and --height2-mm")
    values = {"radius2": values["radius1"], **values}
    if "radius3" not in values:
        return (PlacedFrustum(Frustum(**values)),)
    wrap = values.get("wrap", 2.0 * math.pi)
    return double_cone(
        values["radius1"], values["radius2"], values["radius3"], values["height"], values["height2"], wrap
    )


def refuse_dimensions(args: argparse.Namespace) -> None:
    """Refuse radii and heights beside a mesh.

    Raises:
        GeometryError: one was given.
    """
    for key in DOUBLE_CONE_KEYS:
        if key.plain != "wrap" and getattr(args, key.name) is not None:
            raise GeometryError(f"a mesh and {option_name(key)} cannot go together: the radii are found in the mesh")
