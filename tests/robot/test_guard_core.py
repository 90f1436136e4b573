"""The guard's decisions, on a virtual skin and a mocked arm in virtual time."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.robot.arm_reaction import Phase
from coneskin.robot.commands import Reaction
from coneskin.robot.guard_core import GuardCore
from coneskin.robot.journal import GuardEvent, Kind
from coneskin.robot.owner_messages import Clear, Halt, Note, Speed, Stop
from coneskin.robot.stop_watch import OWNED, Way
from coneskin.skin.circuit import Wiring
from coneskin.skin.faults import Faults
from coneskin.skin.recording import Block

from .rig import Rig, make_core, touch


def test_a_touch_stops_the_arm_in_the_same_frame_and_it_retreats_along_the_normal():
    rig = Rig(touch(0.5, 0.7), speed=1.0).run(0.45)
    assert rig.core.phase is Phase.ARMED
    assert rig.arm.qd[0] == pytest.approx(1.0)
    rig.run(0.052)
    stop = next(output for output in rig.outputs if isinstance(output, Stop))
    at = rig.outputs.index(stop)
    assert isinstance(rig.outputs[at - 1], GuardEvent)  # ``armed``: the stop stands before what explains it
    assert rig.outputs[at - 1].name == "armed"
    # the touch begins at 0.5 s of the skin's time; its touch phase is measured within the next millisecond
    assert rig.event("contact").time - 100.0 == pytest.approx(0.501, abs=0.0011)
    before, normal = rig.point(), rig.normal()
    rig.run(2.5)
    assert rig.core.phase is Phase.LATCHED
    made = sum((b - a) * -n for a, b, n in zip(before, rig.point(), normal, strict=True))
    # 50 mm from where the touch was; ``before`` is one cycle later at up to 0.3 m/s, and the end leaves 0.5 mm
    assert made == pytest.approx(0.050, abs=0.002)
    assert rig.names == [
        "armed", "stopping", "contact", "contact_placed", "slower", "standstill", "retreating", "clipped",
        "touch_ended", "retreated", "slower", "standstill", "latched",
    ]  # fmt: skip
    assert rig.event("standstill").details["ways"] == ["owner"]
    assert max(map(abs, rig.arm.qd)) < 0.01


def test_reaction_stop_does_not_move_the_arm_back():
    rig = Rig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), speed=1.0).run(1.5)
    assert rig.core.phase is Phase.LATCHED
    assert not any(isinstance(output, Speed) for output in rig.outputs)


def test_nothing_moves_before_everything_is_sound():
    rig = Rig(touch(0.0, 0.3), speed=1.0)  # touched from the start
    rig.run(0.29)
    assert rig.core.phase is Phase.STARTING
    assert not any(isinstance(output, Clear) for output in rig.outputs)
    assert any("it is touched" in reason for reason in rig.core.unsound(rig.now))
    rig.run(0.3)
    assert rig.core.phase is Phase.ARMED
    assert [type(o) for o in rig.outputs if not isinstance(o, GuardEvent)] == [Clear]


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (lambda rig: setattr(rig.arm, "safety_bits", 0b100), "the controller's own safety system holds the arm"),
        (lambda rig: setattr(rig.arm, "robot_mode", 5), "not powered, or its brakes"),
        (lambda rig: rig.arm.q.__setitem__(2, 3.5), "joint 3 must be within -3.142 to 3.142 rad, it is at 3.500 rad"),
        (lambda rig: setattr(rig, "mute_arm", True), "the controller is silent"),
        (lambda rig: setattr(rig, "mute_skin", True), "one: no valid frame"),
    ],
)
def test_it_refuses_to_arm_and_says_why(spoil, reason):
    rig = Rig()
    spoil(rig)
    rig.run(1.2)
    assert rig.core.phase is Phase.STARTING
    assert any(reason in line for line in rig.event("waiting").details["reasons"])


@pytest.mark.parametrize(
    ("faults", "words"),
    [
        (Faults(stall_after=500), "no valid frame has come for too long"),
        (Faults(unplug_after=500), "unplugged"),
        (Faults(wiring=Wiring(opened=("C",)), wiring_after=500), "wire of C or of D is open"),
        (Faults(replay_after=500), "came twice or out of order"),
        (Faults(stuck_after=500, stuck_channel="all"), "stood exactly still"),
        (Faults(saturate_after=500, stuck_channel="radial_c"), "full scale"),
        (Faults(status_after=500, status=4), "status bits"),
        (Faults(clock_jump_after=500, clock_jump_us=5_000_000), "clock"),
        (Faults(restart_after=500), "started anew"),
    ],
)
def test_every_fault_of_the_skin_stops_and_latches(faults, words):
    rig = Rig(faults=faults, speed=1.0).run(1.5)
    assert rig.core.phase is Phase.LATCHED
    assert max(map(abs, rig.arm.qd)) < 0.01
    assert words in rig.event("stopping").details["why"]
    assert not any(isinstance(output, Speed) for output in rig.outputs)  # a fault is no reason to move


def test_a_silent_controller_is_a_fault_and_every_way_is_tried():
    rig = Rig(speed=1.0).run(0.5)
    rig.mute_arm = True
    rig.run(2.0)
    ways = [o for o in rig.arm.commands if isinstance(o, Way)]
    assert ways[:6] == [Way.SCRIPT, Way.DASHBOARD, Way.PROTECTIVE] * 2  # and it is not given up
    assert rig.names.count("escalated") == 3
    assert [e.details["rounds"] for e in rig.events if e.name == "not_standing"] == [1, 2, 4, 8]
    assert isinstance(rig.arm.commands[1], Stop)
    assert rig.core.phase is Phase.STOPPING  # nobody has seen it stand, so nobody says so
    assert "has sent no state for 50 ms" in rig.event("stopping").details["why"]


@pytest.mark.parametrize("works", [Way.SCRIPT, Way.DASHBOARD, Way.PROTECTIVE])
def test_a_stop_that_does_not_show_is_followed_by_the_next_way(works):
    rig = Rig(touch(0.5), obeys=frozenset([works]), speed=0.0)
    rig.run(0.3)
    rig.arm._go([1.0, 0, 0, 0, 0, 0], 100.0)  # somebody else moves it; the owner's stop does nothing
    rig.run(1.5)
    ways = [o for o in rig.arm.commands if isinstance(o, Way)]
    assert ways == list(OWNED[1 : OWNED.index(works) + 1])
    assert rig.core.phase is Phase.LATCHED
    assert "ur_rtde did not stop the arm" in rig.event("latched").details["why"]
    assert not any(isinstance(output, Speed) for output in rig.outputs)


def test_an_arm_that_nothing_stops_is_never_called_standing():
    rig = Rig(touch(0.5), obeys=frozenset(), speed=0.0)
    rig.run(0.3)
    rig.arm._go([1.0, 0, 0, 0, 0, 0], 100.0)
    rig.run(3.0)
    assert rig.core.phase is Phase.STOPPING
    assert "standstill" not in rig.names
    ways = [o for o in rig.arm.commands if isinstance(o, Way)]
    assert ways[:6] == [Way.SCRIPT, Way.DASHBOARD, Way.PROTECTIVE] * 2
    assert len(ways) > 30


def test_a_dead_owner_is_not_waited_for():
    rig = Rig(touch(0.5), obeys=frozenset([Way.SCRIPT]), speed=0.0).run(0.3)
    rig.arm._go([1.0, 0, 0, 0, 0, 0], 100.0)
    rig.run(0.203)
    assert isinstance(rig.arm.commands[-1], Stop)
    rig.feed(Kind.LOST, b"owner\nthe process that owns ur_rtde has ended")
    assert rig.arm.commands[-1] is Way.SCRIPT


def test_a_protective_stop_of_the_controller_latches():
    rig = Rig(speed=1.0).run(0.5)
    rig.arm.safety_bits = 0b100
    rig.run(0.5)
    assert rig.core.phase is Phase.LATCHED
    rig.feed(Kind.RESET)
    refused = rig.event("refused")
    assert any("see its screen" in reason for reason in refused.details["reasons"])
    assert rig.core.phase is Phase.LATCHED


def test_a_fault_during_the_retreat_ends_it():
    rig = Rig(touch(0.5, 0.7), speed=1.0).run(0.8)
    assert rig.core.phase is Phase.RETREATING
    rig.mute_skin = True
    rig.run(0.5)
    assert any(isinstance(command, Halt) for command in rig.arm.commands)
    assert rig.core.phase is Phase.LATCHED
    assert "retreated" not in rig.names


def test_clamped_from_two_sides_it_only_stops():
    opposite = touch(0.51, sensor="two", phi=1.57 + math.pi)
    rig = Rig(touch(0.5), opposite, sensors=2, speed=1.0).run(1.5)
    assert rig.core.phase is Phase.LATCHED
    assert not any(isinstance(output, Speed) for output in rig.outputs)
    assert "no way out" in rig.event("latched").details["why"]


def test_reset_needs_a_person_and_a_free_skin():
    rig = Rig(touch(0.5, 2.0), reaction=Reaction(kind="stop"), speed=1.0).run(1.0)
    rig.feed(Kind.RESET)
    assert any("it is touched" in reason for reason in rig.event("refused").details["reasons"])
    rig.run(3.0)
    assert rig.core.phase is Phase.LATCHED  # free again, but nobody has reset it
    rig.feed(Kind.RESET)
    rig.run(0.09)
    assert rig.core.phase is Phase.LATCHED  # until everything has been sound for a while
    rig.arm.target = None
    rig.run(0.3)
    assert rig.core.phase is Phase.ARMED
    assert rig.names.count("armed") == 2
    rig.feed(Kind.RESET)
    assert "nothing to reset" in rig.event("message").details["what"]


def reset(*touches, **settings):
    """A rig that has stopped for a touch at 0.5 s, and was reset at 1.5 s."""
    rig = Rig(touch(0.5, 0.7), *touches, reaction=Reaction(kind="stop"), speed=1.0, **settings).run(1.5)
    assert rig.core.phase is Phase.LATCHED
    rig.feed(Kind.RESET)
    return rig


def test_a_reset_again_and_again_arms_no_later():
    rig = reset()
    for _ in range(4):
        rig.run(0.03)
        rig.feed(Kind.RESET)
    assert rig.core.phase is Phase.ARMED


def test_a_touch_while_a_reset_settles_refuses_it():
    rig = reset(touch(1.52, 1.8)).run(2.0)
    assert rig.core.phase is Phase.LATCHED
    assert any("it is touched" in reason for reason in rig.event("refused").details["reasons"])
    assert rig.names.count("armed") == 1


def test_a_fault_while_a_reset_settles_refuses_it_for_good():
    rig = reset()
    rig.run(0.02)
    rig.mute_skin = True
    rig.run(1.0)
    assert any("no valid frame" in reason for reason in rig.event("refused").details["reasons"])
    rig.mute_skin = False
    rig.run(2.0)
    assert rig.core.phase is Phase.LATCHED  # sound again, but nobody has reset it since


def test_an_arm_that_moves_while_a_reset_settles_is_stopped():
    rig = reset()
    rig.run(0.02)
    rig.arm.go([0.5, 0, 0, 0, 0, 0], 10.0)
    rig.run(1.0)
    assert rig.core.phase is Phase.LATCHED
    assert "something has moved the arm" in rig.event("refused").details["reasons"][-1]
    assert max(map(abs, rig.arm.qd)) < 0.01


def test_a_fault_of_the_line_that_goes_on_is_reported_after_a_reset_again():
    rig = reset()
    rig.run(0.3)
    assert rig.core.phase is Phase.ARMED
    for number in (1, 2):
        for _ in range(100):
            rig.feed(Kind.SKIN, bytes(200))
            rig.run(0.001)
        assert rig.core.phase in (Phase.STOPPING, Phase.LATCHED)
        assert sum("skipped" in str(event.details.get("what")) for event in rig.events) == number
        rig.run(0.5)
        rig.feed(Kind.RESET)


def test_a_latched_arm_that_nobody_sees_is_stopped_until_it_is_seen_to_stand():
    rig = Rig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), speed=1.0).run(1.5)
    rig.mute_arm = True
    rig.run(1.0)
    assert rig.core.phase is Phase.STOPPING
    assert rig.events[-1].name == "not_standing"
    assert any("no state" in str(event.details.get("what")) for event in rig.events)
    rig.mute_arm = False
    rig.run(1.0)
    assert rig.core.phase is Phase.LATCHED
    assert [e.details["why"] for e in rig.events if e.name == "latched"][-1] == "touch; then the controller fell silent"


@pytest.mark.parametrize(("speed", "touched"), [(0.03, False), (0.03, True), (0.3, False)])
def test_a_latched_arm_does_not_creep(speed, touched):
    again = (touch(1.5, 9.0),) if touched else ()
    rig = Rig(touch(0.5, 0.7), *again, reaction=Reaction(kind="stop"), speed=1.0).run(1.6)
    at = rig.arm.q[0]
    rig.arm.go([speed, 0, 0, 0, 0, 0], 10.0)
    rig.run(3.0)
    assert abs(rig.arm.q[0] - at) < (0.001 if touched else 0.03)
    assert rig.core.phase is Phase.LATCHED


def test_an_arm_that_is_moved_again_and_again_gets_a_protective_stop():
    rig = Rig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), speed=1.0).run(1.5)
    for number in range(4):
        assert Way.PROTECTIVE not in rig.arm.commands, number
        rig.arm.go([0.5, 0, 0, 0, 0, 0], 10.0)
        rig.run(0.5)
        if rig.arm.safety_bits != 1:
            break
    assert number == 2
    assert rig.core.phase is Phase.LATCHED


def test_a_state_that_is_no_number_is_no_standstill():
    rig = Rig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), speed=1.0, obeys=frozenset()).run(0.502)
    rig.arm.qd[1] = math.nan
    rig.run(1.0)
    assert rig.core.phase is Phase.STOPPING
    armed = Rig(speed=1.0).run(0.5)
    armed.arm.q[3] = math.nan
    armed.run(0.01)
    assert "not finite" in armed.event("stopping").details["why"]


def test_a_controller_whose_time_is_no_number_is_silent():
    rig = Rig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), speed=1.0, obeys=frozenset()).run(0.4)
    rig.arm.clock = math.nan
    rig.run(1.0)
    assert "not finite" in rig.event("stopping").details["why"]
    assert Way.PROTECTIVE in rig.arm.commands


def test_a_touch_that_came_and_went_within_one_read_refuses_a_reset():
    rig = reset(touch(1.51, 1.53))
    late = b"".join([next(rig._packets)[1] for _ in range(60)])
    rig.now += 0.04  # held up: what has come meanwhile is read at once
    rig.feed(Kind.ARM, rig.arm.step())
    rig.feed(Kind.SKIN, late)
    rig.run(0.5)
    assert rig.core.phase is Phase.LATCHED
    assert "it was touched meanwhile" in rig.event("refused").details["reasons"]


def test_an_arm_without_power_is_a_fault():
    rig = Rig(speed=1.0).run(0.5)
    rig.arm.robot_mode = 3
    rig.run(0.01)
    assert "not powered" in rig.event("stopping").details["why"]


def test_what_is_lost_stays_lost():
    rig = Rig(speed=1.0).run(0.5)
    rig.feed(Kind.LOST, b"controller\nthe controller is gone")
    rig.run(0.5)
    rig.feed(Kind.RESET)
    assert "the controller is gone" in rig.event("refused").details["reasons"]


def test_an_error_of_the_owner_stops():
    rig = Rig(speed=1.0).run(0.5)
    rig.feed(Kind.OWNER, Note("error", "moveJ was refused").encode())
    rig.run(0.5)
    assert rig.core.phase is Phase.LATCHED
    assert "moveJ was refused" in rig.event("latched").details["why"]


def test_a_program_that_ends_by_itself_is_a_fault():
    """The controller's watchdog ends it when the owner of ur_rtde hangs."""
    rig = Rig(speed=1.0).run(0.5)
    rig.arm.runtime_state = 1
    rig.run(0.5)
    assert rig.core.phase is Phase.LATCHED
    assert "the program of ur_rtde has ended" in rig.event("stopping").details["why"]


