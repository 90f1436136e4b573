"""Meshes of which the answer is known: bodies of revolution, noisy, holed, flipped, exploded, crossing. All seeded."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from coneskin.geometry.mesh import Mesh, make_mesh
from coneskin.geometry.pose import Pose

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]
Profile = Sequence[tuple[float, float]]  # (z, radius) from one end to the other [m]

TILTED = Pose.from_xyz_rpy((0.03, -0.05, 0.02), (0.4, -0.7, 0.3))


def revolve(profile: Profile, segments: int = 128, rings: int = 1) -> tuple[Floats, Indices]:
    """A closed body about z with its corners on the profile; each stretch is cut into rings."""
    z, r = [profile[0][0]], [profile[0][1]]
    for (z1, r1), (z2, r2) in pairwise(profile):
        z += list(np.linspace(z1, z2, rings + 1)[1:])
        r += list(np.linspace(r1, r2, rings + 1)[1:])
    phi = 2.0 * math.pi * np.arange(segments) / segments
    corners = np.stack(
        [np.outer(r, np.cos(phi)), np.outer(r, np.sin(phi)), np.repeat(np.array(z)[:, None], segments, 1)], axis=2
    ).reshape(-1, 3)
    k, j = np.meshgrid(np.arange(len(z) - 1), np.arange(segments), indexing="ij")
    a, b = (k * segments + j).ravel(), (k * segments + (j + 1) % segments).ravel()
    faces = [np.stack([a, b, b + segments], 1), np.stack([a, b + segments, a + segments], 1)]
    low, high = len(corners), len(corners) + 1
    corners = np.concatenate([corners, [[0.0, 0.0, z[0]], [0.0, 0.0, z[-1]]]])
    j0 = np.arange(segments)
    top = (len(z) - 1) * segments
    faces.append(np.stack([np.full(segments, low), (j0 + 1) % segments, j0], 1))
    faces.append(np.stack([np.full(segments, high), top + j0, top + (j0 + 1) % segments], 1))
    return corners, np.concatenate(faces)


def placed(body: tuple[Floats, Indices], pose: Pose = TILTED) -> Mesh:
    corners, faces = body
    return make_mesh(corners @ np.array(pose.rotation).T + np.array(pose.translation), faces, "synthetic")


def rugby(
    r1: float = 0.04, belt: float = 0.07, r2: float = 0.04, h1: float = 0.15, h2: float = 0.15
) -> tuple[Floats, Indices]:
    """The double cone of the paper's figure 14."""
    return revolve([(0.0, r1), (h1, belt), (h1 + h2, r2)], rings=12)


def barrel(radius: float = 0.05, bulge: float = 0.003, height: float = 0.3) -> tuple[Floats, Indices]:
    z = np.linspace(0.0, height, 41)
    return revolve([(float(h), radius + bulge * math.sin(math.pi * h / height)) for h in z])


def frustum(r1: float, r2: float, height: float, segments: int = 128, rings: int = 8) -> tuple[Floats, Indices]:
    return revolve([(0.0, r1), (height, r2)], segments, rings)


def joined(*bodies: tuple[Floats, Indices]) -> tuple[Floats, Indices]:
    """Bodies that may cross, as parts of one mesh."""
    corners, faces, count = [], [], 0
    for body_corners, body_faces in bodies:
        corners.append(body_corners)
        faces.append(body_faces + count)
        count += len(body_corners)
    return np.concatenate(corners), np.concatenate(faces)


def moved(body: tuple[Floats, Indices], pose: Pose) -> tuple[Floats, Indices]:
    return body[0] @ np.array(pose.rotation).T + np.array(pose.translation), body[1]


def noisy(body: tuple[Floats, Indices], sigma: float, seed: int = 3) -> tuple[Floats, Indices]:
    rng = np.random.default_rng(seed)
    return body[0] + rng.normal(0.0, sigma, body[0].shape), body[1]


def exploded(body: tuple[Floats, Indices]) -> tuple[Floats, Indices]:
    """Every face with corners of its own, as COLLADA files with normals have it."""
    corners, faces = body
    return corners[faces.ravel()], np.arange(3 * len(faces)).reshape(-1, 3)


def flipped(body: tuple[Floats, Indices], share: float = 1.0, seed: int = 4) -> tuple[Floats, Indices]:
    """Some faces wound the wrong way round."""
    corners, faces = body
    turn = np.random.default_rng(seed).random(len(faces)) < share
    return corners, np.where(turn[:, None], faces[:, ::-1], faces)


def holed(
    radius: float = 0.05,
    height: float = 0.3,
    depth: float = 0.006,
    width: float = 0.006,
    holes: int = 6,
    segments: int = 240,
) -> tuple[Floats, Indices]:
    """A tube with a ring of round-about bolt holes of a depth in its middle."""
    corners, faces = revolve([(0.0, radius), (height, radius)], segments, rings=150)
    rho = np.hypot(corners[:, 0], corners[:, 1])
    side = rho > 0.5 * radius
    phi = np.arctan2(corners[:, 1], corners[:, 0])
    arc = np.abs((phi + math.pi / holes) % (2.0 * math.pi / holes) - math.pi / holes) * radius
    pit = side & (np.hypot(arc, corners[:, 2] - 0.5 * height) < 0.5 * width)
    scale = np.where(pit, (radius - depth) / radius, 1.0)
    return corners * np.stack([scale, scale, np.ones_like(scale)], axis=1), faces


def shoulder(radius: float = 0.05, length: float = 0.12, other: float = 0.055) -> tuple[Floats, Indices]:
    """Two crossing cylinders: the one along x runs into the one along z, so no full wrap of the first exists."""
    upright = moved(revolve([(-0.09, other), (0.09, other)], rings=8), Pose(translation=(0.0, 0.0, 0.0)))
    lying = revolve([(0.0, radius), (length, radius)], rings=8)
    return joined(upright, moved(lying, Pose.from_xyz_rpy((0.0, 0.0, 0.0), (0.0, math.pi / 2.0, 0.0))))
