"""The guard's decisions, on a virtual skin and a mocked arm in virtual time."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.core.recording.block import Block
from coneskin.robot.driver.messages import EndReaction, SetJointVelocity, StatusReport, StopProgram
from coneskin.robot.driver.values import INTERNAL_PATHS, StopPath
from coneskin.robot.guard.core import GuardCore
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.journal import BlockKind, GuardEvent
from coneskin.robot.reaction.rules import Rule
from coneskin.robot.reaction.types import Reaction
from coneskin.skin.virtual.circuit import WiringFaults
from coneskin.skin.virtual.fault_injection import FaultInjection
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from tests.support.guard_rig import GuardRig, make_core, touch
from tests.support.sweep import sweep


@pytest.mark.promise("P01")
def test_a_touch_stops_the_arm_in_the_same_frame_and_it_retreats_along_the_normal():
    wide = Reaction(kind="retreat", arm_distance=0.5)
    rig = GuardRig(touch(0.5, 0.9), reaction=wide, speed=1.0).run(0.45)
    assert rig.core.phase is Phase.ACTIVE
    assert rig.arm.qd[0] == pytest.approx(1.0)
    rig.run(0.052)
    stop = next(output for output in rig.outputs if isinstance(output, StopProgram))
    at = rig.outputs.index(stop)
    assert isinstance(rig.outputs[at - 1], GuardEvent)  # ``armed``: the stop stands before what explains it
    assert rig.outputs[at - 1].name == "activated"
    # the touch begins at 0.5 s of the skin's time; its touch phase is measured within the next millisecond
    assert rig.event("contact").time - 100.0 == pytest.approx(0.501, abs=0.0011)
    before, normal = rig.point(), rig.normal()
    rig.run(2.5)
    assert rig.core.phase is Phase.LATCHED
    made = sum((b - a) * -n for a, b, n in zip(before, rig.point(), normal, strict=True))
    # 50 mm from where the touch was; ``before`` is one cycle later at up to 0.3 m/s, and the end leaves 0.5 mm
    assert made == pytest.approx(0.050, abs=0.002)
    assert rig.names == [
        "activated", "stopping", "contact", "contact_located", "decelerating", "standstill", "retreating",
        "motion_limited", "touch_ended", "retreated", "decelerating", "standstill", "latched",
    ]  # fmt: skip
    assert rig.event("standstill").details["paths"] == ["driver"]
    assert max(map(abs, rig.arm.qd)) < 0.01


def test_reaction_stop_does_not_move_the_arm_back():
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), speed=1.0).run(1.5)
    assert rig.core.phase is Phase.LATCHED
    assert not any(isinstance(output, SetJointVelocity) for output in rig.outputs)


@pytest.mark.promise("P08")
@pytest.mark.parametrize(
    ("faults", "words"),
    [
        (FaultInjection(stall_after=500), "no valid frame has come for too long"),
        (FaultInjection(unplug_after=500), "unplugged"),
        (FaultInjection(wiring=WiringFaults(opened=("C",)), wiring_after=500), "wire of C or of D is open"),
        (FaultInjection(replay_after=500), "came twice or out of order"),
        (FaultInjection(stuck_after=500, stuck_channel="all"), "has not changed at all"),
        (FaultInjection(saturate_after=500, stuck_channel="radial_c"), "full scale"),
        (FaultInjection(status_after=500, status=4), "status bits"),
        (FaultInjection(clock_jump_after=500, clock_jump_us=5_000_000), "clock"),
        (FaultInjection(restart_after=500), "started anew"),
    ],
)
def test_every_fault_of_the_skin_stops_and_latches(faults, words):
    rig = GuardRig(faults=faults, speed=1.0).run(1.5)
    assert rig.core.phase is Phase.LATCHED
    assert max(map(abs, rig.arm.qd)) < 0.01
    assert words in rig.event("stopping").details["why"]
    assert not any(isinstance(output, SetJointVelocity) for output in rig.outputs)  # a fault is no reason to move


@pytest.mark.promise("P14")
def test_a_silent_controller_is_a_fault_and_every_way_is_tried():
    rig = GuardRig(speed=1.0).run(0.5)
    rig.mute_arm = True
    rig.run(2.0)
    paths = [o for o in rig.arm.commands if isinstance(o, StopPath)]
    assert set(paths[:4]) == set(paths[4:8]) == set(INTERNAL_PATHS[1:])  # and it is not given up
    assert rig.names.count("escalated") == 4
    assert [e.details["rounds"] for e in rig.events if e.name == "stop_failed"] == [1, 2, 4, 8]
    assert isinstance(rig.arm.commands[0], StopProgram)
    assert rig.core.phase is Phase.STOPPING  # nobody has seen it stand, so nobody says so
    assert "has sent no state for 50 ms" in rig.event("stopping").details["why"]


@pytest.mark.promise("P21")
@pytest.mark.parametrize("works", [StopPath.PROGRAM, StopPath.COMMAND, StopPath.PROTECTIVE])
def test_a_stop_that_does_not_show_is_followed_by_the_next_way(works):
    rig = GuardRig(touch(0.5), obeys=frozenset([works]), speed=0.0)
    rig.run(0.3)
    rig.arm.go([1.0, 0, 0, 0, 0, 0], 100.0)  # somebody else moves it; the driver's stop does nothing
    rig.run(1.5)
    paths = [o for o in rig.arm.commands if isinstance(o, StopPath)]
    assert paths == list(INTERNAL_PATHS[1 : INTERNAL_PATHS.index(works) + 1])
    assert rig.core.phase is Phase.LATCHED
    assert "no retreat: the driver did not stop the arm" in rig.event("latched").details["why"]
    assert not any(isinstance(output, SetJointVelocity) for output in rig.outputs)


@pytest.mark.promise("P21")
@pytest.mark.long
def test_an_arm_that_nothing_stops_is_never_called_standing():
    rig = GuardRig(touch(0.5), obeys=frozenset(), speed=0.0)
    rig.run(0.3)
    rig.arm.go([1.0, 0, 0, 0, 0, 0], 100.0)
    rig.run(3.0)
    assert rig.core.phase is Phase.STOPPING
    assert "standstill" not in rig.names
    paths = [o for o in rig.arm.commands if isinstance(o, StopPath)]
    assert paths[:8] == list(INTERNAL_PATHS[1:]) * 2
    assert len(paths) > 30


def test_a_dead_driver_is_not_waited_for():
    rig = GuardRig(touch(0.5), obeys=frozenset([StopPath.PROGRAM]), speed=0.0).run(0.3)
    rig.arm.go([1.0, 0, 0, 0, 0, 0], 100.0)
    rig.run(0.203)
    assert isinstance(rig.arm.commands[-1], StopProgram)
    rig.feed(BlockKind.LOST, b"driver\nthe driver process has ended")
    assert rig.arm.commands[-1] is StopPath.PROGRAM


@pytest.mark.promise("P17")
@pytest.mark.parametrize("loss", [{"safety_bits": 0b100}, {"robot_mode": 5}])
def test_nothing_moves_away_once_the_controller_has_stopped_the_arm(loss):
    """Its own stop is seen in the very state in which the arm stands, or while the arm already moves away."""
    rig = GuardRig(touch(0.5, 0.9), speed=1.0).run(0.51)
    while max(map(abs, rig.arm.qd)) > 0.0:
        rig.run(0.002)
    vars(rig.arm).update(loss)
    rig.run(0.5)
    assert not any(isinstance(output, SetJointVelocity) for output in rig.outputs)
    assert "the controller has stopped the arm itself" in rig.event("latched").details["why"]
    late = GuardRig(touch(0.5, 0.9), speed=1.0).run(0.51)
    while late.core.phase is not Phase.RETREATING:
        late.run(0.002)
    vars(late.arm).update(loss)
    before = sum(isinstance(output, SetJointVelocity) for output in late.outputs)
    late.run(0.5)
    assert sum(isinstance(output, SetJointVelocity) for output in late.outputs) == before
    assert late.core.phase is Phase.LATCHED


def test_a_stop_names_its_touch_and_has_a_number():
    """A soft touch only slows; the stop names the second one, which is harder, and so would be every later stop."""
    rules = (Rule(Reaction(kind="stop"), level_above=0.4),)
    soft = ScriptedTouch(0.5, 1.0, 0.1, 1.0, force=0.6)
    rig = GuardRig(soft, touch(0.6, u=0.2, sensor="two"), sensors=2, reaction=Reaction(kind="slow"), rules=rules)
    rig.run(1.5)
    assert rig.names[:3] == ["activated", "speed_reduced", "contact"]
    named = rig.event("stopping").details
    assert named["why"] == "touch"
    assert named["contact"]["sensor"] == "two"
    assert named["contact"]["number"] == 2
    assert [named["stop"], rig.event("latched").details["stop"]] == [1, 1]
    contacts = [event.details for event in rig.events if event.name == "contact"]
    assert [details["number"] for details in contacts] == [1, 2]


@pytest.mark.promise("P17")
def test_a_protective_stop_of_the_controller_latches():
    rig = GuardRig(speed=1.0).run(0.5)
    rig.arm.safety_bits = 0b100
    rig.run(0.5)
    assert rig.core.phase is Phase.LATCHED
    rig.reset()
    refused = rig.event("refused")
    assert any("see its screen" in reason for reason in refused.details["reasons"])
    assert rig.core.phase is Phase.LATCHED


def test_a_fault_during_the_retreat_ends_it():
    rig = GuardRig(touch(0.5, 0.7), speed=1.0).run(0.8)
    assert rig.core.phase is Phase.RETREATING
    rig.mute_skin = True
    rig.run(0.5)
    assert any(isinstance(command, EndReaction) for command in rig.arm.commands)
    assert rig.core.phase is Phase.LATCHED
    assert "retreated" not in rig.names


@pytest.mark.promise("P36")
def test_clamped_from_two_sides_it_only_stops():
    opposite = touch(0.51, sensor="two", phi=1.57 + math.pi)
    rig = GuardRig(touch(0.5), opposite, sensors=2, speed=1.0).run(1.5)
    assert rig.core.phase is Phase.LATCHED
    assert not any(isinstance(output, SetJointVelocity) for output in rig.outputs)
    assert "touches on opposite sides" in rig.event("latched").details["why"]


@pytest.mark.promise("P14")
def test_a_latched_arm_that_nobody_sees_is_stopped_until_it_is_seen_to_stand():
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), speed=1.0).run(1.5)
    rig.mute_arm = True
    rig.run(1.0)
    assert rig.core.phase is Phase.STOPPING
    assert rig.events[-1].name == "stop_failed"
    assert any("no state" in str(event.details.get("what")) for event in rig.events)
    rig.mute_arm = False
    rig.run(1.0)
    assert rig.core.phase is Phase.LATCHED
    assert [e.details["why"] for e in rig.events if e.name == "latched"][-1] == "touch; then the controller fell silent"


@pytest.mark.parametrize(("speed", "touched"), sweep([(0.03, False), (0.03, True), (0.3, False)]))
@pytest.mark.long
def test_a_latched_arm_does_not_creep(speed, touched):
    again = (touch(1.5, 9.0),) if touched else ()
    rig = GuardRig(touch(0.5, 0.7), *again, reaction=Reaction(kind="stop"), speed=1.0).run(1.6)
    at = rig.arm.q[0]
    rig.arm.go([speed, 0, 0, 0, 0, 0], 10.0)
    rig.run(3.0)
    assert abs(rig.arm.q[0] - at) < (0.001 if touched else 0.03)
    assert rig.core.phase is Phase.LATCHED


def test_an_arm_that_is_moved_again_and_again_gets_a_protective_stop():
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), speed=1.0).run(1.5)
    for number in range(4):
        assert StopPath.PROTECTIVE not in rig.arm.commands, number
        rig.arm.go([0.5, 0, 0, 0, 0, 0], 10.0)
        rig.run(0.5)
        if rig.arm.safety_bits != 1:
            break
    assert number == 1
    assert rig.core.phase is Phase.LATCHED


def test_a_guard_that_was_suspended_stops_the_arm_and_latches_though_every_clock_stood_still():
    rig = GuardRig(speed=1.0).run(0.5)
    rig.feed(BlockKind.SUSPENDED, b"5.000")
    assert rig.core.phase is Phase.STOPPING
    rig.run(0.5)
    assert rig.core.phase is Phase.LATCHED
    assert "did nothing for a while" in rig.event("latched").details["why"]


@pytest.mark.promise("P14")
def test_a_state_that_is_no_number_is_no_standstill():
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), speed=1.0, obeys=frozenset()).run(0.502)
    rig.arm.qd[1] = math.nan
    rig.run(1.0)
    assert rig.core.phase is Phase.STOPPING
    armed = GuardRig(speed=1.0).run(0.5)
    armed.arm.q[3] = math.nan
    armed.run(0.01)
    assert "not finite" in armed.event("stopping").details["why"]


def test_a_controller_whose_time_is_no_number_is_silent():
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), speed=1.0, obeys=frozenset()).run(0.4)
    rig.arm.clock = math.nan
    rig.run(1.0)
    assert "not finite" in rig.event("stopping").details["why"]
    assert StopPath.PROTECTIVE in rig.arm.commands


@pytest.mark.promise("P16")
def test_an_arm_without_power_is_a_fault():
    rig = GuardRig(speed=1.0).run(0.5)
    rig.arm.robot_mode = 3
    rig.run(0.01)
    assert "not powered" in rig.event("stopping").details["why"]


@pytest.mark.promise("P39")
def test_an_error_of_the_driver_stops():
    rig = GuardRig(speed=1.0).run(0.5)
    rig.feed(BlockKind.DRIVER, StatusReport("error", "moveJ was refused").encode())
    rig.run(0.5)
    assert rig.core.phase is Phase.LATCHED
    assert "moveJ was refused" in rig.event("latched").details["why"]


def test_a_program_that_ends_by_itself_is_a_fault():
    """The controller's watchdog ends it when the driver of ur_rtde hangs."""
    rig = GuardRig(speed=1.0).run(0.5)
    rig.arm.runtime_state = 1
    rig.run(0.5)
    assert rig.core.phase is Phase.LATCHED
    assert "the driver's program has ended" in rig.event("stopping").details["why"]


