"""Reactions by rule, an external arm, fallbacks, lateness: on a virtual skin and a mocked arm, in virtual time."""

import math

import pytest

from coneskin.errors import RobotConnectionError
from coneskin.recording import Block
from coneskin.robot.arm.workspace import TablePlane
from coneskin.robot.driver.messages import EndReaction, SetJointVelocity, StopProgram
from coneskin.robot.driver.setpoint import JointVelocitySetpoint, SetpointProgram, SetSpeedSlider
from coneskin.robot.driver.stop_path import StopPath, UseStopPath
from coneskin.robot.guard.journal import BlockKind
from coneskin.robot.guard.phase import Phase
from coneskin.robot.reaction.rules import Rule
from coneskin.robot.reaction.types import Reaction
from coneskin.robot.ur.speed_slider import decode_fraction
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.testing.guard_rig import LINK, MODEL, SLIDER, GuardRig, felt, make_core, touch

from ...sweep import sweep

SLOW = Reaction(kind="slow", slow_to=0.2, time_budget=1.0, press=0.1)  # how far it presses is not the matter here


def progress(before, after, normal):
    return sum((b - a) * -n for a, b, n in zip(before, after, normal, strict=True))


# ---- slow


def test_slow_while_it_is_touched_then_as_before():
    rig = GuardRig(touch(0.5, 0.8), reaction=SLOW, speed=1.0).run(0.45)
    assert rig.arm.qd[0] == pytest.approx(1.0)
    rig.run(0.4)
    assert rig.core.phase is Phase.SLOWED
    assert rig.arm.qd[0] == pytest.approx(0.2)
    rig.run(0.9)
    assert rig.core.phase is Phase.ACTIVE
    assert rig.arm.qd[0] == pytest.approx(1.0)
    assert [command for command in rig.arm.commands if isinstance(command, SetSpeedSlider)] == [
        SetSpeedSlider(0.2),
        SetSpeedSlider(1.0),
    ]
    assert rig.names == ["activated", "speed_reduced", "contact", "contact_located", "touch_ended", "resumed"]
    assert not any(isinstance(command, StopProgram | StopPath) for command in rig.arm.commands)


def test_a_slider_that_was_low_already_is_not_raised():
    rig = GuardRig(touch(0.5, 0.8), reaction=SLOW, speed=1.0)
    rig.arm.slider = 0.15
    rig.run(1.6)
    assert [command.fraction for command in rig.arm.commands if isinstance(command, SetSpeedSlider)] == [0.15, 0.15]


def test_an_arm_that_does_not_become_slower_is_stopped():
    rig = GuardRig(touch(0.5, 0.9), reaction=SLOW, speed=1.0)
    rig.arm.heeds = False
    rig.run(1.5)
    assert rig.core.phase is Phase.LATCHED
    assert "did not become slower" in rig.event("stopping").details["why"]
    # 1 rad/s at 10 rad/s2, and four times 25 ms
    assert rig.event("stopping").time - rig.event("speed_reduced").time == pytest.approx(0.2, abs=0.002)
    assert rig.arm.commands[-1] == SetSpeedSlider(1.0)  # where it was before


def test_a_touch_that_lasts_too_long_stops():
    rig = GuardRig(touch(0.5), reaction=SLOW, speed=1.0).run(2.0)
    assert rig.core.phase is Phase.LATCHED
    assert "lasts too long" in rig.event("stopping").details["why"]
    assert not any(isinstance(command, SetJointVelocity) for command in rig.arm.commands)


def test_a_fault_while_slow_stops():
    rig = GuardRig(touch(0.5), reaction=SLOW, speed=1.0).run(0.6)
    assert rig.core.phase is Phase.SLOWED
    rig.mute_skin = True
    rig.run(0.5)
    assert rig.core.phase is Phase.LATCHED


def test_a_firmer_touch_while_slow_gets_its_own_reaction():
    light = Reaction(kind="slow", time_budget=5.0)
    firm = Rule(Reaction(kind="retreat", distance=0.03), level_above=0.5)
    rig = GuardRig(touch(0.5, 1.5), reaction=light, rules=(firm,), speed=1.0).run(2.5)
    assert rig.names[:2] == ["activated", "stopping"] or rig.names[:3] == ["activated", "speed_reduced", "contact"]
    assert "retreated" in rig.names
    assert rig.core.phase is Phase.LATCHED


