"""Random collisions of bench `push-in`: an arm anywhere in its room, and bodies that it runs into."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose, Vector
from coneskin.robot.arm.kinematics import LINK_INDEX, dh_mesh, link_pose, point_jacobian
from coneskin.robot.arm.model import ArmModel, Joints
from coneskin.robot.arm.models import arm_model
from coneskin.skin.sensor import Sensor
from tests.support.collision_rig import SkinOnLink
from tests.support.pressing_body import Body

ARMS = ("UR5e", "UR10e", "UR3e")
SPEED_RANGE = 0.1, 1.5  # rad/s, of the leading joint
MIN_APPROACH_SPEED = 0.05  # m/s, the least of the touched place towards its body
PALM_ANGLES = math.radians(5.0), math.radians(60.0)  # of a palm, on either side of the seam
PALM_FORCES = 2.0, 60.0  # N on each side, at which a palm gives way
SOFT, HARD = 10e3, 75e3  # N/m; ISO/TS 15066, table A.3: abdomen, hand


@dataclass(frozen=True)
class RandomCollision:
    """Collision that a seed gives.

    Attributes:
        case: one of CASES.
        arm: name of the arm.
        q: joint positions at which it collides [rad].
        qd: joint speeds then [rad/s].
        bodies: what it runs into; the first is met at once.
        heeds: False where a stream of servo setpoints moves the arm, which the speed slider does not slow.
    """

    case: str
    arm: str
    q: Joints
    qd: Joints
    bodies: tuple[Body, ...]
    heeds: bool

    @property
    def skins(self) -> list[SkinOnLink]:
        """Skins that the collision needs, the touched ones."""
        names = dict.fromkeys(body.sensor for body in self.bodies)
        return [skin_of(self.arm, name) for name in names]


@cache
def skin_of(arm: str, link: str) -> SkinOnLink:
    """Return the skin of a link, around its tube."""
    model = arm_model(arm)
    length = abs(model.a[LINK_INDEX[link] - 1])
    radius = 0.38 * model.d[4]  # 38 mm on the UR5e
    if link == "upper_arm":
        radius *= 1.3
    cone = Frustum(radius, 0.99 * radius, 0.65 * length)
    placed = PlacedFrustum(cone, dh_mesh(model, link) @ Pose(translation=(0.0, 0.0, 0.2 * length)))
    return SkinOnLink(Sensor(cone, LINK_INDEX[link], name=link), LINK_INDEX[link], placed)


class _Scenery:
    """Arm at the instant of the collision, and the places on it."""

    def __init__(self, rng: random.Random) -> None:
        self.rng = rng
        self.arm = rng.choice(ARMS)
        self.model: ArmModel = arm_model(self.arm)
        angle = rng.uniform
        self.q: Joints = (
            angle(-math.pi, math.pi),
            math.radians(angle(-150.0, -30.0)),
            math.radians(rng.choice((-1.0, 1.0)) * angle(35.0, 140.0)),
            angle(-math.pi, math.pi),
            angle(-math.pi, math.pi),
            angle(-math.pi, math.pi),
        )
        raw = [rng.uniform(-1.0, 1.0) for _ in range(6)]
        scale = math.exp(rng.uniform(*map(math.log, SPEED_RANGE))) / max(map(abs, raw[:3]))
        a, b, c, d, e, f = (max(-2.5, min(2.5, scale * value)) for value in raw)
        self.qd: Joints = (a, b, c, d, e, f)

    def velocity(self, link: str, u: float, phi: float) -> Vector:
        """Return the velocity of a place [m/s]."""
        skin = skin_of(self.arm, link)
        rows = point_jacobian(self.model, self.q, skin.link, skin.cone.point(u, phi))
        x, y, z = (sum(j * v for j, v in zip(row, self.qd, strict=True)) for row in rows)
        return x, y, z

    def approach(self, link: str, u: float, phi: float) -> float:
        """Return the speed of a place along its own outward normal [m/s]."""
        skin = skin_of(self.arm, link)
        normal = link_pose(self.model, self.q, skin.link).rotate(skin.cone.normal(phi))
        return sum(n * v for n, v in zip(normal, self.velocity(link, u, phi), strict=True))

    def along(self, link: str) -> float:
        """Return a random u, not at the very ends [m]."""
        return self.rng.uniform(0.08, 0.92) * skin_of(self.arm, link).cone.frustum.slant

    def facing(self, link: str, u: float, target: Vector) -> float:
        """Return the azimuth of a link's skin that faces a point of the base frame the most."""
        skin = skin_of(self.arm, link)
        pose = link_pose(self.model, self.q, skin.link)

        def towards(phi: float) -> float:
            point, normal = pose.apply(skin.cone.point(u, phi)), pose.rotate(skin.cone.normal(phi))
            return sum(n * (t - p) for n, t, p in zip(normal, target, point, strict=True)) / math.dist(point, target)

        return max((math.radians(angle) for angle in range(0, 360, 5)), key=towards)

    def place(self, link: str, u: float, phi: float) -> Vector:
        """Return a place in the base frame [m]."""
        skin = skin_of(self.arm, link)
        return link_pose(self.model, self.q, skin.link).apply(skin.cone.point(u, phi))

    def met(self) -> tuple[str, float, float] | None:
        """Return link, u and phi of a place that moves towards what it meets; None where there is none."""
        link = self.rng.choice(("forearm", "forearm", "upper_arm"))
        for _ in range(40):
            u, phi = self.along(link), self.rng.uniform(0.0, 2.0 * math.pi)
            velocity = math.hypot(*self.velocity(link, u, phi))
            if self.approach(link, u, phi) > max(MIN_APPROACH_SPEED, 0.4 * velocity):
                return link, u, phi
        return None

    def stiff(self) -> float:
        """Return a stiffness from abdomen to hand [N/m]."""
        return math.exp(self.rng.uniform(math.log(SOFT), math.log(HARD)))


