"""Arms in pinocchio, made from the DH table through its own API: independent kinematics to test ours against."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from coneskin.core.errors import MissingExtra
from coneskin.robot.arm.inertia import ArmInertia
from coneskin.robot.arm.model import ArmModel


@functools.cache
def load_pinocchio() -> Any:
    """Import pinocchio.

    Raises:
        MissingExtra: it is not installed.
    """
    try:
        import pinocchio
    except ImportError as exc:
        raise MissingExtra("pin", "independent kinematics", "check") from exc
    return pinocchio


@functools.lru_cache
def pin_arm(arm: ArmModel) -> tuple[Any, Any, list[int]]:
    """Return a pinocchio model, its data, and the ids of the frames that are the DH frames, from 0 on."""
    pin = load_pinocchio()
    model = pin.Model()
    parent, placement = 0, pin.SE3.Identity()
    frames = [model.addFrame(pin.Frame("dh0", 0, 0, placement, pin.FrameType.OP_FRAME))]
    for i in range(arm.joints):
        turned = pin.SE3(pin.utils.rotate("z", arm.theta[i] if arm.theta else 0.0), np.zeros(3))
        parent = model.addJoint(parent, pin.JointModelRZ(), placement * turned, f"joint{i + 1}")
        placement = pin.SE3(np.eye(3), np.array([0.0, 0.0, arm.d[i]])) * pin.SE3(
            pin.utils.rotate("x", arm.alpha[i]), np.array([arm.a[i], 0.0, 0.0])
        )
        frames.append(model.addFrame(pin.Frame(f"dh{i + 1}", parent, 0, placement, pin.FrameType.OP_FRAME)))
    return model, model.createData(), frames


def pin_place(arm: ArmModel, q: list[float], link: int, p_link: tuple[float, float, float]) -> NDArray[np.float64]:
    """Return a point of a link in the base frame [m], shape (3,)."""
    pin = load_pinocchio()
    model, data, frames = pin_arm(arm)
    pin.framesForwardKinematics(model, data, np.array(q))
    return np.asarray(data.oMf[frames[link]].act(np.array(p_link)))


def pin_rotation(arm: ArmModel, q: list[float], link: int) -> NDArray[np.float64]:
    """Return the rotation of a DH frame in the base frame, shape (3, 3)."""
    pin = load_pinocchio()
    model, data, frames = pin_arm(arm)
    pin.framesForwardKinematics(model, data, np.array(q))
    return np.asarray(data.oMf[frames[link]].rotation)


def pin_jacobian(arm: ArmModel, q: list[float], link: int, p_link: tuple[float, float, float]) -> NDArray[np.float64]:
    """Return velocity of the point over angular velocity of the link, in the base frame, shape (6, n)."""
    pin = load_pinocchio()
    model, data, frames = pin_arm(arm)
    if link == 0:
        return np.zeros((6, arm.joints))
    held = model.frames[frames[link]]
    point = pin.SE3(np.eye(3), held.placement.act(np.array(p_link)))
    pin.computeJointJacobians(model, data, np.array(q))
    return np.asarray(pin.getFrameJacobian(model, data, held.parentJoint, point, pin.LOCAL_WORLD_ALIGNED))


def pin_mass_matrix(arm: ArmModel, inertia: ArmInertia, q: list[float]) -> NDArray[np.float64]:
    """Return the mass matrix of the arm [kg m^2], shape (6, 6), by the composite rigid body algorithm."""
    pin = load_pinocchio()
    heavy = _heavy(arm, inertia)
    found = np.array(pin.crba(heavy, heavy.createData(), np.array(q)))
    return np.asarray(np.triu(found) + np.triu(found, 1).T)


def pin_torques(
    arm: ArmModel, inertia: ArmInertia, gravity: float, q: list[float], qd: list[float], qdd: list[float]
) -> NDArray[np.float64]:
    """Return the torques of the joints [N m], shape (6,), of an upright arm in a motion."""
    pin = load_pinocchio()
    heavy = _heavy(arm, inertia)
    heavy.gravity.linear = np.array([0.0, 0.0, -gravity])
    return np.asarray(pin.rnea(heavy, heavy.createData(), np.array(q), np.array(qd), np.array(qdd)))


def _heavy(arm: ArmModel, inertia: ArmInertia) -> Any:
    """Return the pinocchio model with the links' masses and the rotors."""
    pin = load_pinocchio()
    model, _, frames = pin_arm(arm)
    heavy = pin.Model(model)
    for link, frame in zip(inertia.links, frames[1:], strict=True):
        held = model.frames[frame]
        body = pin.Inertia(link.mass, np.array(link.centre), np.array(link.tensor))
        heavy.appendBodyToJoint(held.parentJoint, body, held.placement)
    heavy.armature = np.array(inertia.rotor)
    return heavy
