"""Room of an arm: its own links (distances are held against those of coal, an FCL), limits of its joints, its sweep."""

from __future__ import annotations

import functools
import math
import random
import re

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from coneskin.core.errors import KinematicsError
from coneskin.geometry.pose import Pose, Vector
from coneskin.robot.arm.kinematics import LINK_INDEX, dh_mesh, link_pose, link_poses
from coneskin.robot.arm.model import ArmModel, Joints
from coneskin.robot.arm.models import ZERO_VELOCITY, arm_model
from coneskin.robot.arm.workspace import (
    _LIMIT_MARGIN,
    _PART_NAMES,
    REACTION_TIME,
    ArmSweep,
    Workspace,
    _clearance_needed,
    _close_pairs,
    _segment_distance,
    blocked_joints,
    reach,
    skeleton,
)
from coneskin.robot.guard.signals.joint_current import _push_torque
from coneskin.robot.reaction.motion_choice import _AdmittanceMotion
from coneskin.robot.reaction.retreat import RetreatPlan, plan_retreat, retreat_step
from coneskin.robot.reaction.types import ArmState, ContactOnLink, Done, Reaction
from tests.robot.arms import FAR_UR10, arms, joints
from tests.robot.retreat_cases import six

ARM = arm_model("UR5e")
SPACE = Workspace(ARM)
Q = (-0.7, -1.6, 1.6, -1.6, -1.6, 0.0)
#: wrist 1 turned so that the wrist hangs beside the shoulder, the elbow bent far
FOLDED = (0.0, -1.2, 2.6, -1.4, -1.57, 0.0)

points = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


@pytest.mark.long
@given(points, points, points, points)
@settings(max_examples=200)
def test_a_distance_of_segments_is_that_of_coal(a, b, c, d):
    coal = pytest.importorskip("coal", reason="coal comes with pin, which has no wheel here")
    np = pytest.importorskip("numpy")
    assume(min(math.dist(a, b), math.dist(c, d)) > 1e-3)
    radius = 1e-3

    def capsule(p, q):
        p, q = np.array(p), np.array(q)
        along = (q - p) / np.linalg.norm(q - p)
        other = np.cross(along, [1.0, 0, 0] if abs(along[0]) < 0.7 else [0, 1.0, 0])
        other /= np.linalg.norm(other)
        turn = np.column_stack([other, np.cross(along, other), along])
        return coal.Capsule(radius, np.linalg.norm(q - p)), coal.Transform3s(turn, 0.5 * (p + q))

    (one, here), (two, there) = capsule(a, b), capsule(c, d)
    result = coal.DistanceResult()
    found = coal.distance(one, here, two, there, coal.DistanceRequest(), result) + 2.0 * radius
    assume(found > 2.5 * radius)  # where capsules meet it gives the depth instead
    assert _segment_distance(a, b, c, d) == pytest.approx(found, abs=2e-6)  # coal stops at 1e-6


@given(points, points, points, points, st.floats(0, 1), st.floats(0, 1))
@settings(max_examples=200)
def test_it_is_the_least_and_symmetric(a, b, c, d, s, t):
    least = _segment_distance(a, b, c, d)
    on_one = [x + s * (y - x) for x, y in zip(a, b, strict=True)]
    on_two = [x + t * (y - x) for x, y in zip(c, d, strict=True)]
    assert least <= math.dist(on_one, on_two) + 1e-12
    assert least == pytest.approx(_segment_distance(d, c, a, b), abs=1e-12)


@pytest.mark.parametrize(
    ("segments", "distance"),
    [
        (((0, 0, 0), (1, 0, 0), (0.5, -1, 0.25), (0.5, 1, 0.25)), 0.25),  # they cross
        (((0, 0, 0), (1, 0, 0), (0, 0.3, 0), (1, 0.3, 0)), 0.3),  # parallel
        (((0, 0, 0), (1, 0, 0), (4, 4, 0), (4, 4, 0)), 5.0),  # a point beyond the end
        (((0, 0, 0), (0, 0, 0), (0, 0, 0), (0, 0, 0)), 0.0),
    ],
)
def test_distances_that_a_person_can_see(segments, distance):
    assert _segment_distance(*segments) == pytest.approx(distance, abs=1e-15)


