"""Retreats that are not begun, or end early, or have several touches to move away from."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from coneskin.core.errors import KinematicsError
from coneskin.robot.arm.kinematics import link_pose
from coneskin.robot.arm.model import Joints
from coneskin.robot.reaction.retreat import DISTANCE_TOLERANCE, RetreatPlan, retreat_step
from coneskin.robot.reaction.types import ArmState, ContactOnLink, Done, JointVelocity, Reaction
from tests.support.pinocchio_arm import pin_jacobian
from tests.support.retreat_simulation import follow

from ..retreat_cases import FOREARM, UR10E, Q, planned

pytest.importorskip("pinocchio", reason="the independent kinematics are pinocchio's (PyPI: pin)")


def test_a_stretched_arm_cannot_retreat_outwards_and_says_so() -> None:
    straight: Joints = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    # at the elbow of an arm stretched along -x, touched on the inside: it would have to move to -x, beyond its reach
    plan = planned(UR10E, straight, [ContactOnLink(3, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))])
    assert isinstance(plan, Done)
    assert "singularity" in plan.reason
    assert not plan.complete


def test_the_shoulder_cannot_move_away_from_a_touch_on_its_side() -> None:
    plan = planned(UR10E, Q, [ContactOnLink(1, (0.06, 0.0, 0.0), (1.0, 0.0, 0.0))])
    assert isinstance(plan, Done)
    assert "0 % of the wanted speed" in plan.reason


@pytest.mark.parametrize(("degrees", "begun"), [(0.0, True), (59.0, True), (61.0, False), (90.0, False)])
def test_a_retreat_is_begun_up_to_60_degrees_off_its_direction(degrees: float, begun: bool) -> None:
    """A point that one joint moves on a circle, touched at an angle to it: the squared cosine must be a quarter."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    plan = planned(UR10E, Q, [ContactOnLink(1, (0.5, 0.0, 0.0), (-s, 0.0, -c))])  # joint 1 turns about its y axis
    assert isinstance(plan, RetreatPlan) == begun


def test_a_step_near_a_singularity_says_so() -> None:
    q: Joints = (*Q[:2], 0.1, *Q[3:])  # the elbow nearly straight
    plan = planned(UR10E, q, [ContactOnLink(3, (0.3, 0.06, 0.0), (0.0, 1.0, 0.0))])
    assert isinstance(plan, RetreatPlan)
    step = retreat_step(plan, ArmState(0.0, q))
    assert isinstance(step, JointVelocity)
    assert "singularity" in step.clipped_by


def test_between_two_opposite_touches_the_arm_stands() -> None:
    other = ContactOnLink(3, (0.3, 0.0, -0.06), (0.0, 0.0, -1.0))
    plan = planned(UR10E, Q, [FOREARM, other])
    assert isinstance(plan, Done)
    assert "no feasible motion away from all 2 touches" in plan.reason


def test_two_touches_on_one_side_are_left_together() -> None:
    other = ContactOnLink(3, (0.1, 0.03, 0.052), (0.0, 0.5, math.sqrt(0.75)))
    plan = planned(UR10E, Q, [FOREARM, other])
    assert isinstance(plan, RetreatPlan)
    first = follow(UR10E, plan, Q)
    second = follow(UR10E, replace(plan, tracks=plan.tracks[::-1]), Q)
    assert first.done.complete
    assert max(first.backwards, second.backwards) < 1e-12
    # neither goes farther than it may: the first of them to make the distance ends it
    assert max(first.made, second.made) == pytest.approx(0.05, abs=2 * DISTANCE_TOLERANCE)
    assert 0.03 < min(first.made, second.made) < 0.0495


