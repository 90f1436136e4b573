"""A network that fills: the controller's states come later and later, and no time between two of them is long."""

import math
from collections import deque

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coneskin.robot.driver.messages import SetJointVelocity
from coneskin.robot.driver.values import ControllerState
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.robot.reaction.types import Reaction
from coneskin.robot.stop.limits import MonitoringLimits
from coneskin.robot.stop.state_age import StateAge
from tests.support.guard_rig import GuardRig, touch
from tests.support.sweep import sweep

CYCLE = 0.002


def state_at(host, controller):
    """A standing arm's state, read at a host time, of a controller's time."""
    return ControllerState(host, controller, *STANDING)


def run(clock, delays, start=1000.0, offset=500.0, rate=1.0):
    """Feed states of every cycle, each read so much later; what comes of it beside the truth."""
    results = []
    for k, delay in enumerate(delays):
        true = start + rate * CYCLE * k
        results.append((clock.feed(state_at(true + delay, start - offset + CYCLE * k)), true, true + delay))
    return results


@given(st.lists(st.floats(0.0, 0.1), min_size=1, max_size=200))
def test_never_before_it_was_measured_never_after_it_was_read(delays):
    quickest = float("inf")
    for (measured, true, read), delay in zip(run(StateAge(0.05), delays), delays, strict=True):
        quickest = min(quickest, delay)
        # 1e-9: differences of numbers near 1000 s, which have 1e-13 each
        assert true - 1e-9 <= measured <= read
        assert abs(measured - true - quickest) < 1e-9  # off by the quickest reading so far, no more


def test_drift_of_100_ppm_does_not_pile_up():
    results = run(StateAge(0.05), [0.0002 if k % 7 else 0.0001 for k in range(60_000)], rate=1.0 + 1e-4)
    worst = max(abs(measured - true) for measured, true, _ in results)
    assert worst < 2 * 5.0 * 1e-4 + 0.0003  # two windows of 5 s at 100 ppm, and the delay itself


def test_a_controller_that_starts_anew():
    clock = StateAge(0.05)
    run(clock, [0.0001] * 10)
    assert clock.feed(state_at(2000.0, 0.002)) == 2000.0  # nothing is known of its clock yet
    assert abs(clock.feed(state_at(2000.010, 0.004)) - 2000.002) < 1e-9


@pytest.mark.parametrize(("ahead", "stepped"), [(0.24, False), (0.26, True)])
def test_a_clock_that_gains_more_than_a_quarter_of_a_second_has_stepped(ahead, stepped):
    clock = StateAge(0.05)
    run(clock, [0.0] * 10)
    clock.feed(state_at(1000.02, 500.02 + ahead))
    assert clock.newest.stepped == pytest.approx(ahead if stepped else 0.0)


def test_states_that_come_late_for_20_ms_move_no_arm_away():
    clock = StateAge(0.25)
    run(clock, [0.0] * 10)
    clock.feed(state_at(1000.09, 500.03))  # 60 ms late, more than 50
    assert clock.stale(1000.109) == ""
    assert clock.stale(1000.111) == "the controller's states come more than 50 ms late, too late to move away by"
    clock.feed(state_at(1000.112, 500.064))  # 48 ms
    assert clock.stale(1000.2) == ""


PATIENT = MonitoringLimits(arm_silence=0.25)  # as a scene of a busy computer has it
STANDING = (0.0,) * 6, (0.0,) * 6, True, False, True
RETREAT = Reaction(kind="retreat", distance=0.06)


class QueuedRig(GuardRig):
    """A rig whose controller sends through a queue that grows by 0.3 s/s up to ``longest``, from ``since`` on."""

    longest, since, held_until = 0.0, math.inf, 0.0

    def feed(self, kind, payload=b""):
        if kind is not BlockKind.ARM:
            return super().feed(kind, payload)
        queue = self.__dict__.setdefault("queue", deque())
        lag = min(self.longest, 0.3 * max(0.0, self.now - self.since))
        queue.append((max(self.now + lag, self.held_until), payload))
        while queue and queue[0][0] <= self.now:
            super().feed(kind, queue.popleft()[1])
        return []

    def fill(self, longest):
        self.longest, self.since = longest, self.now
        return self


def setpoints(rig):
    return sum(isinstance(output, SetJointVelocity) for output in rig.outputs)


@pytest.mark.promise("P15")
def test_states_that_come_later_and_later_are_a_fault_and_the_arm_stands():
    rig = QueuedRig(speed=0.3).run(0.5).fill(0.08).run(1.0)
    (stop,) = [event for event in rig.events if event.name == "stopping"]  # once, though they stay late
    why = (
        "the controller's states come more than 50 ms late: its network is congested, or it does not keep up with its "
    )
    assert stop.details["why"] == f"{why}clock, as a simulator may not"
    assert rig.core.phase is Phase.LATCHED
    assert rig.arm.speed < 0.01
    assert any("more than 50 ms late" in line for line in rig.core.blockers(rig.now))
    rig.longest = 0.0
    rig.run(0.2)
    rig.reset()
    assert rig.run(0.3).core.phase is Phase.ACTIVE  # timely again, and a person has looked


