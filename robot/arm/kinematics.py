"""Forward kinematics of an arm, and the Jacobian of points on its links. Plain floats, readable.

`compiled_kinematics` generates the same for one link of one arm where microseconds count, and is tested against this.

    symbol    meaning
    q         joint positions [rad]
    x, y, z   axes of a DH frame, o its origin [m], all in the base frame; frame 0 is the base, 6 the flange
    J         velocity of a point [m/s] = J @ joint speeds [rad/s]; joint i turns about z of frame i-1, so that
              column i = z_{i-1} x (p - o_{i-1})

Source: Spong, Hutchinson, Vidyasagar, *Robot Modeling and Control*, chapters 3.2 (standard DH) and 4.6 (Jacobian).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from coneskin.core.errors import KinematicsError
from coneskin.geometry.pose import Pose, Vector

from .model import ArmModel, Joints

__all__ = ["JOINTS", "cos_sin", "flange_jacobian", "forward", "link_pose", "link_poses", "point_jacobian"]

JOINTS = 6  #: number of joints

#: x, y and z axes and origin of a DH frame in the base frame
_Frame = tuple[Vector, Vector, Vector, Vector]


def forward(model: ArmModel, q: Sequence[float]) -> Pose:
    """Return the pose of the flange in the base frame at joint positions q [rad].

    Raises:
        KinematicsError: q has not six finite numbers.
    """
    return link_pose(model, q, JOINTS)


def link_pose(model: ArmModel, q: Sequence[float], link: int) -> Pose:
    """Return the pose of the DH frame of a link (0 base .. 6 flange) in the base frame at joint positions q [rad].

    Raises:
        KinematicsError: q has not six finite numbers, or there is no such link.
    """
    return _pose(_frames(model, q, link)[-1])


def link_poses(model: ArmModel, q: Sequence[float]) -> tuple[Pose, ...]:
    """Return the poses of all seven DH frames, 0 base .. 6 flange, in the base frame at joint positions q [rad].

    Raises:
        KinematicsError: q has not six finite numbers.
    """
    return tuple(_pose(frame) for frame in _frames(model, q, JOINTS))


def point_jacobian(
    model: ArmModel, q: Sequence[float], link: int, p_link: Vector = (0.0, 0.0, 0.0)
) -> tuple[Joints, Joints, Joints]:
    """Return the Jacobian of a point that is fixed on a link.

    Args:
        model: the arm.
        q: joint positions [rad], 6 numbers.
        link: link that carries the point, 0 (base) to 6 (flange).
        p_link: point in the DH frame of that link [m].

    Returns:
        x, y and z rows of the Jacobian in the base frame [m/rad], 3 x 6; columns beyond the link are zero.

    Raises:
        KinematicsError: q has not six finite numbers, or there is no such link.
    """
    frames = _frames(model, q, link)
    x, y, z, o = frames[-1]
    p = _sum(o, _sum(_times(p_link[0], x), _sum(_times(p_link[1], y), _times(p_link[2], z))))
    return _rows([_cross(z, _sum(p, _times(-1.0, o))) for _, _, z, o in frames[:-1]])


def flange_jacobian(model: ArmModel, q: Sequence[float]) -> tuple[Joints, Joints, Joints, Joints, Joints, Joints]:
    """Return the 6 x 6 Jacobian of the flange: three rows for its velocity [m/rad], three for its angular velocity.

    Raises:
        KinematicsError: q has not six finite numbers.
    """
    axes = [z for _, _, z, _ in _frames(model, q, JOINTS)[:-1]]
    return *point_jacobian(model, q, JOINTS), *_rows(axes)


def cos_sin(twist: float) -> tuple[float, float]:
    """Return cosine and sine of a DH twist [rad], exactly 0 and +-1 at a quarter turn (math.cos gives 6e-17 there)."""
    if abs(twist) == math.pi / 2.0:
        return 0.0, math.copysign(1.0, twist)
    return math.cos(twist), math.sin(twist)


def _frames(model: ArmModel, q: Sequence[float], last: int) -> list[_Frame]:
    """Return the DH frames 0 .. last."""
    if not 0 <= last <= JOINTS:
        raise KinematicsError(f"link must be 0 (base) to 6 (flange), got {last}")
    if len(q) != JOINTS or not all(math.isfinite(angle) for angle in q):
        raise KinematicsError(f"q must be 6 finite joint positions [rad], got {tuple(q)}")
    x, y, z, o = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
    frames = [(x, y, z, o)]
    for i in range(last):
        turn = q[i] + model.theta[i]
        x, y = _turned(x, y, math.cos(turn), math.sin(turn))
        o = _sum(o, _sum(_times(model.d[i], z), _times(model.a[i], x)))
        y, z = _turned(y, z, *cos_sin(model.alpha[i]))
        frames.append((x, y, z, o))
    return frames


def _turned(u: Vector, v: Vector, c: float, s: float) -> tuple[Vector, Vector]:
    """Turn two axes in their own plane from u towards v."""
    return _sum(_times(c, u), _times(s, v)), _sum(_times(-s, u), _times(c, v))


def _sum(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _times(factor: float, a: Vector) -> Vector:
    return factor * a[0], factor * a[1], factor * a[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _pose(frame: _Frame) -> Pose:
    x, y, z, o = frame
    return Pose.trusted(((x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2])), o)


def _rows(columns: list[Vector]) -> tuple[Joints, Joints, Joints]:
    """Return up to six columns of three as three rows of six, with zeros on the right."""
    a, b, c, d, e, f = columns + [(0.0, 0.0, 0.0)] * (JOINTS - len(columns))
    x, y, z = ((a[k], b[k], c[k], d[k], e[k], f[k]) for k in range(3))
    return x, y, z
