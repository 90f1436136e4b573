"""Deceleration that an arm's motors can give: by joint, over random positions, bare and with its payload.

    python -m bench deceleration [--positions 2000]

A joint that turns alone can be braked with (torque - what gravity and the payload take) / (what it turns): the torques
and inertias of coneskin.robot.arm.inertia, the payload as a point at the flange. The worse direction counts: down.
Beside it what Universal Robots measured for a stop of category 0, which is the worst case of one position: 183 deg/s,
arm stretched out, highest payload (user manuals UR5/CB3 3.4.5 and UR3/CB3 3.10, appendix A): speed over stopping time.
"""

from __future__ import annotations

import argparse
import math
import random

from bench.report import head, quantile, show
from coneskin.robot.arm.inertia import GRAVITY, arm_inertia, joint_torques, mass_matrix
from coneskin.robot.arm.kinematics import point_jacobian
from coneskin.robot.arm.models import JOINT_COUNT, arm_model

PAYLOAD_MASSES = {
    "UR3": 3.0,
    "UR5": 5.0,
    "UR10": 10.0,
    "UR3e": 3.0,
    "UR5e": 5.0,
    "UR10e": 12.5,
    "UR16e": 16.0,
    "UR20": 20.0,
}
#: speed [rad/s] and stopping times [s] of base, shoulder, elbow
MEASURED_STOPS = {"UR5": (0.244, 0.530, 0.164), "UR3": (0.159, 0.154, 0.092)}
STOP_SPEED = math.radians(183.0)
STRETCHED_JOINTS = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
ZERO_JOINTS = (0.0,) * JOINT_COUNT
JOINT_NAMES = ("base", "shoulder", "elbow", "wrist 1", "wrist 2", "wrist 3")


def possible(name: str, q: tuple[float, ...], payload: float) -> list[float]:
    """Return the deceleration that each joint's motor can give in the worse direction [rad/s2]."""
    model, inertia = arm_model(name), arm_inertia(arm_model(name))
    turned, weight = mass_matrix(model, inertia, q), joint_torques(model, inertia, q, ZERO_JOINTS, ZERO_JOINTS)
    rows = point_jacobian(model, q, JOINT_COUNT)
    found = []
    for joint in range(JOINT_COUNT):
        arm2 = sum(row[joint] ** 2 for row in rows)
        held = abs(weight[joint] + payload * GRAVITY * rows[2][joint])
        left = max(0.0, inertia.torque[joint] - held)
        found.append(left / (turned[joint][joint] + payload * arm2))
    return found


def measure(name: str, positions: int) -> list[dict[str, object]]:
    """Return the lines of one arm: bare and with payload."""
    rng = random.Random(name)
    places = [tuple(rng.uniform(-math.pi, math.pi) for _ in range(JOINT_COUNT)) for _ in range(positions)]
    lines = []
    for payload in (0.0, PAYLOAD_MASSES[name]):
        by_joint = list(zip(*(possible(name, q, payload) for q in places), strict=True))
        stretched = possible(name, STRETCHED_JOINTS, payload)
        for joint in range(3):
            values = list(by_joint[joint])
            line: dict[str, object] = {"arm": name, "payload_kg": payload, "joint": JOINT_NAMES[joint]}
            line |= {"stretched": stretched[joint], "least": min(values), "p5": quantile(values, 0.05)}
            line |= {"median": quantile(values, 0.5)}
            line |= {f"share_{rate}": sum(value >= rate for value in values) / len(values) for rate in (10, 20, 40)}
            if payload and name in MEASURED_STOPS:
                line["measured_stretched"] = STOP_SPEED / MEASURED_STOPS[name][joint]
            lines.append(line)
    return lines


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--positions", type=int, default=2000, help="random joint positions (%(default)s)")
    args = parser.parse_args()
    print(head())
    rows = []
    for line in (line for name in PAYLOAD_MASSES for line in measure(name, args.positions)):
        measured = f"{line['measured_stretched']:.1f}" if "measured_stretched" in line else "-"
        what = [f"{line['arm']}, {line['payload_kg']:g} kg, {line['joint']}", f"{line['stretched']:.1f}", measured]
        cells = [f"{line[key]:.1f}" for key in ("least", "p5", "median")]
        rows.append([*what, *cells, *(f"{line[f'share_{rate}']:.0%}" for rate in (10, 20, 40))])
    title = f"rad/s2, and the share of {args.positions} positions in which 10, 20, 40 rad/s2 are possible"
    columns = ["arm, payload, joint", "stretched", "UR, category 0", "least", "p5", "median", "10", "20", "40"]
    show(title, columns, rows)
