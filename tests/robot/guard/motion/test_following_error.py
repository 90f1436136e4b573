"""The monitor of a motion of ours: what ends it at once, what after a while, and what it lets pass."""

import pytest

from coneskin.robot.driver.values import ControllerState
from coneskin.robot.guard.motion.setpoint_stream import _FollowingErrorMonitor
from coneskin.robot.reaction.types import JointVelocity

REST = (0.0,) * 5


def moving(time, speed):
    return ControllerState(time, time, (0.0, *REST), (speed, *REST), True, False, True)


def commanded(speed=0.2, acceleration=4.0):
    monitor = _FollowingErrorMonitor(0.0)
    monitor.command(JointVelocity((speed, *REST), acceleration, 0.1, 0.0))
    return monitor


@pytest.mark.promise("P30")
def test_five_millimetres_towards_the_touch_end_it_at_once():
    assert not commanded().exceeded(moving(0.002, 0.2), -0.0049)
    assert commanded().exceeded(moving(0.002, 0.2), -0.0051)


@pytest.mark.promise("P30")
def test_a_faster_motion_than_any_command_ends_it_after_five_samples():
    monitor = commanded()
    found = [monitor.exceeded(moving(0.002 * k, 0.31), 0.0) for k in range(1, 7)]
    assert found == [False] * 4 + [True] * 2


def test_another_motion_ends_it_after_a_quarter_of_a_second_and_the_time_to_speed_up():
    monitor = commanded()
    allowed = 0.25 + 0.2 / 4.0
    assert not monitor.exceeded(moving(allowed - 0.001, -0.1), 0.0)
    assert monitor.exceeded(moving(allowed + 0.001, -0.1), 0.0)


def test_no_command_takes_more_than_another_quarter_of_a_second_to_speed_up():
    monitor = commanded(speed=0.2, acceleration=0.4)
    assert not monitor.exceeded(moving(0.499, -0.1), 0.0)
    assert monitor.exceeded(moving(0.501, -0.1), 0.0)


def test_a_slower_motion_in_the_same_direction_goes_on():
    monitor = commanded()
    assert not any(monitor.exceeded(moving(0.1 * k, 0.02), 0.0) for k in range(1, 20))
