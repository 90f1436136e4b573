"""Hold-ups of the computer: what was measured, against what a guard reports, and what to do about it."""

import io
import json

import pytest

from coneskin.commissioning.examination import hold_ups
from coneskin.commissioning.examination.hold_ups import begin_measurement, examine_hold_ups


class Measured:
    """A measurement that has ended."""

    def __init__(self, *late):
        self.told = json.dumps({"seconds": 10.0, "late": late})

    def communicate(self):
        return self.told, None


@pytest.mark.parametrize(
    ("late", "verdict", "value", "remedy"),
    [
        ((0.001, 0.019), "ok", "19 ms at most, 0 above 20 ms in 10 s", ""),
        ((0.001, 0.03, 0.04), "warning", "40 ms at most, 2 above 20 ms in 10 s", "end what else runs"),
        ((0.12,), "warning", "120 ms at most, 1 above 20 ms", "sends fewer frames a second"),
    ],
)
def test_what_holds_a_guard_up_is_said_with_a_remedy(late, verdict, value, remedy):
    found = examine_hold_ups(Measured(*late))
    assert (found.item, found.verdict) == ("computer, hold-ups", verdict)
    assert value in found.value
    assert "cores" in found.value
    assert remedy in found.remedy
    assert bool(found.remedy) is bool(remedy)


@pytest.mark.parametrize("may", [False, True])
def test_a_user_who_may_not_let_the_guard_come_first_is_told_how(monkeypatch, may):
    monkeypatch.setattr(hold_ups, "_may_come_first", lambda: may)
    assert ("limits.d" in examine_hold_ups(Measured(0.03)).remedy) is not may


def test_it_is_measured_in_a_process_of_its_own():
    with begin_measurement(0.05) as measurement:
        assert isinstance(measurement.stdout, io.TextIOBase)
        found = examine_hold_ups(measurement)
    assert measurement.returncode == 0
    assert "in 0.05 s" in found.value