def test_touches_on_two_links_are_both_left() -> None:
    hand = ContactOnLink(6, (0.0, 0.05, 0.0), (0.0, 1.0, 0.0))
    plan = planned(UR10E, Q, [FOREARM, hand])
    assert isinstance(plan, RetreatPlan)
    step = retreat_step(plan, ArmState(0.0, Q))
    assert isinstance(step, JointVelocity)
    for contact in (FOREARM, hand):
        rows = pin_jacobian(UR10E, list(Q), contact.link, contact.point)[:3]
        normal = np.array(link_pose(UR10E, Q, contact.link).rotate(contact.normal))
        assert normal @ rows @ np.array(step.qd) < -0.005


@pytest.mark.promise("P02")
@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"location_valid": False}, "the place of the touch on the forearm is not known"),
        ({"link": 0}, "the base was touched, and no joint moves it"),
        ({"normal": (0.0, 0.0, 0.0)}, "no unit normal"),
        ({"point": (math.nan, 0.0, 0.0)}, "no unit normal"),
    ],
)
def test_where_nothing_is_known_nothing_is_planned(change: dict[str, object], words: str) -> None:
    plan = planned(UR10E, Q, [replace(FOREARM, **change)])  # type: ignore[arg-type]
    assert isinstance(plan, Done)
    assert words in plan.reason


@pytest.mark.parametrize("length", [0.991, 1.009])
def test_a_normal_that_is_not_quite_a_unit_is_made_one(length: float) -> None:
    exact, scaled = (
        planned(UR10E, Q, [replace(FOREARM, normal=(0.36 * size, 0.48 * size, 0.8 * size))]) for size in (1.0, length)
    )
    assert isinstance(exact, RetreatPlan)
    assert isinstance(scaled, RetreatPlan)
    assert scaled.tracks[0].away == pytest.approx(exact.tracks[0].away, abs=1e-12)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_an_arm_that_reports_nonsense_is_not_moved(bad: float) -> None:
    plan = planned(UR10E, Q, [FOREARM])
    assert isinstance(plan, RetreatPlan)
    step = retreat_step(plan, ArmState(0.1, (bad, *Q[1:])))
    assert isinstance(step, Done)
    assert "must be finite" in step.reason
    assert isinstance(planned(UR10E, (bad, *Q[1:]), [FOREARM]), Done)


@pytest.mark.promise("P33")
def test_the_time_ends_it() -> None:
    plan = planned(UR10E, Q, [FOREARM], Reaction(kind="retreat", time_budget=1.0))
    assert isinstance(plan, RetreatPlan)
    assert isinstance(retreat_step(plan, ArmState(0.999, Q)), JointVelocity)
    late = retreat_step(plan, ArmState(1.0, Q))
    assert isinstance(late, Done)
    assert not late.complete
    assert "the time of 1.0 s is over" in late.reason
    assert isinstance(retreat_step(plan, ArmState(math.nan, Q)), Done)


@pytest.mark.parametrize(
    ("reaction", "reason"),
    [
        (Reaction(kind="retreat", speed=1.5, arm_speed=5.0, acceleration=40.0, distance=0.5), "joint speed"),
        (Reaction(kind="retreat", speed=1.5, arm_speed=0.1), "arm speed"),
        (Reaction(kind="retreat", distance=0.001), "distance"),
    ],
)
def test_what_clips_is_said(reaction: Reaction, reason: str) -> None:
    q: Joints = (0.3, -1.2, 0.1, 0.4, 0.5, 0.6)
    contact = ContactOnLink(2, (0.3, 0.06, 0.0), (0.0, 1.0, 0.0))
    plan = planned(UR10E, q, [contact], reaction)
    assert isinstance(plan, RetreatPlan)
    step = retreat_step(plan, ArmState(0.0, q))
    assert isinstance(step, JointVelocity)
    assert reason in step.clipped_by


def test_a_retreat_without_contact_or_with_a_link_that_is_not_there_is_refused() -> None:
    with pytest.raises(KinematicsError, match="at least one contact"):
        planned(UR10E, Q, [])
    with pytest.raises(KinematicsError, match=r"link must be 0 .* to 6"):
        planned(UR10E, Q, [replace(FOREARM, link=7)])
