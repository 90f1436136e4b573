"""Solids of triangles that belong to a link: surfaces of revolution, the arm built from them, and bodies beside it.

Where the axes of an arm are is exact. How thick a part is, is drawn from the wrist's offset d5, to which the joints of
the family are in proportion (measured in ``robot/arm/workspace.py``). A tube never stands out of a sheet on it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from coneskin.core.arrays import Floats, Ints
from coneskin.geometry.pose import Pose, Vector
from coneskin.robot.arm.kinematics import LINK_INDEX, dh_mesh
from coneskin.robot.arm.model import ArmModel
from coneskin.scene.values.scene import BodyScene

_SEGMENT_COUNT = 24  # around: a flat piece lies .9 % of the radius below the round side
_CHAMFER_SHARE = 0.16  # of the radius, at the rims of a barrel


class Solid(NamedTuple):
    """Surface of triangles."""

    name: str  #: for people, and in the page's tree of nodes
    link: int  #: index of the DH frame that it moves with
    vertices: Floats  #: in that frame [m], shape (n, 3)
    faces: Ints  #: indices of vertices, counter-clockwise from outside, shape (m, 3)
    colour: tuple[int, int, int]  #: red, green and blue, 0 to 255
    closed: bool = False  #: nobody sees its inside, which then is not drawn; False for a mesh of unknown quality
    opacity: float = 1.0  #: 1 hides what is behind; less for what would hide a sheet


def revolve(profile: Sequence[tuple[float, float]], segments: int = _SEGMENT_COUNT) -> tuple[Floats, Ints]:
    """Return vertices and faces of the surface that a profile sweeps about the z axis.

    Each straight piece of the profile has vertices of its own, so that its rims are shaded as edges. A piece that
    begins or ends on the axis is a fan.

    Args:
        profile: radius and z [m], in the order of growing z where the outside is seen from outside.
        segments: around.
    """
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
        link: index of the DH frame that it moves with.
        place: pose in that frame of the cylinder, whose axis is z.
        radius: of it [m].
        ends: from and to which z it goes [m], in any order.
        colour: red, green and blue, 0 to 255.
    """
    low, high = sorted(ends)
    edge = min(_CHAMFER_SHARE * radius, 0.3 * (high - low))
    inner = radius - edge
    profile = [(0.0, low), (inner, low), (radius, low + edge), (radius, high - edge), (inner, high), (0.0, high)]
    vertices, faces = revolve(profile)
    return Solid(name, link, place.apply_all(vertices), faces, colour, closed=True)


def joined(solids: Sequence[Solid]) -> list[Solid]:
    """Return solids with those of one link that look alike joined into one: each is a call of the drawing process."""
    groups: dict[tuple[object, ...], list[Solid]] = {}
    for solid in solids:
        groups.setdefault((solid.link, solid.colour, solid.closed, solid.opacity), []).append(solid)
    found = []
    for group in groups.values():
        vertices, faces = put_together([(solid.vertices, solid.faces) for solid in group])
        found.append(group[0]._replace(vertices=vertices, faces=faces))
    return found


def put_together(pieces: Sequence[tuple[Floats, Ints]]) -> tuple[Floats, Ints]:
    """Return vertices and faces of several surfaces as those of one."""
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in pieces)])
    faces = [start + faces for start, (_, faces) in zip(starts, pieces, strict=False)]
    return np.concatenate([vertices for vertices, _ in pieces]), np.concatenate(faces)


_SHELL_COLOUR = (201, 205, 210)
_CAP_COLOUR = (118, 143, 168)
_FOOT_COLOUR = (150, 155, 162)
#: radius of a part as a multiple of d5
_BASE, _SHOULDER, _UPPER, _ELBOW, _FOREARM, _WRIST, _FLANGE = 0.72, 0.60, 0.45, 0.50, 0.385, 0.385, 0.33
_ALONG_Y = Pose(((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)))  # z of the barrel along y of the frame


