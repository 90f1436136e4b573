"""Supervisor of the arm: the reaction by rules, a silent controller, and the same inputs the same run, bit by bit."""

import pytest

from coneskin.core.recording.block import Block
from coneskin.robot.driver.messages import EndReaction
from coneskin.robot.driver.values import SetpointProgram, SetSpeedSlider, StopPath, UseStopPath
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.robot.reaction.rules import Rule
from coneskin.robot.reaction.types import Reaction
from tests.support.guard_rig import LINK, GuardRig, make_core, touch
from tests.support.sweep import sweep

from .reactions import SLOW, comply


def test_the_first_rule_that_fits_is_the_reaction():
    rules = (Rule(Reaction(kind="stop"), link=1), Rule(Reaction(kind="stop"), speed_above=0.5, link=LINK))
    fast = GuardRig(touch(0.5, 0.7), rules=rules, speed=1.0).run(0.9)
    assert "retreating" not in fast.names
    slow = GuardRig(touch(0.5, 0.7), rules=rules, speed=0.3).run(0.9)
    assert "retreating" in slow.names


def test_how_firm_a_touch_is_shows_while_the_arm_stops():
    """In the frame in which it begins it is light; the rule for firm ones is met some frames later, in time."""
    rule = Rule(Reaction(kind="stop"), level_above=0.3)
    rig = GuardRig(touch(0.5, 0.9), rules=(rule,), speed=1.0).run(1.5)
    assert "retreating" not in rig.names
    assert rig.core.phase is Phase.LATCHED


def test_a_rules_deceleration_is_that_of_the_stop_in_external_mode_too():
    rule = Rule(Reaction(kind="stop", deceleration=20.0), speed_above=0.1)
    rig = GuardRig(
        touch(0.5), reaction=Reaction(kind="stop", deceleration=1.0), rules=(rule,), external=True, speed=1.0
    )
    rig.run(1.0)
    assert [output for output in rig.outputs if isinstance(output, UseStopPath)] == [
        UseStopPath(StopPath.PROGRAM, 20.0)
    ]


def test_a_controller_that_repeats_itself_is_silent():
    rig = GuardRig(speed=1.0).run(0.5)
    state = rig.arm.poll()
    rig.mute_arm = True
    for _ in range(200):
        rig.run(0.002)
        rig.feed(BlockKind.ARM, state)
    assert "has sent no state for 50 ms" in rig.event("stopping").details["why"]
    assert StopPath.PROTECTIVE in rig.arm.commands


@pytest.mark.promise("P58")
@pytest.mark.long
def test_the_wall_clock_is_no_part_of_it(monkeypatch):
    """Nothing in the guard asks for the time of day: a clock that jumps by a year changes nothing."""
    import time

    def jumped() -> float:
        raise AssertionError("the time of day was asked for")

    monkeypatch.setattr(time, "time", jumped)
    rig = GuardRig(touch(0.5, 0.7), speed=1.0).run(1.7)
    assert rig.core.phase is Phase.LATCHED


@pytest.mark.parametrize(
    "settings",
    sweep([{"reaction": comply()}, {"reaction": SLOW}, {"external": True}]),
)
@pytest.mark.long
def test_the_same_inputs_give_the_same_run_bit_by_bit(settings):
    rig = GuardRig(touch(0.5, 0.7), speed=1.0, **settings).run(1.7)
    again = make_core(
        list(rig.skin.sensors), settings.get("reaction", Reaction(kind="retreat")), external="external" in settings
    )
    outputs: list[object] = []
    for block in rig.blocks:
        again.feed(Block(*block), outputs)
    assert [repr(output) for output in outputs] == [repr(output) for output in rig.outputs]
    assert any(isinstance(output, EndReaction | SetSpeedSlider | SetpointProgram) for output in outputs)
