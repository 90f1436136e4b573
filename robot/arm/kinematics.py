"""Forward kinematics of an arm, the Jacobian of points on its links, and the frames of links and meshes. Plain floats.

    symbol    meaning
    q         joint positions [rad]
    x, y, z   axes of a DH frame, o its origin [m], all in the base frame; frame 0 is the base, the last the flange
    J         velocity of a point [m/s] = J @ joint speeds [rad/s]; joint i turns about z of frame i-1, so that
              column i = z_{i-1} x (p - o_{i-1})

Source: Spong, Hutchinson, Vidyasagar, *Robot Modeling and Control*, chapters 3.2 (standard DH) and 4.6 (Jacobian).

A sensor on a mesh moves with its link. Three frames belong to each link, and they are not the same:

    DH frame     what ``kinematics`` computes: at the *far* end of the link, after Tx(a) Rx(alpha)
    URDF frame   ``upper_arm_link`` and the like: on the link's own joint axis, before Tx(a) Rx(alpha)
    mesh frame   the coordinates in ``upperarm.stl``: turned, and shifted along the joint axis, by the <origin> of the
                 link's <visual> and <collision>, which differs between arms

    p_dh = dh_link(model, "upper_arm").apply(link_mesh(model, "upper_arm").apply(p_mesh))
    p_base = link_pose(model, q, LINK_INDEX["upper_arm"]).apply(p_dh)

The base is the controller's base frame; the URDF's ``base_link`` is turned by half a turn about z against it
(``base_link_inertia`` and ``base`` are not).

In a calibrated arm the frames 2 and 3 of the table may be hundreds of metres away along nearly parallel axes. Upper arm
and forearm are then placed where the arm really is: from the start of joint 2's axis to the point where the next axis
crosses the plane normal to it, as ur_calibration of Universal_Robots_ROS2_Driver does for the URDF.

Sources of the frames, in Universal_Robots_ROS2_Description, releases 2.4.5 to 4.2.0: ``ur_macro.xacro`` (rotations),
``physical_parameters.yaml`` (shoulder_offset, elbow_offset) and ``visual_parameters.yaml`` (visual_offset,
visual_offset_xyz, lately mesh_offset). The later one counts where they differ: by 2 mm at the wrists of the UR3, 1 mm
or less elsewhere.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from coneskin.core.errors import KinematicsError
from coneskin.geometry.pose import Pose, Vector

from .model import ArmModel, Joints
from .models import is_ur
from .vectors import added, cross, dot, minus, scaled

#: x, y and z axes and origin of a DH frame in the base frame
_Frame = tuple[Vector, Vector, Vector, Vector]


def forward(model: ArmModel, q: Sequence[float]) -> Pose:
    """Return the pose of the flange in the base frame at joint positions q [rad].

    Raises:
        KinematicsError: q has not a finite number for each joint.
    """
    return link_pose(model, q, model.joints)


def link_pose(model: ArmModel, q: Sequence[float], link: int) -> Pose:
    """Return the pose of the DH frame of a link (0 base .. n flange) in the base frame at joint positions q [rad].

    Raises:
        KinematicsError: q has not a finite number for each joint, or there is no such link.
    """
    return _pose(_frames(model, q, link)[-1])


def link_poses(model: ArmModel, q: Sequence[float]) -> tuple[Pose, ...]:
    """Return the poses of all DH frames, 0 base .. n flange, in the base frame at joint positions q [rad].

    Raises:
        KinematicsError: q has not a finite number for each joint.
    """
    return tuple(_pose(frame) for frame in _frames(model, q, model.joints))


class PlacedPoint(NamedTuple):
    """Point that is fixed on a link, with a direction, in the base frame."""

    point: Vector  #: where it is [m]
    direction: Vector  #: unit vector that turns with the link
    columns: list[Vector]  #: of its Jacobian [m/rad], one for each joint that moves the link, from joint 1 on

    def velocity(self, qd: Sequence[float]) -> Vector:
        """Return the velocity of the point [m/s] at joint speeds [rad/s]."""
        x = y = z = 0.0
        for (a, b, c), speed in zip(self.columns, qd, strict=False):
            x, y, z = x + a * speed, y + b * speed, z + c * speed
        return x, y, z


def place_point(
    model: ArmModel, q: Sequence[float], link: int, p_link: Vector, direction: Vector = (0.0, 0.0, 0.0)
) -> PlacedPoint:
    """Return where a point that is fixed on a link is, and how the joints move it.

    Args:
        q: joint positions [rad].
        link: link that carries the point, 0 (base) to n (flange).
        p_link: point in the DH frame of that link [m].
        direction: unit vector in that frame.

    Raises:
        KinematicsError: q has not a finite number for each joint, or there is no such link.
    """
    frames = _frames(model, q, link)
    x, y, z, origin = frames[-1]
    p = _combined(x, y, z, p_link, origin)
    columns = [cross(axis, minus(p, o)) for _, _, axis, o in frames[:-1]]
    return PlacedPoint(p, _combined(x, y, z, direction), columns)


def point_jacobian(
    model: ArmModel, q: Sequence[float], link: int, p_link: Vector = (0.0, 0.0, 0.0)
) -> tuple[Joints, Joints, Joints]:
    """Return x, y and z rows of the Jacobian of a point as ``place_point`` takes it [m/rad], 3 x n.

    Columns beyond the link are zero.

    Raises:
        KinematicsError: q has not a finite number for each joint, or there is no such link.
    """
    return _rows(place_point(model, q, link, p_link).columns, model.joints)


def link_motion(model: ArmModel, q: Sequence[float], qd: Sequence[float], link: int) -> tuple[Vector, Vector]:
    """Return the velocity of the origin of a link's DH frame [m/s] and the turning of the link [rad/s], in that frame.

    Raises:
        KinematicsError: q has not a finite number for each joint, or there is no such link.
    """
    *joints, (x, y, z, origin) = _frames(model, q, link)
    velocity = turn = (0.0, 0.0, 0.0)
    for (_, _, axis, o), speed in zip(joints, qd, strict=False):
        velocity = added(velocity, scaled(cross(axis, minus(origin, o)), speed))
        turn = added(turn, scaled(axis, speed))
    return ((dot(x, velocity), dot(y, velocity), dot(z, velocity)), (dot(x, turn), dot(y, turn), dot(z, turn)))


def flange_jacobian(model: ArmModel, q: Sequence[float]) -> tuple[Joints, Joints, Joints, Joints, Joints, Joints]:
    """Return the 6 x n Jacobian of the flange: three rows for its velocity [m/rad], three for its angular velocity.

    Raises:
        KinematicsError: q has not a finite number for each joint.
    """
    axes = [z for _, _, z, _ in _frames(model, q, model.joints)[:-1]]
    return *point_jacobian(model, q, model.joints), *_rows(axes, model.joints)


def cos_sin(twist: float) -> tuple[float, float]:
    """Return cosine and sine of a DH twist [rad], exactly 0 and +-1 at a quarter turn (math.cos gives 6e-17 there)."""
    if abs(twist) == math.pi / 2.0:
        return 0.0, math.copysign(1.0, twist)
    return math.cos(twist), math.sin(twist)


def _frames(model: ArmModel, q: Sequence[float], last: int) -> list[_Frame]:
    """Return the DH frames 0 .. last."""
    joints, theta = model.joints, model.theta
    if not 0 <= last <= joints:
        raise KinematicsError(f"link must be 0 (base) to {joints} (flange), got {last}")
    if len(q) != joints or not all(math.isfinite(angle) for angle in q):
        raise KinematicsError(f"q must be {joints} finite joint positions [rad], got {tuple(q)}")
    x, y, z, o = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
    frames = [(x, y, z, o)]
    for i in range(last):
        turn = q[i] + (theta[i] if theta else 0.0)
        x, y = _turned(x, y, math.cos(turn), math.sin(turn))
        o = added(o, added(scaled(z, model.d[i]), scaled(x, model.a[i])))
        y, z = _turned(y, z, *cos_sin(model.alpha[i]))
        frames.append((x, y, z, o))
    return frames


def _combined(x: Vector, y: Vector, z: Vector, by: Vector, start: Vector = (0.0, 0.0, 0.0)) -> Vector:
    a, b, c = by
    p, q, r = start
    return p + x[0] * a + y[0] * b + z[0] * c, q + x[1] * a + y[1] * b + z[1] * c, r + x[2] * a + y[2] * b + z[2] * c


def _turned(u: Vector, v: Vector, c: float, s: float) -> tuple[Vector, Vector]:
    """Turn two axes in their own plane from u towards v."""
    ux, uy, uz = u
    vx, vy, vz = v
    return ((ux * c + vx * s, uy * c + vy * s, uz * c + vz * s), (vx * c - ux * s, vy * c - uy * s, vz * c - uz * s))


def _pose(frame: _Frame) -> Pose:
    x, y, z, o = frame
    return Pose.trusted(((x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2])), o)


def _rows(columns: list[Vector], joints: int) -> tuple[Joints, Joints, Joints]:
    """Return columns of three as three rows of as many numbers as there are joints, with zeros on the right."""
    zeros = (0.0,) * (joints - len(columns))
    x, y, z = ((*(column[k] for column in columns), *zeros) for k in range(3))
    return x, y, z


#: DH frame that moves with a link, by the link's name in the URDF (without ``_link``)
LINK_INDEX: Mapping[str, int] = MappingProxyType(
    {"base": 0, "shoulder": 1, "upper_arm": 2, "forearm": 3, "wrist_1": 4, "wrist_2": 5, "wrist_3": 6}
)
#: link -> index of the DH length along which its tube runs
TUBE_LENGTHS: Mapping[str, int] = MappingProxyType({"upper_arm": 1, "forearm": 2})

#: arm -> shift of the mesh along the joint axis [m] of upper_arm, forearm, wrist_1, wrist_2, wrist_3; wrist_3 along y
_TUBE_OFFSETS = {
    "UR3": (0.1198, 0.0275, -0.085, -0.083, -0.082, -0.002),
    "UR5": (0.13585, 0.0165, -0.093, -0.095, -0.0818, 0.0),
    "UR10": (0.220941, 0.049042, -0.1149, -0.1158, -0.0922, 0.001),
    "UR3e": (0.120, 0.027, -0.104, -0.08535, -0.0921, 0.0),
    **dict.fromkeys(("UR5e", "UR7e"), (0.138, 0.007, -0.127, -0.0997, -0.0989, -0.0005)),
    **dict.fromkeys(("UR10e", "UR12e", "UR16e"), (0.1762, 0.0393, -0.135, -0.12, -0.1168, -0.0005)),
    **dict.fromkeys(("UR20", "UR30"), (0.260, 0.043, -0.0775, -0.0749, -0.07, 0.0)),
}

_MAX_LINKS = 100  # of any arm
MESHED_ARMS = frozenset(_TUBE_OFFSETS)  #: arms of which it is known where the meshes of their links lie

_QUARTER_TURN = math.pi / 2.0  # rad
#: link -> roll, pitch and yaw of its mesh in the URDF frame [rad]
_TURNED_FRAME = {
    **dict.fromkeys(("base", "shoulder"), (0.0, 0.0, math.pi)),
    **dict.fromkeys(("upper_arm", "forearm"), (_QUARTER_TURN, 0.0, -_QUARTER_TURN)),  # its z axis runs along the link
    **dict.fromkeys(("wrist_1", "wrist_3"), (_QUARTER_TURN, 0.0, 0.0)),
    "wrist_2": (0.0, 0.0, 0.0),
}


def link_index(link: str) -> int:
    """Return the index of the DH frame that moves with a link; "upperarm", "upper_arm", "upper-arm_link" are the same.

    The links of any arm are link_1, link_2 and so on as well.

    Raises:
        KinematicsError: there is no such link; the message lists all.
    """
    plain = "".join(ch for ch in link.lower().removesuffix("_link") if ch.isalnum())
    for name, index in LINK_INDEX.items():
        if plain in (name.replace("_", ""), f"link{index}"):
            return index
    if plain.startswith("link") and plain[4:].isdecimal() and int(plain[4:]) < _MAX_LINKS:
        return int(plain[4:])
    raise KinematicsError(
        f"link must be one of {', '.join(LINK_INDEX)}, or link_1, link_2 and so on of another maker's arm, got {link!r}"
    )


def link_name(index: int) -> str:
    """Return the name of the link that moves with a DH frame: that of a UR arm's, beyond them link_7 and so on."""
    return next((name for name, number in LINK_INDEX.items() if number == index), f"link_{index}")


