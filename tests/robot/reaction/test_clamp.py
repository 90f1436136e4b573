"""Touches that may hold the arm between them: it only stops. A way back from a resisted retreat presses on none."""

import math

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from coneskin.core.errors import RobotRefused
from coneskin.robot.arm.kinematics import link_pose
from coneskin.robot.arm.model import ZERO_VELOCITY
from coneskin.robot.arm.models import arm_model
from coneskin.robot.arm.workspace import Workspace
from coneskin.robot.reaction.backtrack import PathHistory
from coneskin.robot.reaction.motion_choice import _PlannedMotion, plan_reaction_motion, plan_way_back
from coneskin.robot.reaction.types import ArmState, ContactOnLink, Done, Reaction

ARM = arm_model("UR5e")
Q = (0.2, -1.4, 1.5, -1.6, -1.5, 0.3)
CYCLE = 0.002
REACTION = Reaction("retreat", distance=0.03, on_resistance="back")


def way_back(contacts, qd=(0.0, 0.0, 0.5, 0.0, 0.0, 0.0)):
    """Plan the way back of an arm whose retreat, with these joint speeds, was resisted by touches."""
    history = PathHistory()
    for k in range(200, -1, -1):
        history.update(-k * CYCLE, tuple(q - k * CYCLE * v for q, v in zip(Q, qd, strict=True)))
    here = ArmState(0.1, Q)
    return plan_way_back(ARM, REACTION, here, contacts, history, Workspace(ARM, None), -math.inf)


def facing(link, point, towards, q=Q, valid=True, number=1):
    """A touch whose normal points along a vector of the base frame."""
    x, y, z = (sum(a * b for a, b in zip(towards, axis, strict=True)) for axis in axes(link, q))
    return ContactOnLink(link, point, (x, y, z), 0.6, valid, 0.1, number)


def axes(link, q):
    pose = link_pose(ARM, q, link)
    return [pose.rotate(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]


def moving(link, point, qd, q=Q):
    """Direction in which a point of a link moves."""
    before = link_pose(ARM, q, link).apply(point)
    after = link_pose(ARM, [a + 1e-4 * v for a, v in zip(q, qd, strict=True)], link).apply(point)
    way = [b - a for a, b in zip(before, after, strict=True)]
    return [value / math.hypot(*way) for value in way]


def elbow_clamp(valid=True):
    """Forearm and upper arm that close on something between them, as the elbow bends."""
    qd = (0.0, 0.0, 0.5, 0.0, 0.0, 0.0)
    heading = moving(3, (0.2, 0.0, 0.05), qd)
    other = [-value for value in heading]
    return [
        facing(3, (0.2, 0.0, 0.05), heading, number=1),
        facing(2, (0.2, 0.0, 0.1), other, valid=valid, number=2),
    ]


@pytest.mark.promise("P36")
def test_from_a_clamp_it_does_not_retreat():
    touched, here = ArmState(0.0, Q, (0.0, 0.0, 0.5, 0.0, 0.0, 0.0)), ArmState(0.1, Q)
    why = plan_reaction_motion(ARM, REACTION, touched, here, elbow_clamp(), Workspace(ARM, None))
    assert why == "touches on opposite sides, or on two links, may hold the arm between them"


def test_the_way_back_opens_an_elbow_that_has_closed():
    motion = way_back(elbow_clamp())
    assert isinstance(motion, _PlannedMotion)
    step = motion.update(ArmState(0.1, Q, ZERO_VELOCITY), ())
    assert step.qd[2] < 0.0
    assert step.qd[:2] == pytest.approx((0.0, 0.0))


@pytest.mark.promise("P37")
def test_both_places_must_be_certain_and_the_arm_must_have_come_somewhere():
    assert "not certain" in way_back(elbow_clamp(valid=False))
    assert way_back(elbow_clamp(), ZERO_VELOCITY) == "the arm has not come from anywhere"
    assert way_back(()) == "nothing touches any more"


def test_it_does_not_go_back_into_what_came_from_behind():
    first, _ = elbow_clamp()
    behind = facing(3, (0.2, 0.0, 0.05), [-v for v in moving(3, (0.2, 0.0, 0.05), (0, 0, 1, 0, 0, 0))], number=2)
    assert "leads towards the touch" in way_back([first, behind])


def test_an_unknown_word_is_refused():
    with pytest.raises(RobotRefused, match="on_resistance must be one of stop, back, got 'comply'"):
        Reaction("retreat", on_resistance="comply")


speeds = st.tuples(*[st.floats(-0.8, 0.8)] * 3, *[st.just(0.0)] * 3)
normals = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: math.hypot(*v) > 0.3)


@pytest.mark.promise("P37")
@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.filter_too_much])
@given(speeds, st.lists(st.tuples(st.sampled_from((2, 3)), normals), min_size=2, max_size=2))
def test_the_way_back_leads_into_no_touch(qd, touches):
    """The law: whatever way it came, no touched point starts along its own normal."""
    assume(max(map(abs, qd)) > 0.1)
    contacts = []
    for number, (link, normal) in enumerate(touches, 1):
        length = math.hypot(*normal)
        contacts.append(
            ContactOnLink(link, (0.2, 0.0, 0.08), tuple(v / length for v in normal), 0.6, True, 0.1, number)
        )
    motion = way_back(contacts, qd)
    assume(isinstance(motion, _PlannedMotion))
    step = motion.update(ArmState(0.1, Q, ZERO_VELOCITY), ())
    assume(not isinstance(step, Done))
    for contact in contacts:
        pose = link_pose(ARM, Q, contact.link)
        after = link_pose(ARM, [a + 1e-4 * v for a, v in zip(Q, step.qd, strict=True)], contact.link)
        way = [(b - a) / 1e-4 for a, b in zip(pose.apply(contact.point), after.apply(contact.point), strict=True)]
        assert sum(a * b for a, b in zip(way, pose.rotate(contact.normal), strict=True)) < 1.1e-3
