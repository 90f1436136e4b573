"""Masses of a motion: what the sample of its joint positions misses of the heaviest and the lightest.

    python -m bench impact-masses                # four motions of a UR5e, a minute

The sample is that of ``coneskin permissible``, 200 positions; held against 4,000 others of the same box.
"""

from __future__ import annotations

import argparse
import math
import random

import numpy as np

from bench.report import head, show
from coneskin.impact.permissible_speed.arm_patches import motion_positions, patches_of, weigh
from coneskin.robot.arm.models import arm_model
from coneskin.scene.reader import parse_scene
from tests.support.scenes import forearm_scene

MOTIONS = {
    "base turns 70 deg": "[[-10, -90, 90, -90, -90, 0], [60, -90, 90, -90, -90, 0]]",
    "shoulder and elbow, 40 deg": "[[0, -110, 70, -90, -90, 0], [0, -70, 110, -90, -90, 0]]",
    "five joints, 60 deg": "[[-30, -120, 60, -120, -120, 0], [30, -60, 120, -60, -60, 0]]",
    "elbow through stretched out": "[[0, -90, -60, -90, -90, 0], [40, -60, 60, -90, -60, 0]]",
}

MOTION_TABLE = """
[motion]
waypoints_deg = {motion}
speed_deg_s = 60
acceleration_deg_s2 = 400
"""
POSITION_COUNT = 4000
MASS_GRID = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, math.inf)  # kg; a speed is computed with the next step of these


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.parse_args()
    print(head("numpy"))
    rows = []
    for name, motion in MOTIONS.items():
        scene = parse_scene(forearm_scene() + MOTION_TABLE.format(motion=motion))
        patches, sample = patches_of(scene), motion_positions(scene)
        assert scene.motion is not None
        box = list(zip(*scene.motion.waypoints, strict=True))
        chance = random.Random(1)
        others = [tuple(chance.uniform(min(joint), max(joint)) for joint in box) for _ in range(POSITION_COUNT)]
        found, dense = weigh(arm_model("UR5e"), patches, sample), weigh(arm_model("UR5e"), patches, others)
        heavier = np.maximum(dense.max(axis=0) / found.max(axis=0) - 1.0, 0.0)
        lighter = np.maximum(1.0 - dense.min(axis=0) / found.min(axis=0), 0.0)
        median, high = np.percentile(heavier, [50.0, 95.0])
        taken = np.array([min(m for m in MASS_GRID if m >= mass) for mass in found.max(axis=0)])
        above = int(np.sum(dense.max(axis=0) > taken))
        shares = (f"{share:.1%}" for share in (median, high, heavier.max(), lighter.max()))
        rows.append([name, *shares, f"{above} of {len(taken)}"])
    columns = ["motion", "heavier than sampled: median", "95 %", "worst", "lighter: worst", "above its step"]
    show("sampled positions against others; patches of the forearm", columns, rows)
