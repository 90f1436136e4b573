"""Checks of a scene against its arm: names of links, lengths of sensors, joint limits of the motion."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from coneskin.core.errors import KinematicsError

from .values.scene import LinkScene, MotionScene, Scene

if TYPE_CHECKING:
    from coneskin.robot.arm.model import ArmModel

__all__ = ["check_links"]

_TUBES = {"upper_arm": 1, "forearm": 2}  # link name -> index of the DH length that is the tube's


def check_links(scene: Scene, problems: list[str]) -> None:
    """Add to problems a link that no arm has, a sensor longer than its link, a joint beyond its limit.

    Lengths and limits need a known arm; names are the same for all arms.
    """
    from coneskin.robot.arm.kinematics import LINK_INDEX, link_index
    from coneskin.robot.arm.ur_models import arm_model

    arm = None if scene.arm is None else arm_model(scene.arm.model)
    names = {index: name for name, index in LINK_INDEX.items()}
    for link in scene.links:
        try:
            name = names[link_index(link.name)]  # "upperarm" and "upper_arm_link" are the same link
        except KinematicsError:
            problems.append(f"link {link.name}: an arm has no such link; it has {', '.join(LINK_INDEX)}")
            continue
        if arm is not None and name in _TUBES:
            _check_length(link, abs(arm.a[_TUBES[name]]), arm.name, problems)
    if arm is not None and scene.motion is not None:
        _check_limits(scene.motion, arm, problems)


def _check_limits(motion: MotionScene, arm: ArmModel, problems: list[str]) -> None:
    for number, point in enumerate(motion.waypoints, 1):
        for joint, (q, low, high) in enumerate(zip(point, arm.joint_lower, arm.joint_upper, strict=False), 1):
            if not low <= q <= high:
                problems.append(
                    f"motion.waypoints_deg[{number}]: joint {joint} of the {arm.name} must be from "
                    f"{math.degrees(low):g} to {math.degrees(high):g} deg, got {math.degrees(q):g} deg"
                )


def _check_length(link: LinkScene, length: float, arm: str, problems: list[str]) -> None:
    for item in link.sensors:
        height = item.sensor.frustum.height
        if height > length:
            problems.append(
                f"link {link.name}, {item.sensor.name}: height_mm must be at most {1e3 * length:g} mm, the distance "
                f"between the joints of the {arm}'s {link.name}, got {1e3 * height:g} mm"
            )
