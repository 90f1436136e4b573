"""Solid: a surface of triangles that belongs to a link, and surfaces of revolution to build arms from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from coneskin.geometry.pose import Pose

__all__ = ["Solid", "barrel", "joined", "revolve"]

_SEGMENTS = 24  # around: a flat piece lies .9 % of the radius below the round side
_CHAMFER = 0.16  # of the radius, at the rims of a barrel


class Solid(NamedTuple):
    """Surface of triangles.

    Attributes:
        name: for people, and in the page's tree of nodes.
        link: index of the DH frame that it moves with.
        vertices: in that frame [m], shape (n, 3).
        faces: indices of vertices, counter-clockwise from outside, shape (m, 3).
        colour: red, green and blue, 0 to 255.
        closed: nobody sees its inside, which then is not drawn; False for a mesh of unknown quality.
        opacity: 1 hides what is behind; less for what would hide a sheet.
    """

    name: str
    link: int
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    colour: tuple[int, int, int]
    closed: bool = False
    opacity: float = 1.0


def revolve(
    profile: Sequence[tuple[float, float]], segments: int = _SEGMENTS
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return vertices and faces of the surface that a profile sweeps about the z axis.

    Each straight piece of the profile has vertices of its own, so that its rims are shaded as edges. A piece that
    begins or ends on the axis is a fan.

    Args:
        profile: radius and z [m], in the order of growing z where the outside is seen from outside.
        segments: around.
    """
    import numpy as np

    angle = np.linspace(0.0, 2.0 * math.pi, segments, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    vertices, faces = [], []
    k = np.arange(segments)
    after = (k + 1) % segments
    for piece, ((r0, z0), (r1, z1)) in enumerate(pairwise(profile)):
        vertices += [np.column_stack([r0 * ring, np.full(segments, z0)])]
        vertices += [np.column_stack([r1 * ring, np.full(segments, z1)])]
        low = 2 * piece * segments
        high = low + segments
        if r0 > 0.0:
            faces += [np.column_stack([low + k, low + after, high + after])]
        if r1 > 0.0:
            faces += [np.column_stack([low + k, high + after, high + k])]
    return np.concatenate(vertices), np.concatenate(faces)


def barrel(
    name: str, link: int, place: Pose, radius: float, ends: tuple[float, float], colour: tuple[int, int, int]
) -> Solid:
    """Return a closed cylinder with chamfered rims.

    Args:
        name: of the solid.
        link: index of the DH frame that it moves with.
        place: pose in that frame of the cylinder, whose axis is z.
        radius: of it [m].
        ends: from and to which z it goes [m], in any order.
        colour: red, green and blue, 0 to 255.
    """
    low, high = sorted(ends)
    edge = min(_CHAMFER * radius, 0.3 * (high - low))
    inner = radius - edge
    profile = [(0.0, low), (inner, low), (radius, low + edge), (radius, high - edge), (inner, high), (0.0, high)]
    vertices, faces = revolve(profile)
    return Solid(name, link, place.apply_all(vertices), faces, colour, closed=True)


def joined(solids: Sequence[Solid]) -> list[Solid]:
    """Return solids with those of one link that look alike joined into one: each is a call of the drawing process."""
    import numpy as np

    groups: dict[tuple[object, ...], list[Solid]] = {}
    for solid in solids:
        groups.setdefault((solid.link, solid.colour, solid.closed, solid.opacity), []).append(solid)
    found = []
    for group in groups.values():
        starts = np.cumsum([0, *(len(solid.vertices) for solid in group)])
        faces = [start + solid.faces for start, solid in zip(starts, group, strict=False)]
        vertices = np.concatenate([solid.vertices for solid in group])
        found.append(group[0]._replace(vertices=vertices, faces=np.concatenate(faces)))
    return found