def _one(s: _Scenery) -> list[Body] | None:
    at = s.met()
    return at and [Body(*at, stiffness=s.stiff())]


def _second(s: _Scenery, first: Body) -> Body:
    """Return a hand opposite: fixed, or pushing; from the start, or later."""
    cone = skin_of(s.arm, first.sensor).cone.frustum
    u = min(max(first.u + s.rng.uniform(-0.1, 0.1), 0.01), cone.slant - 0.01)
    phi = (first.phi + math.pi + s.rng.uniform(-0.35, 0.35)) % (2.0 * math.pi)
    arrives = s.rng.choice((0.0, s.rng.uniform(0.05, 0.7)))
    push = s.rng.choice((0.0, s.rng.uniform(5.0, 60.0)))
    return Body(first.sensor, u, phi, arrives, 0.0, s.stiff(), push=push)


def _two(s: _Scenery) -> list[Body] | None:
    first = _one(s)
    if not first:
        return None
    follows = s.rng.choice((0.0, s.rng.uniform(5.0, 40.0)))  # a hand that stays on the skin hides the second one
    return [replace(first[0], push=follows), _second(s, first[0])]


def _palm(s: _Scenery) -> list[Body] | None:
    """Return a palm over the seam: it presses both ends of the sheet at the same u."""
    link = s.rng.choice(("forearm", "forearm", "upper_arm"))
    for _ in range(40):
        u, half = s.along(link), s.rng.uniform(*PALM_ANGLES)
        sides = half * s.rng.uniform(0.7, 1.0), 2.0 * math.pi - half
        if all(s.approach(link, u, phi) > MIN_APPROACH_SPEED for phi in sides):
            palm = Body(
                link, u, 0.0, stiffness=0.5 * s.stiff(), hardest=math.exp(s.rng.uniform(*map(math.log, PALM_FORCES)))
            )
            palm = replace(palm, push=s.rng.choice((0.0, 0.5 * palm.hardest)))
            return [replace(palm, phi=phi) for phi in sides]
    return None


def _seam(s: _Scenery) -> list[Body] | None:
    """Return one body on the seam: it presses what its edges reach of both ends of the sheet."""
    link = s.rng.choice(("forearm", "forearm", "upper_arm"))
    for _ in range(40):
        u, sides = s.along(link), (s.rng.uniform(0.0, 0.12), 2.0 * math.pi - s.rng.uniform(0.0, 0.12))
        if all(s.approach(link, u, phi) > MIN_APPROACH_SPEED for phi in sides):
            body = Body(
                link, u, 0.0, stiffness=0.5 * s.stiff(), hardest=math.exp(s.rng.uniform(*map(math.log, PALM_FORCES)))
            )
            body = replace(body, push=s.rng.choice((0.0, 0.5 * body.hardest)))
            return [replace(body, phi=phi) for phi in sides]
    return None