def test_without_a_slider_there_is_no_arming():
    rig = GuardRig(reaction=SLOW)
    core = make_core(list(rig.skin.sensors), SLOW)
    assert any("speed slider" in line for line in core.blockers(0.0))
    rig.run(0.5)
    rig.feed(BlockKind.LOST, b"slider\nthe controller has closed the connection of its speed slider")
    rig.run(0.3)
    assert rig.core.phase is Phase.LATCHED


# ---- rules


def test_the_first_rule_that_fits_is_the_reaction():
    rules = (Rule(Reaction(kind="stop"), link=1), Rule(Reaction(kind="stop"), speed_above=0.5, link=LINK))
    fast = GuardRig(touch(0.5, 0.7), rules=rules, speed=1.0).run(1.5)
    assert "retreating" not in fast.names
    slow = GuardRig(touch(0.5, 0.7), rules=rules, speed=0.3).run(1.5)
    assert "retreating" in slow.names


def test_how_firm_a_touch_is_shows_while_the_arm_stops():
    """In the frame in which it begins it is light; the rule for firm ones is met some frames later, in time."""
    rule = Rule(Reaction(kind="stop"), level_above=0.3)
    rig = GuardRig(touch(0.5, 0.9), rules=(rule,), speed=1.0).run(1.5)
    assert "retreating" not in rig.names
    assert rig.core.phase is Phase.LATCHED


# ---- comply


def comply(**settings):
    return Reaction(kind="comply", speed=0.1, distance=0.04, arm_distance=0.5, **settings)


@pytest.mark.parametrize("external", [False, True])
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


def test_it_gives_way_no_farther_than_its_distance():
    rig = GuardRig(touch(0.5), reaction=comply(), speed=1.0).run(3.0)
    assert rig.core.phase is Phase.LATCHED
    assert rig.event("retreated").details["why"] == "the distance is made"
    assert rig.event("retreated").details["progress"] == pytest.approx(0.04, abs=0.001)


def test_no_longer_than_its_time():
    rig = GuardRig(touch(0.5), reaction=comply(time_budget=0.1), speed=1.0).run(2.0)
    assert "the time of 0.1 s is over" in rig.event("retreated").details["why"]


def test_a_harder_rule_ends_it():
    rules = (Rule(Reaction(kind="stop"), level_above=0.99),)
    rig = GuardRig(touch(0.5), reaction=comply(), rules=rules, speed=1.0).run(0.7)
    assert rig.core.phase is Phase.RETREATING
    rig.core._arm.touch(rig.now, felt(1.0), False, [])
    assert rig.core.phase is Phase.HALTING


# ---- a place that needs time


def test_a_slow_arm_waits_at_standstill_for_the_place_of_the_touch():
    """At 12 bits a place takes some tens of frames, and this arm stands after ten."""
    rig = GuardRig(touch(0.5, 1.5), reaction=Reaction(kind="retreat"), speed=0.05, bits=12).run(2.5)
    assert rig.event("standstill").time < rig.event("contact_located").time
    assert rig.event("retreating").time >= rig.event("contact_located").time
    assert rig.event("retreated").details["progress"] > 0.01


def test_it_waits_for_no_longer_where_the_place_stays_uncertain():
    both = (touch(0.5, phi=0.5), touch(0.5, phi=5.5))
    rig = GuardRig(*both, reaction=Reaction(kind="retreat"), speed=0.05, bits=12).run(1.5)
    assert rig.core.phase is Phase.LATCHED
    assert "no retreat: the place" in rig.event("latched").details["why"]
    assert 0.3 <= rig.event("latched").time - rig.event("standstill").time < 0.31
    assert not any(isinstance(command, SetJointVelocity) for command in rig.arm.commands)


def test_an_arm_that_moves_while_it_waits_is_stopped():
    both = (touch(0.5, phi=0.5), touch(0.5, phi=5.5))
    rig = GuardRig(*both, reaction=Reaction(kind="retreat"), speed=0.05, bits=12).run(0.55)
    assert rig.names[-1] == "standstill"
    rig.arm.go([0.3, 0, 0, 0, 0, 0], 4.0)
    rig.run(0.1)
    assert rig.names.count("stopping") == 2
    assert "something moved the arm" in [e for e in rig.events if e.name == "stopping"][1].details["why"]


