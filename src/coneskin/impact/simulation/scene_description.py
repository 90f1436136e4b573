"""Description of an arm with skins and of the bodies around it in MJCF; text only.

MuJoCo finds where skins and bodies meet; it makes no force of it, because its own contacts have no stiffness in N/m.
The force is the padding's (``mujoco_plant``). Friction is left out, and so is gravity: an arm carries its own weight,
and a person that of the hand. The bare arm meets nothing: no skin feels what touches it elsewhere.

A body of MJCF turns about its own origin, a link of a DH table about the axis of the frame before it. So body i stands
in DH frame i - 1, turned by the joint, and what the tables give in DH frame i is moved by that frame's constant part.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose, Vector
from coneskin.robot.arm.inertia import ArmInertia, LinkInertia, mass_matrix
from coneskin.robot.arm.kinematics import cos_sin
from coneskin.robot.arm.model import ArmModel
from coneskin.scene.values.scene import BodyScene

SERVO_FREQUENCY = 15.0  #: Hz; of the position loop of a joint, critically damped; assumed, UR publishes none


def body_link(model: ArmModel, link: int) -> Pose:
    """Return the pose of a link's DH frame in its MJCF body, 1 (shoulder) to the last."""
    c, s = cos_sin(model.alpha[link - 1])
    turned = ((1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c))
    return Pose(turned, (model.a[link - 1], 0.0, model.d[link - 1]))


