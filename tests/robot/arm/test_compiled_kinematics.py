from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.core.errors import KinematicsError
from coneskin.robot.arm.compiled_kinematics import compile_contact
from coneskin.robot.arm.damped_least_squares import damped_speeds, damping_squared
from coneskin.robot.arm.kinematics import link_pose, point_jacobian
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.arm.models import arm_model

from ..arms import arms, joints, points, units

LINKS = st.integers(1, 6)


@settings(max_examples=300)
@given(arms(), joints(), LINKS, points(), units())
def test_place_is_what_the_readable_kinematics_say(
    arm: ArmModel, q: tuple[float, ...], link: int, p: tuple[float, float, float], n: tuple[float, float, float]
) -> None:
    pose = link_pose(arm, q, link)
    rows = point_jacobian(arm, q, link, p)
    columns = [rows[k][i] for i in range(link) for k in range(3)]
    found = compile_contact(arm, link).place(*q, *p, *n)
    # the same sums in another order: a few units in the last place of some metres
    assert found == pytest.approx([*pose.apply(p), *pose.rotate(n), *columns], rel=0, abs=4e-15)


@settings(max_examples=300)
@given(arms(), joints(), LINKS, points(), units())
def test_drive_is_the_readable_damped_least_squares(
    arm: ArmModel, q: tuple[float, ...], link: int, p: tuple[float, float, float], v: tuple[float, float, float]
) -> None:
    rows = point_jacobian(arm, q, link, p)
    columns = [(rows[0][i], rows[1][i], rows[2][i]) for i in range(link)]
    x, y, z, along, damping, *speeds = compile_contact(arm, link).drive(*q, *p, *v)
    assert (x, y, z) == pytest.approx(link_pose(arm, q, link).apply(p), rel=0, abs=4e-15)
    # cofactors here, Cholesky there: the condition number, at most 1 m^2 / 1 mm^2, times the unit in the last place;
    # the damping itself loses as much of its argument near a singular place
    assert damping == pytest.approx(damping_squared(columns), rel=1e-8)
    assert speeds == pytest.approx(damped_speeds(columns, v), rel=1e-8, abs=1e-8)
    moved = [sum(w * c[k] for w, c in zip(speeds, columns, strict=True)) for k in range(3)]
    assert along == pytest.approx(sum(a * b for a, b in zip(moved, v, strict=True)), abs=1e-9)


def test_zeros_and_ones_of_the_table_are_not_computed() -> None:
    nominal = compile_contact(arm_model("UR10e"), 3).source
    tilted = compile_contact(arm_model("UR10e").calibrated(delta_alpha=(1e-3,) * 6), 3).source
    assert nominal.count("*") < 0.8 * tilted.count("*")
    assert "0.0 *" not in nominal


def test_a_link_is_compiled_once() -> None:
    assert compile_contact(arm_model("UR10e"), 3) is compile_contact(arm_model("ur-10E"), 3)


@pytest.mark.parametrize("link", [0, 7, -1])
def test_a_link_that_no_joint_moves_is_refused(link: int) -> None:
    with pytest.raises(KinematicsError, match=r"link must be 1 \(shoulder\) to 6 \(flange\) to be moved"):
        compile_contact(arm_model("UR10e"), link)