def test_a_damaged_state_is_a_fault():
    rig = Rig(speed=1.0).run(0.5)
    rig.feed(Kind.ARM, b"short")
    assert "cannot be read" in rig.event("fault").details["what"]
    assert rig.core.phase is Phase.STOPPING


kinds = st.sampled_from([*Kind, 77])


@given(st.lists(st.tuples(kinds, st.floats(0.0, 0.05), st.binary(max_size=80)), max_size=60))
@settings(deadline=None, max_examples=60)
def test_nonsense_never_raises_and_never_arms(inputs):
    rig = Rig()
    core = make_core(list(rig.skin.sensors), Reaction())
    now = 0.0
    for kind, dt, payload in inputs:
        now += dt
        core.take(Block(kind, now, payload), [])
    assert core.phase is not Phase.ARMED


@pytest.mark.parametrize("script", [(), (touch(0.5, 0.7),), (touch(0.4, 0.45), touch(0.46))])
def test_the_same_inputs_give_the_same_run_bit_by_bit(script):
    rig = Rig(*script, speed=1.0).run(1.3)
    again: GuardCore = make_core(list(rig.skin.sensors), Reaction())
    outputs: list[object] = []
    for block in rig.blocks:
        again.take(block, outputs)
    assert [repr(output) for output in outputs] == [repr(output) for output in rig.outputs]
