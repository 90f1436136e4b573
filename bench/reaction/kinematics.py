"""Kinematics beside pinocchio, error and microseconds: bench `kinematics` [--calls 2000].

Hot: back to back. Paced: one call each millisecond, after sleeping, as a guard loop makes it: caches are cold. Both
figures of a row come from the same run. pinocchio does the same work: place of a point on the link and its Jacobian; it
does not solve for joint speeds, the row "retreat_step" does. Does not show: other threads, other machines.
"""

from __future__ import annotations

import argparse
import random
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from bench.report import head
from coneskin.robot.arm.kinematics import place_point
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.arm.models import MODEL_NAMES, arm_model
from coneskin.robot.reaction.retreat import RetreatPlan, plan_retreat, retreat_step
from coneskin.robot.reaction.types import ArmState, ContactOnLink, Reaction
from tests.support.pinocchio_arm import load_pinocchio, pin_arm, pin_jacobian, pin_place

TEST_JOINTS = (0.3, -1.2, 1.1, 0.4, 0.5, 0.6)
TOOL_POINT = (0.1, 0.02, 0.05)
AWAY_DIRECTION = (0.0, 0.6, 0.8)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calls", type=int, default=2000, help="paced calls for each row (default: %(default)s)")
    calls = parser.parse_args().calls
    print(head("pin") + "\n")
    errors()
    print(f"\n{'microseconds a call':44} {'hot med':>8} {'paced med':>10} {'p99':>7}")
    nominal = arm_model("UR10e")
    tilted = nominal.calibrated((1e-4,) * 6, (1e-4,) * 6, (1e-3,) * 6, (1e-3,) * 6)
    for arm, which in ((nominal, "nominal"), (tilted, "calibrated")):
        for link, name in ((3, "forearm"), (6, "tool")):
            for row, call in rows(arm, link):
                hot, paced = measure(call, calls)
                print(
                    f"{f'{which}, {name}: {row}':44} {np.median(hot):8.2f} "
                    f"{np.median(paced):10.2f} {np.percentile(paced, 99):7.1f}"
                )


def errors() -> None:
    print(f"{'largest difference from pinocchio':36} {'place m':>9} {'Jacobian m/rad':>15}   (300 random q, all links)")
    source = random.Random(0)
    for name in MODEL_NAMES:
        arm, place, slope = arm_model(name), 0.0, 0.0
        for _ in range(300):
            q = [source.uniform(-6.3, 6.3) for _ in range(6)]
            link = source.randint(1, 6)
            p = (source.uniform(-0.7, 0.7), source.uniform(-0.7, 0.7), source.uniform(-0.7, 0.7))
            point, _, columns = place_point(arm, q, link, p)
            place = max(place, *abs(np.array(point) - pin_place(arm, q, link, p)))
            slope = max(slope, abs(np.array(columns).T - pin_jacobian(arm, q, link, p)[:3, :link]).max())
        print(f"{name:36} {place:9.1e} {slope:15.1e}")


def rows(arm: ArmModel, link: int) -> list[tuple[str, Callable[[], Any]]]:
    plan = plan_retreat(
        arm, ArmState(0.0, TEST_JOINTS), [ContactOnLink(link, TOOL_POINT, AWAY_DIRECTION)], Reaction(kind="retreat")
    )
    if not isinstance(plan, RetreatPlan):
        raise SystemExit(f"no retreat is possible from the bench's own touch: {plan.reason}")
    state = ArmState(0.01, TEST_JOINTS)
    pin_model, data, frames = pin_arm(arm)
    held = pin_model.frames[frames[link]]
    placed, q = held.placement.act(np.array(TOOL_POINT)), np.array(TEST_JOINTS)
    pin = load_pinocchio()
    point = pin.SE3(np.eye(3), placed)

    def pinocchio() -> Any:
        pin.computeJointJacobians(pin_model, data, q)
        data.oMi[held.parentJoint].act(placed)
        return pin.getFrameJacobian(pin_model, data, held.parentJoint, point, pin.LOCAL_WORLD_ALIGNED)

    return [
        ("place and Jacobian", lambda: place_point(arm, TEST_JOINTS, link, TOOL_POINT, AWAY_DIRECTION)),
        ("retreat_step", lambda: retreat_step(plan, state)),
        ("pinocchio, numpy", pinocchio),
    ]


def measure(call: Callable[[], Any], calls: int) -> tuple[list[float], list[float]]:
    """Microseconds of each call, hot and paced; the clock's own time, about 0.05 us, is in them."""
    clock = time.perf_counter_ns
    hot, paced = [], []
    for _ in range(200):
        call()
    for _ in range(50):
        start = clock()
        for _ in range(50):
            call()
        hot.append((clock() - start) / 50e3)
    for _ in range(calls):
        time.sleep(1e-3)
        start = clock()
        call()
        paced.append((clock() - start) / 1e3)
    return hot, paced
