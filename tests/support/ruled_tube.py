"""Meshes of tubes with straight rulings, of which section, rulings and noise are known."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from coneskin.geometry.mesh import Mesh, make_mesh
from coneskin.geometry.pose import Pose

Floats = NDArray[np.float64]
Section = Callable[[Floats], Floats]  #: parts of the way around, from 0 to 1, to points (n, 2) [m], counter-clockwise


def ellipse_section(a: float, b: float) -> Section:
    """Return an ellipse with half axes a and b [m], by its eccentric angle."""

    def section(part: Floats) -> Floats:
        angle = 2.0 * math.pi * part
        return np.stack([a * np.cos(angle), b * np.sin(angle)], axis=-1)

    return section


def rounded_box_section(width: float, depth: float, corner: float) -> Section:
    """Return a rectangle [m] with round corners of a radius [m], by its arc; a stadium where they leave no depth."""
    flat_x, flat_y = 0.5 * width - corner, 0.5 * depth - corner
    quarter = 0.5 * math.pi * corner
    lengths = [flat_y, quarter, 2.0 * flat_x, quarter, 2.0 * flat_y, quarter, 2.0 * flat_x, quarter, flat_y]
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    turns = np.array([0.0, 0.0, 0.5, 0.5, 1.0, 1.0, 1.5, 1.5, 2.0, 2.0]) * math.pi
    nodes = [np.array([0.5 * width, 0.0])]
    for length, one, two in zip(lengths, turns[:-1], turns[1:], strict=True):
        out = [np.array([math.cos(angle), math.sin(angle)]) for angle in (one, two)]
        along = np.array([-out[0][1], out[0][0]])
        nodes.append(nodes[-1] + (length * along if one == two else corner * (out[1] - out[0])))

    def section(part: Floats) -> Floats:
        arc = np.asarray(part, float) % 1.0 * ends[-1]
        number = np.clip(np.searchsorted(ends, arc, side="right") - 1, 0, len(lengths) - 1)
        angle = turns[number]
        rest = arc - ends[number]
        bent = turns[number + 1] > angle
        later = angle + np.where(bent, rest / corner, 0.0)
        out, new = (np.stack([np.cos(t), np.sin(t)], axis=-1) for t in (angle, later))
        along = np.stack([-out[..., 1], out[..., 0]], axis=-1)
        step = np.where(bent[..., None], corner * (new - out), rest[..., None] * along)
        return np.asarray(np.stack(nodes)[number] + step)

    return section


def stadium_section(flat: float, radius: float) -> Section:
    """Return two flats of a length [m] joined by half circles of a radius [m], by its arc."""
    return rounded_box_section(flat + 2.0 * radius, 2.0 * radius, radius)


@dataclass(frozen=True, slots=True)
class RuledTube:
    """A tube along z with a section at z = 0, closed by flat ends.

    Attributes:
        section: at z = 0.
        height: of the other end [m].
        apex: point in which the rulings meet [m]; None where they are parallel to z.
        pose: of the tube in the frame of the link.
    """

    section: Section
    height: float
    apex: tuple[float, float, float] | None = None
    pose: Pose = field(default_factory=Pose)

    def rings(self, part: Floats, z: Floats) -> Floats:
        """Return points at parts of the way around, at heights [m], shape (len(z), len(part), 3), in its own frame."""
        low = np.concatenate([self.section(part), np.zeros((len(part), 1))], axis=1)
        if self.apex is None:
            return np.asarray(low[None] + z[:, None, None] * np.array([0.0, 0.0, 1.0]))
        share = (1.0 - z / self.apex[2])[:, None, None]
        return np.asarray(np.array(self.apex) + share * (low - self.apex)[None])

    def mesh(self, around: int = 128, along: int = 8, noise: float = 0.0, seed: int = 1) -> Mesh:
        """Return the mesh with so many facets around, its corners on the tube but for noise (standard deviation, m)."""
        part, z = np.arange(around) / around, np.linspace(0.0, self.height, along + 1)
        rings = self.rings(part, z)
        corners = rings.reshape(-1, 3) + noise * np.random.default_rng(seed).normal(size=(rings.size // 3, 3))
        corners = np.concatenate([corners, rings[0].mean(axis=0)[None], rings[-1].mean(axis=0)[None]])
        k, j = (index.ravel() for index in np.meshgrid(np.arange(along), np.arange(around), indexing="ij"))
        a, b = k * around + j, k * around + (j + 1) % around
        j = np.arange(around)
        low, top = len(corners) - 2, along * around
        faces = [
            np.stack([a, b, b + around], axis=1),
            np.stack([a, b + around, a + around], axis=1),
            np.stack([np.full(around, low), (j + 1) % around, j], axis=1),
            np.stack([np.full(around, low + 1), top + j, top + (j + 1) % around], axis=1),
        ]
        return make_mesh(self.pose.apply_all(corners), np.concatenate(faces), "ruled tube")

    def distances(self, points: Floats) -> Floats:
        """Return how far points of the link's frame, shape (n, 3), are from the side, continued along its rulings [m].

        The section is looked up at 4000 places, and the distance is that to the nearest tangent plane there.
        """
        local = self.pose.inverse().apply_all(np.asarray(points, float))
        scale = np.ones(len(local)) if self.apex is None else 1.0 - local[:, 2] / self.apex[2]
        foot = local[:, :2]
        if self.apex is not None:
            foot = np.array(self.apex[:2]) + (foot - self.apex[:2]) / scale[:, None]
        part = np.arange(4000) / 4000
        curve = self.section(part)
        blocks = np.array_split(foot, len(foot) // 256 + 1)
        near = np.concatenate([((block[:, None] - curve) ** 2).sum(axis=2).argmin(axis=1) for block in blocks])
        low = np.concatenate([curve[near], np.zeros((len(near), 1))], axis=1)
        ahead = self.section((part[near] + 1e-6) % 1.0) - self.section((part[near] - 1e-6) % 1.0)
        tangent = np.concatenate([ahead, np.zeros((len(near), 1))], axis=1)
        ruling = np.array([0.0, 0.0, 1.0]) if self.apex is None else low - np.array(self.apex)
        normal = np.cross(tangent, np.broadcast_to(ruling, tangent.shape))
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        return np.asarray(np.abs(np.einsum("ij,ij->i", local - low, normal)))


def oval_tube(pose: Pose | None = None, height: float = 0.2) -> RuledTube:
    """Return a tube of 120 x 90 mm, an ellipse in section, 200 mm high where no height [m] is given."""
    return RuledTube(ellipse_section(0.06, 0.045), height, pose=pose or Pose())
