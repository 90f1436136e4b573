"""The way of the whole arm during a retreat, measured at points of the bare arm that the bound does not use."""

import functools
import math
import random

import pytest

from coneskin.geometry.pose import Vector
from coneskin.robot.arm.kinematics import LINK_INDEX, dh_mesh, link_poses
from coneskin.robot.arm.model import ArmModel, Joints
from coneskin.robot.arm.ur_models import arm_model
from coneskin.robot.arm.workspace import ArmSweep
from coneskin.robot.reaction.admittance import begin_admittance
from coneskin.robot.reaction.motion import _AdmittanceMotion
from coneskin.robot.reaction.retreat import RetreatPlan, plan_retreat, retreat_step
from coneskin.robot.reaction.types import ArmState, ContactOnLink, Done, Reaction

from ..retreat_cases import six

_STEP = 0.008  # s


@functools.cache
def bodies(model: ArmModel) -> list[tuple[int, Vector]]:
    """Points on the tubes of upper arm and forearm, and around wrists and flange, each in its DH frame [m]."""
    found = []
    for name, length in (("upper_arm", abs(model.a[1])), ("forearm", abs(model.a[2]))):
        for along in (0.0, 0.3, 0.7, 1.0):
            for angle in (0.0, 1.6, 3.1, 4.7):
                on_tube = (0.055 * math.cos(angle), 0.055 * math.sin(angle), along * length)
                found.append((LINK_INDEX[name], dh_mesh(model, name).apply(on_tube)))
    found += [(link, (x, y, 0.0)) for link in (4, 5, 6) for x, y in ((0.0, 0.0), (0.04, 0.0), (0.0, -0.04))]
    return found


def places(model: ArmModel, q: Joints) -> list[Vector]:
    """Return where these points are, in the base frame [m]."""
    poses = link_poses(model, q)
    return [poses[link].apply(point) for link, point in bodies(model)]


def retreat(model: ArmModel, q: Joints, contact: ContactOnLink, reaction: Reaction) -> tuple[float, float, str]:
    """Return the largest way [m] and speed [m/s] of any of the points, and why the retreat ended."""
    plan = plan_retreat(model, ArmState(0.0, q, (0.0,) * 6), [contact], reaction, sweep=ArmSweep.begin(model, q))
    start = before = places(model, q)
    way, speed, now, qd = 0.0, 0.0, 0.0, (0.0,) * 6
    while not isinstance(plan, Done):
        step = retreat_step(plan, ArmState(now, q, qd))
        if isinstance(step, Done):
            return way, speed, step.reason
        qd, now = step.qd, now + _STEP
        q = six(a + _STEP * b for a, b in zip(q, qd, strict=True))
        there = places(model, q)
        way = max(way, *map(math.dist, there, start))
        speed = max(speed, *(math.dist(a, b) / _STEP for a, b in zip(there, before, strict=True)))
        before = there
    return way, speed, plan.reason


@pytest.mark.promise("P34")
@pytest.mark.parametrize("name", ["UR3e", "UR5e", "UR10e", "UR30"])
def test_no_point_of_the_arm_goes_farther_or_faster_than_allowed(name: str) -> None:
    model, draw = arm_model(name), random.Random(name)
    ends = []
    for _ in range(8):
        q = six(draw.uniform(-1.5, 1.5) for _ in range(6))
        link = draw.choice((1, 2, 2, 3, 3))
        around = draw.uniform(0.0, 2.0 * math.pi)
        normal = (0.0, math.cos(around), math.sin(around))
        contact = ContactOnLink(link, (0.0, 0.06 * normal[1], 0.06 * normal[2]), normal)
        reaction = Reaction("retreat", distance=draw.uniform(0.02, 0.2), arm_distance=draw.choice((0.05, 0.1, 0.3)))
        way, speed, why = retreat(model, q, contact, reaction)
        assert way <= reaction.arm_distance
        assert speed <= reaction.arm_speed
        ends.append(why)
    assert any("as far as arm_distance_mm lets it" in why for why in ends)


def test_a_touch_near_the_base_does_not_swing_the_flange() -> None:
    """A few centimetres there are many at the flange, were its way not bounded."""
    model, q = arm_model("UR10e"), (0.0, -0.8, 0.3, 0.0, 0.0, 0.0)
    contact = ContactOnLink(2, (0.45, 0.06, 0.17), (0.0, 1.0, 0.0))
    wide = retreat(model, q, contact, Reaction("retreat", arm_distance=2.0))
    bound = retreat(model, q, contact, Reaction("retreat"))
    assert wide[0] > 0.15
    assert 0.05 < bound[0] <= 0.1
    assert "as far as arm_distance_mm lets it" in bound[2]


STRETCHED = (0.0, -0.3, 0.1, -0.2, -1.5, 0.0)
TURNED = (0.1, *STRETCHED[1:])
NEAR_SHOULDER = ContactOnLink(2, (0.45, 0.0, 0.1), (0.0, 0.0, 1.0), 0.8)


def test_an_arm_that_something_else_has_moved_so_far_gets_no_step() -> None:
    """The bound is judged by measured positions, not by what was commanded."""
    model = arm_model("UR10e")
    start, sweep = ArmState(0.0, STRETCHED), ArmSweep.begin(model, STRETCHED)
    plan = plan_retreat(model, start, [NEAR_SHOULDER], Reaction("retreat"), sweep=sweep)
    assert isinstance(plan, RetreatPlan)
    assert not isinstance(retreat_step(plan, ArmState(0.1, STRETCHED)), Done)
    over = retreat_step(plan, ArmState(0.1, TURNED))
    assert isinstance(over, Done)
    why = "a point of the arm has moved 100 mm, as far as arm_distance_mm lets it"
    assert over.reason == f"{why}, before the touched one had moved 50 mm"


def test_giving_way_is_bounded_too() -> None:
    motion = _AdmittanceMotion(begin_admittance(arm_model("UR10e"), ArmState(0.0, STRETCHED), Reaction("comply")))
    for time in (0.0, 0.1):
        assert not isinstance(motion.update(ArmState(time, STRETCHED), [NEAR_SHOULDER]), Done)
    over = motion.update(ArmState(0.2, TURNED), [NEAR_SHOULDER])
    assert isinstance(over, Done)
    why = "a point of the arm has moved 100 mm, as far as arm_distance_mm lets it"
    assert over.reason == f"{why}, before the touched one had moved 50 mm"
