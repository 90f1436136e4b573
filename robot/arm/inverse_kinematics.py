"""Inverse kinematics of a nominal UR arm: all solutions in closed form, and the one nearest to a position.

A UR arm has two shoulders (arm left or right of its base axis), two wrists and two elbows: up to 8 solutions. Joints 2,
3 and 4 turn about parallel axes, which makes a closed form possible; a calibrated arm has none.

    symbol  meaning
    p, R    flange in the base frame: position [m] and rotation
    x1, z1  axes of DH frame 1: x1 = (cos q1, sin q1, 0), z1 = (sin q1, -cos q1, 0), the common axis of joints 2, 3, 4
    o5, o4  origins of DH frames 5 and 4 [m]
    n       z1 seen from the flange: R^T z1 = (sin q5 cos q6, -sin q5 sin q6, cos q5)

Source: derived from the DH chain; K. P. Hawkins, *Analytic Inverse Kinematics for the Universal Robots UR-5/UR-10 Arms*
(2013), finds the same branches.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from coneskin.core.errors import KinematicsError
from coneskin.geometry.pose import Pose

from .model import ArmModel, Joints

#: share of the reach by which a pose may be beyond it and still count as on the border; rounding of the pose itself
_BORDER_SHARE = 1e-9
#: sine of q5 below which the axes of joints 4 and 6 are parallel, and the pose determines only the sum of their angles
_WRIST_SINGULAR = 1e-8
#: rounding of a pose's rotation; over the sine of q5 it is what that leaves unknown of joint 6 [rad]
_ROTATION_ROUNDING = 2e-15


def solutions(model: ArmModel, flange: Pose, q6_if_free: float = 0.0) -> list[Joints]:
    """Return all joint positions [rad] in (-pi, pi] that bring the flange to a pose in the base frame, at most 8.

    Args:
        model: a nominal arm.
        flange: wanted pose.
        q6_if_free: position of joint 6 where joints 4 and 6 are parallel and the pose does not determine it [rad].

    Returns:
        none if the pose is out of reach, two equal ones where two branches meet. Joint limits are not checked.

    Raises:
        KinematicsError: the arm is calibrated.
    """
    if any(model.theta) or any(model.a[i] for i in (0, 3, 4, 5)) or any(model.d[i] for i in (1, 2)):
        raise KinematicsError(f"the closed form needs a nominal arm, got a calibrated {model.name}")
    a2, a3, (d1, _, _, d4, d5, d6) = model.a[1], model.a[2], model.d
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = flange.rotation
    px, py, pz = flange.translation
    o5x, o5y, o5z = px - d6 * r02, py - d6 * r12, pz - d6 * r22
    reach = math.hypot(o5x, o5y)
    if reach < abs(d4) * (1.0 - _BORDER_SHARE):
        return []
    opening = math.acos(max(-1.0, min(1.0, d4 / reach))) if reach > 0.0 else 0.0
    heading = math.atan2(o5y, o5x)
    found: list[Joints] = []
    for shoulder in (1.0, -1.0):
        q1 = heading + shoulder * opening + math.pi / 2.0
        c1, s1 = math.cos(q1), math.sin(q1)
        nx, ny, nz = r00 * s1 - r10 * c1, r01 * s1 - r11 * c1, r02 * s1 - r12 * c1
        sine = math.hypot(nx, ny)
        # near the wrist's singularity o4 is as uncertain as joint 6 is, at a distance of d5
        blur = sine if sine <= _WRIST_SINGULAR else _ROTATION_ROUNDING / sine
        border = _BORDER_SHARE + blur * abs(d5) * (abs(a2) + abs(a3)) / abs(a2 * a3)
        for wrist in (1.0, -1.0):
            q5 = math.atan2(wrist * sine, nz)
            q6 = math.atan2(-wrist * ny, wrist * nx) if sine > _WRIST_SINGULAR else q6_if_free
            c6, s6 = math.cos(q6), math.sin(q6)
            c5, s5 = math.cos(q5), math.sin(q5)
            # the x axis of frame 4 turns in the plane of the arm by q2 + q3 + q4
            ux, uy, uz = c5 * c6, -c5 * s6, -s5
            x4x, x4y = r00 * ux + r01 * uy + r02 * uz, r10 * ux + r11 * uy + r12 * uz
            total = math.atan2(r20 * ux + r21 * uy + r22 * uz, x4x * c1 + x4y * s1)
            # o4 in that plane, from the shoulder: two bars, a2 and a3
            o4x, o4y = o5x + d5 * (r00 * s6 + r01 * c6), o5y + d5 * (r10 * s6 + r11 * c6)
            x = o4x * c1 + o4y * s1
            y = o5z + d5 * (r20 * s6 + r21 * c6) - d1
            c3 = (x * x + y * y - a2 * a2 - a3 * a3) / (2.0 * a2 * a3)
            if abs(c3) > 1.0 + border:
                continue
            bend = math.acos(max(-1.0, min(1.0, c3)))
            for elbow in (1.0, -1.0):
                q3 = elbow * bend
                q2 = math.atan2(y, x) - math.atan2(a3 * math.sin(q3), a2 + a3 * math.cos(q3))
                found.append((_turn(q1), _turn(q2), q3, _turn(total - q2 - q3), q5, _turn(q6)))
    return found


def nearest(model: ArmModel, flange: Pose, seed: Sequence[float]) -> Joints:
    """Return the joint positions [rad] for a pose that are nearest to a seed, within joint limits, full turns included.

    Args:
        model: a nominal arm.
        flange: wanted pose in the base frame.
        seed: present joint positions [rad], 6 numbers.

    Raises:
        KinematicsError: the pose is out of reach, or within reach only beyond a joint limit; or the arm is calibrated.
    """
    best: Joints | None = None
    least = math.inf
    for q in solutions(model, flange, seed[5]):
        wound = [
            _wound(angle, near, lower, upper)
            for angle, near, lower, upper in zip(q, seed, model.joint_lower, model.joint_upper, strict=True)
        ]
        if None in wound:
            continue
        distance = sum((angle - near) ** 2 for angle, near in zip(wound, seed, strict=True) if angle is not None)
        if distance < least:
            least = distance
            best = tuple(wound)  # type: ignore[arg-type]
    if best is None:
        x, y, z = flange.translation
        raise KinematicsError(
            f"{model.name} cannot bring its flange to ({x:.4f}, {y:.4f}, {z:.4f}) m in that orientation"
        )
    return best


def _turn(angle: float) -> float:
    """Return the same angle in (-pi, pi]."""
    return math.remainder(angle, math.tau)


def _wound(angle: float, near: float, lower: float, upper: float) -> float | None:
    """Return the same direction as close as possible to another angle, within limits; None if there is none."""
    angle += math.tau * round((near - angle) / math.tau)
    if angle > upper:
        angle -= math.tau * math.ceil((angle - upper) / math.tau)
    elif angle < lower:
        angle += math.tau * math.ceil((lower - angle) / math.tau)
    return angle if lower <= angle <= upper else None
