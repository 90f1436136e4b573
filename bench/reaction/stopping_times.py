"""Stopping times and distances of the simulated arm beside those that Universal Robots publishes.

    python -m bench stopping-times

A stop of category 0 from full speed, arm stretched out, highest payload, shoulder and elbow on their way down: user
manuals UR5/CB3 3.4.5 and UR3/CB3 3.10, appendix A. The e-Series manuals have curves without numbers, and no table of
the UR10 was found: for these arms the simulation stands alone.

The last two columns need no law of braking. What turns loses its energy on the published way, and its momentum in the
published time: so much of its highest torque the joint gives on average, with gravity against it. A joint that gives
more than that is not braked by its motor alone, or carries less than the table says.
"""

from __future__ import annotations

import argparse
import math

from bench.report import head, show
from coneskin.robot.arm.inertia import arm_inertia, joint_torques, loaded, mass_matrix
from coneskin.robot.arm.models import arm_model
from coneskin.robot.sim.motion.arm import CYCLE, SimulatedArm

from .deceleration import JOINT_NAMES, PAYLOAD_MASSES, STOP_SPEED, STRETCHED_JOINTS, ZERO_JOINTS

#: arm -> distance [rad] and time [s] of base, shoulder, elbow
PUBLISHED_STOPS = {
    "UR5": ((0.31, 0.244), (0.70, 0.530), (0.22, 0.164)),
    "UR3": ((0.18, 0.159), (0.20, 0.154), (0.15, 0.092)),
}
SHARES = (0.33, 0.66, 1.0)


def stop(name: str, joint: int, speed: float, payload: float) -> tuple[float, float]:
    """Return distance [rad] and time [s] of a stop of category 0 of one joint, in its worse direction."""
    found = []
    for way in (-1.0, 1.0):
        arm = SimulatedArm(arm_model(name), STRETCHED_JOINTS)
        arm.carry(payload, (0.0, 0.0, 0.0))
        arm.category_0 = True
        arm.qd[joint] = way * speed
        cycles = 0
        while arm.moving:
            arm.update(1.0, hold=True)
            cycles += 1
        found.append((abs(arm.q[joint]), cycles * CYCLE))
    return max(found)


def needed(name: str, joint: int, way: float, time: float, payload: float) -> tuple[float, float]:
    """Return the mean torque of a stop [N m] that takes this way [rad], and of one that takes this time [s]."""
    model, inertia = arm_model(name), loaded(arm_inertia(name), payload, (0.0, 0.0, 0.0))
    turned = mass_matrix(model, inertia, STRETCHED_JOINTS)[joint][joint]
    weight = abs(joint_torques(model, inertia, STRETCHED_JOINTS, ZERO_JOINTS, ZERO_JOINTS)[joint])
    on_way = 0.5 * turned * STOP_SPEED**2 / way + weight * math.sin(way) / way
    return on_way, turned * STOP_SPEED / time + weight * math.cos(way)


def main() -> None:
    """Measure, and print both tables."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    print(head())
    rows, off = [], []
    for name, published in PUBLISHED_STOPS.items():
        for joint, (way, time) in enumerate(published):
            got_way, got_time = stop(name, joint, STOP_SPEED, PAYLOAD_MASSES[name])
            here = got_way / way - 1.0, got_time / time - 1.0
            off += here
            cells = [f"{way:.2f}", f"{got_way:.2f}", f"{here[0]:+.0%}"]
            cells += [f"{1e3 * time:.0f}", f"{1e3 * got_time:.0f}", f"{here[1]:+.0%}"]
            torques, highest = needed(name, joint, way, time, PAYLOAD_MASSES[name]), arm_inertia(name).torque[joint]
            cells += [f"{torque / highest:.0%}" for torque in torques]
            rows.append([f"{name}, {JOINT_NAMES[joint]}", *cells])
    columns = [
        "arm, joint",
        "published rad",
        "simulated rad",
        "",
        "published ms",
        "simulated ms",
        "",
        "torque/way",
        "torque/time",
    ]
    within = f"{sum(abs(share) <= 0.2 for share in off)} of {len(off)} published figures within 20 %"
    show(f"category 0, full speed, payload and extension: {within}", columns, rows)
    rows = []
    for name, payload in PAYLOAD_MASSES.items():
        for joint in range(3):
            speed = arm_model(name).joint_speed[joint]
            stops = [stop(name, joint, share * speed, load * payload) for load in SHARES for share in SHARES]
            rows.append(
                [f"{name}, {JOINT_NAMES[joint]}", *(f"{1e3 * time:.0f}/{math.degrees(way):.0f}" for way, time in stops)]
            )
    columns = ["arm, joint", *(f"{load:.0%} kg, {share:.0%} speed" for load in SHARES for share in SHARES)]
    show("simulated: ms/deg, stretched out", columns, rows)