# ---- external


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


def test_a_program_that_does_not_start_is_not_waited_for():
    rig = GuardRig(touch(0.5, 0.7), external=True, speed=1.0)
    take = rig.arm.take
    rig.arm.take = lambda command: None if isinstance(command, SetpointProgram) else take(command)
    rig.run(0.5)
    rig.arm.runtime_state = 1
    rig.run(2.0)
    assert rig.core.phase is Phase.LATCHED
    assert rig.event("retreated").details["why"] == "its program does not run on the controller"
    assert rig.event("retreated").details["complete"] is False


@pytest.mark.parametrize("external", [False, True])
def test_an_arm_that_something_else_moves_is_not_left_to_it(external):
    """A person starts a program while the arm moves away: it replaces ours."""
    rig = GuardRig(touch(0.5, 0.7), external=external, speed=1.0).run(0.75)
    assert rig.core.phase is Phase.RETREATING
    take, ignored = rig.arm.take, (SetJointVelocity, JointVelocitySetpoint)
    rig.arm.take = lambda command: None if isinstance(command, ignored) else take(command)
    rig.arm.go([-0.5, 0.2, 0.0, 0.0, 0.0, 0.0], 4.0)
    rig.run(0.7)
    assert "does not move as commanded" in rig.event("retreated").details["why"]
    rig.run(0.3)
    assert rig.core.phase is Phase.LATCHED
    assert max(map(abs, rig.arm.qd)) < 0.01


def test_a_slow_arm_has_its_time_to_take_up_its_speed():
    reaction = Reaction(kind="retreat", acceleration=0.25, speed=0.3, time_budget=10.0, arm_distance=0.5)
    rig = GuardRig(touch(0.5, 0.7), reaction=reaction, external=True, speed=1.0).run(5.0)
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


def slow_first(kind="retreat", **settings):
    """Slow, but retreat or comply where the touch is firm."""
    harder = Rule(Reaction(kind=kind, arm_distance=0.5, **settings), level_above=0.5)
    return {"reaction": SLOW, "rules": (harder,)}


@pytest.mark.parametrize("external", [False, True])
@pytest.mark.parametrize("speed", sweep([1.0, 0.15]))
def test_from_slow_to_retreat_the_slider_is_back_before_the_arm_moves_away(external, speed):
    firm = ScriptedTouch(0.5, 1.5, 0.13, 1.57, rise=0.05)
    rig = GuardRig(firm, external=external, speed=speed, **slow_first()).run(4.0)
    order = [name for name in rig.names if name in ("speed_reduced", "stopping", "standstill", "retreating", "latched")]
    assert order == ["speed_reduced", "stopping", "standstill", "retreating", "standstill", "latched"]
    assert rig.event("retreated").details["complete"] is True
    assert rig.arm.slider == 1.0
    assert rig.event("retreated").time - rig.event("retreating").time < 2.0  # at its own speed, not at a fifth of it
    assert "resumed" not in rig.names


def test_a_second_touch_ends_a_retreat_that_began_slow():
    firm = ScriptedTouch(0.5, 1.0, 0.13, 1.57, rise=0.05)
    rig = GuardRig(firm, speed=1.0, sensors=2, **slow_first(distance=0.3, time_budget=10.0)).run(0.8)
    assert rig.core.phase is Phase.RETREATING
    rig.core._arm.touch(rig.now, felt(0.2, 2), True, [])
    assert rig.core.phase is Phase.HALTING


def test_a_slider_that_was_not_heard_for_long_is_not_known():
    rig = GuardRig(touch(1.5), reaction=Reaction(kind="slow", slow_to=0.5), speed=1.0).run(0.5)
    rig.feed(BlockKind.SLIDER, SLIDER.pack((1.0,)))
    feed = rig.feed
    rig.feed = lambda kind, payload=b"": [] if kind is BlockKind.SLIDER else feed(kind, payload)
    rig.run(1.5)
    assert "speed_reduced" not in rig.names  # it might raise a slider that somebody has lowered
    assert rig.core.phase is Phase.LATCHED
    rig.feed = feed
    with pytest.raises(RobotConnectionError, match="from 0 to 1"):
        decode_fraction(SLIDER.pack((math.nan,)))