def _ur_name(model: ArmModel, index: int) -> str:
    if index > model.joints:
        raise KinematicsError(f"link must be one of {', '.join(LINK_INDEX)}, got link_{index}")
    return link_name(index)


def link_mesh(model: ArmModel, link: str) -> Pose:
    """Return the pose of the mesh frame in the URDF frame of a link: p_urdf = link_mesh(...).apply(p_mesh).

    Raises:
        KinematicsError: there is no such link, or the meshes of the arm are not known.
    """
    index = link_index(link)
    offsets = _TUBE_OFFSETS.get(model.name)
    if offsets is None:
        frames = '"urdf" or "dh"' if is_ur(model) else '"dh"'
        raise KinematicsError(
            f"meshes are known for {', '.join(_TUBE_OFFSETS)}, got the arm {model.name!r}: place its sensors with "
            f"frame = {frames} in [[link]]"
        )
    name = _ur_name(model, index)
    along = offsets[index - 2] if index >= 2 else 0.0
    aside = offsets[5] if index == 6 else 0.0
    return Pose.from_xyz_rpy((0.0, aside, along), _TURNED_FRAME[name])


def dh_link(model: ArmModel, link: str) -> Pose:
    """Return the pose of the URDF frame of a link in its DH frame: p_dh = dh_link(...).apply(p_urdf).

    Raises:
        KinematicsError: there is no such link, or the arm is another maker's, whose URDF is not known.
    """
    index = link_index(link)
    if not is_ur(model):
        raise KinematicsError(f'the URDF of the arm {model.name!r} is not known: use frame = "dh" in [[link]]')
    name = _ur_name(model, index)
    if index == 0:
        return Pose()
    if name not in ("upper_arm", "forearm"):
        # the URDF frame is after Rz(q) Tz(d), the DH frame after Tx(a) Rx(alpha) as well
        return _passive(model, index - 1, 0.0).inverse()
    start = 0.0 if name == "upper_arm" else _crossing(model, 1, 0.0)[1]
    angle, _ = _crossing(model, index - 1, start)
    # the URDF frame is at the link's start, turned so that its -x axis points at where the next axis crosses
    return _passive(model, index - 1, model.d[index - 1] - start).inverse() @ Pose.from_xyz_rpy(rpy=(0.0, 0.0, angle))


def dh_mesh(model: ArmModel, link: str) -> Pose:
    """Return the pose of the mesh frame in the DH frame of a link: p_dh = dh_mesh(...).apply(p_mesh).

    Raises:
        KinematicsError: there is no such link, or the meshes of the arm are not known.
    """
    return dh_link(model, link) @ link_mesh(model, link)


def _crossing(model: ArmModel, i: int, start: float) -> tuple[float, float]:
    """Return the point where the axis of the next joint crosses a plane normal to this joint's axis.

    Args:
        i: index of the row of the DH table.
        start: position of the plane along this joint's axis, from the origin of the frame before [m].

    Returns:
        azimuth of the crossing about this joint's axis, less half a turn [rad], and its position along the next axis
        from the origin of the frame after [m].
    """
    cos_alpha, sin_alpha = cos_sin(model.alpha[i])
    along = -(model.d[i] - start) / cos_alpha
    return math.atan2(along * sin_alpha, -model.a[i]), along


def _passive(model: ArmModel, i: int, d: float) -> Pose:
    """Return Tz(d) Tx(a) Rx(alpha) of a row of the DH table."""
    c, s = cos_sin(model.alpha[i])
    return Pose(((1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c)), (model.a[i], 0.0, d))
