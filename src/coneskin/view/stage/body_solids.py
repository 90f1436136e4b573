"""Solids of the bodies that a scene has around the arm, where the scene puts them; a page moves them from there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from coneskin.geometry.pose import Pose, Vector

from .rotation import along
from .solid import Solid, barrel, revolve

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from coneskin.scene.values.body import BodyScene

__all__ = ["body_solids"]

_COLOUR = (214, 177, 142)
_THICK = 0.01  # m; of a wall, behind its face
_ARCS = 24  # straight pieces of a ball's profile


def body_solids(bodies: Sequence[BodyScene]) -> list[Solid]:
    """Return the solids of bodies in the base frame, one for each of their ``parts``."""
    found = []
    for number, body in enumerate(bodies, 1):
        names = body.kind, "second hand"
        found += [_solid(f"body {number}, {name}", body, place) for name, place in zip(names, body.parts, strict=False)]
    return found


def _solid(name: str, body: BodyScene, place: Vector) -> Solid:
    if body.kind == "wall":
        corners, faces = _plate(body.radius)
        return Solid(name, 0, _at(place, body.axis).apply_all(corners), faces, _COLOUR, closed=True)
    if body.kind == "post":
        half = 0.5 * body.length
        return barrel(name, 0, _at(place, body.axis), body.radius, (-half, half), _COLOUR)
    turns = [math.pi * (k / _ARCS - 0.5) for k in range(_ARCS + 1)]
    profile = [(max(0.0, body.radius * math.cos(turn)), body.radius * math.sin(turn)) for turn in turns]
    vertices, faces = revolve(profile, 32)
    return Solid(name, 0, Pose(translation=place).apply_all(vertices), faces, _COLOUR, closed=True)


def _plate(half: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return vertices and faces of a square plate whose front is in the plane z = 0, seen from z > 0."""
    import numpy as np

    corners = np.array([(x, y, z) for z in (-_THICK, 0.0) for y in (-half, half) for x in (-half, half)])
    squares = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return corners, np.array([face for a, b, c, d in squares for face in ((a, b, c), (a, c, d))])


def _at(place: Vector, axis: Vector) -> Pose:
    turned = along(axis)
    return Pose.trusted(turned.rotation, place)
