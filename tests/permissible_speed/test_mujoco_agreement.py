"""The contact's model against the physics engine, in which six joints swing: within 5 % where both hold.

Both hold while the arm is driven as it is wanted and the normal turns little: a push of up to half a second.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.permissible_speed.taylor_integrator import integrate
from coneskin.permissible_speed.two_mass_contact import DrivenArm, StruckBody, TwoMassContact
from coneskin.robot.arm.inertia import effective_mass
from coneskin.robot.arm.kinematics import link_pose, point_jacobian
from coneskin.robot.arm.ur_inertias import arm_inertia
from coneskin.scene.body import BodyScene
from coneskin.skin.padding import Padding
from coneskin.testing.guard_rig import CONE, LINK, MODEL

pytest.importorskip("mujoco", reason="the physics engine is MuJoCo (PyPI: mujoco)")

from coneskin.physics.mujoco_plant import MujocoPlant
from coneskin.physics.scene_description import SheetOnLink

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
    (mass, stiffness), ratio = body, 0.3
    point, pose = CONE.point(u, phi), link_pose(MODEL, q, LINK)
    normal = np.array(pose.rotate(CONE.normal(phi)))
    lever = float(normal @ np.array(point_jacobian(MODEL, q, LINK, point))[:, joint])
    turn = math.copysign(speed, lever)
    heavy = effective_mass(MODEL, arm_inertia(MODEL), q, LINK, point, tuple(normal))
    servo = 2.0 * math.pi * 15.0  # as the plant's joints have it
    arm = DrivenArm(speed * abs(lever), heavy, heavy * servo**2, 2.0 * heavy * servo, REACTION, BRAKING * abs(lever))
    struck = StruckBody(mass, support=stiffness, damping=2.0 * ratio * math.sqrt(stiffness * mass))
    course = integrate(TwoMassContact(arm, struck, padding), 0.4)

    ball = tuple(np.array(pose.apply(point)) + RADIUS * normal)
    hand = BodyScene("hand", ball, radius=RADIUS, mass=mass, stiffness=stiffness, damping=ratio)  # type: ignore[arg-type]
    qd = [0.0] * 6
    qd[joint] = turn
    plant = MujocoPlant(MODEL, [SheetOnLink("one", LINK, CONE)], [hand], padding, q, qd, step=CYCLE / 5.0)
    target, rate = list(q), turn
    for step in range(round(0.4 / CYCLE)):
        change = -math.copysign(min(BRAKING * CYCLE, abs(rate)), turn) if step * CYCLE >= course.braked else 0.0
        qd[joint] = rate + 0.5 * change
        plant.advance(target, qd, CYCLE)
        target[joint] += qd[joint] * CYCLE
        rate += change
    assert course.peak == pytest.approx(plant.peak, rel=0.05)
    assert course.impulse == pytest.approx(plant.impulse, rel=0.05)
    assert course.deepest == pytest.approx(plant.deepest, rel=0.05)
