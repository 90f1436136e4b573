"""Random pushes of bench `impact-agreement`: an arm, driven by one joint, that runs into a ball on a spring."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose, Vector
from coneskin.impact.permissible_speed.arm_patches import ArmPatch
from coneskin.impact.permissible_speed.contact_course import ContactCourse
from coneskin.impact.permissible_speed.extra_way import ExtraWay, extra_ways
from coneskin.impact.permissible_speed.limits_file import BodyRegion, ForceLimits, MeasuredReaction
from coneskin.impact.permissible_speed.speed_map import contact_at
from coneskin.impact.permissible_speed.taylor_integrator import integrate
from coneskin.impact.permissible_speed.two_mass_contact import DrivenArm, StruckBody, TwoMassContact
from coneskin.robot.arm.inertia import arm_inertia, mass_matrix
from coneskin.robot.arm.kinematics import LINK_INDEX, dh_mesh, link_pose, point_jacobian
from coneskin.robot.arm.model import Joints
from coneskin.robot.arm.models import arm_model
from coneskin.skin.materials import Padding
from tests.support.effective_mass import effective_mass

MODEL, LINK = arm_model("UR5e"), LINK_INDEX["forearm"]
LINK_CONE = PlacedFrustum(Frustum(0.0376, 0.0372, 0.26), dh_mesh(MODEL, "forearm") @ Pose(translation=(0.0, 0.0, 0.08)))
RADIUS, REACTION, HORIZON = 0.04, 0.012, 0.3  # m of the ball; s; s
SERVO_RATE = 2.0 * math.pi * 15.0  # of the plant's joints
DAMPING_RATIO = 0.3  # of the damping of the ball's spring
_MIN_SPEED = 0.02  # m/s along the normal


@dataclass(frozen=True)
class Push:
    """One push.

    Attributes:
        q: joint positions at the first contact [rad].
        u, phi: place of the contact on the sheet [m], [rad].
        joint: that turns; the others are to stand.
        rate: of that joint, away from the base of the normal [rad/s], signed.
        braking: of that joint [rad/s^2].
        body: that is struck.
        padding: of the skin.
        levers: of the joints along the normal [m].
        masses: mass matrix of the arm [kg m^2].
    """

    q: Joints
    u: float
    phi: float
    joint: int
    rate: float
    braking: float
    body: StruckBody
    padding: Padding
    levers: NDArray[np.float64]
    masses: NDArray[np.float64]

    @property
    def speed(self) -> float:
        """Of the surface along its normal [m/s]."""
        return abs(self.rate * float(self.levers[self.joint]))

    @property
    def ball(self) -> Vector:
        """Place of the ball at the first contact, in the base frame [m]."""
        pose = link_pose(MODEL, self.q, LINK)
        x, y, z = np.array(pose.apply(LINK_CONE.point(self.u, self.phi))) + RADIUS * np.array(
            pose.rotate(LINK_CONE.normal(self.phi))
        )
        return float(x), float(y), float(z)

    def turned(self, time: float, braked: float) -> tuple[float, float]:
        """Return how far the joint is to have turned, and how fast it is to turn, at a time [s]: [rad], [rad/s].

        Args:
            time: since the first contact.
            braked: when it begins to brake.
        """
        since = min(max(0.0, time - braked), abs(self.rate) / self.braking)
        way = self.rate * (min(time, braked) + since) - math.copysign(0.5 * self.braking * since**2, self.rate)
        return way, self.rate - math.copysign(self.braking * since, self.rate)

    def course(self, *, by_mass: bool = False, extra: ExtraWay | None = None) -> ContactCourse:
        """Return what the model of permissible speeds makes of it.

        Args:
            by_mass: True for the servo of ``coneskin permissible``, which knows the mass alone; else with the
                stiffness that the six servos together have there.
            extra: way of the patch beyond the straight one; implies by_mass.
        """
        pose = link_pose(MODEL, self.q, LINK)
        normal = pose.rotate(LINK_CONE.normal(self.phi))
        mass = effective_mass(MODEL, arm_inertia(MODEL), self.q, LINK, LINK_CONE.point(self.u, self.phi), normal)
        lever = abs(float(self.levers[self.joint]))
        if by_mass or extra is not None:
            ball = BodyRegion("ball", self.body, ForceLimits(math.inf, math.inf))
            measured = MeasuredReaction(REACTION, self.braking, "bench", SERVO_RATE / (2.0 * math.pi))
            contact = contact_at(self.speed, lever, mass, ball, measured, self.padding, extra or ExtraWay())
            return integrate(contact, HORIZON)
        stiffness = float(1.0 / np.sum(self.levers**2 / (np.diag(self.masses) * SERVO_RATE**2)))
        arm = DrivenArm(self.speed, mass, stiffness, 2.0 * stiffness / SERVO_RATE, REACTION, self.braking * lever)
        return integrate(TwoMassContact(arm, self.body, self.padding), HORIZON)

    def extra(self) -> ExtraWay:
        """Return the extra way that ``coneskin permissible`` takes for the patch in this position of the joints."""
        patch = ArmPatch("one", LINK, self.u, self.phi, LINK_CONE.point(self.u, self.phi), LINK_CONE.normal(self.phi))
        return extra_ways(MODEL, [patch], [self.q])[0].rounded_up()


def draw_push(seed: int) -> Push | None:
    """Return the push of a seed; None where the surface hardly moves along its normal."""
    chance = random.Random(seed)
    q: Joints = (
        chance.uniform(-3.0, 3.0),
        chance.uniform(-2.2, -0.9),
        chance.uniform(0.6, 2.2),
        -1.5,
        -1.5,
        0.0,
    )
    u, phi = chance.uniform(0.02, 0.24), chance.uniform(0.0, 2.0 * math.pi)
    joint, rate, braking = chance.randrange(3), chance.uniform(0.2, 1.5), chance.choice([5.0, 10.0, 20.0])
    mass, support = 10.0 ** chance.uniform(-0.5, 1.3), 10.0 ** chance.uniform(3.0, 4.6)
    padding = Padding(loss=chance.choice([0.0, 0.3, 1.0]))
    normal = np.array(link_pose(MODEL, q, LINK).rotate(LINK_CONE.normal(phi)))
    levers = normal @ np.array(point_jacobian(MODEL, q, LINK, LINK_CONE.point(u, phi)))
    body = StruckBody(mass, support=support, damping=2.0 * DAMPING_RATIO * math.sqrt(support * mass))
    masses = np.array(mass_matrix(MODEL, arm_inertia(MODEL), q))
    push = Push(q, u, phi, joint, math.copysign(rate, levers[joint]), braking, body, padding, levers, masses)
    return push if push.speed >= _MIN_SPEED else None
