"""Clocks of several sources on this computer's time: a planted drift of each neither adds up nor looks like a lag."""

import random
import statistics

import pytest

from coneskin.skin.detection.frame.faults import Fault
from coneskin.skin.detection.frame.timing import FrameTiming, TimingLimits

PERIOD, SECONDS = 0.01, 600.0
WAY = 1e-3  # s; the quickest way of a frame to this computer
SETTLED = 2.0  # s


def follow(drift, limits, seed, seconds=SECONDS):
    """Errors of the time at which each frame was measured [s], and the faults, for a clock that is fast by a ratio."""
    draw, timing, errors, faults = random.Random(seed), FrameTiming(limits), [], []
    free = 0.0
    for number in range(round(seconds / PERIOD)):
        measured = number * PERIOD
        free = max(free, measured + WAY + draw.expovariate(1.0 / 2e-3))  # frames do not overtake one another
        clock = int(measured * (1.0 + drift) * 1e6) & 0xFFFFFFFF
        fault = timing.feed(number & 0xFFFF, clock, free)
        timing.seen_valid(free)
        if fault is not None:
            faults.append(fault)
        if measured > SETTLED:
            errors.append(free - timing.measured_age(free) - WAY - measured)
    return errors, faults


@pytest.mark.long
@pytest.mark.parametrize(("drifts", "limit"), [((9e-5, -9e-5), 1e-4), ((4e-3, -4e-3), 5e-3)])
def test_frames_of_two_clocks_that_part_are_put_on_one_time(drifts, limit):
    limits = TimingLimits(clock_drift=limit)
    found = [follow(drift, limits, seed) for seed, drift in enumerate(drifts)]
    assert [faults for _, faults in found] == [[], []]
    apart = [abs(a - b) for (a, b) in zip(*(errors for errors, _ in found), strict=True)]
    # between two quick frames, some 10 periods, an offset rises by the drift, and by the jitter of the quickest of them
    assert statistics.median(apart) < 0.5e-3 + 20 * limit * PERIOD
    assert max(apart) < 5e-3 + 100 * limit * PERIOD
    for errors, _ in found:  # and nothing is left of 600 s of drift, which are 54 ms and 2.4 s
        assert abs(statistics.fmean(errors[-1000:]) - statistics.fmean(errors[:1000])) < 0.5e-3 + 20 * limit * PERIOD


@pytest.mark.parametrize(("drift", "fault"), [(-1.5e-3, Fault.LATE), (1.5e-3, Fault.CLOCK_FAST)])
def test_a_clock_that_parts_faster_than_the_scene_says_is_a_fault(drift, fault):
    _, faults = follow(drift, TimingLimits(clock_drift=1e-4), 3, 120.0)
    assert faults
    assert set(faults) == {fault}