def test_a_person_who_slows_the_arm_further_is_not_overruled():
    rig = GuardRig(touch(0.5, 0.8), reaction=SLOW, speed=1.0).run(0.7)
    rig.arm.slider = 0.05
    rig.run(2.0)
    assert "resumed" in rig.names
    assert rig.arm.slider == 0.05


def test_a_stop_just_after_it_slowed_leaves_no_slider_low():
    rig = GuardRig(ScriptedTouch(0.5, 1.0, 0.13, 1.57, force=1.0), speed=0.02, **slow_first("stop"))
    while "speed_reduced" not in rig.names:
        rig.run(0.001)
    out = []
    rig.core._arm.touch(rig.now, felt(0.9), False, out)
    assert isinstance(out[0], StopProgram)
    rig.arm.take(out[0])
    rig.run(1.0)
    assert rig.core.phase is Phase.LATCHED
    assert rig.arm.slider == 1.0


@pytest.mark.parametrize("later", sweep([0.006, 0.001, 0.02, 0.1]))
def test_touched_again_as_it_goes_on_it_is_slow_again(later):
    first = GuardRig(touch(0.5, 1.0), reaction=SLOW, speed=2.0).run(2.0)
    resumed = round(first.event("resumed").time - 100.0, 3)
    again = touch(resumed + later, resumed + 0.5)
    rig = GuardRig(touch(0.5, 1.0), again, reaction=SLOW, speed=2.0).run(4.0)
    assert "stopping" not in rig.names
    assert rig.names.count("resumed") == 2
    assert rig.arm.slider == 1.0


def test_a_rules_deceleration_is_that_of_the_stop_in_external_mode_too():
    rule = Rule(Reaction(kind="stop", deceleration=20.0), speed_above=0.1)
    rig = GuardRig(
        touch(0.5), reaction=Reaction(kind="stop", deceleration=1.0), rules=(rule,), external=True, speed=1.0
    )
    rig.run(1.0)
    assert [output for output in rig.outputs if isinstance(output, UseStopPath)] == [
        UseStopPath(StopPath.PROGRAM, 20.0)
    ]


@pytest.mark.parametrize("acceleration", [0.1, 4.0])
def test_something_faster_than_it_was_told_is_not_waited_for(acceleration):
    reaction = Reaction(kind="retreat", acceleration=acceleration, time_budget=30.0)
    rig = GuardRig(touch(0.5, 0.7), reaction=reaction, external=True, speed=1.0).run(0.75)
    take = rig.arm.take
    rig.arm.take = lambda command: None if isinstance(command, JointVelocitySetpoint) else take(command)
    rig.arm.go([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], 20.0)
    rig.run(0.12)
    assert "does not move as commanded" in rig.event("retreated").details["why"]


@pytest.mark.parametrize(
    ("lost", "first"), [("program", StopPath.COMMAND), ("command", StopPath.PROGRAM), ("watchdog", StopPath.PROGRAM)]
)
def test_a_way_that_is_lost_is_not_tried(lost, first):
    rig = GuardRig(external=True, speed=1.0).run(0.5)
    rig.feed(BlockKind.LOST, f"{lost}\nit is gone".encode())
    rig.run(1.0)
    assert rig.arm.commands == [first]
    assert rig.core.phase is Phase.LATCHED
    rig.reset()
    assert "it is gone" in rig.event("refused").details["reasons"]


def test_with_its_own_connections_gone_at_once_the_guard_asks_the_watchdog():
    """What went to the dashboard between the two is lost, and nothing says so."""
    rig = GuardRig(external=True, speed=1.0, obeys=frozenset({StopPath.WATCHDOG})).run(0.5)
    rig.feed(BlockKind.LOST, b"program\ngone")
    rig.feed(BlockKind.LOST, b"command\ngone")
    rig.run(1.0)
    assert rig.arm.commands == [StopPath.COMMAND, StopPath.SLIDER, StopPath.WATCHDOG]
    assert rig.core.phase is Phase.LATCHED


