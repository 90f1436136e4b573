"""Touches that may hold the arm between them: it only stops."""

import math
import random
from dataclasses import replace
from itertools import pairwise

import pytest

from coneskin.robot.arm.kinematics import link_pose
from coneskin.robot.arm.models import arm_model
from coneskin.robot.arm.workspace import Workspace, part_in_front, skeleton
from coneskin.robot.reaction.motion_choice import plan_reaction_motion
from coneskin.robot.reaction.types import ArmState, ContactOnLink, Reaction

ARM = arm_model("UR5e")
Q = (0.2, -1.4, 1.5, -1.6, -1.5, 0.3)
REACTION = Reaction("retreat", distance=0.03)


def facing(link, point, towards, number):
    """A touch whose normal points along a vector of the base frame."""
    x, y, z = (sum(a * b for a, b in zip(towards, axis, strict=True)) for axis in axes(link, Q))
    return ContactOnLink(link, point, (x, y, z), 0.6, True, 0.1, number)


def axes(link, q):
    pose = link_pose(ARM, q, link)
    return [pose.rotate(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]


def moving(link, point, qd, q=Q):
    """Direction in which a point of a link moves."""
    before = link_pose(ARM, q, link).apply(point)
    after = link_pose(ARM, [a + 1e-4 * v for a, v in zip(q, qd, strict=True)], link).apply(point)
    way = [b - a for a, b in zip(before, after, strict=True)]
    return [value / math.hypot(*way) for value in way]


def elbow_clamp():
    """Forearm and upper arm that close on something between them, as the elbow bends."""
    qd = (0.0, 0.0, 0.5, 0.0, 0.0, 0.0)
    heading = moving(3, (0.2, 0.0, 0.05), qd)
    other = [-value for value in heading]
    return [
        facing(3, (0.2, 0.0, 0.05), heading, number=1),
        facing(2, (0.2, 0.0, 0.1), other, number=2),
    ]


@pytest.mark.promise("P36")
def test_from_a_clamp_it_does_not_retreat():
    touched, here = ArmState(0.0, Q, (0.0, 0.0, 0.5, 0.0, 0.0, 0.0)), ArmState(0.1, Q)
    why = plan_reaction_motion(ARM, REACTION, touched, here, elbow_clamp(), Workspace(ARM, None))
    assert why == "touches on opposite sides, or on two links, may hold the arm between them"


# a hand in the corner of forearm and wrist, into which a braking UR3e has run, and where it stood in the end
SMALL = arm_model("UR3e")
FIRST = (-1.825, -2.366, 0.788, 1.647, 0.720, -2.428)
STOOD = (-2.015, -2.600, 0.958, 1.229, 0.919, -2.553)
IN_THE_CORNER = ContactOnLink(3, (0.067, 0.006, 0.059), (-0.002, 0.192, 0.981), 0.9, True, 0.1, number=1)


def refused(q, contact, kind):
    """Why it does not move away from a touch that began at those joint positions; empty where it does."""
    reaction = Reaction(kind, distance=0.02)
    motion = plan_reaction_motion(
        SMALL, reaction, ArmState(0.0, q), ArmState(0.3, STOOD), [contact], Workspace(SMALL, None)
    )
    return motion if isinstance(motion, str) else ""


@pytest.mark.promise("P36")
@pytest.mark.parametrize("kind", ["retreat", "comply"])
def test_what_it_may_have_caught_between_its_links_as_it_stopped_it_only_stops(kind):
    """A hand that two links held with 172 N each was pressed by 29 N more as the arm gave way to it."""
    caught = "while it stopped, the arm may have caught what touches it against its own wrist 2"
    assert refused(FIRST, IN_THE_CORNER, kind) == caught
    assert refused(STOOD, IN_THE_CORNER, kind) == ""  # into an arm that stands, the hand came by itself
    x, y, z = IN_THE_CORNER.normal
    outside = ContactOnLink(3, (0.067, 0.0, -0.059), (-x, -y, -z), 0.9, True, 0.1, number=1)
    assert refused(FIRST, outside, kind) != caught


@pytest.mark.promise("P02")
@pytest.mark.parametrize("kind", ["retreat", "comply"])
def test_where_the_place_of_a_touch_is_not_known_no_motion_begins(kind):
    """An arm that complied began all the same, and moved once the place was certain: into what nobody had looked at."""
    assert refused(STOOD, replace(IN_THE_CORNER, location_valid=False), kind).endswith("forearm is not known")


def test_a_part_is_in_front_where_it_reaches_into_a_ball_of_120_mm_at_the_touch():
    """Points along the arm's middle line judge, one a millimetre, of links as thick as the wrist."""
    chance, seen = random.Random(5), [0, 0]
    for _ in range(300):
        q = tuple(chance.uniform(-2.5, 2.5) for _ in range(6))
        turn = chance.uniform(0.0, math.tau)
        normal = (0.0, math.cos(turn), math.sin(turn))
        point = tuple(a + 0.04 * n for a, n in zip((chance.uniform(0.0, 0.39), 0.0, 0.007), normal, strict=True))
        pose = link_pose(ARM, q, 3)
        place, middle = (pose.apply([a + way * n for a, n in zip(point, normal, strict=True)]) for way in (0.0, 0.06))
        clear, near = [], False
        for begin, end in pairwise(skeleton(ARM, q)):
            line = [[a + k / 500 * (b - a) for a, b in zip(begin, end, strict=True)] for k in range(501)]
            room = min(math.dist(middle, at) for at in line)
            least = min(0.06 + 0.5 * ARM.d[4], min(math.dist(place, at) for at in line))
            clear.append(abs(room - least) > 1e-3)
            near = near or room < least
        if all(clear):
            seen[near] += 1
            assert bool(part_in_front(ARM, q, 3, point, normal)) is near
    assert min(seen) > 30


def test_the_base_is_such_a_part():
    q = (0.58143, -0.84197, 2.61949, -0.35025, -2.97529, -2.89440)
    assert part_in_front(ARM, q, 6, (-0.00305, 0.04991, -0.03), (-0.06092, 0.99814, 0.0)) == "base"
