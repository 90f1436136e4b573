"""Lock on an arm: the second guard of a computer is refused, with a line that says what to do."""

import os
import socket
import sys

import pytest

from coneskin.core.errors import RobotRefused
from coneskin.session.guard_run import _arm_lock

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux has names of sockets that need no file")


@pytest.mark.promise("P60")
def test_a_second_guard_of_one_arm_is_refused_and_two_names_are_one_arm():
    now = [0.0]

    def wait(seconds):
        now[0] += seconds

    with _arm_lock("127.77.1.1"), _arm_lock("127.77.1.2"):
        with pytest.raises(RobotRefused, match=r"the arm at 127\.77\.1\.1, process \d+ of user"):
            _arm_lock("127.77.1.1", 3.0, wait, lambda: now[0]).__enter__()
        assert now[0] == pytest.approx(3.0, abs=0.1)
        with _arm_lock("localhost", 0.0), pytest.raises(RobotRefused, match=r"the arm at 127\.0\.0\.1"):
            _arm_lock("127.0.0.1", 0.0).__enter__()


def test_a_lock_that_is_held_names_its_holder_and_one_that_no_guard_holds_is_said_to_be_none():
    with (
        _arm_lock("127.77.1.4"),
        pytest.raises(RobotRefused, match=f"process {os.getpid()} of user {os.getuid()}: end"),
    ):
        _arm_lock("127.77.1.4", 0.0).__enter__()
    with socket.socket(socket.AF_UNIX) as taken:
        taken.bind("\0coneskin guard of 127.77.1.4")
        with pytest.raises(RobotRefused, match="a program that is none and has taken its name"):
            _arm_lock("127.77.1.4", 0.0).__enter__()


def test_the_guard_of_a_program_that_was_killed_has_time_to_end():
    first = _arm_lock("127.77.1.3")
    first.__enter__()
    with _arm_lock("127.77.1.3", 3.0, lambda _: first.__exit__(None, None, None)), pytest.raises(RobotRefused):
        _arm_lock("127.77.1.3", 0.0).__enter__()
