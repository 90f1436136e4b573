"""Outcome of a guarded run for its program: what was measured, and soon."""

import pytest

from coneskin.core.errors import Collision, RobotConnectionError, RobotRefused, SkinConnectionError
from coneskin.robot.guard.signals.journal import GuardEvent
from coneskin.scene import required_packages
from coneskin.scene.reader import parse_scene
from coneskin.session.outcome import (
    NOT_CONFIRMED,
    STANDS,
    STILL_RETREATING,
    braking_time,
    exit_code,
    exit_error,
    stop_error,
)
from coneskin.session.session import Session

from ..scene.scenes import SERIAL_RETREAT

TOUCH = GuardEvent("stopping", 1.0, {"why": "touch", "stop": 1, "contact": {"number": 1}})
PLACE = GuardEvent(
    "contact_located", 1.0, {"number": 1, "sensor": "cuff", "link": "forearm", "u": 0.1234, "phi": 1.5708}
)
ACTIVATED = GuardEvent("activated", 0.5, {})


@pytest.fixture(autouse=True)
def _every_package_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """For some Pythons there is no ur-rtde."""
    monkeypatch.setattr(required_packages, "find_spec", lambda name: name)


@pytest.mark.parametrize(
    ("names", "outcome"),
    [
        (["latched"], STANDS),
        (["standstill", "latched"], STANDS),
        (["standstill"], STILL_RETREATING),
        (["decelerating"], NOT_CONFIRMED),
        ([], NOT_CONFIRMED),
        (["standstill", "latched", "stopping"], NOT_CONFIRMED),  # something moved it again: the newest stop counts
        (["standstill", "latched", "stopping", "standstill", "latched"], STANDS),
        (["standstill", "retreating", "retreated", "stopping", "standstill", "latched"], STANDS),
    ],
)
def test_check_says_what_was_measured(names, outcome):
    session = Session(parse_scene(SERIAL_RETREAT), None, None, 1.0)
    session._log.events += [ACTIVATED, TOUCH, PLACE, *(GuardEvent(name, 1.1, {"why": "again"}) for name in names)]
    session._log.ended = True  # nothing more will come, so nothing is waited for
    session._log.events.append(GuardEvent("ending", 2.0, {}))
    with pytest.raises(Collision, match=f"cuff on the forearm was touched at u = 123.4 mm, phi = 90.0 deg; {outcome}"):
        session.check()


def test_a_fault_is_not_called_a_touch():
    fault = GuardEvent("stopping", 1.0, {"why": "cuff: no valid frame"})
    error = stop_error(fault, PLACE, STANDS)
    assert type(error) is RobotRefused
    assert "cuff: no valid frame; the arm stands" in str(error)


def test_a_slow_arm_that_moves_into_its_touch_too_far_has_collided():
    stop = GuardEvent("stopping", 1.0, {"why": "while slow, the surface would move 3.0 mm", "contact": {"number": 1}})
    assert type(stop_error(stop, PLACE, STANDS, "while slow, the surface would move 3.0 mm")) is Collision
    assert exit_code([stop], arm=True) == 3


def test_the_time_to_brake_is_that_of_the_gentlest_rule():
    # the UR10e's fastest joints do pi rad/s; 10 rad/s2 by default; four times 25 ms to find another path; 0.5 s
    scene = parse_scene(SERIAL_RETREAT)
    assert braking_time(scene) == pytest.approx(3.1416 / 10 + 0.1 + 0.5, abs=1e-3)
    rule = '[[reaction.rule]]\nlevel_above = 0.5\nkind = "stop"\ndeceleration_rad_s2 = 2.0\n'
    assert braking_time(parse_scene(SERIAL_RETREAT + rule)) == pytest.approx(3.1416 / 2 + 0.6, abs=1e-3)


def test_a_guard_that_died_is_told_by_the_error_that_it_died_of():
    for kind in (SkinConnectionError, RobotRefused, RobotConnectionError):
        assert type(exit_error(GuardEvent("guard_exited", 0.0, {"what": "no", "error": kind.__name__}))) is kind
    assert type(exit_error(GuardEvent("guard_exited", 0.0, {"what": "no", "error": "MissingExtra"}))) is RobotRefused
    assert type(exit_error(GuardEvent("guard_exited", 0.0, {"what": "no"}))) is RobotConnectionError
