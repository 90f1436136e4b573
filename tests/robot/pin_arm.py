"""The same arms in pinocchio, made from the DH table through its own API: an independent answer for the tests."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from coneskin.robot.ur_models import ArmModel

pin = pytest.importorskip("pinocchio", reason="the independent kinematics are pinocchio's (PyPI: pin)")


@functools.lru_cache
def pin_arm(arm: ArmModel) -> tuple[Any, Any, list[int]]:
    """A pinocchio model, its data, and the ids of the frames that are the DH frames 0 .. 6."""
    model = pin.Model()
    parent, placement = 0, pin.SE3.Identity()
    frames = [model.addFrame(pin.Frame("dh0", 0, 0, placement, pin.FrameType.OP_FRAME))]
    for i in range(6):
        turned = pin.SE3(pin.utils.rotate("z", arm.theta[i]), np.zeros(3))
        parent = model.addJoint(parent, pin.JointModelRZ(), placement * turned, f"joint{i + 1}")
        placement = pin.SE3(np.eye(3), np.array([0.0, 0.0, arm.d[i]])) * pin.SE3(
            pin.utils.rotate("x", arm.alpha[i]), np.array([arm.a[i], 0.0, 0.0])
        )
        frames.append(model.addFrame(pin.Frame(f"dh{i + 1}", parent, 0, placement, pin.FrameType.OP_FRAME)))
    return model, model.createData(), frames


def pin_place(arm: ArmModel, q: list[float], link: int, p_link: tuple[float, float, float]) -> NDArray[np.float64]:
    """The point in the base frame [m]."""
    model, data, frames = pin_arm(arm)
    pin.framesForwardKinematics(model, data, np.array(q))
    return np.asarray(data.oMf[frames[link]].act(np.array(p_link)))


def pin_rotation(arm: ArmModel, q: list[float], link: int) -> NDArray[np.float64]:
    """The rotation of a DH frame in the base frame."""
    model, data, frames = pin_arm(arm)
    pin.framesForwardKinematics(model, data, np.array(q))
    return np.asarray(data.oMf[frames[link]].rotation)


def pin_jacobian(arm: ArmModel, q: list[float], link: int, p_link: tuple[float, float, float]) -> NDArray[np.float64]:
    """6 x 6: velocity of the point over angular velocity of the link, in the base frame."""
    model, data, frames = pin_arm(arm)
    if link == 0:
        return np.zeros((6, 6))
    held = model.frames[frames[link]]
    point = pin.SE3(np.eye(3), held.placement.act(np.array(p_link)))
    pin.computeJointJacobians(model, data, np.array(q))
    return np.asarray(pin.getFrameJacobian(model, data, held.parentJoint, point, pin.LOCAL_WORLD_ALIGNED))
