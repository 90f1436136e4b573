"""Activation of a guard, at its start and after a manual reset: what stands against it, and what refuses it."""

import pytest

from coneskin.robot.driver.messages import Release
from coneskin.robot.guard.activation import Activation, ActivationStep
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.journal import BlockKind, GuardEvent
from coneskin.robot.reaction.types import Reaction
from coneskin.skin.virtual.circuit import WiringFaults
from coneskin.skin.virtual.fault_injection import FaultInjection
from tests.support.exploration.guard_world import GuardWorld, Settings
from tests.support.guard_rig import GuardRig, touch


@pytest.mark.promise("P61")
def test_nothing_moves_before_everything_is_sound():
    rig = GuardRig(touch(0.0, 0.3), speed=1.0)  # touched from the start
    rig.run(0.29)
    assert rig.core.phase is Phase.STARTING
    assert not any(isinstance(output, Release) for output in rig.outputs)
    assert any("it is touched" in reason for reason in rig.core.blockers(rig.now))
    rig.run(0.3)
    assert rig.core.phase is Phase.ACTIVE
    assert [type(o) for o in rig.outputs if not isinstance(o, GuardEvent)] == [Release]


@pytest.mark.promise("P61")
@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (lambda rig: setattr(rig.arm, "safety_bits", 0b100), "the controller's own safety system holds the arm"),
        (lambda rig: setattr(rig.arm, "robot_mode", 5), "not powered, or its brakes"),
        (lambda rig: rig.arm.q.__setitem__(2, 3.5), "joint 3 must be within -3.142 to 3.142 rad, it is at 3.500 rad"),
        (lambda rig: setattr(rig, "mute_arm", True), "the controller is silent"),
        (lambda rig: setattr(rig, "mute_skin", True), "one: waits for its first valid frame; if none comes"),
    ],
)
def test_it_refuses_to_arm_and_says_why(spoil, reason):
    rig = GuardRig()
    spoil(rig)
    rig.run(1.2)
    assert rig.core.phase is Phase.STARTING
    assert any(reason in line for line in rig.event("waiting").details["reasons"])


def test_a_short_from_the_start_is_named_although_no_valid_frame_came():
    shorted = FaultInjection(wiring=WiringFaults(shorts=(("A", "B"),)), wiring_after=0)
    rig = GuardRig(faults=shorted).run(1.2)
    assert any("one: no valid frame (too much drive" in line for line in rig.event("waiting").details["reasons"])


def test_what_holds_of_several_sensors_is_said_once():
    reasons = GuardWorld(Settings(sensors=2)).core.blockers(0.0)
    assert reasons[0] == "one, two: waits for its first valid frame; if none comes, check power and cable"
    assert not any("frame" in reason for reason in reasons[1:])


def test_a_sensor_that_falls_silent_is_said_to_in_one_sentence():
    world = GuardWorld(Settings())
    world.act("wait")
    world.act("skin mute")
    world.act("wait for a change")
    assert "one: no valid frame has come for too long: check power, cable and frame rate" in world.core.blockers(
        world.now
    )


def test_only_the_number_of_the_release_that_waits_is_its_acknowledgement():
    activation = Activation(settle=0.1)
    assert not activation.acknowledged(activation.number)
    steps = [activation.poll(0.05 * k, [], []) for k in range(4)]
    assert steps[2:] == [ActivationStep.RELEASE, ActivationStep.WAIT]
    assert [activation.acknowledged(number) for number in range(3)] == [False, True, False]
    assert activation.poll(0.2, ["it is touched"], []) is ActivationStep.WITHDRAW
    assert not activation.acknowledged(activation.number)


def test_reset_needs_a_person_and_a_free_skin():
    rig = GuardRig(touch(0.5, 2.0), reaction=Reaction(kind="stop"), speed=1.0).run(1.0)
    rig.reset()
    assert any("it is touched" in reason for reason in rig.event("refused").details["reasons"])
    rig.run(3.0)
    assert rig.core.phase is Phase.LATCHED  # free again, but nobody has reset it
    rig.reset()
    rig.run(0.09)
    assert rig.core.phase is Phase.LATCHED  # until everything has been sound for a while
    rig.arm.target = None
    rig.run(0.3)
    assert rig.core.phase is Phase.ACTIVE
    assert rig.names.count("activated") == 2
    rig.reset()
    assert "nothing to reset" in rig.events[-1].details["reasons"][0]


