"""Skeleton of an arm: a line along the axes of its tubes."""

from __future__ import annotations

import functools
from collections.abc import Sequence

from coneskin.geometry.pose import Vector

from .kinematics import link_poses
from .link_frames import LINK_INDEX, dh_mesh
from .model import ArmModel

__all__ = ["skeleton"]


def skeleton(model: ArmModel, q: Sequence[float]) -> list[Vector]:
    """Return the corners of a line from base to flange, in the base frame [m], at joint positions q [rad].

    Upper arm and forearm lie beside the line between the origins of the DH table; their place is that of their meshes.
    """
    poses = link_poses(model, q)
    corners: list[Vector] = [poses[0].translation, poses[1].translation]
    for link, begin, end in _tubes(model):
        corners += [poses[link].apply(begin), poses[link].apply(end)]
    return [*corners, *(pose.translation for pose in poses[4:])]


@functools.lru_cache(maxsize=32)
def _tubes(model: ArmModel) -> tuple[tuple[int, Vector, Vector], ...]:
    """Return index of the DH frame, and both ends of the axis in it [m], of upper arm and forearm."""
    tubes = []
    for name, length in (("upper_arm", abs(model.a[1])), ("forearm", abs(model.a[2]))):
        mesh = dh_mesh(model, name)
        tubes.append((LINK_INDEX[name], mesh.translation, mesh.apply((0.0, 0.0, length))))
    return tuple(tubes)