def test_the_thickness_covers_the_tubes_that_were_measured():
    # radii of the meshes: 42.6 mm on the UR5e's upper arm, 54.0 mm on the UR10's
    assert _clearance_needed(arm_model("UR5e")) / 2 > 0.0426
    assert _clearance_needed(arm_model("UR10")) / 2 > 0.0540


def test_an_arm_as_people_use_it_does_not_touch_itself():
    for name in ("UR3e", "UR5e", "UR10e", "UR16e", "UR20", "UR30"):
        assert _close_pairs(arm_model(name), skeleton(arm_model(name), Q)) == []


def test_a_wrist_at_the_base_is_close_to_it():
    (first, second, distance), *_ = _close_pairs(ARM, skeleton(ARM, folded()))
    assert _PART_NAMES[first] in ("base", "shoulder", "upper arm")
    assert _PART_NAMES[second].startswith(("wrist", "forearm"))
    assert distance < _clearance_needed(ARM)


def folded():
    """Joint positions at which the wrist is in the base."""
    return (0.0, -2.2, 2.75, -1.2, -1.57, 0.0)


def towards_base(q):
    """A touch on the outside of wrist 1: moving away from it leads to the base's axis."""
    pose: Pose = link_pose(ARM, q, 4)
    x, y, _ = pose.translation
    size = math.hypot(x, y)
    return ContactOnLink(4, (0.0, 0.0, 0.0), pose.inverse().rotate((x / size, y / size, 0.0)))


@pytest.mark.promise("P35")
def test_a_retreat_that_would_fold_the_arm_into_itself_ends_before():
    q, reaction = FOLDED, Reaction(kind="retreat", distance=0.5, time_budget=20.0)
    for space in (None, SPACE):
        plan = plan_retreat(ARM, ArmState(0.0, q), [towards_base(q)], reaction, space)
        assert not isinstance(plan, Done)
        end, why = follow(plan, q)
        near = min((distance for *_, distance in _close_pairs(ARM, skeleton(ARM, end))), default=math.inf)
        if space is None:
            assert near < 0.8 * _clearance_needed(ARM)  # it would have gone there
        else:
            assert re.fullmatch(r"the wrist \d would come within \d+ mm of the (base|shoulder), axis to axis", why)
            assert near == math.inf


@pytest.mark.long
@given(st.tuples(*[st.floats(-0.5, 0.5)] * 6), st.tuples(*[st.floats(-0.5, 0.5)] * 3))
@settings(max_examples=12)
def test_no_retreat_brings_two_parts_closer_than_they_may_be(turned, tilted):
    q = tuple(angle + turn for angle, turn in zip(FOLDED, turned, strict=True))
    contact = towards_base(q)
    normal = [n + t for n, t in zip(contact.normal, tilted, strict=True)]
    contact = ContactOnLink(4, contact.point, tuple(n / math.hypot(*normal) for n in normal))
    plan = plan_retreat(
        ARM, ArmState(0.0, q), [contact], Reaction(kind="retreat", distance=0.5, time_budget=20.0), SPACE
    )
    assume(not isinstance(plan, Done))
    before = {(pair.first, pair.second): pair.distance for pair in _close_pairs(ARM, skeleton(ARM, q))}
    end, _ = follow(plan, q)
    for pair in _close_pairs(ARM, skeleton(ARM, end)):
        # a part that was too close may stay so; half a setpoint at 0.5 m/s is 1 mm
        assert pair.distance > min(_clearance_needed(ARM), before.get((pair.first, pair.second), math.inf)) - 1.5e-3


def follow(plan, q, period=0.004):
    """Return the standstill of an arm that follows at once, and its reason; a setpoint holds for a period [s]."""
    time, qd = 0.0, (0.0,) * 6
    while True:
        step = retreat_step(plan, ArmState(time, q, qd))
        if isinstance(step, Done):
            braking = max(map(abs, qd)) / (2.0 * plan.reaction.acceleration)
            return tuple(a + braking * v for a, v in zip(q, qd, strict=True)), step.reason
        time, qd = time + period, step.qd
        q = tuple(a + period * v for a, v in zip(q, qd, strict=True))


