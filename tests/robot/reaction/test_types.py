"""Settings of a reaction."""

from __future__ import annotations

import math

import pytest

from coneskin.core.errors import RobotRefused
from coneskin.robot.reaction.types import Reaction


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
