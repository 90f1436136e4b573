"""Touches that may hold the arm between them: it only stops."""

import math

import pytest

from coneskin.robot.arm.kinematics import link_pose
from coneskin.robot.arm.models import arm_model
from coneskin.robot.arm.workspace import Workspace
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
