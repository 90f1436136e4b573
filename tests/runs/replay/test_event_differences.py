"""Differences of a replay are found bit by bit, and told in units."""

from typing import Any

import pytest

from coneskin.robot.guard.signals.journal import EventName, GuardEvent
from coneskin.runs.replay.event_differences import event_differences

STANDING = GuardEvent(EventName.STANDSTILL, 102.0, {"speed": 0.001, "paths": ["driver"], "clock_us": 5})


@pytest.mark.parametrize(
    ("time", "details", "line"),
    [
        (102.0022, {}, "2.0000 s, standstill: 2.2 ms later"),
        (101.9999999, {}, "2.0000 s, standstill: 0.0001 ms earlier"),
        (102.0, {"speed": 0.0017}, "2.0000 s, standstill: speed 0.0010 -> 0.0017 rad/s"),
        (102.0, {"speed": 0.0010000000000000002}, "2.0000 s, standstill: speed 0.001 rad/s, by +2.2e-19 rad/s"),
        (102.0, {"clock_us": 6}, "2.0000 s, standstill: clock_us 5 -> 6"),
        (102.0, {"paths": ["x"]}, "2.0000 s, standstill: paths 'driver' -> 'x'"),
        (102.0, {"more": 1}, "2.0000 s, standstill: more is new"),
        (102.0, {"speed": None}, "2.0000 s, standstill: speed is not known any more"),
    ],
)
def test_what_differs_is_told_with_its_unit(time: float, details: dict[str, Any], line: str) -> None:
    other = GuardEvent(EventName.STANDSTILL, time, {**STANDING.details, **details})
    assert list(event_differences([STANDING], [other], 100.0)) == [line]


def test_an_event_without_a_partner_does_not_move_the_others() -> None:
    ended = GuardEvent(EventName.ENDING, 103.0, {"what": "the guard was told to end"})
    both = [STANDING, ended]
    assert list(event_differences(both, both, 100.0)) == []
    (line,) = event_differences([ended], both, 100.0)
    assert line == "2.0000 s  standstill: 0.0010 rad/s, by the path driver: is new"
    assert list(event_differences([STANDING], [ended], 100.0)) == [
        "2.0000 s  standstill: 0.0010 rad/s, by the path driver: "
        "replayed as 3.0000 s  ending: the guard was told to end"
    ]
