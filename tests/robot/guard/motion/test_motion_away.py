"""Motion away from a touch under guard: giving way, waiting for the place, another's motion, a table, a clamp."""

import math

import pytest

from coneskin.robot.arm.models import ZERO_VELOCITY
from coneskin.robot.driver.messages import SetJointVelocity
from coneskin.robot.driver.values import ControllerState, JointVelocitySetpoint, SetpointProgram, StopPath
from coneskin.robot.guard.motion.setpoint_stream import ReactionPlanner
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.joint_current import _push_torque
from coneskin.robot.reaction.bare_side import BareSides
from coneskin.robot.reaction.rules import Rule
from coneskin.robot.reaction.types import ArmState, ContactOnLink, Reaction
from tests.support.guard_rig import MODEL, GuardRig, felt, touch
from tests.support.sweep import sweep

from ..reactions import comply


def progress(before, after, normal):
    return sum((b - a) * -n for a, b, n in zip(before, after, normal, strict=True))


@pytest.mark.promise("P01")
@pytest.mark.parametrize("external", sweep([False, True]))
def test_it_gives_way_while_it_is_pushed_and_stops_with_the_push(external):
    rig = GuardRig(touch(0.5, 1.0), reaction=comply(), speed=1.0, external=external).run(0.7)
    assert rig.core.phase is Phase.RETREATING
    before, normal = rig.point(), rig.normal()
    rig.run(0.2)
    assert 0.005 < progress(before, rig.point(), normal) < 0.021  # at 0.1 m/s, from a standstill
    rig.run(1.0)
    assert rig.core.phase is Phase.LATCHED
    assert rig.event("retreating").details == {"how": "push"}
    assert rig.event("retreated").details["why"] == "the touch is over"
    assert rig.event("retreated").time - 100.0 == pytest.approx(1.0, abs=0.01)
    assert max(map(abs, rig.arm.qd)) < 0.01


@pytest.mark.long
def test_it_gives_way_no_farther_than_its_distance():
    rig = GuardRig(touch(0.5), reaction=comply(), speed=1.0).run(1.9)
    assert rig.core.phase is Phase.LATCHED
    assert rig.event("retreated").details["why"] == "the distance is made"
    assert rig.event("retreated").details["progress"] == pytest.approx(0.04, abs=0.001)


def test_no_longer_than_its_time():
    rig = GuardRig(touch(0.5), reaction=comply(time_budget=0.1), speed=1.0).run(0.9)
    assert "the time of 0.1 s is over" in rig.event("retreated").details["why"]


def test_a_harder_rule_ends_it():
    rules = (Rule(Reaction(kind="stop"), level_above=0.99),)
    rig = GuardRig(touch(0.5), reaction=comply(), rules=rules, speed=1.0).run(0.7)
    assert rig.core.phase is Phase.RETREATING
    rig.core._arm.touch(rig.now, felt(1.0), False, [])
    assert rig.core.phase is Phase.HALTING


@pytest.mark.parametrize(
    ("kind", "held", "expected"), [("retreat", 2.0, 2.0), ("comply", 2.0, 2.0), ("retreat", 9.0, 4.0)]
)
@pytest.mark.long
def test_a_motion_away_brakes_no_harder_than_the_motors_hold(kind, held, expected):
    reaction = comply() if kind == "comply" else Reaction(kind="retreat")
    rig = GuardRig(touch(0.5, 1.5), reaction=reaction, speed=0.5)
    rig.core._arm._planner._held_braking = lambda q, qd: held if any(qd) else math.inf
    rig.run(1.0)
    sent = [command.acceleration for command in rig.arm.commands if isinstance(command, SetJointVelocity)]
    assert max(sent) == expected


@pytest.mark.long
def test_a_slow_arm_waits_at_standstill_for_the_place_of_the_touch():
    """At 12 bits a place takes some tens of frames, and this arm stands after ten."""
    rig = GuardRig(touch(0.5, 1.5), reaction=Reaction(kind="retreat"), speed=0.05, bits=12).run(1.7)
    assert rig.event("standstill").time < rig.event("contact_located").time
    assert rig.event("retreating").time >= rig.event("contact_located").time
    assert rig.event("retreated").details["progress"] > 0.01


