"""The processes beside the guard: who falls silent stops the arm, and nothing goes on without an acknowledgement."""

import random

import pytest

from coneskin.robot.driver.messages import Release, StatusReport, StopProgram
from coneskin.robot.driver.values import StopPath
from coneskin.robot.guard import companion_monitor
from coneskin.robot.guard.companion_monitor import CompanionMonitor
from coneskin.robot.guard.core import _StallClock
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.journal import BlockKind, stopping_contact
from coneskin.robot.reaction.rules import Rule
from coneskin.robot.reaction.types import Reaction
from coneskin.robot.stop.limits import MonitoringLimits
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from tests.support.guard_rig import GuardRig, touch
from tests.support.sweep import sweep

BOTH = pytest.mark.parametrize("external", [False, True], ids=["internal", "external"])


def stopping_time(rig, since):
    """Time from a moment to the stop, in the rig's own time [s]."""
    return rig.event("stopping").time - since


# ---- silence


@pytest.mark.long
@pytest.mark.promise("P50")
@BOTH
def test_a_program_that_is_suspended_stops_its_arm_within_200_ms(external):
    rig = GuardRig(speed=1.0, external=external).run(0.5)
    rig.companions.program_is_mute = True
    since = rig.now
    rig.run(2.0)
    assert rig.core.phase is Phase.LATCHED
    assert stopping_time(rig, since) < 0.2
    assert "the program that guards: it was suspended for 150 ms" in rig.event("latched").details["why"]
    rig.companions.program_is_mute = False
    rig.run(1.0)
    assert rig.core.phase is Phase.LATCHED  # alive again is not enough
    rig.reset()
    rig.arm.target = None
    rig.run(0.3)
    assert rig.core.phase is Phase.ACTIVE


@pytest.mark.promise("P40")
@BOTH
def test_a_frozen_process_is_a_fault_although_nobody_needs_it_and_another_path_stops_the_arm(external):
    rig = GuardRig(speed=1.0, external=external, obeys=frozenset({StopPath.PROGRAM})).run(0.5)
    rig.companions.process_is_mute = True
    since = rig.now
    rig.run(1.2)
    assert stopping_time(rig, since) < 0.25
    name = "the guard watchdog" if external else "the driver process"
    assert f"{name}: no heartbeat for 200 ms" in rig.event("latched").details["why"]
    assert rig.event("standstill").details["paths"][-1] == "program"
    if not external:  # at once: it is known that the driver does not act
        assert rig.event("escalated").time - rig.event("stopping").time < 0.003


def companions():
    """A monitor that misses the driver process after 150 ms."""
    monitor = CompanionMonitor(MonitoringLimits(program_silence=0.1125), GuardRig().core._arm)
    monitor.hear_program(0.0, suspended=False)
    return monitor


def silent(monitor, now):
    monitor.poll(now)
    return list(monitor.blockers)


def test_time_in_which_the_guard_itself_was_held_up_is_nobodys_silence():
    monitor, clock = companions(), _StallClock()
    monitor.hear_helper(1.0)
    assert silent(monitor, clock.fair(1.0)) == []
    assert silent(monitor, clock.fair(1.5)) == []  # its heartbeats wait to be read
    for step in range(1, 150):
        assert silent(monitor, clock.fair(1.5 + 0.001 * step)) == []
    assert silent(monitor, clock.fair(1.652))
    monitor.hear_helper(1.653)
    assert silent(monitor, clock.fair(1.653)) == []
    monitor.lose("driver", 1.653)
    assert silent(monitor, clock.fair(3.0)) == []


def test_a_look_that_saw_it_wait_excuses_a_process_for_90_ms():
    monitor = companions()
    monitor.hear_helper(0.0)
    monitor.hold_up_helper(0.15, "load 9.0 on 2 cores", "driver")
    assert silent(monitor, 0.235) == []
    assert "no heartbeat for 150 ms: it hangs" in silent(monitor, 0.245)[0]


@pytest.mark.parametrize(("seconds", "taken_off"), [(0.019, 0.0), (0.021, 0.021)])
def test_more_than_20_ms_between_two_looks_is_a_hold_up_of_the_guard(seconds, taken_off):
    clock = _StallClock()
    clock.fair(7.0)
    assert clock.fair(7.0 + seconds) == pytest.approx(7.0 + seconds - taken_off, abs=1e-9)