def _grip(s: _Scenery) -> list[Body] | None:
    """Return a hand that closes around the link: it follows, and presses on both sides."""
    first = _one(s)
    if not first:
        return None
    body = replace(first[0], push=s.rng.uniform(3.0, 40.0))
    phi = (body.phi + math.pi + s.rng.uniform(-0.5, 0.5)) % (2.0 * math.pi)
    return [body, replace(body, phi=phi, push=body.push * s.rng.uniform(0.6, 1.4))]


def _fingers(s: _Scenery) -> list[Body] | None:
    """Return three or four fingers about the place that meets them."""
    first = _one(s)
    if not first:
        return None
    body, cone = first[0], skin_of(s.arm, first[0].sensor).cone.frustum
    found = []
    for _ in range(s.rng.choice((3, 4))):
        u = min(max(body.u + s.rng.uniform(-0.06, 0.06), 0.02), cone.slant - 0.02)
        phi = (body.phi + s.rng.uniform(-0.08, 0.08) / cone.radius_at(u)) % (2.0 * math.pi)
        found.append(replace(body, u=u, phi=phi, gap=s.rng.uniform(0.0, 0.004), push=s.rng.uniform(2.0, 20.0)))
    return found


def _clamp(s: _Scenery) -> list[Body] | None:
    """Return a clamp: both sides of one link, or two links, a few millimetres apart."""
    first = _one(s)
    if not first:
        return None
    body, gap = first[0], s.rng.uniform(0.0, 0.02)
    if s.rng.random() < 0.5:
        return [body, replace(_second(s, body), arrives=0.0, gap=gap, push=0.0)]
    link = "upper_arm" if body.sensor == "forearm" else "forearm"
    u = s.along(link)
    phi = s.facing(link, u, s.place(body.sensor, body.u, body.phi))
    return [body, Body(link, u, phi, gap=gap, stiffness=s.stiff())]


def _pushing(s: _Scenery) -> list[Body] | None:
    first = _one(s)
    return first and [replace(first[0], push=s.rng.uniform(15.0, 150.0), push_speed=s.rng.uniform(0.1, 0.4))]


def _growing(s: _Scenery) -> list[Body] | None:
    first = _one(s)
    to, time = s.rng.choice((5.0, 20.0, 100.0)), s.rng.uniform(0.1, 1.5)
    return first and [replace(first[0], push=2.0, push_speed=s.rng.uniform(0.1, 0.4), grow_to=to, grow_time=time)]


#: by the name in the table
ALL_CASES: dict[str, Callable[[_Scenery], list[Body] | None]] = {
    "one hand": _one,
    "two hands": _two,
    "palm over the seam": _palm,
    "clamp": _clamp,
    "person pushing back": _pushing,
    "growing press": _growing,
}
#: collisions with more than one contact, for bench `decode`
SEVERAL_CASES: dict[str, Callable[[_Scenery], list[Body] | None]] = {
    "seam press": _seam,
    "palm over the seam": _palm,
    "grip": _grip,
    "several fingers": _fingers,
    "two hands": _two,
    "clamp": _clamp,
}
_Cases = dict[str, Callable[[_Scenery], list[Body] | None]]


def case_of(seed: int, cases: _Cases = ALL_CASES) -> str:
    """Return the case of a seed; they take turns."""
    return list(cases)[seed % len(cases)]


def draw(seed: int, cases: _Cases = ALL_CASES) -> RandomCollision:
    """Return the collision of a seed."""
    case = case_of(seed, cases)
    rng = random.Random(f"collision {seed}")
    while True:
        scenery = _Scenery(rng)
        if bodies := cases[case](scenery):
            break
    heeds = rng.random() < 0.7
    return RandomCollision(case, scenery.arm, scenery.q, scenery.qd, tuple(bodies), heeds)
