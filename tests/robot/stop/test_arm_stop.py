"""Stop of an arm under guard: paths that are left, the watch at standstill, programs that start again, late states."""

import math

import pytest

from coneskin.robot.driver.messages import StopProgram
from coneskin.robot.driver.values import SetSpeedSlider, StopPath
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.robot.reaction.types import Reaction
from coneskin.robot.sim.mock_arm import SLIDER
from tests.support.guard_rig import GuardRig, touch


@pytest.mark.parametrize(
    ("lost", "first"), [("program", StopPath.COMMAND), ("command", StopPath.PROGRAM), ("watchdog", StopPath.PROGRAM)]
)
@pytest.mark.long
def test_a_way_that_is_lost_is_not_tried(lost, first):
    rig = GuardRig(external=True, speed=1.0).run(0.5)
    rig.feed(BlockKind.LOST, f"{lost}\nit is gone".encode())
    rig.run(1.0)
    assert rig.arm.commands == [first]
    assert rig.core.phase is Phase.LATCHED
    rig.reset()
    assert "it is gone" in rig.event("refused").details["reasons"]


@pytest.mark.parametrize("held", [math.inf, 2.5])
def test_a_stop_has_the_time_that_the_motors_take(held):
    """At 2 rad/s it is told to brake with 10 rad/s2, and the motors have 2.5: 0.8 s, not 0.2 and four times 25 ms."""
    rig = GuardRig(touch(0.5, 0.9), reaction=Reaction(kind="stop"), external=True, speed=2.0)
    go = rig.arm.go
    rig.arm.go = lambda target, acceleration: go(target, min(acceleration, 2.5))
    rig.core._arm._stop._held_braking = lambda q, qd: held if any(qd) else math.inf
    rig.run(2.5)
    assert rig.core.phase.stands
    first, *others = rig.arm.commands
    assert first is StopPath.PROGRAM
    assert bool(others) == (held == math.inf)


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
    rig.run(0.9)
    assert rig.core.phase is Phase.LATCHED
    assert rig.names.count("latched") == 2
    assert max(map(abs, rig.arm.qd)) < 0.01


@pytest.mark.promise("P22")
@pytest.mark.long
def test_an_externally_controlled_arm_is_latched_at_the_end_of_a_watch():
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), external=True, speed=1.0).run(1.2)
    standing = rig.event("standstill").time
    assert rig.core.phase is Phase.STANDING  # a program may start again at once
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
    assert rig.core.phase is Phase.STANDING
    rig.run(0.2)
    assert rig.core.phase is Phase.LATCHED


@pytest.mark.promise("P27")
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
    assert rig.core.phase is Phase.STANDING
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


@pytest.mark.promise("P27")
def test_a_protective_stop_that_never_shows_is_said():
    obeys = frozenset(StopPath) - {StopPath.PROTECTIVE}
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), external=True, speed=1.0, obeys=obeys).run(0.8)
    for _ in range(2):
        rig.arm.go([1.0, 0, 0, 0, 0, 0], 4.0)
        rig.run(0.3)
    rig.run(1.0)
    assert "does not show the protective stop" in rig.event("latched").details["why"]


@pytest.mark.promise("P29")
@pytest.mark.long
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
    assert rig.core.phase is Phase.LATCHED  # raised under a program, it would be a protective stop
    assert "end the program first" in rig.event("refused").details["reasons"][0]
    rig.arm.runtime_state = 1
    rig.run(0.1)
    rig.reset()
    rig.run(0.3)
    assert rig.core.phase is Phase.ACTIVE
    assert [output for output in rig.outputs if isinstance(output, SetSpeedSlider)] == [SetSpeedSlider(0.6)]


@pytest.mark.promise("P26")
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


@pytest.mark.promise("P28")
def test_a_person_may_jog_a_latched_arm():
    rig = GuardRig(touch(0.5), reaction=Reaction(kind="stop"), external=True).run(1.3)
    rig.arm.runtime_state = 1
    rig.arm.go([0.2, 0, 0, 0, 0, 0], 10.0)
    rig.run(0.7)
    assert rig.core.phase is Phase.LATCHED
    assert rig.names.count("stopping") == 1


def late_burst(rig, seconds):
    """The guard is held up: frames and states wait, and come all at once, each kind together."""
    skin, states = [], []
    for step in range(round(1000 * seconds)):
        rig.now += 0.001
        skin.append(next(rig._packets)[1])
        if step % 2 == 0:
            states.append(rig.arm.poll())
    return skin, states


@pytest.mark.promise("P23")
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
