"""Inertia of an arm: what its links weigh, and the mass that a contact on it feels.

    symbol    meaning
    M         joint-space mass matrix [kg m^2]: kinetic energy = qd^T M qd / 2
    J         Jacobian of a point [m/rad]
    tau       joint torques [N m] = M qdd + what gravity and the joint speeds take
    n         unit vector in the base frame
    m_n       effective mass along n [kg]: a blow at the point along n moves it as it would move a free mass of m_n

Source: Khatib, "Inertial properties in robotic manipulation: an object-level framework", IJRR 14 (1995), eq. 9: the
effective mass is 1 / (n^T J M^-1 J^T n). The joints are free in it; held joints make an arm heavier, never lighter.
Torques: the recursion of Luh, Walker and Paul, as in Siciliano et al., *Robotics*, chapter 7.5.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from coneskin.core.errors import KinematicsError
from coneskin.geometry.pose import Vector

from .kinematics import JOINTS, link_poses, point_jacobian
from .model import ArmModel, Joints

__all__ = ["GRAVITY", "ArmInertia", "LinkInertia", "effective_mass", "joint_torques", "mass_matrix"]

GRAVITY = 9.82  #: of an arm that stands upright [m/s^2]; as a UR controller has it until it is told another

Tensor = tuple[Vector, Vector, Vector]


@dataclass(frozen=True, slots=True)
class LinkInertia:
    """Inertia of one link, in its DH frame.

    Attributes:
        mass: [kg].
        centre: centre of mass [m].
        tensor: inertia about the centre of mass along the axes of the DH frame [kg m^2], symmetric, 3 x 3.
    """

    mass: float
    centre: Vector
    tensor: Tensor


@dataclass(frozen=True, slots=True)
class ArmInertia:
    """Inertia of an arm, and what its joints can hold.

    Attributes:
        links: the six moving links, shoulder to wrist 3.
        torque: highest torque of each joint [N m].
        rotor: inertia of each motor's rotor as the joint feels it, through the gear [kg m^2].
    """

    links: tuple[LinkInertia, ...]
    torque: Joints
    rotor: Joints


def mass_matrix(model: ArmModel, inertia: ArmInertia, q: Sequence[float]) -> list[list[float]]:
    """Return the mass matrix, 6 x 6 [kg m^2]: the sum of Jv^T m Jv + Jw^T I Jw over the links, and the rotors.

    Args:
        model: the nominal arm; the DH frames of a calibrated one may be far from its links.
        inertia: of the arm.
        q: joint positions [rad].

    Raises:
        KinematicsError: q has not six finite numbers.
    """
    poses = link_poses(model, q)
    axes = [pose.rotate((0.0, 0.0, 1.0)) for pose in poses[:-1]]
    m = [[inertia.rotor[i] if i == j else 0.0 for j in range(JOINTS)] for i in range(JOINTS)]
    for index, link in enumerate(inertia.links, 1):
        rows = point_jacobian(model, q, index, link.centre)
        back = _columns(poses[index].rotation)  # base frame -> frame of the link
        spins = [_apply(back, axes[i]) for i in range(index)]
        turned = [_apply(link.tensor, spin) for spin in spins]
        for i in range(index):
            for j in range(i + 1):
                value = link.mass * sum(row[i] * row[j] for row in rows) + _dot(spins[i], turned[j])
                m[i][j] += value
                m[j][i] += value if i != j else 0.0
    return m


def joint_torques(
    model: ArmModel, inertia: ArmInertia, q: Sequence[float], qd: Sequence[float], qdd: Sequence[float]
) -> list[float]:
    """Return the torques of the motors of an upright arm in a motion, without friction [N m].

    Args:
        model: the nominal arm.
        inertia: of the arm.
        q: joint positions [rad].
        qd: joint speeds [rad/s].
        qdd: joint accelerations [rad/s^2].

    Raises:
        KinematicsError: q has not six finite numbers.
    """
    poses = link_poses(model, q)
    spin: Vector = (0.0, 0.0, 0.0)  # of the link, and its rate; the acceleration of its frame's origin
    rate: Vector = (0.0, 0.0, 0.0)
    lift: Vector = (0.0, 0.0, GRAVITY)  # an arm at rest feels gravity as a base that is lifted
    loads = []  # of each link: its centre of mass, what its acceleration takes of force and of torque
    for i, link in enumerate(inertia.links):
        axis, pose = poses[i].rotate((0.0, 0.0, 1.0)), poses[i + 1]
        rate = _sum(rate, _sum(_scaled(axis, qdd[i]), _scaled(_cross(spin, axis), qd[i])))
        spin = _sum(spin, _scaled(axis, qd[i]))
        step = _minus(pose.translation, poses[i].translation)
        arm = pose.rotate(link.centre)
        before, lift = lift, _sum(lift, _swept(rate, spin, step))
        centre = _sum(pose.translation, arm)
        force = _scaled(_sum(before, _swept(rate, spin, _sum(step, arm))), link.mass)
        back = _columns(pose.rotation)
        local = _apply(back, spin)
        turning = _sum(_apply(link.tensor, _apply(back, rate)), _cross(local, _apply(link.tensor, local)))
        loads.append((centre, force, pose.rotate(turning)))
    torques = [0.0] * JOINTS
    carried: Vector = (0.0, 0.0, 0.0)  # force of all links beyond a joint, and their torque about the base's origin
    turned: Vector = (0.0, 0.0, 0.0)
    for i in reversed(range(JOINTS)):
        centre, force, turning = loads[i]
        carried = _sum(carried, force)
        turned = _sum(turned, _sum(turning, _cross(centre, force)))
        about = _minus(turned, _cross(poses[i].translation, carried))
        torques[i] = _dot(poses[i].rotate((0.0, 0.0, 1.0)), about) + inertia.rotor[i] * qdd[i]
    return torques


def effective_mass(
    model: ArmModel, inertia: ArmInertia, q: Sequence[float], link: int, p_link: Vector, direction: Vector
) -> float:
    """Return the mass that a blow at a point of a link feels along a direction [kg]; infinite where it cannot move.

    Args:
        model: the nominal arm.
        inertia: of the arm.
        q: joint positions [rad].
        link: index of the link's DH frame, 0 to 6.
        p_link: the point in that frame [m].
        direction: in the base frame; its length does not matter.

    Raises:
        KinematicsError: q has not six finite numbers, there is no such link, or the direction is 0.
    """
    length = math.hypot(*direction)
    if not (math.isfinite(length) and length > 0.0):
        raise KinematicsError(f"a direction must be finite and not 0, got {direction}")
    rows = point_jacobian(model, q, link, p_link)
    along = [sum(d * row[j] for d, row in zip(direction, rows, strict=True)) / length for j in range(JOINTS)]
    mobility = sum(a * b for a, b in zip(along, _solved(mass_matrix(model, inertia, q), along), strict=True))
    return 1.0 / mobility if mobility > 0.0 else math.inf


def _solved(matrix: list[list[float]], right: Sequence[float]) -> list[float]:
    """Solve a symmetric positive definite system by Cholesky's method."""
    n = len(right)
    lower = [[0.0] * n for _ in range(n)]
    for i in range(n):
        for j in range(i + 1):
            rest = matrix[i][j] - sum(lower[i][k] * lower[j][k] for k in range(j))
            lower[i][j] = math.sqrt(rest) if i == j else rest / lower[j][j]
    y: list[float] = []
    for i in range(n):
        y.append((right[i] - sum(lower[i][k] * y[k] for k in range(i))) / lower[i][i])
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (y[i] - sum(lower[k][i] * x[k] for k in range(i + 1, n))) / lower[i][i]
    return x


def _columns(rows: Tensor) -> Tensor:
    a, b, c = zip(*rows, strict=True)
    return a, b, c


def _apply(rows: Tensor, v: Vector) -> Vector:
    return _dot(rows[0], v), _dot(rows[1], v), _dot(rows[2], v)


def _swept(rate: Vector, spin: Vector, arm: Vector) -> Vector:
    """Return the acceleration of the end of an arm that turns, against its beginning."""
    return _sum(_cross(rate, arm), _cross(spin, _cross(spin, arm)))


def _sum(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _scaled(a: Vector, factor: float) -> Vector:
    return a[0] * factor, a[1] * factor, a[2] * factor


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