def _describe_arm(model: ArmModel, inertia: ArmInertia, geoms: Mapping[int, str]) -> str:
    """Return the bodies of an arm, nested; ``link1`` is the shoulder, ``joint1`` turns it."""
    opened: list[str] = []
    place = Pose()
    for link in range(1, model.joints + 1):
        theta = model.theta[link - 1] if model.theta else 0.0
        c, s = math.cos(theta), math.sin(theta)
        here = place @ Pose(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
        x, y, _ = zip(*here.rotation, strict=True)
        place = body_link(model, link)
        opened.append(
            f'<body name="link{link}" pos="{numbers(here.translation)}" xyaxes="{numbers((*x, *y))}">'
            f'<joint name="joint{link}" axis="0 0 1" armature="{inertia.rotor[link - 1]!r}"/>'
            + _inertial(inertia.links[link - 1], place)
            + geoms.get(link, "")
        )
    return "\n".join(opened) + "</body>" * model.joints


def _describe_servos(inertia: ArmInertia, masses: Sequence[float]) -> str:
    """Return the servos of the joints: stiff position loops that saturate at the joint's highest torque."""
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


_CONTACT_MARGIN = -1.0  # m; of MuJoCo's own force, so far inside that it makes none
_CONTACT_GAP = 1.002  # m; beyond the margin; contacts are reported in it all the same, 2 mm before surfaces touch
_PRISM_SIDES = 96  # of the prism that a sheet is: its radius is wrong by at most 0.03 mm on a link of 50 mm
_WALL_THICKNESS = 0.02  # m; thickness of a wall
_SMALLEST_NUMBER = 1e-9  # kg m^2 and the like, where MuJoCo wants a number above 0


@dataclass(frozen=True, slots=True)
class SheetOnLink:
    """Skin on a link of the arm."""

    name: str  #: of its sensor
    link: int  #: index of the link's DH frame
    cone: PlacedFrustum  #: its surface in that frame


def describe_scene(
    model: ArmModel,
    inertia: ArmInertia,
    q: Sequence[float],
    sheets: Sequence[SheetOnLink],
    bodies: Sequence[BodyScene],
    step: float,
) -> str:
    """Return the whole model as MJCF.

    Args:
        q: joint positions at which its servos are tuned [rad].
        sheets: on its links; geoms ``sheet0`` and so on.
        bodies: around it; geoms ``body0.0`` and so on, of which the second number counts the parts.
        step: of the integration [s].
    """
    geoms: dict[int, str] = {}
    meshes = ""
    for number, sheet in enumerate(sheets):
        meshes += f'<mesh name="mesh{number}" vertex="{numbers(_vertices(model, sheet))}"/>'
        geoms[sheet.link] = geoms.get(sheet.link, "") + f'<geom name="sheet{number}" type="mesh" mesh="mesh{number}"/>'
    names = [f"body{n}.{part}" for n, body in enumerate(bodies) for part, _ in enumerate(body.parts)]
    pairs = "".join(
        f'<pair geom1="sheet{number}" geom2="{name}" margin="{_CONTACT_MARGIN!r}" gap="{_CONTACT_GAP!r}" condim="1"/>'
        for number in range(len(sheets))
        for name in names
    )
    placed = "".join(
        _body(f"body{n}.{part}", body, place) for n, body in enumerate(bodies) for part, place in enumerate(body.parts)
    )
    masses = [row[i] for i, row in enumerate(mass_matrix(model, inertia, q))]
    return (
        f'<mujoco><compiler angle="radian" autolimits="true"/>'
        f'<option timestep="{step!r}" integrator="implicitfast" gravity="0 0 0"/>'
        f'<default><geom contype="0" conaffinity="0" mass="0"/></default>'
        f"<asset>{meshes}</asset><worldbody>{_describe_arm(model, inertia, geoms)}{placed}</worldbody>"
        f"<contact>{pairs}</contact><actuator>{_describe_servos(inertia, masses)}</actuator></mujoco>"
    )


def _vertices(model: ArmModel, sheet: SheetOnLink) -> list[float]:
    """Return the corners of the prism that stands for a sheet, in the MJCF body of its link [m].

    A partial wrap is a whole cone here: what is beside the sheet touches the link.
    """
    place = body_link(model, sheet.link)
    cone = sheet.cone.frustum
    if sheet.cone.bends:
        azimuths = [cone.wrap * side / _PRISM_SIDES for side in range(_PRISM_SIDES)]
        corners = [sheet.cone.point(u, phi) for u in (0.0, cone.slant) for phi in azimuths]
        return [value for corner in corners for value in place.apply(corner)]
    grown = 1.0 / math.cos(math.pi / _PRISM_SIDES) ** 0.5  # half of the facets' error outside, half inside
    found: list[float] = []
    for height, radius in ((0.0, cone.radius1), (cone.height, cone.radius2)):
        for side in range(_PRISM_SIDES):
            angle = 2.0 * math.pi * side / _PRISM_SIDES
            corner = (grown * radius * math.cos(angle), grown * radius * math.sin(angle), height)
            found += place.apply(sheet.cone.link_frustum.apply(corner))
    return found


def _body(name: str, body: BodyScene, place: Vector) -> str:
    if body.kind == "wall":
        x, y, z = (p - 0.5 * _WALL_THICKNESS * a for p, a in zip(place, body.axis, strict=True))
        size = numbers((body.radius, body.radius, 0.5 * _WALL_THICKNESS))
        return f'<geom name="{name}" type="box" size="{size}" pos="{numbers((x, y, z))}" zaxis="{numbers(body.axis)}"/>'
    if body.kind == "post":
        size = numbers((body.radius, 0.5 * body.length))
        return f'<geom name="{name}" type="capsule" size="{size}" pos="{numbers(place)}" zaxis="{numbers(body.axis)}"/>'
    rate = math.sqrt(body.stiffness / body.mass)
    spring = f'stiffness="{body.stiffness!r}" damping="{2.0 * body.damping * rate * body.mass!r}"'
    slides = "".join(
        f'<joint name="{name}.{axis}" type="slide" axis="{vector}" {spring}/>'
        for axis, vector in (("x", "1 0 0"), ("y", "0 1 0"), ("z", "0 0 1"))
    )
    return (
        f'<body name="{name}" pos="{numbers(place)}">{slides}'
        f'<inertial pos="0 0 0" mass="{body.mass!r}" diaginertia="{f"{_SMALLEST_NUMBER!r} " * 3}"/>'
        f'<geom name="{name}" type="sphere" size="{body.radius!r}"/></body>'
    )
