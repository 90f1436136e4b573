"""Agreement of the contact's model with MuJoCo: peak force, impulse and compression in random contacts.

    python bench/impact_agreement.py --contacts 40

In MuJoCo six joints with servos and torque limits move an arm; the model has one mass on one servo. Both get the same
padding, body, reaction time and deceleration; the guard has no part in it. The model holds for a push along the normal:
where the speed along the normal changes by more than 10 % because the arm turns, the surface recedes by more than 5 %
of the compression because it slides past the body, or a joint's torque saturates, it does not.
"""

from __future__ import annotations

import argparse
import math
import random

import numpy as np
from report import head, quantile

from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose
from coneskin.permissible_speed.taylor_integrator import integrate
from coneskin.permissible_speed.two_mass_contact import DrivenArm, StruckBody, TwoMassContact
from coneskin.physics.mujoco_plant import MujocoPlant
from coneskin.physics.scene_description import SheetOnLink
from coneskin.robot.arm.inertia import effective_mass, mass_matrix
from coneskin.robot.arm.kinematics import link_pose, point_jacobian
from coneskin.robot.arm.link_frames import LINK_INDEX, dh_mesh
from coneskin.robot.arm.ur_inertias import arm_inertia
from coneskin.robot.arm.ur_models import arm_model
from coneskin.scene.body import BodyScene
from coneskin.skin.padding import Padding

MODEL, LINK = arm_model("UR5e"), LINK_INDEX["forearm"]
CONE = PlacedFrustum(Frustum(0.0376, 0.0372, 0.26), dh_mesh(MODEL, "forearm") @ Pose(translation=(0.0, 0.0, 0.08)))
CYCLE, RADIUS, REACTION, HORIZON = 5e-4, 0.04, 0.012, 0.3
SERVO = 2.0 * math.pi * 15.0  # of the plant's joints


def contact(seed: int) -> tuple[float, float, float, float, bool, bool] | None:
    """Return speed, relative differences of peak, impulse and compression, whether it bottoms out, whether it holds."""
    chance = random.Random(seed)
    q = [chance.uniform(-3.0, 3.0), chance.uniform(-2.2, -0.9), chance.uniform(0.6, 2.2), -1.5, -1.5, 0.0]
    u, phi = chance.uniform(0.02, 0.24), chance.uniform(0.0, 2.0 * math.pi)
    joint, rate, braking = chance.randrange(3), chance.uniform(0.2, 1.5), chance.choice([5.0, 10.0, 20.0])
    mass, stiffness = 10.0 ** chance.uniform(-0.5, 1.3), 10.0 ** chance.uniform(3.0, 4.6)
    padding = Padding(loss=chance.choice([0.0, 0.3, 1.0]))
    point, pose = CONE.point(u, phi), link_pose(MODEL, q, LINK)
    normal = np.array(pose.rotate(CONE.normal(phi)))
    jacobian = np.array(point_jacobian(MODEL, q, LINK, point))
    levers = normal @ jacobian
    lever = float(levers[joint])
    speed = rate * abs(lever)
    if speed < 0.02:
        return None
    diagonal = np.diag(np.array(mass_matrix(MODEL, arm_inertia(MODEL), q)))  # of which the plant makes its servos
    stiff = float(1.0 / np.sum(levers**2 / (diagonal * SERVO**2)))
    heavy = effective_mass(MODEL, arm_inertia(MODEL), q, LINK, point, tuple(normal))
    arm = DrivenArm(speed, heavy, stiff, 2.0 * stiff / SERVO, REACTION, braking * abs(lever))
    body = StruckBody(mass, support=stiffness, damping=0.6 * math.sqrt(stiffness * mass))
    course = integrate(TwoMassContact(arm, body, padding), HORIZON)
    ball = tuple(np.array(pose.apply(point)) + RADIUS * normal)
    hand = BodyScene("hand", ball, radius=RADIUS, mass=mass, stiffness=stiffness, damping=0.3)
    turn = math.copysign(rate, lever)
    qd = [0.0] * 6
    qd[joint] = turn
    plant = MujocoPlant(MODEL, [SheetOnLink("one", LINK, CONE)], [hand], padding, q, qd, step=1e-4)
    target, now, most = list(q), turn, 0.0
    limits = arm_inertia(MODEL).torque
    for step in range(round(HORIZON / CYCLE)):
        change = -math.copysign(min(braking * CYCLE, abs(now)), turn) if step * CYCLE >= course.braked else 0.0
        qd[joint] = now + 0.5 * change
        plant.advance(target, qd, CYCLE)
        target[joint] += qd[joint] * CYCLE
        now += change
        most = max(most, *(abs(t) / limit for t, limit in zip(plant.torque, limits, strict=True)))
    turned = abs(target[joint] - q[joint])
    axis = np.array(pose.rotate(CONE.link_frustum.rotate((0.0, 0.0, 1.0))))
    around = np.cross(axis, normal) @ jacobian[:, joint] * turn
    aside = abs(around) / speed * min(course.stopping_distance, speed * HORIZON)
    recedes = aside**2 / (2.0 * (RADIUS + CONE.frustum.radius1))
    swings = (
        turned * float(np.linalg.norm(jacobian[:, joint])) / abs(lever)
    )  # by what the speed along the normal changes
    holds = most < 0.99 and swings < 0.1 and recedes < 0.05 * course.deepest
    return (
        speed,
        course.peak / plant.peak - 1.0,
        course.impulse / plant.impulse - 1.0,
        course.deepest / plant.deepest - 1.0,
        course.deepest > padding.thickness,
        holds,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--contacts", type=int, default=40)
    args = parser.parse_args()
    print(head("mujoco", "numpy"))
    found, seed = [], 0
    while len(found) < args.contacts:
        one = contact(seed)
        seed += 1
        if one is not None:
            found.append(one)
    print(f"{len(found)} contacts of a UR5e's forearm; the model over MuJoCo, less 1")
    columns = [("count", 6), ("within 5 %", 12), ("peak: median", 14), ("95 %", 8), ("worst", 8)]
    columns += [("impulse: worst", 16), ("depth: worst", 14)]
    print(" " * 44 + "".join(f"{name:>{width}}" for name, width in columns))
    groups = {
        "holds: a push along the normal": [one for one in found if one[5]],
        "... padding does not bottom out": [one for one in found if one[5] and not one[4]],
        "... padding bottoms out": [one for one in found if one[5] and one[4]],
        "does not hold": [one for one in found if not one[5]],
    }
    for name, rows in groups.items():
        if rows:
            peaks = [abs(one[1]) for one in rows]
            signed = quantile([one[1] for one in rows], 0.5)
            print(
                f"{name:44}{len(rows):>6}{sum(missed <= 0.05 for missed in peaks):>12}"
                f"{signed:>+14.1%}{quantile(peaks, 0.95):>8.1%}{max(peaks):>8.1%}"
                f"{max(abs(one[2]) for one in rows):>16.1%}{max(abs(one[3]) for one in rows):>14.1%}"
            )


if __name__ == "__main__":
    main()
