"""The arm does not fold into itself while it moves away; distances are held against those of coal (an FCL)."""

import math

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from coneskin.geometry.pose import Pose
from coneskin.robot.arm.kinematics import link_pose
from coneskin.robot.arm.ur_models import arm_model
from coneskin.robot.arm.workspace import (
    _PART_NAMES,
    JointLimits,
    TablePlane,
    Workspace,
    _clearance_needed,
    _close_pairs,
    _PartPair,
    _segment_distance,
    skeleton,
)
from coneskin.robot.reaction.retreat import plan_retreat, retreat_step
from coneskin.robot.reaction.types import ArmState, ContactOnLink, Done, Reaction

ARM = arm_model("UR5e")
SPACE = Workspace(ARM)
Q = (-0.7, -1.6, 1.6, -1.6, -1.6, 0.0)
#: wrist 1 turned so that the wrist hangs beside the shoulder, the elbow bent far
FOLDED = (0.0, -1.2, 2.6, -1.4, -1.57, 0.0)

points = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


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


def test_a_wrist_at_the_base_is_named():
    (pair, *_) = _close_pairs(ARM, skeleton(ARM, folded()))
    assert isinstance(pair, _PartPair)
    assert _PART_NAMES[pair.second].startswith(("wrist", "forearm"))
    assert f"within {1e3 * pair.distance:.0f} mm of the {_PART_NAMES[pair.first]}" in pair.why


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
        near = min((pair.distance for pair in _close_pairs(ARM, skeleton(ARM, end))), default=math.inf)
        if space is None:
            assert near < 0.8 * _clearance_needed(ARM)  # it would have gone there
        else:
            assert "axis to axis" in why
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
            braking = max(map(abs, qd)) / (2.0 * JointLimits.of(ARM, plan.reaction.acceleration).braking)
            return tuple(a + braking * v for a, v in zip(q, qd, strict=True)), step.reason
        time, qd = time + period, step.qd
        q = tuple(a + period * v for a, v in zip(q, qd, strict=True))


def test_a_part_that_is_too_close_may_move_out_and_the_way_it_came_counts_as_free():
    q = folded()
    inwards = [0.0, -0.3, 0.3, 0.0, 0.0, 0.0]
    why = SPACE.obstruction(q, inwards, 4.0) or SPACE.obstruction(q, [-value for value in inwards], 4.0)
    assert "axis to axis" in why  # one of the two leads deeper
    assert not (SPACE.obstruction(q, inwards, 4.0) and SPACE.obstruction(q, [-value for value in inwards], 4.0))
    assert Workspace(ARM, avoid_self=False).obstruction(q, inwards, 4.0) == ""
    assert "table" in Workspace(ARM, TablePlane(3.0), avoid_self=False).obstruction(
        Q, [0.0, 0.5, 0.0, 0.0, 0.0, 0.0], 4.0
    )
    assert SPACE.obstruction(q, [0.0] * 6, 4.0) == ""
