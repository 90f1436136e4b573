"""A stop counts when measured speed says so."""

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coneskin.robot.driver.values import EXTERNAL_PATHS, INTERNAL_PATHS, StopPath
from coneskin.robot.stop.limits import MonitoringLimits
from coneskin.robot.stop.stop_monitor import STANDSTILL_SAMPLES, StopMonitor

ALL = INTERNAL_PATHS
LIMITS = MonitoringLimits(arm_silence=0.0)


def monitor(speed=1.0, paths=ALL, budget=0.3):
    return StopMonitor(0.0, speed, paths, LIMITS, budget)


def test_a_stop_that_works_needs_one_way():
    stop = monitor()
    for k in range(60):
        now = 0.002 * (k + 1)
        stop.sample(now, max(0.0, 1.0 - 10.0 * max(0.0, now - 0.004)))
        assert stop.next_paths(now) == []
    assert stop.used == [StopPath.DRIVER]
    # 1 rad/s at 10 rad/s2 after 4 ms: 0.05 rad/s less at 10 ms (or one cycle later by rounding), standing at 104 ms
    assert 0.0099 < stop.course.slowed_at < 0.0121
    assert 0.104 <= stop.course.standing_at <= 0.104 + 0.002 * STANDSTILL_SAMPLES


def test_an_arm_that_was_still_speeding_up_has_slowed_when_it_is_below_its_top():
    stop = monitor(speed=0.5)
    for now, speed in ((0.002, 0.55), (0.004, 0.58), (0.006, 0.57)):
        stop.sample(now, speed)
        assert stop.course.slowed_at is None
    stop.sample(0.008, 0.52)
    assert stop.course.slowed_at == 0.008


def test_what_is_a_slowdown_and_what_is_its_end_has_limits():
    """A drop by 0.05 rad/s, or a tenth; a rise by 0.1 rad/s above the least; less than 0.01 rad/s slower in 25 ms."""
    for speed, slows in ((0.951, False), (0.949, True)):
        stop = monitor()
        stop.sample(0.002, speed)
        assert (stop.course.slowed_at is not None) is slows
    for speed, undone in ((0.599, False), (0.601, True)):
        stop = monitor()
        stop.sample(0.002, 0.5)
        stop.sample(0.004, speed)
        assert stop.course.undone is undone
    for slower, undone in ((0.009, True), (0.011, False)):
        stop = monitor()
        for now, speed in ((0.002, 0.9), (0.022, 0.9 - slower), (0.03, 0.9 - slower)):
            stop.sample(now, speed)
        assert stop.course.undone is undone


def test_ways_come_one_by_one_without_slowdown_and_the_last_one_after_the_budget():
    stop = monitor()
    times = {}
    for k in range(150):
        now = 0.001 * k
        stop.sample(now, 1.0)
        for path in stop.next_paths(now):
            times[path] = now
    # a look each millisecond: the sum of patiences may round to just behind one
    assert times == {w: pytest.approx(0.025 * (k + 1), abs=0.0011) for k, w in enumerate(ALL[1:])}
    late = monitor(budget=0.03)
    late.sample(0.01, 0.5)  # it slows, but does not get there
    assert late.next_paths(0.029) == []
    assert late.next_paths(0.031) == [StopPath.PROTECTIVE]
    late.sample(0.12, 0.5)
    assert late.next_paths(0.12) == []  # another program now would take its place
    assert late.next_paths(0.132) == [StopPath.PROGRAM]


def stubborn(seconds=2.0, restart=0.0, paths=ALL, obeys=frozenset(StopPath)):
    """An arm at 1 rad/s that each stop brakes at 10 rad/s2; a new program starts once it stands, or after a while."""
    stop = monitor(paths=paths, budget=0.2)
    speed, braking, rest, named = 1.0, True, 0.0, []
    for k in range(1, round(500 * seconds)):
        now = 0.002 * k
        if braking:
            speed = max(0.0, speed - 0.02)
            if speed == 0.0:
                rest += 0.002
                braking = rest < restart
        else:
            speed, rest = min(1.0, speed + 0.02), 0.0
        stop.sample(now, speed)
        for path in stop.next_paths(now):
            named.append((now, path))
            if path is StopPath.PROTECTIVE and path in obeys:
                return stop, named, now
            braking = True
        if stop.course.standing_at is not None:
            return stop, named, now
    return stop, named, None


@pytest.mark.promise("P27")
def test_a_program_that_starts_again_and_again_ends_in_a_protective_stop():
    _, named, ended = stubborn()
    assert named[-1][1] is StopPath.PROTECTIVE
    assert ended < 0.8


@pytest.mark.parametrize("hertz", [2, 8, 20, 60])
@pytest.mark.parametrize("swing", [0.06, 0.1, 0.2])
def test_an_arm_that_shakes_as_it_goes_on_gets_a_protective_stop(hertz, swing):
    stop = monitor(paths=EXTERNAL_PATHS, budget=0.2)
    named = []
    for k in range(1, 500):
        now = 0.002 * k
        stop.sample(now, 0.9 + swing * math.sin(2.0 * math.pi * hertz * now))
        named += [(now, path) for path in stop.next_paths(now)]
    assert next(now for now, path in named if path is StopPath.PROTECTIVE) < 0.7
    for (now, path), (after, _) in itertools.pairwise(named):
        assert after - now >= (0.099 if path is StopPath.PROTECTIVE else 0.024)


