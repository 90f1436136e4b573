"""Random collisions of bench `collision`: an arm anywhere in its room that runs into a body in the physics engine."""

from __future__ import annotations

import functools
import math
import random
from dataclasses import dataclass

from coneskin.geometry.pose import Vector
from coneskin.robot.arm.kinematics import dh_mesh, link_pose, point_jacobian
from coneskin.robot.arm.model import ArmModel, Joints
from coneskin.robot.arm.models import arm_model
from coneskin.scene.build import SensorOnArm, place_on_arm
from coneskin.scene.reader import parse_scene
from coneskin.scene.values.scene import BodyScene, Scene
from tests.support.scenes import commissioned

ARM_MODELS = ("UR5e", "UR10e", "UR3e")
SPEED_RANGE = 0.1, 1.5  # m/s of the touched place along its normal
BODY_KINDS = ("hand", "mass", "person", "grip", "wall", "post")
STIFFNESS_RANGE = 10e3, 75e3  # N/m; ISO/TS 15066, table A.3: abdomen, hand
MASS_RANGE = (0.6, 1.2, 4.4, 40.0)  # kg; the same table: hand, neck, head, chest
HAND_MASSES = MASS_RANGE[:2]  # that push or grip
_TOUCHING, _APART = -1e-4, 0.01  # m that skin and body must be apart before they meet; those that are not to meet
RUN_UP, RUN_UP_ACCELERATION = 0.12, 40.0  # s, rad/s^2

_LINK_TABLE = """
[[link]]
name = "{name}"
[[link.sensor]]
id = {number}
name = "{name} skin"
radius1_mm = {radius1:.3f}
radius2_mm = {radius2:.3f}
height_mm = {height:.3f}
xyz_mm = [0, 0, {start:.3f}]
"""


@dataclass(frozen=True)
class RandomImpact:
    """Collision that a seed gives.

    Attributes:
        arm: name of the arm.
        start: joint positions from which it runs up [rad].
        qd: joint speeds with which it collides [rad/s].
        body: what it runs into.
        place: link, u [m] and phi [rad] that meet it.
        approach: speed of that place along its normal [m/s].
    """

    arm: str
    start: Joints
    qd: Joints
    body: BodyScene
    place: tuple[str, float, float]
    approach: float

    def scene(self, reaction: str) -> Scene:
        """Return the scene of the arm with a reaction, as if commissioned; the other tube is bare."""
        link = self.place[0].removesuffix(" skin")
        return commissioned(parse_scene(scene_text(self.arm, f'kind = "{reaction}"\nbare_side = "allowed"', (link,))))


def scene_text(arm: str, reaction: str, links: tuple[str, ...] = ("upper_arm", "forearm")) -> str:
    """Return the scene of an arm with skins around tubes of it, as of bench/collision/push_in_cases.py."""
    model, text = arm_model(arm), f'[arm]\nmodel = "{arm}"\nhost = "127.0.0.1"\n'
    for number, name in enumerate(("upper_arm", "forearm"), 1):
        if name not in links:
            continue
        length = 1e3 * abs(model.a[number])
        radius = 380.0 * model.d[4] * (1.3 if name == "upper_arm" else 1.0)
        text += _LINK_TABLE.format(
            name=name, number=number, radius1=radius, radius2=0.99 * radius, height=0.65 * length, start=0.2 * length
        )
    return f"{text}[reaction]\n{reaction}\n"


def draw(seed: int) -> RandomImpact:
    """Return the collision of a seed; the kinds of body take turns."""
    rng = random.Random(f"impact {seed}")
    while (found := _try(rng, BODY_KINDS[seed % len(BODY_KINDS)])) is None:
        pass
    return found