def test_with_no_way_left_it_says_that_it_waits():
    rig = GuardRig(external=True, speed=1.0).run(0.5)
    for name in ("program", "command", "slider", "watchdog"):
        rig.feed(BlockKind.LOST, f"{name}\ngone".encode())
    rig.arm.heeds = False
    rig.arm.go([1.0, 0, 0, 0, 0, 0], 100.0)
    rig.run(1.0)
    assert rig.core.phase is Phase.STOPPING
    assert "standstill" not in rig.names


@pytest.mark.parametrize("external", [False, True])
def test_a_latched_arm_that_a_program_moves_is_stopped_again(external):
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), external=external, speed=1.0).run(1.5)
    assert rig.core.phase is Phase.LATCHED
    rig.arm.go([1.0, 0, 0, 0, 0, 0], 4.0)
    rig.run(0.02)
    assert rig.core.phase is Phase.LATCHED  # 0.05 rad/s, five samples long
    rig.run(1.2)
    assert rig.core.phase is Phase.LATCHED
    assert rig.names.count("latched") == 2
    assert max(map(abs, rig.arm.qd)) < 0.01


def test_an_externally_controlled_arm_is_latched_at_the_end_of_a_watch():
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), external=True, speed=1.0).run(1.2)
    standing = rig.event("standstill").time
    assert rig.core.phase is Phase.STOPPING  # a program may start again at once
    rig.arm.go([1.0, 0, 0, 0, 0, 0], 4.0)
    rig.run(0.6)
    assert "latched" not in rig.names
    assert rig.names.count("stopping") == 2
    rig.run(0.6)
    assert rig.core.phase is Phase.LATCHED
    assert rig.event("latched").time - standing > 0.7
    ours = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), speed=1.0).run(1.2)
    assert ours.event("latched").time == ours.event("standstill").time  # nothing else can start there


def test_a_program_that_starts_during_the_watch_and_does_not_move_yet_lengthens_it():
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), external=True, speed=1.0).run(0.8)
    rig.arm.runtime_state = 1
    rig.run(0.3)
    rig.arm.runtime_state = 2
    rig.run(0.6)
    assert rig.core.phase is Phase.STOPPING
    rig.run(0.2)
    assert rig.core.phase is Phase.LATCHED


def test_programs_that_start_again_and_again_without_a_motion_end_in_a_protective_stop():
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), external=True, speed=1.0).run(0.8)
    for _ in range(3):
        assert StopPath.PROTECTIVE not in rig.arm.commands
        rig.arm.runtime_state = 1
        rig.run(0.1)
        rig.arm.runtime_state = 2
        rig.run(0.1)
    assert StopPath.PROTECTIVE in rig.arm.commands
    assert rig.core.phase is Phase.LATCHED  # the controller shows it
    assert "a program started again and again" in rig.event("latched").details["why"]


def test_a_program_that_starts_a_second_time_gets_a_protective_stop_until_the_controller_shows_it():
    obeys = frozenset(StopPath) - {StopPath.PROTECTIVE}
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), external=True, speed=1.0, obeys=obeys).run(0.8)
    for _ in range(2):
        assert StopPath.PROTECTIVE not in rig.arm.commands
        rig.arm.go([1.0, 0, 0, 0, 0, 0], 4.0)
        rig.run(0.3)
    assert rig.arm.commands.count(StopPath.PROTECTIVE) > 1  # it stands, but not by that
    assert rig.core.phase is Phase.STOPPING
    rig.arm.safety_bits = 0b10000000100
    rig.run(0.01)
    assert rig.core.phase is Phase.LATCHED
    count = rig.arm.commands.count(StopPath.PROTECTIVE)
    rig.run(1.0)
    assert rig.arm.commands.count(StopPath.PROTECTIVE) == count


def test_while_it_is_touched_the_first_program_that_starts_again_gets_a_protective_stop():
    rig = GuardRig(touch(0.5), reaction=Reaction(kind="stop"), external=True, speed=1.0).run(0.8)
    assert StopPath.PROTECTIVE not in rig.arm.commands
    rig.arm.go([1.0, 0, 0, 0, 0, 0], 4.0)
    rig.run(0.1)
    assert rig.arm.commands[-1] is StopPath.PROTECTIVE
    assert rig.core.phase is Phase.LATCHED  # the controller shows it


