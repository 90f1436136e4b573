"""What a program is told of a stop: measured truth, and soon."""

import pytest

from coneskin.errors import Collision, RobotConnectionError, RobotRefused, SkinConnectionError
from coneskin.robot.journal import GuardEvent
from coneskin.scene_reader import parse_scene
from coneskin.session import Session
from coneskin.verdict import NOT_SEEN, STANDS, STILL_LEAVING, braking_time, death, stop_error

from .scenes import SERIAL_RETREAT

TOUCH = GuardEvent("stopping", 1.0, {"why": "touch"})
PLACE = GuardEvent("contact_placed", 1.0, {"sensor": "cuff", "link": "forearm", "u": 0.1234, "phi": 1.5708})
ARMED = GuardEvent("armed", 0.5, {})


@pytest.mark.parametrize(
    ("names", "outcome"),
    [
        (["latched"], STANDS),
        (["standstill", "latched"], STANDS),
        (["standstill"], STILL_LEAVING),
        (["slower"], NOT_SEEN),
        ([], NOT_SEEN),
        (["standstill", "latched", "stopping"], NOT_SEEN),  # something moved it again: the newest stop counts
        (["standstill", "latched", "stopping", "standstill", "latched"], STANDS),
        (["standstill", "retreating", "retreated", "stopping", "standstill", "latched"], STANDS),
    ],
)
def test_check_says_what_was_measured(names, outcome):
    session = Session(parse_scene(SERIAL_RETREAT), None, None, 1.0)
    session._log.events += [ARMED, TOUCH, PLACE, *(GuardEvent(name, 1.1, {"why": "again"}) for name in names)]
    session._log.ended = True  # nothing more will come, so nothing is waited for
    session._log.events.append(GuardEvent("ending", 2.0, {}))
    with pytest.raises(Collision, match=f"cuff on the forearm was touched at u = 123.4 mm, phi = 90.0 deg; {outcome}"):
        session.check()


def test_a_fault_is_not_called_a_touch():
    fault = GuardEvent("stopping", 1.0, {"why": "cuff: no valid frame"})
    error = stop_error(fault, PLACE, STANDS)
    assert type(error) is RobotRefused
    assert "cuff: no valid frame; the arm stands" in str(error)


def test_the_time_to_brake_is_that_of_the_gentlest_rule():
    # the UR10e's fastest joints do pi rad/s; 10 rad/s2 by default; four times 25 ms to find another way; 0.5 s
    scene = parse_scene(SERIAL_RETREAT)
    assert braking_time(scene) == pytest.approx(3.1416 / 10 + 0.1 + 0.5, abs=1e-3)
    rule = '[[reaction.rule]]\nlevel_above = 0.5\nkind = "stop"\ndeceleration_rad_s2 = 2.0\n'
    assert braking_time(parse_scene(SERIAL_RETREAT + rule)) == pytest.approx(3.1416 / 2 + 0.6, abs=1e-3)


def test_a_guard_that_died_is_told_by_the_error_that_it_died_of():
    for kind in (SkinConnectionError, RobotRefused, RobotConnectionError):
        assert type(death(GuardEvent("died", 0.0, {"what": "no", "error": kind.__name__}))) is kind
    assert type(death(GuardEvent("died", 0.0, {"what": "no", "error": "MissingExtra"}))) is RobotRefused
    assert type(death(GuardEvent("died", 0.0, {"what": "no"}))) is RobotConnectionError