def _try(rng: random.Random, kind: str) -> RandomImpact | None:
    arm = rng.choice(ARM_MODELS)
    model = arm_model(arm)
    angle = rng.uniform
    lift, elbow = math.radians(angle(-150.0, -30.0)), math.radians(rng.choice((-1.0, 1.0)) * angle(35.0, 140.0))
    wrists = angle(-math.pi, math.pi), angle(-math.pi, math.pi), angle(-math.pi, math.pi)
    q: Joints = (angle(-math.pi, math.pi), lift, elbow, *wrists)
    raw = [angle(-1.0, 1.0) for _ in range(6)]
    skins = _skins(arm)
    item = rng.choice(skins)
    cone = item.frustum
    u, phi = angle(0.12, 0.88) * cone.frustum.slant, angle(0.0, 2.0 * math.pi)
    pose = link_pose(model, q, item.link)
    point, normal = pose.apply(cone.point(u, phi)), pose.rotate(cone.normal(phi))
    rows = point_jacobian(model, q, item.link, cone.point(u, phi))
    velocity = [sum(j * v for j, v in zip(row, raw, strict=True)) for row in rows]
    along = sum(n * v for n, v in zip(normal, velocity, strict=True))
    if along < 0.6 * math.hypot(*velocity):
        return None  # a brush along the skin is no blow
    approach = math.exp(angle(*map(math.log, SPEED_RANGE)))
    a, b, c, d, e, f = (approach / along * value for value in raw)
    qd: Joints = (a, b, c, d, e, f)
    if any(abs(v) > 0.95 * most for v, most in zip(qd, model.joint_speed, strict=True)):
        return None
    way = RUN_UP - 0.5 * max(map(abs, qd)) / RUN_UP_ACCELERATION
    a, b, c, d, e, f = (x - way * v for x, v in zip(q, qd, strict=True))
    tube = pose.rotate(dh_mesh(model, item.link_name).rotate((0.0, 0.0, 1.0)))
    body = _body(rng, kind, point, normal, tube, cone.frustum.radius_at(u))
    start: Joints = (a, b, c, d, e, f)
    if not _clear(model, start, q, skins, item, body):
        return None
    return RandomImpact(arm, start, qd, body, (item.name, u, phi), approach)


@functools.cache
def _skins(arm: str) -> list[SensorOnArm]:
    return place_on_arm(parse_scene(scene_text(arm, 'kind = "stop"')))


def _clear(
    model: ArmModel, start: Joints, end: Joints, skins: list[SensorOnArm], met: SensorOnArm, body: BodyScene
) -> bool:
    """Tell whether nothing touches on the way, and in the end only the skin that is to meet the body."""
    size = 0.0 if body.kind == "wall" else body.radius
    for step in range(11):
        q = [a + 0.1 * step * (b - a) for a, b in zip(start, end, strict=True)]
        for item in skins:
            back = item.frustum.link_frustum.inverse() @ link_pose(model, q, item.link).inverse()
            for part, place in enumerate(body.parts):
                u, _, distance = item.frustum.frustum.locate(*back.apply(place))
                beside = max(-u, u - item.frustum.frustum.slant, 0.0)
                free = math.hypot(beside, max(distance, 0.0)) - size if distance > 0.0 or beside > 0.0 else -size
                here = item is met and part == 0
                if free < (_TOUCHING if here else _APART) and not (here and step == 10):
                    return False
    return True


def _body(rng: random.Random, kind: str, point: Vector, normal: Vector, tube: Vector, radius: float) -> BodyScene:
    """Return a body that a place of the skin meets."""
    across = _cross(normal, tube)
    size = rng.uniform(0.02, 0.06)
    mass = rng.choice(HAND_MASSES if kind in ("person", "grip") else MASS_RANGE)
    stiffness = math.exp(rng.uniform(*map(math.log, STIFFNESS_RANGE)))
    force = math.exp(rng.uniform(math.log(15.0), math.log(100.0)))
    tilt = [math.radians(rng.uniform(-15.0, 15.0)) for _ in range(2)]
    if kind == "wall":
        facing = _sum(_sum(_times(-1.0, normal), _times(math.sin(tilt[0]), tube)), _times(math.sin(tilt[1]), across))
        return BodyScene(kind, point, facing, radius=size)
    if kind == "post":
        axis = _sum(across, _times(math.sin(tilt[0]), tube))
        return BodyScene(kind, _sum(point, _times(0.5 * size, normal)), axis, radius=0.5 * size, length=0.3)
    middle = _sum(point, _times(size, normal))
    if kind == "mass":
        return BodyScene(kind, middle, radius=size, mass=mass)
    opposite = _times(-2.0 * (size + radius) - rng.uniform(0.02, 0.06), normal)
    return BodyScene(
        kind, middle, opposite, size, mass=mass, stiffness=stiffness, force=force, delay=rng.uniform(0.05, 0.3)
    )


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _sum(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _times(factor: float, a: Vector) -> Vector:
    return factor * a[0], factor * a[1], factor * a[2]
