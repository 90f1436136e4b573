from __future__ import annotations

import math
import random
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from coneskin.robot.arm.kinematics import link_pose
from coneskin.robot.arm.model import ArmModel, Joints
from coneskin.robot.arm.models import MODEL_NAMES, arm_model
from coneskin.robot.arm.workspace import _LIMIT_MARGIN, ArmSweep
from coneskin.robot.reaction.retreat import DISTANCE_TOLERANCE, RetreatPlan, plan_retreat, retreat_step
from coneskin.robot.reaction.types import ArmState, ContactOnLink, Done, JointVelocity, Reaction
from tests.support.pinocchio_arm import pin_jacobian
from tests.support.retreat_simulation import follow, joints_within, touch

from ..arms import FAR_UR10, NEAR_UR10, arms, points, units
from ..retreat_cases import FOREARM, UR10E, Q, elbow_limited, planned, six

pytest.importorskip("pinocchio", reason="the independent kinematics are pinocchio's (PyPI: pin)")


@st.composite
def states(draw: st.DrawFn) -> tuple[ArmModel, Joints, Joints, list[ContactOnLink], Reaction]:
    """Any arm anywhere, joints at their limits and singular places often among them, moving, touched once to thrice."""
    arm = draw(arms())
    angles = []
    for lower, upper in zip(arm.joint_lower, arm.joint_upper, strict=True):
        low, up = max(lower, -7.0), min(upper, 7.0)
        edges = [low, low + _LIMIT_MARGIN, low + 0.05, 0.0, math.pi / 2]
        edges += [-math.pi / 2, up - 0.05, up - _LIMIT_MARGIN, up]
        angles.append(draw(st.one_of(st.floats(low, up), st.sampled_from(edges))))
    speeds = [draw(st.floats(-most, most)) for most in arm.joint_speed]
    contacts = [
        ContactOnLink(draw(st.integers(1, 6)), draw(points(0.5)), draw(units()))
        for _ in range(draw(st.sampled_from([1, 1, 1, 2, 3])))
    ]
    reaction = Reaction(
        kind="retreat",
        speed=draw(st.floats(0.01, 1.5)),
        acceleration=draw(st.floats(0.5, 40.0)),
        arm_speed=draw(st.floats(0.05, 5.0)),
        distance=draw(st.floats(0.005, 0.5)),
    )
    return arm, six(angles), six(speeds), contacts, reaction


@pytest.mark.long
@pytest.mark.promise("P33")
@settings(max_examples=100)
@given(states(), st.floats(0.0, 1.9))
def test_a_step_keeps_all_limits_and_never_moves_towards_an_obstacle(
    state: tuple[ArmModel, Joints, Joints, list[ContactOnLink], Reaction], time: float
) -> None:
    arm, q, qd, contacts, reaction = state
    plan = planned(arm, q, contacts, reaction, qd)
    assume(isinstance(plan, RetreatPlan))
    assert isinstance(plan, RetreatPlan)
    step = retreat_step(plan, ArmState(time, q, qd))
    assert step == retreat_step(plan, ArmState(time, q, qd))  # nothing but its arguments counts
    if isinstance(step, Done):  # begun from a standstill, but joints that run at their limits are taken out
        assert "at its limit" in step.reason
        assert any(qd)
        return
    assert step.qd[max(c.link for c in contacts) :] == (0.0,) * (6 - max(c.link for c in contacts))
    assert all(abs(v) <= most * (1 + 1e-12) for v, most in zip(step.qd, arm.joint_speed, strict=True))
    assert step.acceleration == reaction.acceleration
    for i, v in enumerate(step.qd):  # braking after the reaction time ends within the margin
        room = arm.joint_upper[i] - q[i] if v > 0 else q[i] - arm.joint_lower[i]
        assert v == 0.0 or abs(v) * 0.01 + v * v / (2 * reaction.acceleration) <= room - _LIMIT_MARGIN + 1e-12
    away = []
    for contact in contacts:
        rows = pin_jacobian(arm, list(q), contact.link, contact.point)[:3]
        normal = link_pose(arm, q, contact.link).rotate(contact.normal)
        towards = float(np.array(normal) @ rows @ np.array(step.qd))
        away.append(-towards)
        assert towards <= 1e-7 * reaction.speed  # rounding of several touches that nearly block each other
        if len(contacts) == 1:  # by least squares the point is never faster than wanted
            assert np.linalg.norm(rows @ np.array(step.qd)) <= reaction.speed * (1 + 1e-9)
    assert step.away == pytest.approx(sum(away) / len(away), abs=1e-7)
    flange = pin_jacobian(arm, list(q), 6, (0.0, 0.0, 0.0))[:3] @ np.array(step.qd)
    assert np.linalg.norm(flange) <= reaction.arm_speed


