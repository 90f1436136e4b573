"""A stop counts when measured speed says so."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coneskin.robot.stop_watch import OWNED, STEADY, StopWatch, Way

ALL = OWNED


def watch(speed=1.0, ways=ALL, budget=0.3):
    return StopWatch(0.0, speed, ways, 0.025, budget, 0.01)


def test_a_stop_that_works_needs_one_way():
    stop = watch()
    for k in range(60):
        now = 0.002 * (k + 1)
        stop.sample(now, max(0.0, 1.0 - 10.0 * max(0.0, now - 0.004)))
        assert stop.next_ways(now) == []
    assert stop.used == [Way.OWNER]
    # 1 rad/s at 10 rad/s2 after 4 ms: 0.05 rad/s less at 10 ms (or one cycle later by rounding), standing at 104 ms
    assert 0.0099 < stop.slowed_at < 0.0121
    assert 0.104 <= stop.standing_at <= 0.104 + 0.002 * STEADY


def test_an_arm_that_was_still_speeding_up_has_slowed_when_it_is_below_its_top():
    stop = watch(speed=0.5)
    for now, speed in ((0.002, 0.55), (0.004, 0.58), (0.006, 0.57)):
        stop.sample(now, speed)
        assert stop.slowed_at is None
    stop.sample(0.008, 0.52)
    assert stop.slowed_at == 0.008


def test_ways_come_one_by_one_without_slowdown_and_at_once_after_the_budget():
    stop = watch()
    times = {}
    for k in range(200):
        now = 0.001 * k
        stop.sample(now, 1.0)
        for way in stop.next_ways(now):
            times[way] = now
    # a look each millisecond: the sum of patiences may round to just behind one
    assert times == {w: pytest.approx(0.025 * (k + 1), abs=0.0011) for k, w in enumerate(ALL[1:])}
    late = watch(budget=0.03)
    late.sample(0.01, 0.5)  # it slows, but does not get there
    assert late.next_ways(0.029) == []
    assert late.next_ways(0.031) == [Way.SCRIPT, Way.DASHBOARD, Way.PROTECTIVE]
    assert late.next_ways(1.0) == []


def test_without_any_measurement_every_way_is_tried():
    stop = watch(speed=None)
    assert [way for k in range(200) for way in stop.next_ways(0.001 * k)] == list(ALL[1:])
    assert stop.standing_at is None


def test_a_passing_zero_is_no_standstill():
    stop = watch()
    for k in range(50):
        stop.sample(0.002 * k, 0.0 if k % STEADY else 0.5)
    assert stop.standing_at is None


def test_samples_from_before_the_stop_say_nothing_and_late_ones_are_not_counted_as_slow():
    stop = StopWatch(1.0, 1.0, ALL, 0.025, 0.3, 0.01, 0.05)
    now = 1.0005
    for k in range(20):  # 20 states of the 40 ms before the stop, read just after it
        stop.sample(now, 0.9, 0.96 + 0.002 * k)
        assert stop.next_ways(now) == []
    assert stop.slowed_at is None
    now = 1.04  # held up again: what comes now was measured from 2 ms after the stop on
    for k in range(20):
        measured = 1.002 + 0.002 * k
        stop.sample(now, 1.0 - 10.0 * max(0.0, measured - 1.006), measured)
        assert stop.next_ways(now) == []
    assert stop.slowed_at == now


@pytest.mark.parametrize("stuck", [True, False])
def test_neither_silence_nor_a_clock_that_stands_still_keeps_the_next_way_away(stuck):
    stop = StopWatch(1.0, 1.0, ALL, 0.025, 0.3, 0.01, 0.05)
    taken = {}
    for k in range(1, 600):
        now = 1.0 + 0.001 * k
        if stuck:
            stop.sample(now, 1.0, 1.001)
        for way in stop.next_ways(now):
            taken[way] = now - 1.0
    assert list(taken) == list(ALL[1:])
    assert taken[Way.SCRIPT] < 0.025 + 0.05 + 0.002
    assert taken[Way.PROTECTIVE] <= 0.3 + 0.05 + 0.002


def test_ways_that_are_gone_are_not_taken():
    stop = watch()
    stop.forget(frozenset({Way.SCRIPT, Way.PROTECTIVE}), 0.0)
    assert [way for k in range(400) for way in stop.next_ways(0.001 * k)] == [Way.DASHBOARD]
    stop = watch()
    stop.forget(frozenset({Way.OWNER}), 0.001)
    assert stop.next_ways(0.001) == [Way.SCRIPT]  # the one in use is gone: no patience


def test_hurry_takes_the_next_way_at_once():
    stop = watch()
    stop.sample(0.002, 0.9)
    assert stop.next_ways(0.002) == []
    stop.hurry(0.003)
    assert stop.next_ways(0.003) == [Way.SCRIPT]


@given(st.lists(st.floats(0.0, 3.0), max_size=300), st.floats(0.0, 3.0) | st.none())
def test_standing_means_the_last_samples_were_slow_and_no_way_is_named_twice(speeds, first):
    stop = watch(first)
    named = []
    for k, speed in enumerate(speeds):
        stop.sample(0.002 * k, speed)
        named += stop.next_ways(0.002 * k)
        assert (stop.standing_at is not None) == (
            k + 1 >= STEADY and max(speeds[max(0, k + 1 - STEADY) : k + 1]) < 0.01
        )
    assert len(named) == len(set(named))
