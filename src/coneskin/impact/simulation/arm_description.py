"""Description of an arm in MJCF, MuJoCo's format, from its DH table and its inertias; text only.

A body of MJCF turns about its own origin, a link of a DH table about the axis of the frame before it. So body i stands
in DH frame i - 1, turned by the joint, and what the tables give in DH frame i is moved by that frame's constant part.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from coneskin.geometry.pose import Pose, Vector
from coneskin.robot.arm.inertia import ArmInertia, LinkInertia
from coneskin.robot.arm.kinematics import JOINTS, cos_sin
from coneskin.robot.arm.model import ArmModel

__all__ = ["body_link", "describe_arm", "describe_servos", "numbers"]

SERVO_FREQUENCY = 15.0  #: Hz; of the position loop of a joint, critically damped; assumed, UR publishes none


def body_link(model: ArmModel, link: int) -> Pose:
    """Return the pose of a link's DH frame in its MJCF body, 1 (shoulder) to 6."""
    c, s = cos_sin(model.alpha[link - 1])
    turned = ((1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c))
    return Pose(turned, (model.a[link - 1], 0.0, model.d[link - 1]))


def describe_arm(model: ArmModel, inertia: ArmInertia, geoms: Mapping[int, str]) -> str:
    """Return the bodies of an arm, nested; ``link1`` is the shoulder, ``joint1`` turns it.

    Args:
        model: the arm.
        inertia: of its links.
        geoms: what else stands in the body of a link, by the link's index.
    """
    opened: list[str] = []
    place = Pose()
    for link in range(1, JOINTS + 1):
        c, s = math.cos(model.theta[link - 1]), math.sin(model.theta[link - 1])
        here = place @ Pose(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
        x, y, _ = zip(*here.rotation, strict=True)
        place = body_link(model, link)
        opened.append(
            f'<body name="link{link}" pos="{numbers(here.translation)}" xyaxes="{numbers((*x, *y))}">'
            f'<joint name="joint{link}" axis="0 0 1" armature="{inertia.rotor[link - 1]!r}"/>'
            + _inertial(inertia.links[link - 1], place)
            + geoms.get(link, "")
        )
    return "\n".join(opened) + "</body>" * JOINTS


def describe_servos(inertia: ArmInertia, masses: Sequence[float]) -> str:
    """Return the servos of the joints: stiff position loops that saturate at the joint's highest torque.

    Args:
        inertia: for the torques.
        masses: what each servo turns [kg m^2]: the diagonal of the mass matrix.
    """
    rate = 2.0 * math.pi * SERVO_FREQUENCY
    return "".join(
        f'<position name="servo{i}" joint="joint{i}" kp="{mass * rate * rate!r}" kv="{2.0 * mass * rate!r}" '
        f'forcerange="{-torque!r} {torque!r}"/>'
        for i, (mass, torque) in enumerate(zip(masses, inertia.torque, strict=True), 1)
    )


def numbers(values: Sequence[float]) -> str:
    """Return numbers as MJCF has them, with every digit."""
    return " ".join(repr(float(value)) for value in values)


def _inertial(link: LinkInertia, place: Pose) -> str:
    """Return mass, centre and tensor of a link in its MJCF body, whose DH frame is at a place in it."""
    rows = place.rotation
    half = [[sum(rows[i][k] * link.tensor[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
    t = [[sum(half[i][k] * rows[j][k] for k in range(3)) for j in range(3)] for i in range(3)]
    centre: Vector = place.apply(link.centre)
    full = numbers((t[0][0], t[1][1], t[2][2], t[0][1], t[0][2], t[1][2]))
    return f'<inertial pos="{numbers(centre)}" mass="{link.mass!r}" fullinertia="{full}"/>'
