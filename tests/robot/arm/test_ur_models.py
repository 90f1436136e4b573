from __future__ import annotations

import math

import pytest

from coneskin.core.errors import KinematicsError
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.arm.models import MODEL_NAMES, arm_model


def test_the_whole_family_is_there() -> None:
    assert set(MODEL_NAMES) >= {
        "UR3",
        "UR5",
        "UR10",
        "UR3e",
        "UR5e",
        "UR7e",
        "UR8 Long",
        "UR10e",
        "UR12e",
        "UR15",
        "UR16e",
        "UR18",
        "UR20",
        "UR30",
    }


@pytest.mark.parametrize("name", ["UR10e", "ur10e", "ur-10e", "UR 10e", "ur_10_E", " UR10e "])
def test_a_name_may_be_written_as_people_write_it(name: str) -> None:
    assert arm_model(name).name == "UR10e"


@pytest.mark.parametrize("name", ["", "UR11", "ur10ee", "Panda"])
def test_an_unknown_arm_is_refused_with_the_names_there_are(name: str) -> None:
    with pytest.raises(KinematicsError, match=r"arm must be one of UR3, UR5.*UR30, got"):
        arm_model(name)


# reach as the data sheets give it [m]
REACH = {"UR3": 0.5, "UR5": 0.85, "UR10": 1.3, "UR3e": 0.5, "UR5e": 0.85, "UR7e": 0.85, "UR10e": 1.3, "UR16e": 0.9}
REACH |= {"UR8 Long": 1.75, "UR12e": 1.3, "UR15": 1.3, "UR18": 0.95, "UR20": 1.75, "UR30": 1.3}


@pytest.mark.parametrize("name", MODEL_NAMES)
def test_the_lengths_give_the_reach_of_the_data_sheet(name: str) -> None:
    arm = arm_model(name)
    reach = abs(arm.a[1]) + abs(arm.a[2]) + arm.d[4]
    if REACH[name] >= 1.3 or name == "UR18":
        assert reach == pytest.approx(REACH[name], abs=0.005)  # the sheet rounds to a centimetre
    else:
        assert 0.0 < reach - REACH[name] < 0.08  # the sheet leaves out most of the wrist


@pytest.mark.parametrize("name", MODEL_NAMES)
def test_limits_are_symmetric_and_only_small_arms_turn_wrist_3_without_end(name: str) -> None:
    arm = arm_model(name)
    assert arm.joint_lower == tuple(-limit for limit in arm.joint_upper)
    assert arm.joint_upper[2] == pytest.approx(math.pi)
    assert math.isinf(arm.joint_upper[5]) == (name in ("UR3", "UR3e"))


#: user manuals, and joint_limits.yaml of ros-industrial/universal_robot [deg/s]
SPEEDS = {
    (180, 180, 180, 360, 360, 360): "UR3, UR3e",
    (180, 180, 180, 180, 180, 180): "UR5, UR5e, UR7e",
    (120, 120, 180, 180, 180, 180): "UR10, UR10e, UR12e, UR16e",
    (180, 180, 240, 300, 300, 300): "UR8 Long, UR15, UR18",
    (120, 120, 150, 210, 210, 210): "UR20, UR30",
}


@pytest.mark.parametrize("speeds", SPEEDS, ids=SPEEDS.values())
def test_speeds_and_limits_are_those_of_the_manual(speeds: tuple[int, ...]) -> None:
    for name in SPEEDS[speeds].split(", "):
        arm = arm_model(name)
        assert [round(math.degrees(v), 6) for v in arm.joint_speed] == list(speeds), name
        assert [round(math.degrees(v), 6) for v in arm.joint_upper[:5]] == [360, 360, 180, 360, 360], name
        assert math.degrees(arm.joint_upper[5]) == (math.inf if name in ("UR3", "UR3e") else 360.0), name


#: default_kinematics.yaml of ros-industrial/universal_robot: d1, a2, a3, d4, d5, d6 [m]; the others: test_kinematics
LENGTHS = {
    "UR8 Long": (0.2186, -0.8989, -0.7149, 0.1824, 0.1361, 0.1434),
    "UR15": (0.2186, -0.6475, -0.5164, 0.1824, 0.1361, 0.1434),
    "UR18": (0.2186, -0.475, -0.3389, 0.1824, 0.1361, 0.1434),
    "UR7e": (0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996),
    "UR12e": (0.1807, -0.6127, -0.57155, 0.17415, 0.11985, 0.11655),
}


@pytest.mark.parametrize("name", LENGTHS)
def test_lengths_are_those_of_the_maker(name: str) -> None:
    arm, (d1, a2, a3, d4, d5, d6) = arm_model(name), LENGTHS[name]
    assert (arm.a, arm.d) == ((0.0, a2, a3, 0.0, 0.0, 0.0), (d1, 0.0, 0.0, d4, d5, d6))


def test_calibration_adds_to_each_column_and_leaves_the_rest() -> None:
    arm = arm_model("UR5e")
    found = arm.calibrated((1, 0, 0, 0, 0, 0), (0, 2, 0, 0, 0, 0), (0, 0, 3, 0, 0, 0), (0, 0, 0, 4, 0, 0))
    assert (found.a[0], found.d[1], found.alpha[2], found.theta[3]) == (1.0, 2.0, 3.0, 4.0)
    assert found.a[1:] == arm.a[1:]
    assert arm.calibrated() == arm
    assert hash(found) != hash(arm)


@pytest.mark.parametrize("delta", [(0.0,) * 5, (0.0, math.nan, 0.0, 0.0, 0.0, 0.0)])
def test_a_calibration_that_cannot_be_is_refused(delta: tuple[float, ...]) -> None:
    with pytest.raises(KinematicsError, match=r"delta_d must be 6 finite numbers"):
        arm_model("UR5e").calibrated(delta_d=delta)


def test_limits_that_cannot_be_are_refused() -> None:
    six = (1.0,) * 6
    with pytest.raises(KinematicsError, match=r"joint_lower of X must be below joint_upper"):
        ArmModel("X", six, six, six, six, six, six)
    with pytest.raises(KinematicsError, match=r"joint_speed of X must be above 0 rad/s"):
        ArmModel("X", six, six, six, (0.0,) * 6, six, (0.0,) * 6)
