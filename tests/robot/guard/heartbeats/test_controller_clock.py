"""When a state was measured, whenever it came to be read."""

from hypothesis import given
from hypothesis import strategies as st

from coneskin.robot.guard.heartbeats.controller_clock import ControllerClock

CYCLE = 0.002


def run(clock, delays, start=1000.0, offset=500.0, rate=1.0):
    """Feed states of every cycle, each read so much later; what comes of it beside the truth."""
    results = []
    for k, delay in enumerate(delays):
        true = start + rate * CYCLE * k
        results.append((clock.measured_at(true + delay, start - offset + CYCLE * k), true, true + delay))
    return results


@given(st.lists(st.floats(0.0, 0.1), min_size=1, max_size=200))
def test_never_before_it_was_measured_never_after_it_was_read(delays):
    quickest = float("inf")
    for (measured, true, read), delay in zip(run(ControllerClock(), delays), delays, strict=True):
        quickest = min(quickest, delay)
        # 1e-9: differences of numbers near 1000 s, which have 1e-13 each
        assert true - 1e-9 <= measured <= read
        assert abs(measured - true - quickest) < 1e-9  # off by the quickest reading so far, no more


def test_drift_of_100_ppm_does_not_pile_up():
    results = run(ControllerClock(), [0.0002 if k % 7 else 0.0001 for k in range(60_000)], rate=1.0 + 1e-4)
    worst = max(abs(measured - true) for measured, true, _ in results)
    assert worst < 2 * 5.0 * 1e-4 + 0.0003  # two windows of 5 s at 100 ppm, and the delay itself


def test_a_controller_that_starts_anew():
    clock = ControllerClock()
    run(clock, [0.0001] * 10)
    assert clock.measured_at(2000.0, 0.002) == 2000.0  # nothing is known of its clock yet
    assert abs(clock.measured_at(2000.010, 0.004) - 2000.002) < 1e-9