def arm_solids(model: ArmModel, slimmest: Mapping[int, float] | None = None) -> tuple[Solid, ...]:
    """Return the solids of an arm, each in the DH frame that it moves with.

    Args:
        model: the arm; one whose meshes ``dh_mesh`` knows.
        slimmest: index of a link -> radius that its tube must not exceed [m], because a sheet lies on it.

    Raises:
        KinematicsError: the places of the arm's tubes are not known.
    """
    size, thin = model.d[4], slimmest or {}
    shoulder, elbow, wrist = _SHOULDER * size, _ELBOW * size, _WRIST * size
    rise = model.d[0]
    found = [
        barrel("base", 0, Pose(), _BASE * size, (0.0, 0.45 * rise), _FOOT_COLOUR),
        # frame 1 has its y axis along joint 1, its z axis along joint 2
        barrel("shoulder, upright", 1, _ALONG_Y, shoulder, (-0.55 * rise, 0.75 * shoulder), _SHELL_COLOUR),
    ]
    reach = dh_mesh(model, "upper_arm")
    beside = reach.translation[2]  # of the upper arm's axis, along joint 2
    found.append(barrel("shoulder, across", 1, Pose(), shoulder, (-shoulder, beside - shoulder), _SHELL_COLOUR))
    for name, joint, radius in (("upper_arm", shoulder, _UPPER), ("forearm", elbow, _FOREARM)):
        found += _tube(model, name, joint, thin.get(LINK_INDEX[name], radius * size), radius * size)
    across = dh_mesh(model, "forearm").translation[2]
    # frame 4 has its y axis along joint 4, its z axis along joint 5; frame 5 its y axis against joint 5
    found += [
        barrel("wrist 1, across", 4, _ALONG_Y, wrist, (across + elbow - model.d[3], 1.1 * wrist), _SHELL_COLOUR),
        barrel("wrist 1", 4, Pose(), 0.96 * wrist, (-1.15 * wrist, 0.9 * wrist), _CAP_COLOUR),
        barrel("wrist 2, across", 5, _ALONG_Y, wrist, (model.d[4] - 0.9 * wrist, -1.1 * wrist), _SHELL_COLOUR),
        barrel("wrist 2", 5, Pose(), 0.96 * wrist, (-1.15 * wrist, 0.9 * wrist), _CAP_COLOUR),
        barrel("wrist 3", 6, Pose(), _FLANGE * size, (0.9 * wrist - model.d[5], 0.0), _SHELL_COLOUR),
        barrel("flange", 6, Pose(), 0.8 * _FLANGE * size, (-0.02 * size, 0.06 * size), _FOOT_COLOUR),
    ]
    return tuple(found)


def _tube(model: ArmModel, name: str, joint: float, tube: float, whole: float) -> list[Solid]:
    """Return the tube of the upper arm or the forearm, and the joint at each of its ends."""
    link, place = LINK_INDEX[name], dh_mesh(model, name)
    length = abs(model.a[link - 1])
    words = name.replace("_", " ")
    near, far = place.translation, place.apply((0.0, 0.0, length))
    ends = [near, far]
    radii = [joint, _ELBOW * model.d[4] if name == "upper_arm" else whole]
    found = [
        barrel(f"{words}, tube", link, place, min(tube, whole), (0.5 * joint, length - 0.5 * radii[1]), _SHELL_COLOUR)
    ]
    for at, radius, end in zip(ends, radii, ("near", "far"), strict=True):
        half = 1.12 * radius
        found.append(barrel(f"{words}, {end} joint", link, Pose(translation=at), radius, (-half, half), _CAP_COLOUR))
    return found


_BODY_COLOUR = (214, 177, 142)
_WALL_THICKNESS = 0.01  # m; of a wall, behind its face
_ARC_COUNT = 24  # straight pieces of a ball's profile


def body_solids(bodies: Sequence[BodyScene]) -> list[Solid]:
    """Return the solids of bodies in the base frame, one for each of their ``parts``."""
    found = []
    for number, body in enumerate(bodies, 1):
        names = body.kind, "second hand"
        found += [_solid(f"body {number}, {name}", body, place) for name, place in zip(names, body.parts, strict=False)]
    return found


def _solid(name: str, body: BodyScene, place: Vector) -> Solid:
    turned = Pose.along(body.axis, place)
    if body.kind == "wall":
        corners, faces = _plate(body.radius)
        return Solid(name, 0, turned.apply_all(corners), faces, _BODY_COLOUR, closed=True)
    if body.kind == "post":
        half = 0.5 * body.length
        return barrel(name, 0, turned, body.radius, (-half, half), _BODY_COLOUR)
    turns = [math.pi * (k / _ARC_COUNT - 0.5) for k in range(_ARC_COUNT + 1)]
    profile = [(max(0.0, body.radius * math.cos(turn)), body.radius * math.sin(turn)) for turn in turns]
    vertices, faces = revolve(profile, 32)
    return Solid(name, 0, Pose(translation=place).apply_all(vertices), faces, _BODY_COLOUR, closed=True)


def _plate(half: float) -> tuple[Floats, Ints]:
    """Return vertices and faces of a square plate whose front is in the plane z = 0, seen from z > 0."""
    corners = np.array([(x, y, z) for z in (-_WALL_THICKNESS, 0.0) for y in (-half, half) for x in (-half, half)])
    squares = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return corners, np.array([face for a, b, c, d in squares for face in ((a, b, c), (a, c, d))])