def test_a_protective_stop_that_never_shows_is_said():
    obeys = frozenset(StopPath) - {StopPath.PROTECTIVE}
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), external=True, speed=1.0, obeys=obeys).run(0.8)
    for _ in range(2):
        rig.arm.go([1.0, 0, 0, 0, 0, 0], 4.0)
        rig.run(0.3)
    rig.run(1.0)
    assert "does not show the protective stop" in rig.event("latched").details["why"]


def test_a_slider_at_0_is_put_back_by_a_reset_and_by_nothing_else():
    obeys = frozenset({StopPath.SLIDER})
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), external=True, speed=1.0, obeys=obeys)
    rig.arm.slider = 0.6
    for _ in range(40):  # 50 times a second
        rig.run(0.02)
        rig.feed(BlockKind.SLIDER, SLIDER.pack((rig.arm.slider,)))
    assert rig.arm.slider == 0.0
    rig.run(1.5)
    assert rig.core.phase is Phase.LATCHED
    rig.feed(BlockKind.SLIDER, SLIDER.pack((rig.arm.slider,)))
    assert not any(isinstance(output, SetSpeedSlider) for output in rig.outputs)
    rig.arm.target = None
    rig.reset()
    rig.run(0.3)
    assert rig.core.phase is Phase.ACTIVE
    assert [output for output in rig.outputs if isinstance(output, SetSpeedSlider)] == [SetSpeedSlider(0.6)]


@pytest.mark.parametrize("anew", [False, True])
def test_a_touched_arm_that_creeps_is_stopped_after_two_millimetres_however_often_the_program_starts(anew):
    rig = GuardRig(touch(0.5), reaction=Reaction(kind="stop"), external=True).run(1.5)
    assert rig.core.phase is Phase.LATCHED
    at = rig.arm.q[0]
    for number in range(400):
        if rig.arm.safety_bits != 1:
            break
        rig.arm.runtime_state = 1 if anew and number % 5 == 0 else 2  # between two programs
        rig.arm.go([0.0095, 0, 0, 0, 0, 0], 10.0)
        rig.run(0.02)
    assert StopPath.PROTECTIVE in rig.arm.commands
    assert abs(rig.arm.q[0] - at) < 0.004  # it was 0.06 rad, and without end where it starts anew


def test_a_person_may_jog_a_latched_arm():
    rig = GuardRig(touch(0.5), reaction=Reaction(kind="stop"), external=True).run(1.5)
    rig.arm.runtime_state = 1
    rig.arm.go([0.2, 0, 0, 0, 0, 0], 10.0)
    rig.run(1.0)
    assert rig.core.phase is Phase.LATCHED
    assert rig.names.count("stopping") == 1


# ---- where no retreat along the normal is possible


def clamped(**settings):
    opposite = touch(0.51, sensor="two", phi=1.57 + math.pi)
    return GuardRig(touch(0.5), opposite, sensors=2, speed=1.0, **settings)


def test_back_along_the_path_only_where_the_scene_asks_and_nothing_is_pressed():
    assert "retreating" not in clamped().run(1.5).names
    pressed = clamped(reaction=Reaction(kind="retreat", fallback="path")).run(1.5)  # one of the two is in the way
    assert "touches on opposite sides" in pressed.event("latched").details["why"]


def test_back_along_the_path_where_the_place_is_not_known():
    """The retreat is refused by the table, which stands higher than the arm; the way back is level."""
    table = TablePlane(2.0)
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="retreat", distance=0.08), table=table, speed=1.0).run(1.5)
    assert "the table at 2000 mm is in the way" in rig.event("latched").details["why"]
    back = GuardRig(
        touch(0.5, 0.7), reaction=Reaction(kind="retreat", distance=0.08, fallback="path"), table=table, speed=1.0
    ).run(0.49)
    was = list(back.arm.q)
    back.run(2.0)
    event = back.event("retreated").details
    assert back.event("retreating").details == {"how": "path"}
    assert event["complete"] is True
    assert back.arm.q[1:] == pytest.approx(was[1:], abs=1e-6)  # only joint 1 had moved
    # brakes from 1 rad/s at 10 rad/s2: 0.05 rad; 80 mm at the arm's reach, which bounds the way of every point
    from coneskin.robot.arm.joint_limits import reach

    assert was[0] + 0.05 + 0.012 - back.arm.q[0] == pytest.approx(0.079 / reach(MODEL)[0], abs=0.01)


