"""Driver process on a twin of the wheel, with a clock that is set."""

import pytest

from coneskin.core.channel import Channel, pair
from coneskin.robot.ur.driver_process import _DriverProcess

from .fake_wheel import arm


@pytest.fixture
def now():
    """Return the driver's clock, to be set."""
    return [10.0]


@pytest.fixture
def driver(now):
    made = arm()
    (guard, guard_end), (program, program_end) = ((Channel(s) for s in pair()) for _ in range(2))
    served = _DriverProcess(made, guard_end, program_end, lambda: now[0])
    yield served, made, guard, program
    for channel in (guard, guard_end, program, program_end):
        channel.close()
