"""Model check: the arm on the controller must be the arm of the scene, judged by where it says that its flange is.

A wrong model puts every point in the wrong place, and a retreat goes in the wrong direction. The controller reports
joint positions and the pose of its TCP; with the TCP's offset taken off, that is the flange, which the kinematics of
the scene's model must give as well. Neither the name on the dashboard (UR10 for UR10 and UR10e) nor a label is as sure.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from coneskin.core.errors import RobotRefused
from coneskin.geometry.pose import Pose
from coneskin.robot.arm.kinematics import forward
from coneskin.robot.arm.model import ArmModel, Joints
from coneskin.robot.arm.models import MODEL_NAMES, arm_model

from .rtde_connection import RtdeConnection

_POSE_NAMES = ("actual_q", "actual_TCP_pose", "tcp_offset")
#: distance that the flange may be from where the model has it [m]; calibration makes a millimetre or two, another model
#: of the family centimetres
_FLANGE_TOLERANCE = 0.01


class _ArmPose(NamedTuple):
    """Pose of an arm as its controller reports it."""

    q: Joints  #: joint positions [rad]
    tcp: Joints  #: pose of the TCP in the base frame: x, y, z [m] and a rotation vector [rad]
    offset: Joints  #: pose of the TCP in the flange's frame, likewise


def read_pose(host: str, timeout: float = 2.0) -> _ArmPose | None:
    """Ask the controller once and return its answer; None from an old one that does not report its TCP's offset.

    Raises:
        RobotConnectionError: it cannot be reached.
        RobotTimeout: it does not answer.
    """
    with RtdeConnection(host, timeout) as connection:
        try:
            recipe = connection.ask_outputs(_POSE_NAMES, 125.0)
        except RobotRefused:
            return None
        connection.start()
        return _ArmPose(*recipe.unpack(connection.wait_data(timeout)))  # type: ignore[arg-type]


def _flange_distance(arm: ArmModel, pose: _ArmPose) -> float:
    """Return the distance of the flange of a model from the flange that the controller reports [m]."""
    base_tcp, flange_tcp = (Pose.from_rotation_vector(v[3:], v[:3]) for v in (pose.tcp, pose.offset))
    return math.dist(forward(arm, pose.q).translation, (base_tcp @ flange_tcp.inverse()).translation)


def check_model(arm: ArmModel, pose: _ArmPose, host: str) -> None:
    """Refuse an arm that is not the scene's.

    Raises:
        RobotRefused: the flange is not where the model has it; the message names the model that fits, if one does.
    """
    distance = _flange_distance(arm, pose)
    if distance <= _FLANGE_TOLERANCE:
        return
    fits = [name for name in MODEL_NAMES if _flange_distance(arm_model(name), pose) <= _FLANGE_TOLERANCE]
    raise RobotRefused(
        f"the arm at {host} is no {arm.name}: its flange is {1e3 * distance:.0f} mm from where a {arm.name} would have "
        f"it; " + (f"it is where a {' or '.join(fits)} has it: correct arm.model" if fits else "no model fits")
    )
