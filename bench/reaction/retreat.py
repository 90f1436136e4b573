"""Success of retreats from random poses: bench `retreat` [--runs 300].

Each run puts an arm at random joint positions, touches a link at random, and follows the retreat at 500 Hz with
speedj's ramps and commands that act two cycles late. First table: retreats that were begun. Second: what the touched
point would do by the objective chosen (all three rows of its Jacobian) and by the one not chosen (the row along the
direction). No obstacle, no dynamics, no tool, no collision of the arm with itself or its table.
"""

from __future__ import annotations

import argparse
import math
import random

from bench.report import head
from coneskin.robot.arm.damped_least_squares import DAMPING_FLOOR, damped_speeds
from coneskin.robot.arm.kinematics import point_jacobian
from coneskin.robot.arm.models import MODEL_NAMES, arm_model
from coneskin.robot.reaction.retreat import MIN_PROGRESS, RetreatPlan, plan_retreat
from coneskin.robot.reaction.types import ArmState, Reaction
from tests.support.retreat_simulation import follow, joints_within, touch

LINKS = {1: "shoulder", 2: "upper arm", 3: "forearm", 4: "wrist 1", 5: "wrist 2", 6: "wrist 3"}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=300, help="retreats for each link (default: %(default)s)")
    runs = parser.parse_args().runs
    print(f"{head()}\n{Reaction(kind='retreat')}\n")
    followed(runs)
    print()
    objectives(runs)


def followed(runs: int) -> None:
    print(
        f"{'touched':10} {'begun':>6} {'made whole':>10} {'time s':>13} {'end - distance mm':>18} "
        f"{'drift / made':>19} {'joint speed':>11} {'accel.':>6} {'past limit':>10} {'back mm':>8}"
    )
    print(
        f"{'':10} {'%':>6} {'%':>10} {'med':>6} {'max':>6} {'least':>9} {'most':>8} "
        f"{'med':>6} {'p95':>6} {'max':>5} {'of limit':>11} {'rad/s2':>6} {'rad':>10} {'max':>8}"
    )
    source = random.Random(20)
    for link, name in LINKS.items():
        results = []
        for run in range(runs):
            arm = arm_model(MODEL_NAMES[run % len(MODEL_NAMES)])
            q = joints_within(arm, source)
            plan = plan_retreat(arm, ArmState(0.0, q), [touch(arm, source, link)], Reaction(kind="retreat"))
            if isinstance(plan, RetreatPlan):
                results.append(follow(arm, plan, q))
        if not results:
            print(f"{name:10} {0:6.0f}")
            continue
        whole = [r for r in results if r.done.complete]
        ends = [1e3 * (r.made - Reaction(kind="retreat").distance) for r in whole]
        drifts = sorted(r.drift / max(r.made, 1e-9) for r in whole)
        times = sorted(r.time for r in results)
        print(
            f"{name:10} {100 * len(results) / runs:6.0f} {100 * len(whole) / len(results):10.0f} "
            f"{times[len(times) // 2]:6.2f} {times[-1]:6.2f} {min(ends):9.3f} {max(ends):8.3f} "
            f"{drifts[len(drifts) // 2]:6.3f} {drifts[int(0.95 * len(drifts))]:6.2f} {drifts[-1]:5.2f} "
            f"{max(r.joint_speed for r in results):11.2f} {max(r.acceleration for r in results):6.2f} "
            f"{max(r.beyond for r in results):10.4f} {1e3 * max(r.backwards for r in results):8.4f}"
        )


def objectives(runs: int) -> None:
    print(
        "at the touch, for 1 m/s wanted; only where the direction can be followed at all "
        f"(at least {100 * MIN_PROGRESS:.0f} % of the speed)"
    )
    print(f"{'touched':10} {'across / along':>23} {'':>23} {'joint speeds rad/s':>20}")
    print(f"{'':10} {'three rows med':>15} {'p95':>7} {'one row med':>15} {'p95':>7} {'three max':>11} {'one max':>8}")
    source = random.Random(21)
    for link, name in LINKS.items():
        three: list[float] = []
        one: list[float] = []
        fast3 = fast1 = 0.0
        for run in range(4 * runs):
            arm = arm_model(MODEL_NAMES[run % len(MODEL_NAMES)])
            q, contact = joints_within(arm, source), touch(arm, source, link)
            plan = plan_retreat(arm, ArmState(0.0, q), [contact], Reaction(kind="retreat"))
            if not isinstance(plan, RetreatPlan):
                continue
            away = plan.tracks[0].away
            rows = point_jacobian(arm, q, link, contact.point)
            columns = [(rows[0][i], rows[1][i], rows[2][i]) for i in range(link)]
            row = [sum(c * u for c, u in zip(column, away, strict=True)) for column in columns]
            least = sum(g * g for g in row) + DAMPING_FLOOR
            for speeds, ratios in ((damped_speeds([(columns, away)])[0], three), ([g / least for g in row], one)):
                v = [sum(w * column[k] for w, column in zip(speeds, columns, strict=True)) for k in range(3)]
                along = sum(a * b for a, b in zip(v, away, strict=True))
                ratios.append(math.hypot(*(a - along * u for a, u in zip(v, away, strict=True))) / along)
            fast3 = max(fast3, *map(abs, damped_speeds([(columns, away)])[0]))
            fast1 = max(fast1, *(abs(g) / least for g in row))
        if three:
            three.sort()
            one.sort()
            n = len(three)
            print(
                f"{name:10} {three[n // 2]:15.3f} {three[int(0.95 * n)]:7.2f} {one[n // 2]:15.3f} "
                f"{one[int(0.95 * n)]:7.2f} {fast3:11.2f} {fast1:8.2f}"
            )