@pytest.mark.promise("P02")
def test_it_waits_for_no_longer_where_the_place_stays_uncertain():
    both = (touch(0.5, phi=0.5), touch(0.5, phi=5.5))
    rig = GuardRig(*both, reaction=Reaction(kind="retreat"), speed=0.05, bits=12).run(1.0)
    assert rig.core.phase is Phase.LATCHED
    assert "no retreat: the place" in rig.event("latched").details["why"]
    assert 0.3 <= rig.event("latched").time - rig.event("standstill").time < 0.31
    assert not any(isinstance(command, SetJointVelocity) for command in rig.arm.commands)


@pytest.mark.promise("P02")
def test_an_arm_that_moves_while_it_waits_is_stopped():
    both = (touch(0.5, phi=0.5), touch(0.5, phi=5.5))
    rig = GuardRig(*both, reaction=Reaction(kind="retreat"), speed=0.05, bits=12).run(0.55)
    assert rig.names[-1] == "standstill"
    rig.arm.go([0.3, 0, 0, 0, 0, 0], 4.0)
    rig.run(0.1)
    assert rig.names.count("stopping") == 2
    assert "something moved the arm" in [e for e in rig.events if e.name == "stopping"][1].details["why"]


@pytest.mark.long
def test_a_external_arm_is_stopped_by_script_and_follows():
    wide = Reaction(kind="retreat", arm_distance=0.5)
    rig = GuardRig(touch(0.5, 0.9), reaction=wide, external=True, speed=1.0).run(0.45)
    assert rig.core.phase is Phase.ACTIVE
    assert rig.arm.commands == []  # nothing is sent before it is needed
    rig.run(0.052)
    before, normal = rig.point(), rig.normal()
    rig.run(3.0)  # with the watch before it latches
    kinds = [command if isinstance(command, StopPath) else type(command) for command in rig.arm.commands]
    assert kinds[:4] == [
        StopPath.PROGRAM,
        JointVelocitySetpoint,
        SetpointProgram,
        JointVelocitySetpoint,
    ]  # there are speeds before the program starts
    assert kinds[-3:] == [JointVelocitySetpoint, StopPath.PROGRAM, JointVelocitySetpoint]
    assert rig.arm.commands[-1].token == 0  # the speeds count no more, even if the stop were lost
    # 0.5 mm left for braking; ``before`` is one cycle later at up to 0.3 m/s
    assert progress(before, rig.point(), normal) == pytest.approx(0.050, abs=0.002)
    assert rig.event("retreated").details["complete"] is True
    assert rig.core.phase is Phase.LATCHED


@pytest.mark.long
def test_a_program_that_does_not_start_is_not_waited_for():
    rig = GuardRig(touch(0.5, 0.7), external=True, speed=1.0)
    take = rig.arm.feed
    rig.arm.feed = lambda command: None if isinstance(command, SetpointProgram) else take(command)
    rig.run(0.5)
    rig.arm.runtime_state = 1
    rig.run(1.5)
    assert rig.core.phase is Phase.LATCHED
    assert rig.event("retreated").details["why"] == "its program does not run on the controller"
    assert rig.event("retreated").time - rig.event("retreating").time == pytest.approx(0.5, abs=0.005)
    assert rig.event("retreated").details["complete"] is False


@pytest.mark.promise("P30")
@pytest.mark.parametrize("external", [False, True])
@pytest.mark.long
def test_an_arm_that_something_else_moves_is_not_left_to_it(external):
    """A person starts a program while the arm moves away: it replaces ours."""
    rig = GuardRig(touch(0.5, 0.7), external=external, speed=1.0).run(0.75)
    assert rig.core.phase is Phase.RETREATING
    take, ignored = rig.arm.feed, (SetJointVelocity, JointVelocitySetpoint)
    rig.arm.feed = lambda command: None if isinstance(command, ignored) else take(command)
    rig.arm.go([-0.5, 0.2, 0.0, 0.0, 0.0, 0.0], 4.0)
    rig.run(0.7)
    assert "does not move as commanded" in rig.event("retreated").details["why"]
    rig.run(0.3)
    assert rig.core.phase is Phase.LATCHED
    assert max(map(abs, rig.arm.qd)) < 0.01


