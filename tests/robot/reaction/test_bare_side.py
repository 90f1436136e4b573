"""How far a motion moves outward what no skin covers; points all around the arm, moved by other kinematics, judge."""

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose
from coneskin.robot.arm.kinematics import dh_mesh, link_pose
from coneskin.robot.arm.models import arm_model
from coneskin.robot.arm.workspace import arm_parts, skeleton
from coneskin.robot.reaction.bare_side import BareSides

ARM = arm_model("UR5e")
Q = (0.2, -1.4, 1.5, -1.6, -1.5, 0.3)
LINK = 3
joints = st.tuples(*[st.floats(-3.0, 3.0)] * 6)
steps = st.tuples(*[st.floats(-0.02, 0.02)] * 6)


def sheet(wrap, turn=0.0, low=0.0, length=0.3922):
    """A sheet around the forearm; 0.3922 m is all of it."""
    at = dh_mesh(ARM, "forearm") @ Pose.from_xyz_rpy((0.0, 0.0, low), (0.0, 0.0, turn))
    return LINK, PlacedFrustum(Frustum(0.04, 0.038, length, wrap), at)


def moved(q, step):
    return tuple(a + b for a, b in zip(q, step, strict=True))


def way_of_strip(skin, q, there):
    """The farthest that any point of the bare strip goes along its own normal, of many."""
    link, cone = skin
    wrap, farthest = cone.frustum.wrap, 0.0
    before, after = link_pose(ARM, q, link), link_pose(ARM, there, link)
    for k in range(201):
        phi = wrap + (math.tau - wrap) * k / 200
        normal = cone.link_frustum.rotate((math.cos(phi), math.sin(phi), 0.0))
        for u in (0.0, 0.5 * cone.frustum.slant, cone.frustum.slant):
            at = cone.centre(u)
            step = [b - a for a, b in zip(before.apply(at), after.apply(at), strict=True)]
            farthest = max(farthest, sum(a * b for a, b in zip(before.rotate(normal), step, strict=True)))
    return farthest


@given(joints)
@settings(max_examples=25)
def test_the_parts_are_those_of_the_arms_middle_line_wherever_it_is(q):
    corners = skeleton(ARM, q)[1:]
    for (_, link, begin, end), (a, b) in zip(arm_parts(ARM), pairwise(corners), strict=True):
        pose = link_pose(ARM, q, link)
        assert pose.apply(begin) == pytest.approx(a, abs=1e-6)
        assert pose.apply(end) == pytest.approx(b, abs=1e-6)


@given(joints, steps)
@settings(max_examples=25)
def test_without_a_skin_it_is_as_far_as_the_farthest_corner_goes(q, step):
    there = moved(q, step)
    farthest = max(map(math.dist, skeleton(ARM, q)[1:], skeleton(ARM, there)[1:]))
    assert BareSides(ARM, []).way(q, there)[0] == pytest.approx(farthest, abs=1e-6)


@pytest.mark.promise("P33")
@given(joints, steps, st.floats(math.radians(180.0), math.radians(350.0)), st.floats(-3.0, 3.0))
@settings(max_examples=40)
def test_a_strip_goes_as_far_as_the_farthest_of_many_points_on_it(q, step, wrap, turn):
    bare, there = BareSides(ARM, [sheet(wrap, turn)]), moved(q, step)
    own = [station for station in bare._stations if station.strip is not None]
    bare._stations = tuple(own)
    assert len(own) == 2
    assert bare.way(q, there)[0] == pytest.approx(way_of_strip(sheet(wrap, turn), q, there), rel=1e-3, abs=1e-7)


@pytest.mark.promise("P33")
def test_a_strip_behind_a_touch_leads_and_one_on_its_side_does_not():
    there = moved(Q, (0.0, 0.02, 0.0, 0.0, 0.0, 0.0))
    pose, cone = link_pose(ARM, Q, LINK), sheet(math.tau)[1]
    middle = cone.centre(0.5 * cone.frustum.slant)
    step = [b - a for a, b in zip(pose.apply(middle), link_pose(ARM, there, LINK).apply(middle), strict=True)]
    x, y, _ = cone.link_frustum.inverse().rotate(pose.inverse().rotate(tuple(step)))
    ahead, wrap = math.atan2(y, x), math.radians(300.0)
    ways = []
    for side in (0.0, math.pi):
        bare = BareSides(ARM, [sheet(wrap, ahead + side - (wrap + math.radians(30.0)))])
        bare._stations = tuple(station for station in bare._stations if station.strip)
        ways.append(bare.way(Q, there))
    assert ways[0][0] > 0.8 * math.hypot(x, y)
    assert ways[0][1] == "strip of the forearm"
    assert ways[1][0] == 0.0


def test_a_sheet_all_around_covers_what_it_lies_on_and_no_more():
    def forearm(*sheets):
        return [s for s in BareSides(ARM, sheets)._stations if s.name == "forearm"]

    assert forearm(sheet(math.tau)) == []
    assert len(forearm(sheet(math.tau, low=0.1, length=0.2))) == 4  # both ends of what is bare on either side
    assert len(forearm(sheet(math.tau, low=0.0, length=0.19), sheet(math.tau, low=0.2, length=0.1922))) == 2
    assert forearm(sheet(math.tau, low=0.0, length=0.195), sheet(math.tau, low=0.196, length=0.1962)) == []
    assert len(forearm((2, sheet(math.tau)[1]))) == 2, "of another link"


@pytest.mark.parametrize(("gap", "bare"), [(4.9e-3, False), (5.1e-3, True)])
def test_between_two_sheets_a_part_of_less_than_5_mm_is_felt_by_both(gap, bare):
    whole = [sheet(math.tau, length=0.2), sheet(math.tau, low=0.2 + gap, length=0.3922 - 0.2 - gap)]
    assert ("forearm" in BareSides(ARM, whole).parts) is bare