def test_the_touched_point_leaves_the_obstacle() -> None:
    """In words: a ball rests on the skin, outside. After the retreat there is air between them."""
    ball = link_pose(UR10E, Q, 3).apply((0.3, 0.0, 0.06 + 0.02))  # radius 2 cm, centre along the normal
    plan = planned(UR10E, Q, [FOREARM])
    assert isinstance(plan, RetreatPlan)
    q = np.array(Q)
    time = 0.0
    while isinstance(step := retreat_step(plan, ArmState(time, six(q))), JointVelocity):
        q, time = q + 0.002 * np.array(step.qd), time + 0.002
    assert step.complete
    there = link_pose(UR10E, list(q), 3).apply((0.3, 0.0, 0.06))
    assert math.dist(there, ball) == pytest.approx(0.02 + 0.05, abs=1e-3)


def test_the_way_made_while_braking_is_made_good() -> None:
    """The arm moves on into the obstacle by 1 cm before it retreats: the end is counted from the touch."""
    plan = planned(UR10E, Q, [FOREARM])
    assert isinstance(plan, RetreatPlan)
    rows = pin_jacobian(UR10E, list(Q), 3, FOREARM.point)[:3]
    on = np.array(Q) + np.linalg.pinv(rows) @ (-0.01 * np.array(plan.tracks[0].away))
    step = retreat_step(plan, ArmState(0.1, six(on)))
    assert isinstance(step, JointVelocity)
    assert step.progress == pytest.approx(-0.01, abs=3e-4)  # the step is linearised: 1 cm over an arm of 1 m
    assert follow(UR10E, plan, six(on)).made == pytest.approx(0.05, abs=1e-3)