@pytest.mark.long
def test_a_slow_arm_has_its_time_to_take_up_its_speed():
    reaction = Reaction(kind="retreat", acceleration=0.25, speed=0.3, time_budget=10.0, arm_distance=0.5)
    rig = GuardRig(touch(0.5, 0.7), reaction=reaction, external=True, speed=1.0).run(3.6)
    assert rig.event("retreated").details["complete"] is True


@pytest.mark.long
def test_an_arm_that_its_speed_slider_slows_is_not_something_else():
    patient = Reaction(kind="retreat", time_budget=20.0, arm_distance=0.5)
    rig = GuardRig(touch(0.5, 0.7), reaction=patient, external=True, speed=1.0).run(0.45)
    rig.arm.slider = 0.3
    rig.run(8.0)
    assert rig.event("retreated").details["complete"] is True


def test_a_fault_ends_a_external_retreat():
    rig = GuardRig(touch(0.5, 0.7), external=True, speed=1.0).run(0.75)
    assert rig.core.phase is Phase.RETREATING
    rig.mute_skin = True
    rig.run(1.0)
    assert rig.arm.commands[-2] is StopPath.PROGRAM
    assert rig.core.phase is Phase.LATCHED
    assert max(map(abs, rig.arm.qd)) < 0.01


@pytest.mark.parametrize("acceleration", [0.1, 4.0])
@pytest.mark.long
def test_something_faster_than_it_was_told_is_not_waited_for(acceleration):
    reaction = Reaction(kind="retreat", acceleration=acceleration, time_budget=30.0)
    rig = GuardRig(touch(0.5, 0.7), reaction=reaction, external=True, speed=1.0).run(0.75)
    take = rig.arm.feed
    rig.arm.feed = lambda command: None if isinstance(command, JointVelocitySetpoint) else take(command)
    rig.arm.go([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], 20.0)
    rig.run(0.12)
    assert "does not move as commanded" in rig.event("retreated").details["why"]


def clamped(**settings):
    opposite = touch(0.51, sensor="two", phi=1.57 + math.pi)
    return GuardRig(touch(0.5), opposite, sensors=2, speed=1.0, **settings)


@pytest.mark.promise("P36")
def test_from_touches_on_opposite_sides_it_only_stops():
    rig = clamped().run(0.9)
    assert "retreating" not in rig.names
    assert "touches on opposite sides" in rig.event("latched").details["why"]


def test_a_table_in_the_way_is_named_and_the_arm_stays():
    table = 2.0  # higher than the arm
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="retreat", distance=0.08), table=table, speed=1.0).run(1.5)
    assert "the table at 2000 mm is in the way" in rig.event("latched").details["why"]


@pytest.mark.promise("P37")
def test_from_a_second_hand_behind_it_stays():
    hands = touch(0.5, 0.65), touch(0.7, 1.5, sensor="two", phi=1.57 + math.pi)
    reaction = Reaction("retreat", distance=0.08, arm_distance=0.3)
    rig = GuardRig(*hands, reaction=reaction, sensors=2, speed=1.0, follows=True).run(0.9)
    assert rig.names.count("retreating") == 1
    assert rig.core.phase is Phase.LATCHED
    assert rig.names.count("stopping") == 2


@pytest.mark.promise("P33")
def test_where_a_bare_side_may_lead_it_is_slow():
    q, near_shoulder = (0.0, -1.2, 1.5, -1.6, -1.5, 0.3), ContactOnLink(2, (0.3, 0.06, 0.1), (0.0, 1.0, 0.0), 0.9)
    bare, out = BareSides(MODEL, []), []
    planner = ReactionPlanner(MODEL, bare=bare)
    planner.torque.now = tuple(5.0 * turn for turn in _push_torque(MODEL, q, near_shoulder))
    here = ArmState(0.0, q)
    motion = planner.begin(Reaction("retreat", bare_side="allowed"), here, here, [near_shoulder], out)
    for k in range(100):
        now = 0.002 * (k + 1)
        state = ControllerState(now, now, q, ZERO_VELOCITY, True, False, True)
        assert motion.update(state, [near_shoulder], out) is None
    qd = next(one.qd for one in reversed(out) if isinstance(one, SetJointVelocity))
    way, _ = bare.way(q, [a + 0.01 * v for a, v in zip(q, qd, strict=True)])
    assert way / 0.01 == pytest.approx(0.008, rel=0.02)