def test_a_hold_up_of_the_guard_excuses_for_as_long_again_and_no_longer():
    clock = _StallClock()
    assert clock.fair(7.0) == 7.0
    assert clock.fair(7.1) == pytest.approx(7.0)
    assert clock.fair(7.1999) == pytest.approx(7.0999 - 0.0, abs=0.1)
    for step in range(1, 12):
        now = clock.fair(7.2 + 0.01 * step)
    assert now == pytest.approx(7.31)


@pytest.mark.promise("P48")
def test_a_guard_that_is_held_up_again_and_again_notices_silence():
    """Held up for 30 ms after each 3 ms it took 1.3 s, and a frozen program's arm moved on by 64 deg."""
    monitor, clock = companions(), _StallClock()
    monitor.hear_helper(0.0)
    now = 0.0
    while not silent(monitor, clock.fair(now)):
        now += 0.03
        if not silent(monitor, clock.fair(now)):
            now += 0.003
    assert 0.15 < now < 0.15 + 0.03 + 0.034
    monitor.hear_helper(now)
    assert not silent(monitor, clock.fair(now))


@pytest.mark.promise("P40")
@BOTH
@pytest.mark.long
def test_a_process_that_waits_for_a_processor_is_no_fault_for_half_a_second(external):
    rig = GuardRig(speed=1.0, external=external).run(0.5)
    rig.companions.process_is_mute = True
    since = rig.now
    while rig.core.phase is Phase.ACTIVE and rig.now < since + 1.0:
        rig.feed(BlockKind.HELD_UP, b"load 9.0 on 2 cores")
        rig.run(0.03)
    assert 0.47 < stopping_time(rig, since) < 0.56  # the last heartbeat came up to 20 ms before
    rig.run(1.0)
    assert "no heartbeat for 500 ms: this computer holds it up (load 9.0 on 2 cores)" in str(
        rig.event("latched").details["why"]
    )
    assert "may do so for 0.5 s" in rig.event("message").details["what"]
    assert rig.names.count("message") == 1


@pytest.mark.promise("P40")
@pytest.mark.parametrize("waits", sweep([False, True]))
def test_the_second_guard_watchdog_is_missed_too_though_the_first_one_lives(waits):
    rig = GuardRig(speed=1.0, external=True).run(0.5)
    rig.companions.second_is_mute = True
    since = rig.now
    while rig.core.phase is Phase.ACTIVE and rig.now < since + 1.0:
        if waits:
            rig.feed(BlockKind.HELD_UP, b"load 9.0 on 2 cores\nsecond")
        rig.run(0.03)
    low, high = (0.47, 0.56) if waits else (0.17, 0.25)
    assert low < stopping_time(rig, since) < high
    assert "the second guard watchdog: no heartbeat" in rig.event("stopping").details["why"]
    rig.run(1.5)
    rig.reset()
    assert "the second guard watchdog" in str(rig.event("refused").details["reasons"])


@pytest.mark.promise("P40")
def test_a_process_that_got_a_processor_and_hangs_has_no_more_time_than_any_other():
    rig = GuardRig(speed=1.0).run(0.5)
    rig.companions.process_is_mute = True
    since = rig.now
    rig.run(0.1)
    rig.feed(BlockKind.HELD_UP, b"load 9.0 on 2 cores")
    rig.run(0.5)
    assert stopping_time(rig, since) < 0.25
    assert "the driver process: no heartbeat for 200 ms: it hangs" in rig.event("stopping").details["why"]


@pytest.mark.promise("P08")
@pytest.mark.promise("P14")
def test_a_guard_that_was_held_up_reads_before_it_calls_anything_silent():
    """Held up for 0.2 s, it read the skin, and called the controller silent whose states were next to be read."""
    rig = GuardRig(speed=0.3).run(0.5)
    rig.now += 0.2
    rig.feed(BlockKind.TICK, b"")
    assert rig.core.phase is Phase.ACTIVE
    assert "fault" not in rig.names
    since = rig.now
    while rig.core.phase is Phase.ACTIVE and rig.now < since + 2.0:
        rig.now += 0.002
        rig.feed(BlockKind.TICK, b"")
    assert 0.0 < rig.now - since < 0.21  # as long again, and no longer


def test_what_has_never_been_heard_is_a_blocker():
    rig = GuardRig()
    rig.companions.program_is_mute = True
    rig.run(1.0)
    assert rig.core.phase is Phase.STARTING
    assert any("no sign of life yet" in reason for reason in rig.core.blockers(rig.now))


