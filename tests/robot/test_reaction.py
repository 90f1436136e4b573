from __future__ import annotations

import math
from dataclasses import replace

import pytest

from coneskin.errors import RobotRefused
from coneskin.robot.reaction import (
    ArmState,
    ContactOnLink,
    JointVelocity,
    Reaction,
    RetreatPlan,
    Stop,
    react,
    retreat_step,
)
from coneskin.robot.ur_models import model

ARM = model("UR10e")
STATE = ArmState(3.0, (0.3, -1.2, 1.1, 0.4, 0.5, 0.6), (0.1, 0.2, -0.3, 0.0, 0.0, 0.0))
TOUCH = ContactOnLink(3, (0.3, 0.0, 0.06), (0.0, 0.0, 1.0))


def test_no_touch_no_reaction() -> None:
    assert react(ARM, STATE, [], Reaction()) is None


def test_stop_is_a_stop() -> None:
    assert react(ARM, STATE, [TOUCH], Reaction(kind="stop", deceleration=7.0)) == (Stop(7.0, "touch on link 3"), None)


def test_retreat_stops_at_once_and_brings_the_plan() -> None:
    answer = react(ARM, STATE, [TOUCH], Reaction(deceleration=7.0))
    assert answer is not None
    stop, plan = answer
    assert stop == Stop(7.0, "touch on link 3")
    assert isinstance(plan, RetreatPlan)
    assert plan.start_time == 3.0
    assert isinstance(retreat_step(plan, replace(STATE, time=3.3)), JointVelocity)


@pytest.mark.parametrize(
    ("contacts", "words"),
    [
        ([replace(TOUCH, location_valid=False)], "link 3; no retreat: the place of the touch"),
        (
            [TOUCH, replace(TOUCH, link=5, location_valid=False)],
            "link 3, 5; no retreat: the place of the touch on link 5",
        ),
        ([replace(TOUCH, link=0)], "link 0; no retreat: the base"),
        ([TOUCH, replace(TOUCH, normal=(0.0, 0.0, -1.0))], "link 3; no retreat: no way out that leads away from all 2"),
    ],
)
def test_where_there_is_no_way_out_it_stops_and_says_why(contacts: list[ContactOnLink], words: str) -> None:
    answer = react(ARM, STATE, contacts, Reaction())
    assert answer is not None
    stop, plan = answer
    assert plan is None
    assert stop.deceleration == Reaction().deceleration
    assert words in stop.reason


def test_a_touch_stops_even_an_arm_that_reports_nonsense() -> None:
    answer = react(ARM, replace(STATE, q=(math.nan,) * 6), [TOUCH], Reaction())
    assert answer is not None
    assert answer[1] is None
    assert "must be finite" in answer[0].reason


def test_the_same_gives_the_same() -> None:
    assert react(ARM, STATE, [TOUCH], Reaction()) == react(ARM, STATE, [TOUCH], Reaction())


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ({"kind": "flee"}, "reaction kind must be one of slow, comply, retreat, stop, got 'flee'"),
        ({"distance": 0.0}, "reaction distance must be above 0 and at most 0.5 m, got 0.0"),
        ({"distance": 50.0}, "reaction distance must be above 0 and at most 0.5 m, got 50.0"),
        ({"speed": -0.1}, "reaction speed must be above 0 and at most 1.5 m/s"),
        ({"deceleration": math.nan}, "reaction deceleration must be above 0 and at most 40.0 rad/s"),
        ({"acceleration": 41.0}, "reaction acceleration must be above 0 and at most 40.0 rad/s"),
        ({"time_budget": math.inf}, "reaction time_budget must be above 0 and at most 60.0 s"),
    ],
)
def test_settings_that_cannot_be_are_refused(setting: dict[str, object], words: str) -> None:
    with pytest.raises(RobotRefused, match=words.replace("/", ".").replace("'", ".")):
        Reaction(**setting)  # type: ignore[arg-type]
