"""The arm as a line to draw: where its joints really are, offsets included."""

from __future__ import annotations

from collections.abc import Sequence

from coneskin.geometry.pose import Vector

from .kinematics import link_pose, link_poses
from .link_frames import dh_link
from .ur_models import ArmModel

__all__ = ["skeleton"]


def skeleton(model: ArmModel, q: Sequence[float]) -> list[Vector]:
    """Corners of a line from base to flange, in the base frame [m], at joint positions q [rad].

    The tubes of upper arm and forearm lie beside the line between their joints' origins in the DH table; here they
    start where the URDF has them.
    """
    corners: list[Vector] = [(0.0, 0.0, 0.0)]
    for index, name in ((1, "shoulder"), (2, "upper_arm"), (3, "forearm")):
        corners.append((link_pose(model, q, index) @ dh_link(model, name)).translation)
    corners += [pose.translation for pose in link_poses(model, q)[4:]]
    return corners