# ---- releases


@pytest.mark.promise("P64")
@BOTH
def test_it_is_active_only_after_the_acknowledgement(external):
    rig = GuardRig(external=external)
    take = rig.companions.feed
    rig.companions.feed = lambda output: None  # it beats, and does not answer
    rig.run(1.0)
    assert Release(1) in rig.outputs
    assert rig.core.phase is Phase.STARTING
    rig.feed(BlockKind.DRIVER, StatusReport("released", "7").encode())
    rig.feed(BlockKind.DRIVER, StatusReport("released", "nonsense").encode())
    assert rig.core.phase is Phase.STARTING
    rig.feed(BlockKind.DRIVER, StatusReport("released", "1").encode())
    assert rig.core.phase is Phase.ACTIVE
    rig.companions.feed = take


@pytest.mark.long
def test_a_release_that_nobody_acknowledges_is_taken_back_and_its_late_answer_counts_for_nothing():
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), speed=1.0).run(1.5)
    rig.companions.feed = lambda output: None
    rig.reset()
    rig.run(0.2)
    assert rig.outputs.count(Release(2)) == 1
    seen = len(rig.outputs)
    rig.companions.process_is_mute = True
    rig.run(0.4)
    refused = rig.event("refused")
    assert refused.details["request"] == 1
    assert any("the driver process: no heartbeat" in reason for reason in refused.details["reasons"])
    assert any(isinstance(output, StopProgram) for output in rig.outputs[seen:])
    rig.feed(BlockKind.DRIVER, StatusReport("released", "2").encode())
    rig.run(0.1)
    assert rig.core.phase is Phase.LATCHED
    assert rig.names.count("activated") == 1


@pytest.mark.promise("P40")
def test_a_reset_while_the_driver_hangs_is_refused_with_its_name():
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), speed=1.0).run(1.0)
    rig.companions.process_is_mute = True
    rig.run(0.5)
    rig.reset()
    assert any("the driver process: no heartbeat" in reason for reason in rig.event("refused").details["reasons"])
    rig.run(0.5)
    assert not any(output == Release(2) for output in rig.outputs)


# ---- resets


@pytest.mark.promise("P62")
@pytest.mark.long
def test_a_reset_of_another_stop_than_the_newest_forgives_nothing():
    rig = GuardRig(touch(0.5, 0.7), touch(1.7, 1.9), reaction=Reaction(kind="stop"), speed=1.0).run(1.0)
    rig.reset()
    rig.arm.target = None
    rig.run(1.2)
    assert [event.details["stop"] for event in rig.events if event.name == "latched"] == [1, 2]
    unreadable = dict.fromkeys((b"", b"x y", b"2", b"2 1 1", b"-2 1"), (0, 0))  # for no stop at all
    for payload, (stop, request) in {
        b"0 1": (0, 1),
        b"1 1": (1, 1),
        b"3 1": (3, 1),
        b"99 1": (99, 1),
        **unreadable,
    }.items():
        rig.feed(BlockKind.RESET, payload)
        details = rig.events[-1].details
        assert details["request"] == request
        assert details["reasons"] == [f"it is for stop {stop}, and stop 2 has latched the arm: look at that first"]
    rig.run(0.3)
    assert rig.core.phase is Phase.LATCHED
    rig.feed(BlockKind.RESET, b"2 5")
    rig.run(0.5)
    assert rig.core.phase is Phase.ACTIVE
    assert rig.events[-1].details["request"] == 5


def test_resets_that_came_before_any_stop_forgive_none_that_comes():
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), speed=1.0).run(0.4)
    for number in range(3):
        rig.feed(BlockKind.RESET, b"1 %d" % number)
    rig.run(0.6)
    assert rig.core.phase is Phase.LATCHED
    refused = [event for event in rig.events if event.name == "refused"]
    assert [event.details["request"] for event in refused] == [0, 1, 2]
    assert all("nothing to reset" in event.details["reasons"][0] for event in refused)


# ---- the contact that stopped