def test_a_damaged_state_is_a_fault():
    rig = GuardRig(speed=1.0).run(0.5)
    rig.feed(BlockKind.ARM, b"short")
    assert "cannot be read" in rig.event("fault").details["what"]
    assert rig.core.phase is Phase.STOPPING


kinds = st.sampled_from([*BlockKind, 77])


@given(st.lists(st.tuples(kinds, st.floats(0.0, 0.05), st.binary(max_size=80)), max_size=60))
@settings(max_examples=60)
def test_nonsense_never_raises_and_never_arms(inputs):
    rig = GuardRig()
    core = make_core(list(rig.skin.sensors), Reaction(kind="retreat"))
    now = 0.0
    for kind, dt, payload in inputs:
        now += dt
        core.feed(Block(kind, now, payload), [])
    assert core.phase is not Phase.ACTIVE


@pytest.mark.parametrize(
    "script",
    [(touch(0.5, 0.7),), *(pytest.param(s, marks=pytest.mark.long) for s in ((), (touch(0.4, 0.45), touch(0.46))))],
)
def test_the_same_inputs_give_the_same_run_bit_by_bit(script):
    rig = GuardRig(*script, speed=1.0).run(1.3)
    again: GuardCore = make_core(list(rig.skin.sensors), Reaction(kind="retreat"))
    outputs: list[object] = []
    for block in rig.blocks:
        again.feed(block, outputs)
    assert [repr(output) for output in outputs] == [repr(output) for output in rig.outputs]
