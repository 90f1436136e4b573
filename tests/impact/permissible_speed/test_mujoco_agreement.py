"""The contact's model against the physics engine, in which six joints swing: within 5 % where both hold.

Both hold while the arm is driven as it is wanted and the normal turns little: a push of up to half a second. Where
other joints are dragged along or the surface turns, the extra way keeps the model from pressing less.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.impact.permissible_speed.arm_patches import ArmPatch
from coneskin.impact.permissible_speed.contact_course import ContactCourse
from coneskin.impact.permissible_speed.extra_way import extra_ways
from coneskin.impact.permissible_speed.limits_file import BodyRegion, ForceLimits, MeasuredReaction
from coneskin.impact.permissible_speed.speed_map import contact_at
from coneskin.impact.permissible_speed.taylor_integrator import integrate
from coneskin.impact.permissible_speed.two_mass_contact import DrivenArm, StruckBody, TwoMassContact
from coneskin.robot.arm.inertia import arm_inertia
from coneskin.robot.arm.kinematics import link_pose, point_jacobian
from coneskin.scene.values.scene import BodyScene
from coneskin.skin.materials import Padding
from tests.support.guard_rig import CONE, LINK, MODEL

pytest.importorskip("mujoco", reason="the physics engine is MuJoCo (PyPI: mujoco)")

from coneskin.impact.simulation.mujoco_plant import MujocoPlant
from coneskin.impact.simulation.scene_description import SheetOnLink
from tests.support.effective_mass import effective_mass

Q1 = tuple(math.radians(angle) for angle in (-2.0, -90.0, 90.0, -90.0, -90.0, 0.0))
Q2 = tuple(math.radians(angle) for angle in (20.0, -60.0, 70.0, -90.0, -90.0, 0.0))
CYCLE, BRAKING, REACTION, RADIUS = 5e-4, 10.0, 0.012, 0.04


@pytest.mark.long
@pytest.mark.parametrize(
    ("q", "u", "phi", "joint", "speed", "body", "padding"),
    [
        (Q1, 0.13, math.pi / 2, 0, 0.3, (0.6, 15e3), Padding()),
        (Q1, 0.13, math.pi / 2, 0, 1.0, (0.6, 15e3), Padding()),  # it bottoms out
        (Q1, 0.25, math.pi / 2, 0, 1.0, (2.0, 20e3), Padding(loss=0.0)),
        (Q1, 0.13, math.pi / 2, 0, 0.6, (10.0, 1.0), Padding()),  # all but free
        (Q2, 0.13, 0.0, 1, 0.5, (0.6, 15e3), Padding()),
        (Q2, 0.20, math.pi, 2, 0.8, (0.6, 15e3), Padding()),
    ],
)
def test_peak_and_impulse_are_those_of_the_physics_engine(
    q: tuple[float, ...],
    u: float,
    phi: float,
    joint: int,
    speed: float,
    body: tuple[float, float],
    padding: Padding,
) -> None:
    course, _, plant = meet(q, u, phi, joint, speed, body, padding)
    assert course.peak == pytest.approx(plant.peak, rel=0.05)
    assert course.impulse == pytest.approx(plant.impulse, rel=0.05)
    assert course.deepest == pytest.approx(plant.deepest, rel=0.05)


@pytest.mark.long
@pytest.mark.parametrize(
    ("q", "u", "phi", "joint", "speed", "body", "padding", "braking"),
    [
        (
            (-0.4802, -1.7026, 0.7141, -1.5000, -1.5000, 0.0000),
            0.1391,
            2.9927,
            1,
            0.5061,
            (16.5804, 1855.4),
            Padding(loss=0.3),
            20.0,
        ),  # lag
        (
            (-0.9489, -1.0747, 1.9727, -1.5000, -1.5000, 0.0000),
            0.2231,
            3.1762,
            1,
            1.3313,
            (17.4819, 3586.8),
            Padding(loss=0.3),
            5.0,
        ),  # bend
        (
            (2.7318, -1.4779, 1.4962, -1.5000, -1.5000, 0.0000),
            0.1090,
            3.3176,
            1,
            1.2198,
            (1.0019, 10699.3),
            Padding(loss=0.3),
            20.0,
        ),  # both
    ],
)
def test_with_the_extra_way_it_does_not_press_less_than_the_physics_engine(
    q: tuple[float, ...],
    u: float,
    phi: float,
    joint: int,
    speed: float,
    body: tuple[float, float],
    padding: Padding,
    braking: float,
) -> None:
    """Of the random pushes of a bench, those of which the straight way of one mass made the least."""
    course, extra, plant = meet(q, u, phi, joint, speed, body, padding, braking)
    assert course.peak < 0.7 * plant.peak
    assert extra.peak > plant.peak


def meet(
    q: tuple[float, ...],
    u: float,
    phi: float,
    joint: int,
    speed: float,
    body: tuple[float, float],
    padding: Padding,
    braking: float = BRAKING,
) -> tuple[ContactCourse, ContactCourse, MujocoPlant]:
    """Return the courses without and with the extra way of the place, and the plant after the push."""
    (mass, stiffness), ratio = body, 0.3
    point, pose = CONE.point(u, phi), link_pose(MODEL, q, LINK)
    normal = np.array(pose.rotate(CONE.normal(phi)))
    lever = float(normal @ np.array(point_jacobian(MODEL, q, LINK, point))[:, joint])
    turn = math.copysign(speed, lever)
    heavy = effective_mass(MODEL, arm_inertia(MODEL), q, LINK, point, tuple(normal))
    servo = 2.0 * math.pi * 15.0  # as the plant's joints have it
    arm = DrivenArm(speed * abs(lever), heavy, heavy * servo**2, 2.0 * heavy * servo, REACTION, braking * abs(lever))
    struck = StruckBody(mass, support=stiffness, damping=2.0 * ratio * math.sqrt(stiffness * mass))
    course = integrate(TwoMassContact(arm, struck, padding), 0.4)
    region = BodyRegion("ball", struck, ForceLimits(math.inf, math.inf))
    measured = MeasuredReaction(REACTION, braking, "this test", servo / (2.0 * math.pi))
    (way,) = extra_ways(MODEL, [ArmPatch("one", LINK, u, phi, point, CONE.normal(phi))], [q])
    extra = integrate(contact_at(speed * abs(lever), abs(lever), heavy, region, measured, padding, way), 0.4)

    ball = tuple(np.array(pose.apply(point)) + RADIUS * normal)
    hand = BodyScene("hand", ball, radius=RADIUS, mass=mass, stiffness=stiffness, damping=ratio)  # type: ignore[arg-type]
    qd = [0.0] * 6
    qd[joint] = turn
    plant = MujocoPlant(MODEL, [SheetOnLink("one", LINK, CONE)], [hand], padding, q, qd, step=CYCLE / 5.0)
    target, rate = list(q), turn
    for step in range(round(0.4 / CYCLE)):
        change = -math.copysign(min(braking * CYCLE, abs(rate)), turn) if step * CYCLE >= course.braked else 0.0
        qd[joint] = rate + 0.5 * change
        plant.update(target, qd, CYCLE)
        target[joint] += qd[joint] * CYCLE
        rate += change
    return course, extra, plant