def test_an_arm_that_stood_does_not_go_back():
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="retreat", fallback="path"), table=TablePlane(2.0)).run(1.5)
    assert "the arm stood when it was touched" in rig.event("latched").details["why"]


# ---- lateness


def late_burst(rig, seconds):
    """The guard is held up: frames and states wait, and come all at once, each kind together."""
    skin, states = [], []
    for step in range(round(1000 * seconds)):
        rig.now += 0.001
        skin.append(next(rig._packets)[1])
        if step % 2 == 0:
            states.append(rig.arm.step())
    return skin, states


def test_states_that_waited_are_no_reason_for_another_way():
    """A touch is read after 40 ms without the processor; 20 states from before the stop are read after it."""
    rig = GuardRig(touch(0.5, 0.7), speed=1.0).run(0.49)
    skin, states = late_burst(rig, 0.04)
    rig.feed(BlockKind.SKIN, b"".join(skin))
    assert isinstance(rig.arm.commands[-1], StopProgram)
    for state in states:
        rig.feed(BlockKind.ARM, state)
    rig.run(0.5)
    assert not any(isinstance(command, StopPath) for command in rig.arm.commands)
    assert rig.event("standstill").details["paths"] == ["driver"]


def test_a_guard_that_is_held_up_during_a_stop_looks_before_it_escalates():
    rig = GuardRig(touch(0.5, 0.7), speed=1.0).run(0.503)
    assert isinstance(rig.arm.commands[-1], StopProgram)
    skin, states = late_burst(rig, 0.04)
    for state in states:  # the loop reads them first while a stop is under way
        rig.feed(BlockKind.ARM, state)
    rig.feed(BlockKind.SKIN, b"".join(skin))
    rig.run(0.3)
    assert not any(isinstance(command, StopPath) for command in rig.arm.commands)


def test_a_stop_that_does_not_work_is_seen_in_late_states_too():
    rig = GuardRig(touch(0.5, 0.7), speed=1.0, obeys=frozenset([StopPath.PROGRAM])).run(0.503)
    _, states = late_burst(rig, 0.04)
    for state in states:
        rig.feed(BlockKind.ARM, state)
    assert rig.arm.commands[-1] is StopPath.PROGRAM


def test_a_controller_that_repeats_itself_is_silent():
    rig = GuardRig(speed=1.0).run(0.5)
    state = rig.arm.step()
    rig.mute_arm = True
    for _ in range(200):
        rig.run(0.002)
        rig.feed(BlockKind.ARM, state)
    assert "has sent no state for 50 ms" in rig.event("stopping").details["why"]
    assert StopPath.PROTECTIVE in rig.arm.commands


def test_the_wall_clock_is_no_part_of_it(monkeypatch):
    """Nothing in the guard asks for the time of day: a clock that jumps by a year changes nothing."""
    import time

    def jumped() -> float:
        raise AssertionError("the time of day was asked for")

    monkeypatch.setattr(time, "time", jumped)
    rig = GuardRig(touch(0.5, 0.7), speed=1.0).run(2.0)
    assert rig.core.phase is Phase.LATCHED


@pytest.mark.parametrize(
    "settings",
    sweep(
        [
            {"reaction": comply()},
            {"reaction": SLOW},
            {"external": True},
            {"reaction": Reaction(kind="retreat", fallback="path")},
        ]
    ),
)
def test_the_same_inputs_give_the_same_run_bit_by_bit(settings):
    rig = GuardRig(touch(0.5, 0.7), speed=1.0, **settings).run(2.5)
    again = make_core(
        list(rig.skin.sensors), settings.get("reaction", Reaction(kind="retreat")), external="external" in settings
    )
    outputs: list[object] = []
    for block in rig.blocks:
        again.take(Block(*block), outputs)
    assert [repr(output) for output in outputs] == [repr(output) for output in rig.outputs]
    assert any(isinstance(output, EndReaction | SetSpeedSlider | SetpointProgram) for output in outputs)