@pytest.mark.long
def test_retreats_from_anywhere_end_where_they_should() -> None:
    """python -m bench retreat prints the same over more runs, with the spread of the drift."""
    source = random.Random(5)
    reaction = Reaction(kind="retreat")
    complete = 0
    drifts = []
    for run in range(40):
        arm = arm_model(MODEL_NAMES[run % len(MODEL_NAMES)])
        link = 2 + run % 5
        q = joints_within(arm, source, part=0.98)
        plan = planned(arm, q, [touch(arm, source, link)])
        if isinstance(plan, Done):
            continue
        result = follow(arm, plan, q)
        assert result.backwards < 1e-9
        assert result.joint_speed <= 1.0 + 1e-9
        assert result.acceleration <= reaction.acceleration * (1 + 1e-9)
        assert result.beyond < 0.0
        assert result.time < reaction.time_budget + 0.3  # and the ramp to standstill
        assert result.made < reaction.distance + 1e-3
        if result.done.complete:
            complete += 1
            drifts.append(result.drift / result.made)
            assert result.made > reaction.distance - 2 * DISTANCE_TOLERANCE
            assert "distance" in result.clipped
    assert complete > 30
    assert sorted(drifts)[len(drifts) // 2] < 0.01
    assert max(drifts) < math.tan(math.radians(60.0))  # what LEAST_PROGRESS lets pass


@pytest.mark.parametrize("arm", [NEAR_UR10, FAR_UR10], ids=["near", "far"])
def test_a_calibrated_arm_retreats_as_well(arm: ArmModel) -> None:
    # wrist 1: the frames of links 2 and 3 of the far table are not on the arm
    plan = planned(arm, Q, [ContactOnLink(4, (0.05, 0.0, 0.0), (1.0, 0.0, 0.0))])
    assert isinstance(plan, RetreatPlan)
    result = follow(arm, plan, Q)
    assert result.done.complete
    assert result.drift < 1e-3


def test_a_joint_before_its_limit_is_locked_and_the_others_do_it() -> None:
    plan = planned(UR10E, Q, [FOREARM])
    assert isinstance(plan, RetreatPlan)
    free = retreat_step(plan, ArmState(0.0, Q))
    assert isinstance(free, JointVelocity)
    assert free.qd[2] > 0.01
    assert free.clipped_by == ("arm speed",)
    near, far = _LIMIT_MARGIN + 1e-4, 1.0
    behind = planned(elbow_limited(Q[2] - near, Q[2] + far), Q, [FOREARM])
    assert isinstance(behind, RetreatPlan)
    assert retreat_step(behind, ArmState(0.0, Q)) == free  # a limit at its back does not matter
    ahead = planned(elbow_limited(Q[2] - far, Q[2] + near), Q, [FOREARM])
    assert isinstance(ahead, RetreatPlan)
    step = retreat_step(ahead, ArmState(0.0, Q))
    assert isinstance(step, JointVelocity)
    assert step.qd[2] == 0.0
    assert "joint 3 limit" in step.clipped_by
    assert step.away > 0.0


def test_a_joint_that_still_runs_at_its_limit_when_touched_does_not_forbid_the_plan() -> None:
    """The arm stops before it retreats; what counts is whether it could retreat from there."""
    edge = elbow_limited(Q[2] - 1.0, Q[2] + _LIMIT_MARGIN + 0.03)  # 30 mrad: enough for 0.05 rad/s, not for 2 rad/s
    plan = planned(edge, Q, [FOREARM], qd=(0.0, 0.0, 2.0, 0.0, 0.0, 0.0))
    assert isinstance(plan, RetreatPlan)
    running = retreat_step(plan, ArmState(0.1, Q, (0.0, 0.0, 2.0, 0.0, 0.0, 0.0)))
    still = retreat_step(plan, ArmState(0.1, Q))
    assert isinstance(running, JointVelocity)
    assert isinstance(still, JointVelocity)
    assert running.qd[2] == 0.0
    assert still.qd[2] > 0.0


def test_with_the_joint_that_it_needs_at_its_limit_it_stands() -> None:
    tip = ContactOnLink(4, (0.0, 0.0, 0.0), link_pose(UR10E, Q, 4).inverse().rotate((0.0, 0.0, 1.0)))
    assert isinstance(planned(UR10E, Q, [tip]), RetreatPlan)
    fixed = replace(
        UR10E,
        joint_lower=six([angle - _LIMIT_MARGIN for angle in Q]),
        joint_upper=six([angle + _LIMIT_MARGIN for angle in Q]),
    )
    plan = planned(fixed, Q, [tip])
    assert isinstance(plan, Done)
    assert "at its limit" in plan.reason


@pytest.mark.long
@pytest.mark.promise("P33")
def test_a_retreat_into_a_joint_limit_stays_within_it() -> None:
    """Runs that begin close before a limit, in whichever direction they go."""
    source = random.Random(6)
    locked = 0
    for run in range(20):
        arm = arm_model(MODEL_NAMES[run % len(MODEL_NAMES)])
        link = 2 + run % 5
        q = list(joints_within(arm, source, part=0.5))
        i = source.randrange(min(link, 5))
        q[i] = source.choice([arm.joint_lower[i] + 0.03, arm.joint_upper[i] - 0.03])
        plan = planned(arm, six(q), [touch(arm, source, link)])
        if isinstance(plan, Done):
            continue
        result = follow(arm, plan, six(q))
        assert result.beyond < -0.5 * _LIMIT_MARGIN  # of the margin of 20 mrad the two late cycles take some
        locked += any("limit" in reason for reason in result.clipped)
    assert locked > 3  # else nothing was tried


@pytest.mark.parametrize(("left", "goes_on"), [(2.1e-3, True), (1.9e-3, False)])
def test_it_ends_two_millimetres_before_the_arm_has_moved_as_far_as_it_may(left: float, goes_on: bool) -> None:
    sweep = ArmSweep.begin(UR10E, Q)
    reaction = Reaction(kind="retreat", distance=0.2, arm_distance=0.05)
    plan = plan_retreat(UR10E, ArmState(0.0, Q), [FOREARM], reaction, sweep=sweep)
    assert isinstance(plan, RetreatPlan)
    first = retreat_step(plan, ArmState(0.0, Q))
    assert isinstance(first, JointVelocity)

    def at(time: float) -> Joints:
        return six([a + time * v for a, v in zip(Q, first.qd, strict=True)])

    time = brentq(lambda time: sweep.distance(at(time)) - (reaction.arm_distance - left), 0.0, 1.0)
    step = retreat_step(plan, ArmState(0.1, at(time)))
    assert isinstance(step, JointVelocity) is goes_on
    assert goes_on or "a point of the arm has moved 50 mm" in step.reason
