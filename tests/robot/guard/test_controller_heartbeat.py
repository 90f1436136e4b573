"""A program that depends on the heartbeat is known by the count that it found at its start."""

import pytest

from coneskin.robot.guard.controller_heartbeat import COUNT_PERIOD, ControllerHeartbeat, heartbeat_count
from coneskin.robot.ur.input_writers import decode_echo, heartbeat_lines
from coneskin.robot.ur.rtde_codec import Recipe


def started(at=100.0, echo_age=0.0, required=True):
    """A program that began at a time, and found the count of some time before."""
    heartbeat = ControllerHeartbeat(required)
    heartbeat.sample(at - 0.01, running=False)
    heartbeat.sample(at, running=True)
    heartbeat.feed(heartbeat_count(at - echo_age))
    return heartbeat


@pytest.mark.parametrize("at", [100.0, 2**30 * COUNT_PERIOD + 0.01, 2**31 * COUNT_PERIOD])
def test_a_program_that_found_the_count_of_its_start_depends_on_it(at):
    assert started(at).trouble(at + 10.0) == ""
    assert started(at).blocker() == ""


@pytest.mark.parametrize(("older", "depends"), [(5, True), (6, False)])
def test_a_report_may_be_five_counts_older_than_the_first_state_of_its_program(older, depends):
    heartbeat = started(100.01, echo_age=older * COUNT_PERIOD)
    assert (heartbeat.blocker() == "") is depends


@pytest.mark.parametrize("at", [100.0, 2**30 * COUNT_PERIOD + 0.01])
def test_a_count_from_before_its_start_is_that_of_another_program(at):
    heartbeat = started(at, echo_age=0.5)
    assert heartbeat.trouble(at + 0.49) == ""  # it may not have got there yet
    assert "goes on if the network is cut" in heartbeat.trouble(at + 0.51)
    assert heartbeat.trouble(at + 1.0) == ""  # said once
    heartbeat.sample(at + 2.0, running=False)
    heartbeat.sample(at + 2.1, running=True)
    assert heartbeat.trouble(at + 3.0) != ""  # and of the next one


def test_a_program_that_ran_before_its_start_was_seen_blocks_where_it_is_required():
    for required in (True, False):
        heartbeat = ControllerHeartbeat(required)
        assert heartbeat.blocker() == ""
        heartbeat.sample(100.0, running=True)
        assert bool(heartbeat.blocker()) is required


def test_the_count_is_never_zero_and_fits_a_register():
    assert heartbeat_count(0.0) == 1
    assert 0 < heartbeat_count(1e9) < 2**31


def test_the_lines_use_the_register_that_is_written_and_report_it():
    text = heartbeat_lines(4.0)
    assert text.splitlines() == [
        'rtde_set_watchdog("input_int_register_46", 4, "stop")',
        "write_output_integer_register(46, read_input_integer_register(46))",
    ]
    assert decode_echo(Recipe(("output_int_register_46",)).pack((7,))) == 7