def names_the_right_one(seed):
    """Tell whether the stop names the firm touch, and not the soft one that has slowed the arm before."""
    chance = random.Random(seed)
    soft, hard = chance.sample(("one", "two"), 2)
    begin = chance.uniform(0.25, 0.35)
    later = begin + chance.uniform(0.02, 0.15)
    places = [{"u": chance.uniform(0.03, 0.23), "phi": chance.uniform(0.3, 6.0)} for _ in range(2)]
    touches = (
        ScriptedTouch(begin, 9.0, **places[0], force=chance.uniform(0.9, 1.5), rise=0.0005, sensor=soft),
        ScriptedTouch(later, 9.0, **places[1], force=chance.uniform(15.0, 60.0), rise=0.0005, sensor=hard),
    )
    rules = (Rule(Reaction(kind="stop"), level_above=0.82),)
    rig = GuardRig(*touches, sensors=2, reaction=Reaction(kind="slow"), rules=rules).run(later + 0.06)
    assert rig.names.index("speed_reduced") < rig.names.index("stopping")
    contact = stopping_contact(rig.event("stopping"), rig.events)
    assert contact is not None
    right = contact.details["sensor"] == hard
    return right and abs(contact.details["u"] - places[1]["u"]) < 0.01


@pytest.mark.long
@pytest.mark.promise("P04")
@pytest.mark.parametrize("seeds", sweep([range(8), range(8, 30)]))
def test_the_touch_that_stopped_is_named_in_each_of_30_runs(seeds):
    assert all(map(names_the_right_one, seeds))


# ---- the driver's program ends, announced or not


def report(rig, kind):
    rig.feed(BlockKind.DRIVER, StatusReport(kind).encode())


@pytest.mark.long
@pytest.mark.promise("P20")
def test_the_driver_s_program_may_end_where_that_was_announced_and_for_no_longer_than_5_s():
    rig = GuardRig(speed=0.0).run(0.5)
    report(rig, "restarts")
    rig.run(0.05)  # it still runs
    rig.arm.runtime_state = 1
    rig.run(0.3)
    rig.arm.runtime_state = 2
    rig.run(0.01)
    report(rig, "restarted")
    rig.run(0.5)
    assert rig.core.phase is Phase.ACTIVE
    report(rig, "restarts")
    rig.arm.runtime_state = 1
    rig.run(4.9)
    assert rig.core.phase is Phase.ACTIVE
    rig.run(0.5)
    assert rig.core.phase is Phase.LATCHED
    assert "the driver's program has ended on the controller" in rig.event("latched").details["why"]


@pytest.mark.long
def test_a_restart_that_is_announced_again_and_again_has_no_more_than_5_s():
    rig = GuardRig(speed=0.0).run(0.5)
    rig.arm.runtime_state = 1
    for _ in range(4):  # of a program whose paths are refused
        report(rig, "restarts")
        rig.run(1.4)
    assert rig.core.phase is Phase.LATCHED
    assert "the driver's program has ended on the controller" in rig.event("latched").details["why"]


@pytest.mark.long
@pytest.mark.pure  # compiled, the time is a constant
def test_a_restart_that_was_refused_leaves_the_next_one_its_time(monkeypatch):
    monkeypatch.setattr(companion_monitor, "_RESTART_TIMEOUT", 1.0)
    rig = GuardRig(speed=0.0).run(0.5)
    report(rig, "restarts")
    rig.run(1.2)  # the old program goes on
    report(rig, "restarts")
    rig.arm.runtime_state = 1
    rig.run(0.9)
    assert rig.core.phase is Phase.ACTIVE
    rig.run(0.3)
    assert rig.core.phase is Phase.LATCHED


@pytest.mark.promise("P20")
def test_the_driver_s_program_that_ends_unannounced_is_a_fault():
    rig = GuardRig(speed=0.0).run(0.5)
    report(rig, "restarts")
    report(rig, "restarted")
    rig.run(0.1)
    rig.arm.runtime_state = 1
    rig.run(0.3)
    assert rig.core.phase is Phase.LATCHED


@pytest.mark.promise("P20")
def test_a_guard_that_was_held_up_over_a_restart_reads_its_end_with_its_announcement():
    """It read both reports, and then the states: running, not running, running. 16 paths of 220 were stopped for it."""
    rig = GuardRig(speed=0.0).run(0.5)
    states = []
    for running in (2, 2, 2, 1, 1, 1, 1, 2, 2):
        rig.now += 0.002
        rig.arm.runtime_state = running
        states.append(rig.arm.poll())
    rig.now += 0.03
    report(rig, "restarts")
    report(rig, "restarted")
    for state in states:
        rig.feed(BlockKind.ARM, state)
    rig.run(0.3)
    assert rig.core.phase is Phase.ACTIVE
    rig.arm.runtime_state = 1
    rig.run(0.3)
    assert rig.core.phase is Phase.LATCHED
