"""Inertia of an arm: what its links weigh, what its joints take, and the table of the UR family.

    symbol    meaning
    M         joint-space mass matrix [kg m^2]: kinetic energy = qd^T M qd / 2
    J         Jacobian of a point [m/rad]
    tau       joint torques [N m] = M qdd + what gravity and the joint speeds take

Source of the torques: the recursion of Luh, Walker and Paul, as in Siciliano et al., *Robotics*, chapter 7.5.

Sources of the table:
    Masses, centres of mass and tensors: ``physical_parameters.yaml`` of Universal_Robots_ROS2_Description (commit
    3426d67; it quotes Universal Robots, "DH Parameters for calculations of kinematics and dynamics"), there in the URDF
    frames, here in the DH frames of that article. The UR3 and UR5 have no published tensors: theirs are those of solid
    cylinders of the published mass, as in that file. The tensors that it gives for the UR30 are the UR16e's, digit for
    digit, with which an upper arm of 28.5 kg would turn as one of 10; so shoulder and wrists have the UR20's tensors,
    whose masses are the same, and upper arm and forearm the UR20's, scaled by mass and by length squared (ours).
    The UR7e has the UR5e's, the UR12e the UR10e's. UR15 and UR18 are from commits 2cb0bf1 and 6ffee81, the UR8 Long
    from commit 31e2294 of ros-industrial/universal_robot.
    Torques: Universal Robots, "Max. joint torques", as collected in ``joint_limits.yaml`` there.
    Rotors: not published. 0.1 kg m^2 at every joint, as MuJoCo Menagerie's UR5e has it (``universal_robots_ur5e``,
    armature), scaled with the joint's highest torque over 150 N m, because larger joints have larger motors (assumed).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from coneskin.core.errors import KinematicsError
from coneskin.geometry.pose import Vector

from .kinematics import link_poses, point_jacobian
from .model import ArmModel, Joints
from .models import arm_model
from .vectors import added, cross, dot, minus, scaled

_HELD_SHARE = 1.25  # of its highest torque, that a joint at rest withstands by friction; fitted to the UR5's elbow
_LEAST_BRAKING = 0.5  # rad/s^2
#: of an arm that stands upright [m/s^2]; as a UR controller has it until it is told another
GRAVITY = 9.82

Tensor = tuple[Vector, Vector, Vector]


@dataclass(frozen=True, slots=True)
class LinkInertia:
    """Inertia of one link, in its DH frame."""

    mass: float  #: [kg]
    centre: Vector  #: centre of mass [m]
    tensor: Tensor  #: inertia about the centre of mass along the axes of the DH frame [kg m^2], symmetric, 3 x 3


@dataclass(frozen=True, slots=True)
class ArmInertia:
    """Inertia of an arm, and what its joints can hold."""

    links: tuple[LinkInertia, ...]  #: that move, from the base on
    torque: Joints  #: highest torque of each joint [N m]
    rotor: Joints  #: inertia of each motor's rotor as the joint feels it, through the gear [kg m^2]


def mass_matrix(model: ArmModel, inertia: ArmInertia, q: Sequence[float]) -> list[list[float]]:
    """Return the mass matrix, n x n [kg m^2]: the sum of Jv^T m Jv + Jw^T I Jw over the links, and the rotors.

    Args:
        model: the nominal arm; the DH frames of a calibrated one may be far from its links.
        q: joint positions [rad].

    Raises:
        KinematicsError: q has not a finite number for each joint.
    """
    poses = link_poses(model, q)
    axes = [pose.rotate((0.0, 0.0, 1.0)) for pose in poses[:-1]]
    m = [[inertia.rotor[i] if i == j else 0.0 for j in range(model.joints)] for i in range(model.joints)]
    for index, link in enumerate(inertia.links, 1):
        rows = point_jacobian(model, q, index, link.centre)
        back = _columns(poses[index].rotation)  # base frame -> frame of the link
        spins = [_apply(back, axes[i]) for i in range(index)]
        turned = [_apply(link.tensor, spin) for spin in spins]
        for i in range(index):
            for j in range(i + 1):
                value = link.mass * sum(row[i] * row[j] for row in rows) + dot(spins[i], turned[j])
                m[i][j] += value
                m[j][i] += value if i != j else 0.0
    return m


def joint_torques(
    model: ArmModel, inertia: ArmInertia, q: Sequence[float], qd: Sequence[float], qdd: Sequence[float]
) -> list[float]:
    """Return the torques of the motors of an upright arm in a motion, without friction [N m].

    Args:
        model: the nominal arm.
        q: joint positions [rad].
        qd: joint speeds [rad/s].
        qdd: joint accelerations [rad/s^2].

    Raises:
        KinematicsError: q has not a finite number for each joint.
    """
    poses = link_poses(model, q)
    spin: Vector = (0.0, 0.0, 0.0)  # of the link, and its rate; the acceleration of its frame's origin
    rate: Vector = (0.0, 0.0, 0.0)
    lift: Vector = (0.0, 0.0, GRAVITY)  # an arm at rest feels gravity as a base that is lifted
    loads = []  # of each link: its centre of mass, what its acceleration takes of force and of torque
    for i, link in enumerate(inertia.links):
        axis, pose = poses[i].rotate((0.0, 0.0, 1.0)), poses[i + 1]
        rate = added(rate, added(scaled(axis, qdd[i]), scaled(cross(spin, axis), qd[i])))
        spin = added(spin, scaled(axis, qd[i]))
        step = minus(pose.translation, poses[i].translation)
        arm = pose.rotate(link.centre)
        before, lift = lift, added(lift, _swept(rate, spin, step))
        centre = added(pose.translation, arm)
        force = scaled(added(before, _swept(rate, spin, added(step, arm))), link.mass)
        back = _columns(pose.rotation)
        local = _apply(back, spin)
        turning = added(_apply(link.tensor, _apply(back, rate)), cross(local, _apply(link.tensor, local)))
        loads.append((centre, force, pose.rotate(turning)))
    torques = [0.0] * model.joints
    carried: Vector = (0.0, 0.0, 0.0)  # force of all links beyond a joint, and their torque about the base's origin
    turned: Vector = (0.0, 0.0, 0.0)
    for i in reversed(range(model.joints)):
        centre, force, turning = loads[i]
        carried = added(carried, force)
        turned = added(turned, added(turning, cross(centre, force)))
        about = minus(turned, cross(poses[i].translation, carried))
        torques[i] = dot(poses[i].rotate((0.0, 0.0, 1.0)), about) + inertia.rotor[i] * qdd[i]
    return torques


def highest_acceleration(
    model: ArmModel, inertia: ArmInertia, q: Sequence[float], qd: Sequence[float], direction: Sequence[float]
) -> float:
    """Return the highest acceleration along a direction, whose greatest number is 1 [rad/s^2]; see `joint_torques`."""
    still = joint_torques(model, inertia, q, qd, (0.0,) * model.joints)
    found = math.inf
    for along, limit, torque, moved in zip(
        direction, inertia.torque, still, joint_torques(model, inertia, q, qd, direction), strict=True
    ):
        most, slope = limit if along else _HELD_SHARE * limit, moved - torque
        if slope:
            found = min(found, (most - math.copysign(torque, torque * slope)) / abs(slope))
    return found


def held_braking(
    name: str, payload: float = 0.0, centre: Sequence[float] = (0.0, 0.0, 0.0)
) -> Callable[[Joints, Joints], float] | None:
    """Return what tells how hard an arm's motors can brake it at joint positions and speeds, upright [rad/s^2].

    That is of the leading joint, and the least of the bare arm and of one with all that it carries; infinite where the
    arm stands, and at least `_LEAST_BRAKING`, where a real arm would sag.

    Args:
        payload: the most that it carries, taken as a point [kg].
        centre: of the payload, in the flange's frame [m].

    Returns:
        it; None for an arm of unknown inertia.
    """
    try:
        bare = arm_inertia(name)
    except KinematicsError:
        return None
    return functools.partial(_held, arm_model(name), tuple(dict.fromkeys((bare, loaded(bare, payload, centre)))))


def _held(model: ArmModel, inertias: Sequence[ArmInertia], q: Joints, qd: Joints) -> float:
    lead = max(map(abs, qd))
    if lead == 0.0:
        return math.inf
    against = [-speed / lead for speed in qd]
    return max(_LEAST_BRAKING, min(highest_acceleration(model, one, q, qd, against) for one in inertias))


def _columns(rows: Tensor) -> Tensor:
    a, b, c = zip(*rows, strict=True)
    return a, b, c


def _apply(rows: Tensor, v: Vector) -> Vector:
    return dot(rows[0], v), dot(rows[1], v), dot(rows[2], v)


def _swept(rate: Vector, spin: Vector, arm: Vector) -> Vector:
    """Return the acceleration of the end of an arm that turns, against its beginning."""
    return added(cross(rate, arm), cross(spin, cross(spin, arm)))


def loaded(inertia: ArmInertia, mass: float, centre: Sequence[float]) -> ArmInertia:
    """Return the inertia of an arm that carries a payload, taken as a point.

    Args:
        mass: of the payload [kg].
        centre: its centre of mass in the flange's frame [m].
    """
    if not mass > 0.0:
        return inertia
    last = inertia.links[-1]
    both = last.mass + mass
    x, y, z = centre
    share, arm = mass / both, minus((x, y, z), last.centre)
    part, square = last.mass * share, dot(arm, arm)
    rows = [
        tuple(have + part * ((square if i == j else 0.0) - arm[i] * arm[j]) for j, have in enumerate(row))
        for i, row in enumerate(last.tensor)
    ]
    tensor: Tensor = (rows[0], rows[1], rows[2])  # type: ignore[assignment]
    link = LinkInertia(both, added(last.centre, scaled(arm, share)), tensor)
    return replace(inertia, links=(*inertia.links[:-1], link))


_ROTOR_PER_TORQUE = 0.1 / 150.0  # kg m^2 of reflected inertia for each N m of highest torque

#: mass [kg]; centre x, y, z [m]; tensor xx, xy, xz, yy, yz, zz [kg m^2], about the centre, in the DH frame
_Row = tuple[float, Vector, tuple[float, float, float, float, float, float]]


def _rod(along: float, across: float) -> tuple[float, float, float, float, float, float]:
    """Return the tensor of a cylinder along x."""
    return along, 0.0, 0.0, across, 0.0, across


def _pin(along: float, across: float) -> tuple[float, float, float, float, float, float]:
    """Return the tensor of a cylinder along y."""
    return across, 0.0, 0.0, along, 0.0, across


_UR5E_LINKS: tuple[_Row, ...] = (
    (3.761, (0.0, -0.02561, 0.00193), (0.0070021, 7.3e-7, -1.053e-5, 0.00648091, 0.00049994, 0.00657286)),
    (8.058, (0.2125, 0.0, 0.11336), (0.01505885, -5.4e-5, 5.63e-6, 0.33388086, -1.81e-6, 0.33247207)),
    (2.846, (0.15, 0.0, 0.0265), (0.00399632, -1.365e-5, 0.00137272, 0.07879254, -6.6e-6, 0.0784851)),
    (1.37, (0.0, -0.0018, 0.01634), (0.00165491, -2.82e-6, -4.38e-6, 0.00135962, 0.00010157, 0.00126279)),
    (1.3, (0.0, 0.0018, 0.01634), (0.00135617, -2.74e-6, 4.44e-6, 0.00127827, -5.048e-5, 0.00096614)),
    (0.365, (0.0, 0.0, -0.001159), (0.00018694, 6e-8, -1.7e-7, 0.00018908, -9.2e-7, 0.00025756)),
)
_UR10E_LINKS: tuple[_Row, ...] = (
    (7.369, (0.021, 0.0, 0.027), (0.03408, 0.00002, -0.00425, 0.03529, 0.00008, 0.02156)),
    (13.051, (0.38, 0.0, 0.158), (0.02814, 0.00005, -0.01561, 0.77068, 0.00002, 0.76943)),
    (3.989, (0.24, 0.0, 0.068), (0.01014, 0.00008, 0.00916, 0.30928, 0.0, 0.30646)),
    (2.1, (0.0, 0.007, 0.018), (0.00296, -0.00001, 0.0, 0.00222, -0.00024, 0.00258)),
    (1.98, (0.0, 0.007, 0.018), (0.00296, -0.00001, 0.0, 0.00222, -0.00024, 0.00258)),
    (0.615, (0.0, 0.0, -0.026), (0.0004, 0.0, 0.0, 0.00041, 0.0, 0.00034)),
)
#: of UR8 Long, UR15 and UR18, which share them
_UR15_SHOULDER: _Row = (
    9.9883, (0.000024, -0.033309, 0.025304), (0.051334, 0.000025, -0.000016, 0.047702, 0.008805, 0.034263)
)  # fmt: skip
_UR15_WRISTS: tuple[_Row, ...] = (
    (2.089, (0.000025, -0.019695, 0.016413), (0.004339, 0.000019, 0.000001, 0.002548, 0.000706, 0.003912)),
    (2.0869, (0.000025, 0.01996, 0.015886), (0.004288, 0.000017, -0.000003, 0.002566, -0.000716, 0.003927)),
    (1.0666, (-0.000018, -0.000112, -0.053397), (0.001406, -0.000003, 0.00001, 0.001404, -0.000024, 0.001002)),
)
_LINK_TABLE: dict[str, tuple[_Row, ...]] = {
    "UR3": (
        (2.0, (0.0, -0.02, 0.0), _pin(0.005625, 0.008093167)),
        (3.42, (0.13, 0.0, 0.1157), _rod(0.00961875, 0.021728492)),
        (1.26, (0.05, 0.0, 0.0238), _rod(0.00354375, 0.006546809)),
        (0.8, (0.0, 0.0, 0.01), _pin(0.00225, 0.001610642)),
        (0.8, (0.0, 0.0, 0.01), _pin(0.00225, 0.001572174)),
        (0.35, (0.0, 0.0, -0.02), (0.000136267, 0.0, 0.0, 0.000136267, 0.0, 0.0001792)),
    ),
    "UR5": (
        (3.7, (0.0, -0.02561, 0.00193), _pin(0.01040625, 0.014972358)),
        (8.393, (0.2125, 0.0, 0.11336), _rod(0.0151074, 0.133885835)),
        (2.33, (0.15, 0.0, 0.0265), _rod(0.004095, 0.031216804)),
        (1.219, (0.0, -0.0018, 0.01634), _pin(0.0021942, 0.00201389)),
        (1.219, (0.0, 0.0018, 0.01634), _pin(0.0021942, 0.00183104)),
        (0.1879, (0.0, 0.0, -0.001159), (8.062476e-5, 0.0, 0.0, 8.062476e-5, 0.0, 0.000132117)),
    ),
    "UR10": tuple((mass, *row[1:]) for mass, row in zip((7.1, 12.7, 4.27, 2.0, 2.0, 0.365), _UR10E_LINKS, strict=True)),
    "UR3e": (
        (1.98, (0.0, -0.02, 0.0), (0.0027657, 9.6e-6, -1.49e-5, 0.0021501, 0.0001873, 0.0025626)),
        (3.4445, (0.13, 0.0, 0.1157), (0.0042623, -4.09e-5, -0.001496, 0.0460284, -1.29e-5, 0.0448947)),
        (1.437, (0.05, 0.0, 0.0238), (0.0010511, 0.0, -3.31e-5, 0.0113396, 2.2e-6, 0.0110895)),
        (0.871, (0.0, 0.0, 0.01), (0.0008174, -5e-7, 2.1e-6, 0.0006844, 6.17e-5, 0.0005497)),
        (0.805, (0.0, 0.0, 0.01), (0.0006059, -6e-7, -6e-7, 0.0005837, -2.71e-5, 0.0003831)),
        (0.261, (0.0, 0.0, -0.02), (0.000108, -1e-7, -1e-7, 0.0001086, -2e-7, 0.0001371)),
    ),
    "UR5e": _UR5E_LINKS,
    "UR7e": _UR5E_LINKS,
    "UR8 Long": (
        _UR15_SHOULDER,
        (17.0738, (0.565429, -0.000074, 0.19542), (0.056709, 0.000292, -0.054852, 2.44012, -0.000014, 2.432744)),
        (7.6393, (0.416102, 0.000058, 0.065663), (0.022148, 0.000052, 0.019779, 0.633274, 0.000003, 0.625889)),
        *_UR15_WRISTS,
    ),
    "UR10e": _UR10E_LINKS,
    "UR12e": _UR10E_LINKS,
    "UR15": (
        _UR15_SHOULDER,
        (14.9255, (0.419009, -0.000083, 0.192787), (0.048202, 0.000232, -0.032135, 1.188499, -0.000017, 1.182771)),
        (6.1015, (0.305471, 0.000019, 0.070552), (0.018481, -0.000005, 0.013601, 0.303502, 0.000003, 0.296843)),
        *_UR15_WRISTS,
    ),
    "UR16e": (
        (7.369, (0.0, -0.016, 0.03), (0.03351, 0.00002, -0.00001, 0.03374, 0.00374, 0.021)),
        (10.45, (0.302, 0.0, 0.16), (0.02796, -0.0001, -0.0072, 0.47558, 0.00003, 0.47635)),
        (4.321, (0.194, 0.0, 0.065), (0.01091, 0.00006, 0.01012, 0.1206, 0.00001, 0.11714)),
        (2.18, (0.0, -0.009, 0.011), (0.00609, -0.00001, 0.0, 0.00245, 0.00083, 0.00579)),
        (2.033, (0.0, 0.018, 0.012), (0.00389, -0.00001, 0.0, 0.00219, -0.00045, 0.00363)),
        (0.907, (0.0, 0.0, -0.044), (0.00117, 0.0, 0.0, 0.00118, 0.0, 0.00084)),
    ),
    "UR18": (
        _UR15_SHOULDER,
        (14.2009, (0.308664, -0.000088, 0.190204), (0.045094, 0.000179, -0.024705, 0.630805, -0.00002, 0.625724)),
        (5.52, (0.199652, 0.000021, 0.073101), (0.016891, 0.0, 0.009081, 0.129732, 0.000003, 0.123451)),
        *_UR15_WRISTS,
    ),
    "UR20": (
        (16.343, (0.0, -0.061, 0.0062), (0.08866, -0.00011, -0.00011, 0.07632, 0.0072, 0.08418)),
        (29.632, (0.5226, 0.0, 0.2098), (0.1467, 0.00019, -0.05163, 4.6659, 0.00004, 4.6348)),
        (7.879, (0.3234, 0.0, 0.0604), (0.02612, -0.00005, -0.02898, 0.75763, -0.00001, 0.75327)),
        (3.054, (0.0, -0.0026, 0.0393), (0.00555, -0.00001, -0.00002, 0.00537, 0.00036, 0.00402)),
        (3.126, (0.0, 0.0024, 0.0379), (0.00586, -0.00001, -0.00002, 0.00578, -0.00037, 0.00427)),
        (0.926, (0.0, 0.0, -0.0293), (0.00092, 0.0, 0.0, 0.00091, 0.0, 0.00117)),
    ),
    "UR30": (
        (16.343, (-0.0001, -0.06, 0.0069), (0.08866, -0.00011, -0.00011, 0.07632, 0.0072, 0.08418)),
        (28.542, (0.3894, 0.0, 0.2103), (0.1413, 0.0, -0.0367, 2.4542, 0.0, 2.4379)),
        (7.156, (0.2257, 0.0, 0.0629), (0.02372, 0.0, -0.01819, 0.32877, 0.0, 0.32688)),
        (3.054, (0.0, -0.0048, 0.0353), (0.00555, -0.00001, -0.00002, 0.00537, 0.00036, 0.00402)),
        (3.126, (0.0, 0.0046, 0.0341), (0.00586, -0.00001, -0.00002, 0.00578, -0.00037, 0.00427)),
        (0.926, (0.0, 0.0, -0.0293), (0.00092, 0.0, 0.0, 0.00091, 0.0, 0.00117)),
    ),
}


def _torque(large: float, elbow: float, wrist: float) -> Joints:
    return large, large, elbow, wrist, wrist, wrist


#: highest torque of base and shoulder, elbow, wrists [N m]
_JOINT_TORQUES = {
    "UR3": _torque(56.0, 28.0, 12.0),
    "UR10": _torque(330.0, 150.0, 56.0),
    "UR3e": _torque(54.0, 28.0, 9.0),
    **dict.fromkeys(("UR5", "UR5e", "UR7e"), _torque(150.0, 150.0, 28.0)),
    **dict.fromkeys(("UR10e", "UR12e", "UR16e"), _torque(330.0, 150.0, 54.0)),
    **dict.fromkeys(("UR8 Long", "UR15", "UR18"), _torque(433.0, 204.0, 70.0)),
    **dict.fromkeys(("UR20", "UR30"), _torque(738.0, 433.0, 107.0)),
}


def arm_inertia(model: ArmModel | str) -> ArmInertia:
    """Return the inertia of an arm, or of that of a name, without any tool.

    Raises:
        KinematicsError: there is no such arm, or its inertia is not known.
    """
    return _inertia(arm_model(model).name if isinstance(model, str) else model.name)


@functools.cache
def _inertia(name: str) -> ArmInertia:
    if name not in _LINK_TABLE:
        raise KinematicsError(f"inertias are known for {', '.join(_LINK_TABLE)}, got the arm {name!r}")
    links = tuple(
        LinkInertia(mass, centre, ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))
        for mass, centre, (xx, xy, xz, yy, yz, zz) in _LINK_TABLE[name]
    )
    torque = _JOINT_TORQUES[name]
    return ArmInertia(links, torque, tuple(_ROTOR_PER_TORQUE * value for value in torque))
