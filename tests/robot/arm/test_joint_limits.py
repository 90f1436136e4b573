from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coneskin.geometry.pose import Pose
from coneskin.robot.arm.kinematics import link_poses
from coneskin.robot.arm.model import ZERO_VELOCITY, ArmModel
from coneskin.robot.arm.ur_models import arm_model
from coneskin.robot.arm.workspace import _LIMIT_MARGIN, REACTION_TIME, JointLimits, reach

from ..arms import FAR_UR10, arms, joints


@given(st.floats(0.0, 3.2), st.floats(-0.5, 2.0), st.floats(0.5, 40.0), st.sampled_from([-1.0, 1.0]))
def test_a_joint_is_blocked_exactly_where_it_could_no_longer_brake(
    speed: float, room: float, braking: float, side: float
) -> None:
    limits = JointLimits.of(arm_model("UR5e"), braking)
    edge = limits.upper[1] if side > 0 else limits.lower[1]
    q = (0.0, edge - side * room, 0.0, 0.0, 0.0, 0.0)
    needed = speed * REACTION_TIME + speed**2 / (2.0 * braking)
    if abs(needed - room) < 1e-9 or speed == 0.0:
        return
    assert (limits.blocked(q, ZERO_VELOCITY, [0.0, side * speed]) == [1]) == (needed > room)
    assert limits.blocked(q, ZERO_VELOCITY, [0.0, -side * 1e-6]) == []  # away from it is free


def test_the_speed_that_a_joint_has_counts_if_it_is_more_than_the_one_wanted() -> None:
    limits = JointLimits.of(arm_model("UR5e"), 4.0)
    q = (limits.upper[0] - 0.1, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert limits.blocked(q, ZERO_VELOCITY, [0.1]) == []
    assert limits.blocked(q, (2.0, 0.0, 0.0, 0.0, 0.0, 0.0), [0.1]) == [0]
    assert limits.blocked(q, (2.0, 0.0, 0.0, 0.0, 0.0, 0.0), [-0.1]) == []


def test_a_joint_that_turns_without_end_is_never_blocked() -> None:
    limits = JointLimits.of(arm_model("UR3e"), 4.0)
    assert limits.blocked((0.0,) * 5 + (500.0,), ZERO_VELOCITY, [0.0] * 5 + [3.0]) == []


def test_the_margin_is_kept_on_both_sides() -> None:
    limits = JointLimits.of(arm_model("UR5e"), 4.0)
    assert limits.upper[2] == pytest.approx(math.pi - _LIMIT_MARGIN)
    assert limits.lower[2] == pytest.approx(-math.pi + _LIMIT_MARGIN)


@given(arms(), joints())
def test_no_joint_origin_nor_the_flange_is_beyond_the_reach(arm: ArmModel, q: tuple[float, ...]) -> None:
    # where the nominal arm is: a calibrated table has frames that are not on the arm
    poses = link_poses(arm_model(arm.name), q)
    for i, most in enumerate(reach(arm)):
        back: Pose = poses[i].inverse()
        for pose in poses[i + 1 :]:
            x, y, _ = back.apply(pose.translation)
            assert math.hypot(x, y) <= most - 0.1 + 1e-12


def test_the_reach_is_that_of_the_stretched_arm_and_does_not_fall_for_a_far_calibration() -> None:
    arm = arm_model("UR10")
    assert reach(arm)[0] == pytest.approx(0.612 + math.hypot(0.5723, 0.0) + 0.163941 + 0.1157 + 0.0922 + 0.1)
    assert reach(arm)[5] == pytest.approx(0.1)
    assert reach(FAR_UR10) == reach(arm)