@pytest.mark.long
def test_a_lag_within_what_a_silence_may_last_is_no_fault():
    rig = QueuedRig(speed=0.3, limits=PATIENT).run(0.5).fill(0.2).run(1.5)
    assert rig.core.phase is Phase.ACTIVE
    rig.longest = 0.3
    assert rig.run(1.5).core.phase is Phase.LATCHED


@pytest.mark.promise("P15")
def test_no_arm_moves_away_by_states_that_are_late():
    rig = QueuedRig(touch(1.2, 1.5), reaction=RETREAT, speed=0.3, limits=PATIENT).run(0.5).fill(0.1).run(2.0)
    assert rig.core.phase is Phase.LATCHED
    assert "no retreat: the controller's states come more than 50 ms late" in rig.event("latched").details["why"]
    assert setpoints(rig) == 0


@pytest.mark.promise("P15")
def test_a_motion_away_ends_where_states_become_late():
    rig = QueuedRig(touch(0.5, 0.8), reaction=RETREAT, speed=0.3, limits=PATIENT).run(0.5)
    while "retreating" not in rig.names:
        rig.run(0.001)
    rig.fill(0.2).run(1.5)
    assert rig.core.phase is Phase.LATCHED
    retreated = rig.event("retreated")
    assert "more than 50 ms late, too late to move away by" in retreated.details["why"]
    # 50 ms late at 0.3 s per second, 20 ms more, and what the queue of that time hides
    assert retreated.time - rig.event("retreating").time < 0.05 / 0.3 + 0.02 + 0.08


@pytest.mark.long
@pytest.mark.parametrize("seconds", [0.04, 0.2])
def test_a_host_that_was_held_up_reads_late_states_at_once_and_moves_on(seconds):
    rig = QueuedRig(touch(0.5, 0.8), reaction=RETREAT, speed=0.3, limits=PATIENT).run(0.5)
    while "retreating" not in rig.names:
        rig.run(0.001)
    rig.run(0.05)
    rig.held_until = rig.now + seconds
    rig.run(3.0)
    assert "late" not in rig.event("retreated").details["why"]


def test_a_controller_whose_time_stands_still_is_silent():
    rig = GuardRig(speed=0.3).run(0.5)
    for _ in range(100):
        rig.arm.clock -= CYCLE  # the mock arm's own clock goes on by as much
        rig.run(CYCLE)
    assert rig.event("stopping").details["why"] == "the controller has sent no state for 50 ms"
    assert rig.event("stopping").time < rig.now - 0.1


@pytest.mark.promise("P15")
@pytest.mark.parametrize("step", sweep([-10.0, 3600.0]))
def test_a_clock_that_steps_is_one_stop_with_its_reason_and_a_reset_is_enough(step):
    """Back for good, or ahead for one state. It was 990 stops in 10 s, and no reset."""
    rig = GuardRig(speed=0.3, reaction=Reaction("stop")).run(0.5)
    rig.arm.clock += step
    rig.run(CYCLE)
    rig.arm.clock -= max(step, 0.0)
    rig.run(1.0)
    assert rig.names.count("stopping") == 1
    assert "clock has stepped by" in rig.event("stopping").details["why"]
    assert rig.core.phase is Phase.LATCHED
    rig.reset()
    assert rig.run(1.0).core.phase is Phase.ACTIVE


@pytest.mark.parametrize("period", [0.002, 0.008], ids=["e-Series", "CB3"])
@pytest.mark.parametrize("drift", [-1e-3, 1e-3])  # ten times what quartz does
def test_neither_drift_nor_a_busy_reader_is_a_lag(period, drift):
    age, seen = StateAge(0.05), []
    for k in range(round(60.0 / period)):
        measured = k * period
        held = measured % 0.1 < 0.03  # the reader takes up to 30 ms of them at once, ten times a second
        read = measured - measured % 0.1 + 0.03 if held else measured
        age.feed(ControllerState(read, 100.0 + (1.0 - drift) * measured, *STANDING))
        seen += [age.trouble(read), age.stale(read)]
    assert set(seen) == {""}


def test_a_simulator_that_falls_behind_is_a_lag_that_says_so():
    age = StateAge(0.05)
    for k in range(4000):
        age.feed(ControllerState(0.002 * k, 0.98 * 0.002 * k, *STANDING))
    assert "does not keep up with its clock" in age.trouble(8.0)
