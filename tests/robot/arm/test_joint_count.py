"""Arms of one to eight joints: kinematics against pinocchio, least squares against numpy."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coneskin.core.errors import KinematicsError
from coneskin.robot.arm.damped_least_squares import _damping_squared, damped_speeds
from coneskin.robot.arm.kinematics import flange_jacobian, forward, link_poses, place_point
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.arm.workspace import ArmSweep, skeleton
from coneskin.robot.driver.messages import SetJointVelocity, decode_command
from coneskin.robot.reaction.retreat import plan_retreat, retreat_step
from coneskin.robot.reaction.types import ArmState, ContactOnLink, JointVelocity, Reaction
from tests.support.pinocchio_arm import pin_jacobian, pin_place

lengths, angles = st.floats(-0.6, 0.6), st.floats(-3.0, 3.0)


@st.composite
def posed_arms(draw):
    """An arm of one to eight joints, and joint positions."""
    n = draw(st.integers(1, 8))
    rows = [tuple(draw(st.lists(kind, min_size=n, max_size=n))) for kind in (lengths, lengths, angles, angles, angles)]
    a, d, alpha, theta, q = rows
    return ArmModel("X", a, d, alpha, (-4.0,) * n, (4.0,) * n, (3.0,) * n, theta), q


@given(posed_arms(), st.tuples(lengths, lengths, lengths), st.data())
def test_points_and_jacobians_are_those_of_pinocchio(posed, point, data):
    pytest.importorskip("pinocchio", reason="the independent kinematics are pinocchio's (PyPI: pin)")
    arm, q = posed
    link = data.draw(st.integers(1, arm.joints))
    placed = place_point(arm, q, link, point)
    assert placed.point == pytest.approx(tuple(pin_place(arm, list(q), link, point)), abs=1e-12)
    columns = np.zeros((3, arm.joints))
    columns[:, :link] = np.array(placed.columns).T
    assert columns == pytest.approx(pin_jacobian(arm, list(q), link, point).reshape(6, -1)[:3], abs=1e-12)
    assert len(link_poses(arm, q)) == arm.joints + 1
    whole = np.array(flange_jacobian(arm, q))
    assert whole == pytest.approx(pin_jacobian(arm, list(q), arm.joints, (0.0, 0.0, 0.0)).reshape(6, -1), abs=1e-12)


@given(posed_arms(), st.tuples(lengths, lengths, lengths))
def test_damped_speeds_are_those_of_numpy(posed, wanted):
    arm, q = posed
    columns = place_point(arm, q, arm.joints, (0.1, 0.2, 0.3)).columns
    speeds, damping = damped_speeds([(columns, wanted)])
    assert damping == _damping_squared([c for c in columns if any(c)] or [(0.0, 0.0, 0.0)])
    j = np.array(columns).T
    expected = np.linalg.solve(j.T @ j + damping * np.eye(arm.joints), j.T @ np.array(wanted))
    # the damping of 1 mm against lengths of metres: a condition of 1e7 leaves half of the digits
    assert speeds == pytest.approx(expected, abs=1e-7)
    assert np.linalg.norm(j @ speeds) <= np.linalg.norm(wanted) + 1e-9  # never faster than wanted


@given(posed_arms())
def test_the_line_of_the_arm_ends_at_its_flange_and_is_as_long_as_its_table(posed):
    arm, q = posed
    corners = skeleton(arm, q)
    assert corners[-1] == pytest.approx(forward(arm, q).translation, abs=1e-12)
    sizes = [math.dist(a, b) for a, b in pairwise(corners)]
    table = [abs(size) for row in zip(arm.d, arm.a, strict=True) for size in row]
    assert sizes == pytest.approx(table, abs=1e-12)
    assert ArmSweep.begin(arm, q).distance(q) == 0.0


@given(st.lists(angles, min_size=1, max_size=8), st.floats(0.1, 9.0))
def test_joint_speeds_of_any_arm_pass_between_the_processes(qd, acceleration):
    command = SetJointVelocity(tuple(qd), acceleration)
    assert decode_command(command.encode()) == command


@pytest.mark.parametrize("body", [b"", b"V", b"V1234567", b"V123456789"])
def test_damaged_joint_speeds_are_refused(body):
    with pytest.raises(ValueError, match="of the guard"):
        decode_command(body)


#: KUKA LBR iiwa 7 R800; DH table of its controller's manual, as in iiwa_stack
SEVEN = ArmModel(
    "seven",
    a=(0.0,) * 7,
    d=(0.34, 0.0, 0.4, 0.0, 0.4, 0.0, 0.126),
    alpha=tuple(math.pi / 2.0 * turn for turn in (-1, 1, 1, -1, -1, 1, 0)),
    joint_lower=(-2.9,) * 7,
    joint_upper=(2.9,) * 7,
    joint_speed=(1.7,) * 7,
)
Q7 = (0.3, 0.5, -0.2, -1.2, 0.4, 0.7, 0.1)


@pytest.mark.parametrize(
    ("changed", "why"),
    [
        ({"d": (0.0,) * 6}, "d of X must be 7 finite numbers"),
        ({"theta": (0.0,) * 6}, "theta of X must be 7"),
        ({"joint_speed": ()}, "speed of X must be 7"),
        ({"joint_upper": (2.0,) * 8}, "joint_lower and joint_upper of X must be 7 numbers each"),
        (dict.fromkeys(("a", "d", "alpha", "joint_lower", "joint_upper", "joint_speed"), ()), "a of X must be 1"),
    ],
)
def test_a_table_with_a_row_missing_is_refused(changed, why):
    fields = ("a", "d", "alpha", "joint_lower", "joint_upper", "joint_speed")
    with pytest.raises(KinematicsError, match=why):
        ArmModel(**{"name": "X", **{key: getattr(SEVEN, key) for key in fields}, **changed})


def test_positions_of_another_arm_are_refused():
    with pytest.raises(KinematicsError, match="q must be 7 finite joint positions"):
        forward(SEVEN, Q7[:6])
    with pytest.raises(KinematicsError, match=r"link must be 0 \(base\) to 7 \(flange\), got 8"):
        place_point(SEVEN, Q7, 8, (0.0, 0.0, 0.0))


def test_a_retreat_moves_the_point_of_a_seventh_link_away():
    contact = ContactOnLink(7, (0.0, 0.05, 0.0), (0.0, 1.0, 0.0))
    state = ArmState(0.0, Q7)
    plan = plan_retreat(SEVEN, state, [contact], Reaction(kind="retreat", speed=0.1))
    step = retreat_step(plan, state)
    assert isinstance(step, JointVelocity)
    assert len(step.qd) == 7
    placed = place_point(SEVEN, Q7, 7, contact.point, contact.normal)
    along = sum(v * -n for v, n in zip(placed.velocity(step.qd), placed.direction, strict=True))
    assert along == pytest.approx(step.away, abs=1e-9)
    assert along > 0.05
