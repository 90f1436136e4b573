from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coneskin.core.errors import KinematicsError
from coneskin.robot.arm.kinematics import flange_jacobian, forward, link_pose, link_poses, point_jacobian
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.arm.ur_models import arm_model
from tests.support.pinocchio_arm import pin_jacobian, pin_place, pin_rotation

from ..arms import FAR_UR10, NOMINAL, arms, joints, points

pytest.importorskip("pinocchio", reason="the independent kinematics are pinocchio's (PyPI: pin)")

ARMS = pytest.mark.parametrize("arm", NOMINAL, ids=lambda arm: arm.name)
LINKS = st.integers(0, 6)


@ARMS
def test_places_and_jacobians_agree_with_pinocchio(arm: ArmModel) -> None:
    source = np.random.default_rng(1)
    for _ in range(40):
        q = list(source.uniform(-2 * np.pi, 2 * np.pi, 6))
        for link in range(7):
            x, y, z = (float(v) for v in source.uniform(-0.7, 0.7, 3))
            # 1e-12 m is what was asked for; six rotations of lengths of 1 m leave about 1e-15
            found = link_pose(arm, q, link).apply((x, y, z))
            np.testing.assert_allclose(found, pin_place(arm, q, link, (x, y, z)), rtol=0, atol=1e-14)
            np.testing.assert_allclose(
                point_jacobian(arm, q, link, (x, y, z)), pin_jacobian(arm, q, link, (x, y, z))[:3], rtol=0, atol=1e-14
            )
            np.testing.assert_allclose(link_pose(arm, q, link).rotation, pin_rotation(arm, q, link), rtol=0, atol=1e-14)
        np.testing.assert_allclose(flange_jacobian(arm, q), pin_jacobian(arm, q, 6, (0, 0, 0)), rtol=0, atol=1e-14)


def test_a_far_calibration_agrees_with_pinocchio_too() -> None:
    source = np.random.default_rng(2)
    for _ in range(100):
        q = list(source.uniform(-2 * np.pi, 2 * np.pi, 6))
        # 440 m forth and back: their rounding, 1e-13 m, stays
        np.testing.assert_allclose(
            forward(FAR_UR10, q).translation, pin_place(FAR_UR10, q, 6, (0, 0, 0)), rtol=0, atol=1e-12
        )


@given(arms(), joints(), LINKS, points())
def test_the_jacobian_is_the_derivative_of_the_place(
    arm: ArmModel, q: tuple[float, ...], link: int, p: tuple[float, float, float]
) -> None:
    h = 1e-5  # truncation h^2 |p| / 6 = 3e-11 per metre, rounding 1e-15 / h = 1e-10
    rows = np.array(point_jacobian(arm, q, link, p))
    for i in range(6):
        up, down = ([*q[:i], q[i] + step, *q[i + 1 :]] for step in (h, -h))
        slope = (np.array(link_pose(arm, up, link).apply(p)) - link_pose(arm, down, link).apply(p)) / (2 * h)
        np.testing.assert_allclose(rows[:, i], slope, rtol=0, atol=2e-9)


@given(arms(), joints(), LINKS, points(), points())
def test_links_are_rigid(
    arm: ArmModel, q: tuple[float, ...], link: int, a: tuple[float, float, float], b: tuple[float, float, float]
) -> None:
    pose = link_pose(arm, q, link)
    assert math.dist(pose.apply(a), pose.apply(b)) == pytest.approx(math.dist(a, b), abs=1e-14)


@ARMS
def test_at_zero_the_arm_lies_along_minus_x(arm: ArmModel) -> None:
    """The zero position of UR's drawings; also checked so in calibration_test.cpp of its ROS 2 driver."""
    x, y, z = forward(arm, (0.0,) * 6).translation
    assert x == pytest.approx(arm.a[1] + arm.a[2], abs=1e-15)
    assert y == pytest.approx(-(arm.d[3] + arm.d[5]), abs=1e-15)
    assert z == pytest.approx(arm.d[0] - arm.d[4], abs=1e-15)


@ARMS
def test_at_home_the_arm_stands_upright(arm: ArmModel) -> None:
    """UR's home position, joints 2 and 4 at -90 deg: a candle."""
    pose = forward(arm, (0.0, -math.pi / 2, 0.0, -math.pi / 2, 0.0, 0.0))
    height = arm.d[0] - arm.a[1] - arm.a[2] + arm.d[4]
    assert pose.translation == pytest.approx((0.0, -(arm.d[3] + arm.d[5]), height), abs=1e-15)


# What a simulated UR10 answered, printed in calibration_test.cpp of Universal_Robots_ROS2_Driver; its table had
# alpha = 1.570796327 for pi / 2.
@pytest.mark.parametrize(
    ("q", "place"),
    [
        (
            (
                -1.6007002035724084976209269370884,
                -1.7271001974688928726209269370884,
                -2.2029998938189905288709269370884,
                -0.80799991289247685699592693708837,
                1.59510004520416259765625,
                -0.03099996248354131012092693708837,
            ),
            (-0.179925914147547, -0.606869755162764, 0.230789102067257),
        ),
        (
            (
                1.32645022869110107421875,
                2.426007747650146484375,
                5.951572895050048828125,
                1.27409040927886962890625,
                -0.54105216661562138824592693708837,
                0.122173048555850982666015625,
            ),
            (
                0.39922988003280424074148413637886,
                0.59688365069340565405298093537567,
                -0.6677819040276375961440180617501,
            ),
        ),
    ],
)
def test_the_flange_is_where_universal_robots_says(q: tuple[float, ...], place: tuple[float, ...]) -> None:
    off = 1.570796327 - math.pi / 2
    simulated = arm_model("UR10").calibrated(delta_alpha=(off, 0.0, 0.0, off, -off, 0.0))
    assert forward(simulated, q).translation == pytest.approx(place, abs=2e-15)
    assert forward(arm_model("UR10"), q).translation == pytest.approx(place, abs=1e-9)


def test_all_poses_at_once_are_the_poses_one_by_one() -> None:
    q = (0.1, -1.0, 0.5, 0.3, 0.2, 0.9)
    assert link_poses(arm_model("UR5e"), q) == tuple(link_pose(arm_model("UR5e"), q, link) for link in range(7))


def test_columns_beyond_the_link_are_zero() -> None:
    rows = point_jacobian(arm_model("UR5e"), (0.1, -1.0, 0.5, 0.3, 0.2, 0.9), 3, (0.1, 0.2, 0.3))
    assert all(row[3:] == (0.0, 0.0, 0.0) for row in rows)
    assert all(any(row[i] for row in rows) for i in range(3))


@pytest.mark.parametrize("link", [-1, 7])
def test_a_link_that_is_not_there_is_refused(link: int) -> None:
    with pytest.raises(KinematicsError, match=r"link must be 0 \(base\) to 6 \(flange\), got"):
        link_pose(arm_model("UR5e"), (0.0,) * 6, link)


@pytest.mark.parametrize("q", [(0.0,) * 5, (0.0, math.nan, 0.0, 0.0, 0.0, 0.0), (math.inf,) * 6])
def test_joint_positions_that_cannot_be_are_refused(q: tuple[float, ...]) -> None:
    with pytest.raises(KinematicsError, match=r"q must be 6 finite joint positions"):
        forward(arm_model("UR5e"), q)
