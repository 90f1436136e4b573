"""Solids of an arm, made from its tables: tubes, joints and flange where its kinematics has them.

Where the axes are is exact; how thick a part is, is drawn from the wrist's offset d5, to which the joints of the family
are in proportion (``self_collision`` has the measured numbers). A tube never stands out of a sheet that lies on it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from coneskin.geometry.pose import Pose, Vector
from coneskin.robot.arm.link_frames import LINK_INDEX, dh_mesh
from coneskin.robot.arm.model import ArmModel

from .solid import Solid, barrel

__all__ = ["arm_solids"]

_SHELL = (201, 205, 210)
_CAP = (118, 143, 168)
_FOOT = (150, 155, 162)
#: radius of a part as a multiple of d5
_BASE, _SHOULDER, _UPPER, _ELBOW, _FOREARM, _WRIST, _FLANGE = 0.72, 0.60, 0.45, 0.50, 0.385, 0.385, 0.33
_ALONG_Y = Pose(((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)))  # z of the barrel along y of the frame


def arm_solids(model: ArmModel, slimmest: Mapping[int, float] | None = None) -> tuple[Solid, ...]:
    """Return the solids of an arm, each in the DH frame that it moves with.

    Args:
        model: the arm; one whose meshes ``link_frames`` knows.
        slimmest: index of a link -> radius that its tube must not exceed [m], because a sheet lies on it.

    Raises:
        KinematicsError: the places of the arm's tubes are not known.
    """
    size, thin = model.d[4], slimmest or {}
    shoulder, elbow, wrist = _SHOULDER * size, _ELBOW * size, _WRIST * size
    rise = model.d[0]
    found = [
        barrel("base", 0, Pose(), _BASE * size, (0.0, 0.45 * rise), _FOOT),
        # frame 1 has its y axis along joint 1, its z axis along joint 2
        barrel("shoulder, upright", 1, _ALONG_Y, shoulder, (-0.55 * rise, 0.75 * shoulder), _SHELL),
    ]
    reach = dh_mesh(model, "upper_arm")
    beside = reach.translation[2]  # of the upper arm's axis, along joint 2
    found.append(barrel("shoulder, across", 1, Pose(), shoulder, (-shoulder, beside - shoulder), _SHELL))
    for name, joint, radius in (("upper_arm", shoulder, _UPPER), ("forearm", elbow, _FOREARM)):
        found += _tube(model, name, joint, thin.get(LINK_INDEX[name], radius * size), radius * size)
    across = dh_mesh(model, "forearm").translation[2]
    # frame 4 has its y axis along joint 4, its z axis along joint 5; frame 5 its y axis against joint 5
    found += [
        barrel("wrist 1, across", 4, _ALONG_Y, wrist, (across + elbow - model.d[3], 1.1 * wrist), _SHELL),
        barrel("wrist 1", 4, Pose(), 0.96 * wrist, (-1.15 * wrist, 0.9 * wrist), _CAP),
        barrel("wrist 2, across", 5, _ALONG_Y, wrist, (model.d[4] - 0.9 * wrist, -1.1 * wrist), _SHELL),
        barrel("wrist 2", 5, Pose(), 0.96 * wrist, (-1.15 * wrist, 0.9 * wrist), _CAP),
        barrel("wrist 3", 6, Pose(), _FLANGE * size, (0.9 * wrist - model.d[5], 0.0), _SHELL),
        barrel("flange", 6, Pose(), 0.8 * _FLANGE * size, (-0.02 * size, 0.06 * size), _FOOT),
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
    found = [barrel(f"{words}, tube", link, place, min(tube, whole), (0.5 * joint, length - 0.5 * radii[1]), _SHELL)]
    for at, radius, end in zip(ends, radii, ("near", "far"), strict=True):
        half = 1.12 * radius
        found.append(barrel(f"{words}, {end} joint", link, _at(at), radius, (-half, half), _CAP))
    return found


def _at(point: Vector) -> Pose:
    """Return a pose at a point, with z along that of the frame: the axis of the joint there."""
    if not all(math.isfinite(value) for value in point):
        raise AssertionError("a table of an arm is finite")
    return Pose(translation=point)
