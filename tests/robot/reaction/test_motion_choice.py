"""Ways to leave: with the push, above the table; the kinematics judge."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from coneskin.robot.arm.kinematics import link_pose
from coneskin.robot.arm.models import ZERO_VELOCITY, arm_model
from coneskin.robot.arm.workspace import Workspace, skeleton
from coneskin.robot.guard.signals.joint_current import _push_torque
from coneskin.robot.reaction.motion_choice import _AdmittanceMotion, _PlannedMotion, _wanted_speed
from coneskin.robot.reaction.retreat import plan_retreat
from coneskin.robot.reaction.types import ArmState, ContactOnLink, Done, Reaction

ARM = arm_model("UR5e")
Q = (0.2, -1.4, 1.5, -1.6, -1.5, 0.3)
CYCLE = 0.002
FOREARM = ContactOnLink(3, (0.2, 0.0, 0.05), (0.0, 0.0, 1.0), 0.8, True, 0.1)
bent = st.tuples(
    st.floats(-3.0, 3.0), st.floats(-2.6, -0.5), st.floats(0.5, 2.5), *[st.floats(-2.0, 2.0) for _ in range(3)]
)
normals = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: math.hypot(*v) > 0.3)


def unit(vector):
    length = math.hypot(*vector)
    return tuple(value / length for value in vector)


def ramped(qd, wanted, most):
    gap = max(abs(b - a) for a, b in zip(qd, wanted, strict=True))
    share = min(1.0, most / gap) if gap else 1.0
    return tuple(a + share * (b - a) for a, b in zip(qd, wanted, strict=True))


def pushed(q, force=1000.0):
    """Torques on the joints of a push on the forearm [N m]; so strong a one bounds nothing."""
    return tuple(force * turn for turn in _push_torque(ARM, q, FOREARM))


def follow(step, q=Q, time=0.0, longest=5.0):
    """An arm that does as it is told; the states on the way, and how it ended."""
    qd, states = ZERO_VELOCITY, []
    while time < longest:
        state = ArmState(time, q, qd, pushed(q))
        states.append(state)
        now = step(state)
        if isinstance(now, Done):
            return states, now
        qd = ramped(qd, now.qd, now.acceleration * CYCLE)
        q = tuple(a + CYCLE * v for a, v in zip(q, qd, strict=True))
        time += CYCLE
    return states, None


def moved(contact, before, after):
    """How far the touched point has come along -n of the start [m]."""
    pose = link_pose(ARM, before, contact.link)
    normal, start = pose.rotate(contact.normal), pose.apply(contact.point)
    end = link_pose(ARM, after, contact.link).apply(contact.point)
    return sum((b - a) * -n for a, b, n in zip(start, end, normal, strict=True))


# ---- comply


@given(st.floats(0.0, 1.0), st.floats(0.0, 0.3), st.floats(0.4, 1.0))
def test_the_speed_rises_with_the_level_and_never_above_what_is_set(level, threshold, full):
    reaction = Reaction(kind="comply", speed=0.2, full_level=full)

    def at(value):
        return _wanted_speed(reaction, [ContactOnLink(3, (0, 0, 0), (0, 0, 1), value, True, threshold)])

    assert 0.0 <= at(level) <= 0.2
    assert at(threshold) == 0.0
    assert at(full) == pytest.approx(0.2)
    assert at(min(1.0, level + 0.1)) >= at(level)


def comply(level, reaction=None):
    """A complying arm that is pushed at the forearm, so firmly at each time."""
    reaction = reaction or Reaction(kind="comply", speed=0.1, arm_speed=0.5)
    motion = _AdmittanceMotion(ARM, ArmState(0.0, Q), reaction)

    def step(state):
        push = level(state.time)
        contacts = [] if push is None else [ContactOnLink(*list_of(FOREARM)[:3], push, True, 0.1)]
        return motion.update(state, contacts)

    return step


def list_of(contact):
    return [getattr(contact, name) for name in contact.__dataclass_fields__]


def test_half_a_push_is_half_the_speed_and_it_comes_up_as_the_damping_says():
    states, _ = follow(comply(lambda _: 0.35), longest=0.4)  # (0.35 - 0.1) / (0.6 - 0.1)
    speeds = [moved(FOREARM, a.q, b.q) / CYCLE for a, b in pairwise(states)]
    assert speeds[-1] == pytest.approx(0.05, rel=0.01)
    at = round(0.05 / CYCLE)
    assert speeds[at] == pytest.approx(0.05 * (1 - math.exp(-1)), rel=0.1)  # the arm's ramp is a cycle or two late
    assert max(speeds) < 0.0505
    assert all(b - a < 0.05 * CYCLE / 0.05 * 1.5 for a, b in pairwise(speeds))


@pytest.mark.long
@given(st.lists(st.floats(0.0, 1.0), min_size=20, max_size=20))
@settings(max_examples=12)
def test_however_it_is_pushed_it_moves_away_and_no_farther_than_allowed(levels):
    reaction = Reaction(kind="comply", speed=0.1, distance=0.02, time_budget=0.8)
    states, over = follow(comply(lambda t: levels[min(19, int(t / 0.04))], reaction))
    assert isinstance(over, Done)
    made = moved(FOREARM, Q, states[-1].q)
    assert -1e-5 <= made <= 0.0201
    assert over.progress == pytest.approx(made, abs=1e-3)  # progress is along the way, ``made`` along the first normal


@pytest.mark.promise("P38")
@given(st.lists(st.tuples(*[st.floats(-60.0, 60.0)] * 6), min_size=4, max_size=12), st.floats(0.0, 5.0))
@settings(max_examples=40)
def test_whatever_acts_on_the_joints_it_never_drives_against_it(torques, doubt):
    """The law: the torque from outside does work on the arm, never the arm on what presses, whatever the skin reads."""
    motion = _AdmittanceMotion(ARM, ArmState(0.0, Q), Reaction(kind="comply", speed=0.2))
    for k, torque in enumerate(torques, 1):
        step = motion.update(ArmState(0.05 * k, Q, torque=torque, doubt=(doubt,) * 6), [FOREARM])
        if isinstance(step, Done):
            return
        power = sum(t * v for t, v in zip(torque, step.qd, strict=True))
        assert power >= 0.0
        if step.away > 0.0:
            assert step.away <= power / step.away / 1500.0 + 1e-12


def test_a_push_that_something_else_carries_off_is_followed_no_more():
    """The level does not fall, so it is no lighter touch: 15 N of 60 N, or of 20 N, and the arm rests."""
    for force, left, moves in ((60.0, 46.0, True), (60.0, 44.0, False), (20.0, 6.0, True), (20.0, 4.0, False)):
        motion = _AdmittanceMotion(ARM, ArmState(0.0, Q), Reaction(kind="comply", speed=0.2))
        for time, push in ((0.1, force), (0.3, left)):
            step = motion.update(ArmState(time, Q, torque=pushed(Q, push)), [FOREARM])
        assert (step.away > 0.0) is moves, (force, left)
    for time, less, moves in ((0.4, 0.009, False), (0.5, 0.011, True)):
        lighter = replace(FOREARM, level=FOREARM.level - less)
        assert (motion.update(ArmState(time, Q, torque=pushed(Q, 4.0)), [lighter]).away > 0.0) is moves


@pytest.mark.parametrize(("force", "followed"), [(10.0, 10.0), (60.0, 30.0)])
def test_a_push_is_followed_at_1500_newton_seconds_a_metre_and_half_of_a_firm_one(force, followed):
    motion = _AdmittanceMotion(ARM, ArmState(0.0, Q), Reaction(kind="comply", speed=0.2))
    step = motion.update(ArmState(0.9, Q, torque=pushed(Q, force)), [FOREARM])
    assert step.away == pytest.approx(followed / 1500.0, rel=0.01)


@pytest.mark.parametrize(("speed", "moves"), [(0.9e-3, False), (1.1e-3, True)])
def test_below_a_millimetre_a_second_it_stands(speed, moves):
    motion = _AdmittanceMotion(ARM, ArmState(0.0, Q), Reaction(kind="comply", speed=0.2, full_level=0.6))
    touch = replace(FOREARM, level=0.1 + 0.5 * speed / 0.2)
    step = motion.update(ArmState(0.9, Q, torque=pushed(Q)), [touch])
    assert any(step.qd) is moves


def test_without_motor_currents_it_does_not_give_way():
    motion = _AdmittanceMotion(ARM, ArmState(0.0, Q), Reaction(kind="comply"))
    assert "sends no motor currents" in motion.update(ArmState(0.1, Q), [FOREARM]).reason


def test_no_push_no_motion_and_the_end_of_the_push_is_the_end():
    states, over = follow(comply(lambda t: 0.05 if t < 0.1 else None))
    assert states[-1].q == Q
    assert over.reason == "the touch is over"


@pytest.mark.promise("P31")
def test_a_push_whose_place_is_not_known_holds_the_arm():
    motion = _AdmittanceMotion(ARM, ArmState(0.0, Q), Reaction(kind="comply"))
    lost = ContactOnLink(3, FOREARM.point, FOREARM.normal, 0.9, False, 0.1)
    step = motion.update(ArmState(0.1, Q, torque=pushed(Q)), [FOREARM, lost])
    assert step.qd == ZERO_VELOCITY
    assert step.clipped_by == ("place",)
    assert motion.last.plan is None


@pytest.mark.promise("P38")
def test_it_brakes_as_a_stop_where_something_else_may_be_pressed_and_gently_where_a_push_ends():
    """In a grip, giving way to one hand met the other, and braked into that with 4 rad/s2."""
    reaction = Reaction(kind="comply", acceleration=4.0, deceleration=12.0)

    def complying(speed):
        motion = _AdmittanceMotion(ARM, ArmState(0.0, Q), reaction)
        motion.last = motion.last._replace(speed=speed)
        return motion

    lost = ContactOnLink(3, FOREARM.point, FOREARM.normal, 0.9, False, 0.1)
    state = ArmState(0.002, Q, torque=pushed(Q))
    step = complying(0.1).update(state, [lost])
    assert (step.qd, step.acceleration) == (ZERO_VELOCITY, 12.0)
    x, y, z = FOREARM.normal
    other = replace(FOREARM, normal=(-x, -y, -z), level=0.9, number=2)
    step = complying(0.1).update(state, [FOREARM, other])
    assert (step.qd, step.acceleration, step.clipped_by) == (ZERO_VELOCITY, 12.0, ("opposed",))
    step = complying(0.0).update(state, [replace(FOREARM, level=0.1, threshold=0.1)])
    assert (step.qd, step.acceleration, step.clipped_by) == (ZERO_VELOCITY, 4.0, ("level",))
    step = complying(0.0).update(replace(state, time=0.0), [FOREARM])  # firm, and the motion has just begun
    assert (step.qd, step.clipped_by) == (ZERO_VELOCITY, ("damping",))


# ---- the table


@pytest.mark.promise("P35")
@pytest.mark.long
@given(bent, normals, st.floats(-0.5, 0.8))
@settings(max_examples=20)
def test_no_point_of_the_arm_goes_below_the_table(q, normal, height):
    contact = ContactOnLink(3, (0.2, 0.0, 0.0), unit(normal))
    space = Workspace(ARM, height)
    plan = plan_retreat(ARM, ArmState(0.0, q), [contact], Reaction(kind="retreat", distance=0.2), space)
    assume(not isinstance(plan, Done))
    states, over = follow(lambda state: _PlannedMotion(plan).update(state, ()), q)
    assert isinstance(over, Done)
    before = skeleton(ARM, q)
    last = states[-1]
    braking = max(map(abs, last.qd)) / (2 * Reaction(kind="retreat").acceleration)
    stood = tuple(a + braking * v for a, v in zip(last.q, last.qd, strict=True))  # where it comes to stand
    for state_q in [*(state.q for state in states[::5]), stood]:
        for was, now in zip(before[1:], skeleton(ARM, state_q)[1:], strict=True):
            # one cycle at 0.5 m/s is 1 mm; the line between the corners is what is held above the table
            assert now[2] >= min(height, was[2]) - 1.5e-3


def test_the_table_is_named():
    down = ContactOnLink(3, (0.2, 0.0, 0.0), unit(link_pose(ARM, Q, 3).inverse().rotate((0.0, 0.0, 1.0))))
    plan = plan_retreat(ARM, ArmState(0.0, Q), [down], Reaction(kind="retreat"), Workspace(ARM, 1.5))
    assert plan == Done("the table at 1500 mm is in the way")
    low = Workspace(ARM, -1.0)
    assert not isinstance(plan_retreat(ARM, ArmState(0.0, Q), [down], Reaction(kind="retreat"), low), Done)