def test_a_part_that_is_too_close_may_move_out():
    q = folded()
    inwards = [0.0, -0.3, 0.3, 0.0, 0.0, 0.0]
    why = SPACE.obstruction(q, inwards, 4.0) or SPACE.obstruction(q, [-value for value in inwards], 4.0)
    assert "axis to axis" in why  # one of the two leads deeper
    assert not (SPACE.obstruction(q, inwards, 4.0) and SPACE.obstruction(q, [-value for value in inwards], 4.0))
    assert SPACE.obstruction(q, [0.0] * 6, 4.0) == ""


@given(st.floats(0.0, 3.2), st.floats(-0.5, 2.0), st.floats(0.5, 40.0), st.sampled_from([-1.0, 1.0]))
def test_a_joint_is_blocked_exactly_where_it_could_no_longer_brake(
    speed: float, room: float, braking: float, side: float
) -> None:
    arm = arm_model("UR5e")
    edge = side * (arm.joint_upper[1] - _LIMIT_MARGIN)
    q = (0.0, edge - side * room, 0.0, 0.0, 0.0, 0.0)
    needed = speed * REACTION_TIME + speed**2 / (2.0 * braking)
    if abs(needed - room) < 1e-9 or speed == 0.0:
        return
    assert (blocked_joints(arm, braking, q, ZERO_VELOCITY, [0.0, side * speed]) == [1]) == (needed > room)
    assert blocked_joints(arm, braking, q, ZERO_VELOCITY, [0.0, -side * 1e-6]) == []  # away from it is free


def test_the_speed_that_a_joint_has_counts_if_it_is_more_than_the_one_wanted() -> None:
    arm = arm_model("UR5e")
    q = (arm.joint_upper[0] - _LIMIT_MARGIN - 0.1, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert blocked_joints(arm, 4.0, q, ZERO_VELOCITY, [0.1]) == []
    assert blocked_joints(arm, 4.0, q, (2.0, 0.0, 0.0, 0.0, 0.0, 0.0), [0.1]) == [0]
    assert blocked_joints(arm, 4.0, q, (2.0, 0.0, 0.0, 0.0, 0.0, 0.0), [-0.1]) == []


def test_a_joint_that_turns_without_end_is_never_blocked() -> None:
    assert blocked_joints(arm_model("UR3e"), 4.0, (0.0,) * 5 + (500.0,), ZERO_VELOCITY, [0.0] * 5 + [3.0]) == []


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_margin_is_kept_on_both_sides(side: float) -> None:
    for room, blocked in ((_LIMIT_MARGIN + 1e-6, []), (_LIMIT_MARGIN - 1e-6, [2])):
        q = (0.0, 0.0, side * (math.pi - room), 0.0, 0.0, 0.0)
        assert blocked_joints(arm_model("UR5e"), 4.0, q, ZERO_VELOCITY, [0.0, 0.0, side * 1e-6]) == blocked


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
    motion = _AdmittanceMotion(arm_model("UR10e"), ArmState(0.0, STRETCHED), Reaction("comply"))
    pushed = _push_torque(arm_model("UR10e"), STRETCHED, NEAR_SHOULDER)  # by 1 N
    torque = tuple(1000.0 * each for each in pushed)
    for time in (0.0, 0.1):
        assert not isinstance(motion.update(ArmState(time, STRETCHED, torque=torque), [NEAR_SHOULDER]), Done)
    over = motion.update(ArmState(0.2, TURNED, torque=torque), [NEAR_SHOULDER])
    assert isinstance(over, Done)
    why = "a point of the arm has moved 100 mm, as far as arm_distance_mm lets it"
    assert over.reason == f"{why}, before the touched one had moved 50 mm"


def test_an_arm_whose_links_are_not_known_has_no_workspace() -> None:
    with pytest.raises(KinematicsError, match="meshes are known for UR3"):
        Workspace(arm_model("UR15"))
    assert len(skeleton(arm_model("UR15"), ZERO_VELOCITY)) == 9