def reset(*touches, **settings):
    """A rig that has stopped for a touch at 0.5 s, and was reset at 1.5 s."""
    rig = GuardRig(touch(0.5, 0.7), *touches, reaction=Reaction(kind="stop"), speed=1.0, **settings).run(1.5)
    assert rig.core.phase is Phase.LATCHED
    rig.reset()
    return rig


def test_a_reset_again_and_again_arms_no_later():
    rig = reset()
    for _ in range(4):
        rig.run(0.03)
        rig.reset()
    assert rig.core.phase is Phase.ACTIVE


@pytest.mark.promise("P63")
def test_a_touch_while_a_reset_settles_refuses_it():
    rig = reset(touch(1.52, 1.8)).run(0.5)
    assert rig.core.phase is Phase.LATCHED
    assert any("it is touched" in reason for reason in rig.event("refused").details["reasons"])
    assert rig.names.count("activated") == 1


@pytest.mark.long
def test_a_fault_while_a_reset_settles_refuses_it_for_good():
    rig = reset()
    rig.run(0.02)
    rig.mute_skin = True
    rig.run(0.3)
    assert any("no valid frame" in reason for reason in rig.event("refused").details["reasons"])
    rig.mute_skin = False
    rig.run(0.6)
    assert rig.core.phase is Phase.LATCHED  # sound again, but nobody has reset it since


@pytest.mark.promise("P63")
def test_an_arm_that_moves_while_a_reset_settles_is_stopped():
    rig = reset()
    rig.run(0.02)
    rig.arm.go([0.5, 0, 0, 0, 0, 0], 10.0)
    rig.run(1.0)
    assert rig.core.phase is Phase.LATCHED
    assert "something has moved the arm" in rig.event("refused").details["reasons"][-1]
    assert max(map(abs, rig.arm.qd)) < 0.01


@pytest.mark.long
def test_a_fault_of_the_line_that_goes_on_is_reported_after_a_reset_again():
    rig = reset()
    rig.run(0.3)
    assert rig.core.phase is Phase.ACTIVE
    for number in (1, 2):
        for _ in range(100):
            rig.feed(BlockKind.SKIN, bytes(200))
            rig.run(0.001)
        assert rig.core.phase in (Phase.STOPPING, Phase.LATCHED)
        assert sum("skipped" in str(event.details.get("what")) for event in rig.events) == number
        rig.run(0.5)
        rig.reset()


def test_a_touch_that_came_and_went_within_one_read_refuses_a_reset():
    rig = reset(touch(1.51, 1.53))
    late = b"".join([next(rig._packets)[1] for _ in range(60)])
    rig.now += 0.04  # held up: what has come meanwhile is read at once
    rig.feed(BlockKind.ARM, rig.arm.poll())
    rig.feed(BlockKind.SKIN, late)
    rig.run(0.5)
    assert rig.core.phase is Phase.LATCHED
    assert "it was touched meanwhile" in rig.event("refused").details["reasons"]


def test_what_is_lost_stays_lost():
    rig = GuardRig(speed=1.0).run(0.5)
    rig.feed(BlockKind.LOST, b"controller\nthe controller is gone")
    rig.run(0.5)
    rig.reset()
    assert "the controller is gone" in rig.event("refused").details["reasons"]


def test_a_release_has_4_s_to_be_acknowledged_and_what_is_waited_for_is_listed_twice_a_second():
    activation = Activation(settle=0.0)
    steps = [activation.poll(now, [], []) for now in (0.0, 3.9, 4.1)]
    assert steps == [ActivationStep.RELEASE, ActivationStep.WAIT, ActivationStep.WITHDRAW]
    activation, counts = Activation(settle=0.0), []
    for now in (0.0, 0.45, 0.55):
        activation.poll(now, ["it is touched"], out := [])
        counts.append(len(out))
    assert counts == [0, 0, 1]