@pytest.mark.parametrize("deceleration", [3.0, 10.0])
@pytest.mark.parametrize(("paths", "next_path"), [(EXTERNAL_PATHS, StopPath.PROTECTIVE), (ALL, StopPath.PROGRAM)])
def test_a_slowdown_that_ends_before_the_arm_stands_is_one_no_more(deceleration, paths, next_path):
    """Where other programs move the arm, what has undone one stop would undo the next: none undoes a protective one."""
    stop = monitor(paths=paths, budget=1.0 / deceleration + 0.1)
    named, end = [], 0.2 / deceleration  # then another program has replaced that of the stop
    for k in range(1, 60):
        now = 0.002 * k
        stop.sample(now, max(1.0 - deceleration * now, 0.8))
        named += [(now, path) for path in stop.next_paths(now)]
    assert end < named[0][0] < end + 0.05
    assert named[0][1] is next_path


def test_a_way_that_is_lost_in_a_later_round_is_not_waited_for():
    stop = monitor(paths=EXTERNAL_PATHS)
    named = []
    now = 0.0
    while len(named) < 6:  # the second round: script, dashboard
        now += 0.001
        stop.sample(now, 1.0)
        named += stop.next_paths(now)
    assert named[-1] is StopPath.COMMAND
    stop.forget(frozenset({StopPath.COMMAND}), now)
    assert stop.next_paths(now) == [StopPath.SLIDER]


@pytest.mark.promise("P21")
def test_a_stop_is_tried_again_and_again_while_the_arm_moves():
    stop = monitor(paths=EXTERNAL_PATHS)
    named = []
    for k in range(2000):
        now = 0.001 * k
        stop.sample(now, 1.0)
        named += [(now, path) for path in stop.next_paths(now)]
    assert [path for _, path in named[:9]] == [*EXTERNAL_PATHS[1:], *EXTERNAL_PATHS]
    assert stop.rounds >= 5
    times = [now for now, _ in named]
    for (now, path), after in zip(named, times[1:], strict=False):
        assert after - now >= (0.099 if path is StopPath.PROTECTIVE else 0.024)


def test_without_any_measurement_every_way_is_tried():
    stop = monitor(speed=None)
    assert [path for k in range(150) for path in stop.next_paths(0.001 * k)] == list(ALL[1:])
    assert stop.course.standing_at is None


@pytest.mark.promise("P22")
def test_a_passing_zero_is_no_standstill():
    stop = monitor()
    for k in range(50):
        stop.sample(0.002 * k, 0.0 if k % STANDSTILL_SAMPLES else 0.5)
    assert stop.course.standing_at is None


def test_samples_from_before_the_stop_say_nothing_and_late_ones_are_not_counted_as_slow():
    stop = StopMonitor(1.0, 1.0, ALL, MonitoringLimits(), 0.3)
    now = 1.0005
    for k in range(20):  # 20 states of the 40 ms before the stop, read just after it
        stop.sample(now, 0.9, 0.96 + 0.002 * k)
        assert stop.next_paths(now) == []
    assert stop.course.slowed_at is None
    now = 1.04  # held up again: what comes now was measured from 2 ms after the stop on
    for k in range(20):
        measured = 1.002 + 0.002 * k
        stop.sample(now, 1.0 - 10.0 * max(0.0, measured - 1.006), measured)
        assert stop.next_paths(now) == []
    assert stop.course.slowed_at == now


@pytest.mark.parametrize("stuck", [True, False])
def test_neither_silence_nor_a_clock_that_stands_still_keeps_the_next_way_away(stuck):
    stop = StopMonitor(1.0, 1.0, ALL, MonitoringLimits(), 0.3)
    taken = {}
    for k in range(1, 600):
        now = 1.0 + 0.001 * k
        if stuck:
            stop.sample(now, 1.0, 1.001)
        for path in stop.next_paths(now):
            taken.setdefault(path, now - 1.0)
    assert list(taken) == list(ALL[1:])
    assert taken[StopPath.PROGRAM] < 0.025 + 0.05 + 0.002
    assert taken[StopPath.PROTECTIVE] <= 0.3 + 0.05 + 0.002


def test_ways_that_are_gone_are_not_taken():
    stop = monitor()
    stop.forget(frozenset({StopPath.PROGRAM, StopPath.SLIDER, StopPath.PROTECTIVE}), 0.0)
    assert {path for k in range(400) for path in stop.next_paths(0.001 * k)} == {StopPath.COMMAND}
    stop = monitor()
    stop.forget(frozenset({StopPath.DRIVER}), 0.001)
    assert stop.next_paths(0.001) == [StopPath.PROGRAM]  # the one in use is gone: no patience


def test_hurry_takes_the_next_way_at_once():
    stop = monitor()
    stop.sample(0.002, 0.9)
    assert stop.next_paths(0.002) == []
    stop.forget(frozenset({StopPath.DRIVER}), 0.003)
    assert stop.next_paths(0.003) == [StopPath.PROGRAM]


@given(st.lists(st.floats(0.0, 3.0), max_size=300), st.floats(0.0, 3.0) | st.none())
def test_standing_means_the_last_samples_were_slow_and_a_protective_stop_is_left_to_work(speeds, first):
    stop = monitor(first)
    quiet_until = 0.0
    for k, speed in enumerate(speeds):
        stop.sample(0.002 * k, speed)
        for path in stop.next_paths(0.002 * k):
            assert 0.002 * k >= quiet_until
            if path is StopPath.PROTECTIVE:
                quiet_until = 0.002 * k + 0.0999
        assert (stop.course.standing_at is not None) == (
            k + 1 >= STANDSTILL_SAMPLES and max(speeds[max(0, k + 1 - STANDSTILL_SAMPLES) : k + 1]) < 0.01
        )
