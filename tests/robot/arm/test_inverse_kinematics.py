"""Closed-form inverse kinematics against forward kinematics, all branches, singular poses included."""

from __future__ import annotations

import math
import random

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from coneskin.core.errors import KinematicsError
from coneskin.geometry.pose import Pose
from coneskin.robot.arm.inverse_kinematics import nearest, solutions
from coneskin.robot.arm.kinematics import forward
from coneskin.robot.arm.models import MODEL_NAMES, arm_model

ANGLE = st.floats(-math.pi, math.pi)
LAW = settings(max_examples=300)


def distance(first: Pose, second: Pose) -> float:
    """Largest difference of any number of the two poses [m or 1]."""
    turns = (
        abs(a - b) for r, s in zip(first.rotation, second.rotation, strict=True) for a, b in zip(r, s, strict=True)
    )
    return max(*turns, *(abs(a - b) for a, b in zip(first.translation, second.translation, strict=True)))


@LAW
@given(st.sampled_from(MODEL_NAMES), st.tuples(*[ANGLE] * 6))
@example("UR3", (0.0, 0.0, 0.0, -2.0, 3.040709081509654e-09, 0.0))  # stretched, and all but singular at the wrist
def test_every_solution_reaches_the_pose_and_one_is_where_we_came_from(name: str, q: tuple[float, ...]) -> None:
    arm = arm_model(name)
    pose = forward(arm, q)
    found = solutions(arm, pose, q6_if_free=q[5])
    for solution in found:
        # where two branches meet, acos of 1 - 1e-16 leaves 1e-8 rad, times a reach of about 2 m
        assert distance(forward(arm, solution), pose) < 1e-7
    # the seed is among them: as a pose exactly, as angles up to the square root of rounding at a branch point
    assert distance(forward(arm, nearest(arm, pose, q)), pose) < 1e-7


def test_away_from_singular_poses_there_are_eight_or_four_exact_ones() -> None:
    draw = random.Random(5)
    counts = []
    for _ in range(300):
        arm = arm_model(draw.choice(MODEL_NAMES))
        q = [draw.uniform(-3.1, 3.1) for _ in range(6)]
        if min(abs(math.sin(q[2])), abs(math.sin(q[4]))) < 0.1:
            continue
        pose = forward(arm, q)
        found = solutions(arm, pose)
        counts.append(len(found))
        assert len(set(found)) == len(found)
        gap = min(max(abs(math.remainder(a - b, math.tau)) for a, b in zip(s, q, strict=True)) for s in found)
        if math.hypot(*pose.translation[:2]) > 2 * arm.d[3]:  # else near the shoulder's singular cylinder
            assert gap < 1e-10
    assert set(counts) <= {2, 4, 6, 8}
    assert counts.count(8) > len(counts) / 4


@pytest.mark.parametrize(
    "q",
    [
        (0.3, -1.2, 1.4, -0.5, 0.0, 0.7),  # wrist: joints 4 and 6 parallel
        (0.3, -1.2, 1.4, -0.5, math.pi, 0.7),
        (0.3, -1.2, 0.0, -0.5, 0.9, 0.7),  # elbow: arm stretched
        (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),  # both
        (0.0, -math.pi / 2, 0.0, -math.pi / 2, 0.0, 0.0),  # upright, o5 above the base
    ],
)
def test_singular_poses_are_reached(q: tuple[float, ...]) -> None:
    for name in MODEL_NAMES:
        arm = arm_model(name)
        pose = forward(arm, q)
        assert distance(forward(arm, nearest(arm, pose, q)), pose) < 1e-7  # see above


def test_nearest_keeps_full_turns() -> None:
    arm = arm_model("ur10e")
    seed = (4.0, -1.2, 1.4, -4.5, 0.9, -5.7)
    # 1e-10: condition of the pose about 1e3, rounding 1e-13
    assert nearest(arm, forward(arm, seed), seed) == pytest.approx(seed, abs=1e-10)


def test_nearest_stays_within_joint_limits() -> None:
    arm = arm_model("ur10e")
    seed = (6.2, -1.2, 1.4, -0.5, 0.9, 0.7)
    beyond = (6.4, *seed[1:])
    got = nearest(arm, forward(arm, beyond), seed)
    assert all(low <= a <= high for low, a, high in zip(arm.joint_lower, got, arm.joint_upper, strict=True))
    assert distance(forward(arm, got), forward(arm, beyond)) < 1e-9


def test_a_pose_out_of_reach_is_refused_with_its_place() -> None:
    arm = arm_model("ur10e")
    far = Pose(translation=(2.0, 0.0, 0.5))
    assert solutions(arm, far) == []
    with pytest.raises(KinematicsError, match=r"UR10e cannot bring its flange to \(2.0000, 0.0000, 0.5000\) m"):
        nearest(arm, far, (0.0,) * 6)
    assert solutions(arm, Pose(translation=(0.0, 0.0, 0.7))) == []  # inside the shoulder's cylinder


def test_a_calibrated_arm_has_no_closed_form() -> None:
    arm = arm_model("ur10e").calibrated(delta_theta=(1e-4, 0, 0, 0, 0, 0))
    with pytest.raises(KinematicsError, match="nominal arm"):
        solutions(arm, forward(arm, (0.1,) * 6))
