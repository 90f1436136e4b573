"""Slow reaction of an arm under guard: on a virtual skin and a mocked arm, in virtual time."""

import math

import pytest

from coneskin.core.errors import RobotConnectionError
from coneskin.robot.driver.messages import SetJointVelocity, StopProgram
from coneskin.robot.driver.values import SetSpeedSlider, StopPath
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.robot.reaction.rules import Rule
from coneskin.robot.reaction.types import Reaction
from coneskin.robot.sim.mock_arm import SLIDER
from coneskin.robot.ur.input_writers import decode_fraction
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from tests.support.guard_rig import GuardRig, felt, make_core, touch
from tests.support.sweep import sweep

from ..reactions import SLOW

pytestmark = pytest.mark.long


@pytest.mark.promise("P01")
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


@pytest.mark.promise("P07")
def test_an_arm_that_does_not_become_slower_is_stopped():
    rig = GuardRig(touch(0.5, 0.9), reaction=SLOW, speed=1.0)
    rig.arm.heeds = False
    rig.run(1.5)
    assert rig.core.phase is Phase.LATCHED
    assert "did not become slower" in rig.event("stopping").details["why"]
    # 1 rad/s at 10 rad/s2, and four times 25 ms; by the first state that was measured then
    assert rig.event("stopping").time - rig.event("speed_reduced").time == pytest.approx(0.201, abs=0.002)
    assert rig.arm.commands[-1] == SetSpeedSlider(1.0)  # where it was before


@pytest.mark.promise("P07")
def test_an_arm_whose_motors_brake_softer_has_the_time_that_these_take():
    rig = GuardRig(touch(0.5, 0.9), reaction=SLOW, speed=1.0)
    rig.arm.heeds = False
    rig.core._arm._stop._held_braking = lambda q, qd: 4.0 if any(qd) else math.inf
    rig.run(1.5)
    # 1 rad/s at 4 rad/s2, and four times 25 ms
    assert rig.event("stopping").time - rig.event("speed_reduced").time == pytest.approx(0.351, abs=0.002)


def test_a_touch_that_lasts_too_long_stops():
    rig = GuardRig(touch(0.5), reaction=SLOW, speed=1.0).run(1.7)
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
    rig = GuardRig(touch(0.5, 1.5), reaction=light, rules=(firm,), speed=1.0).run(1.8)
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


def slow_first(kind="retreat", **settings):
    """Slow, but retreat or comply where the touch is firm."""
    harder = Rule(Reaction(kind=kind, arm_distance=0.5, **settings), level_above=0.5)
    return {"reaction": SLOW, "rules": (harder,)}


@pytest.mark.parametrize("external", [False, True])
@pytest.mark.parametrize("speed", sweep([1.0, 0.15]))
def test_from_slow_to_retreat_the_slider_is_back_before_the_arm_moves_away(external, speed):
    firm = ScriptedTouch(0.5, 1.5, 0.13, 1.57, rise=0.05)
    rig = GuardRig(firm, external=external, speed=speed, **slow_first()).run(3.0)
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
    rig.run(0.9)
    assert "resumed" in rig.names
    assert rig.arm.slider == 0.05


def test_a_stop_just_after_it_slowed_leaves_no_slider_low():
    rig = GuardRig(ScriptedTouch(0.5, 1.0, 0.13, 1.57, force=1.0), speed=0.02, **slow_first("stop"))
    while "speed_reduced" not in rig.names:
        rig.run(0.001)
    out = []
    rig.core._arm.touch(rig.now, felt(0.9), False, out)
    assert isinstance(out[0], StopProgram)
    rig.arm.feed(out[0])
    rig.run(1.0)
    assert rig.core.phase is Phase.LATCHED
    assert rig.arm.slider == 1.0


@pytest.mark.parametrize("later", sweep([0.006, 0.001, 0.02, 0.1]))
def test_touched_again_as_it_goes_on_it_is_slow_again(later):
    first = GuardRig(touch(0.5, 1.0), reaction=SLOW, speed=2.0).run(1.6)
    resumed = round(first.event("resumed").time - 100.0, 3)
    again = touch(resumed + later, resumed + 0.5)
    rig = GuardRig(touch(0.5, 1.0), again, reaction=SLOW, speed=2.0).run(2.7)
    assert "stopping" not in rig.names
    assert rig.names.count("resumed") == 2
    assert rig.arm.slider == 1.0
