"""Interpreter mode: lines of its port, and what they do to the program that waits for them."""

from __future__ import annotations

import pytest

from coneskin.robot.sim.ports.client_interface import interpreter_reply
from tests.robot.sim.program_bench import FAR, Bench

PROGRAM = "def p():\n  global count = 0\n  interpreter_mode()\n  write_output_integer_register(1, 9)\nend\n"


@pytest.fixture
def waiting() -> Bench:
    """A program in interpreter mode."""
    bench = Bench(start_delay=0.0)
    bench.send(PROGRAM)
    bench.step(3)
    return bench


def say(bench: Bench, *lines: str) -> list[str]:
    return [interpreter_reply(bench.controller, line) for line in lines]


def test_statements_are_numbered_and_executed_in_order(waiting: Bench) -> None:
    assert say(waiting, "count = count + 5\n", "write_output_integer_register(0, count)") == [
        "ack: 1: count = count + 5",
        "ack: 2: write_output_integer_register(0, count)",
    ]
    waiting.step(2)
    assert waiting.controller.output_ints[0] == 5
    assert say(waiting, "statelastexecuted", "statelastinterpreted", "stateunexecuted", "statelastcleared") == [
        "state: 2: statelastexecuted",
        "state: 2: statelastinterpreted",
        "state: 0: stateunexecuted",
        "state: 0: statelastcleared",
    ]


def test_a_function_of_one_line_is_known_to_the_next_until_it_is_cleared(waiting: Bench) -> None:
    say(waiting, "def twice(x): return 2 * x end", "write_output_integer_register(0, twice(21))")
    waiting.step(2)
    assert waiting.controller.output_ints[0] == 42
    say(waiting, "clear_interpreter()")
    waiting.step(2)
    (reply,) = say(waiting, "write_output_integer_register(0, twice(1))")
    assert reply.startswith("discard: line 1: the controller has no function twice in")


def test_what_is_no_urscript_is_discarded_and_the_rest_goes_on(waiting: Bench) -> None:
    wrong, right = say(waiting, "count = (", "count = 3 write_output_integer_register(0, count)")
    assert wrong.startswith("discard: line 1: ")
    assert wrong.endswith(": count = (")
    assert right.startswith("ack: 1: ")
    waiting.step(2)
    assert waiting.controller.output_ints[0] == 3


def test_a_motion_is_aborted_and_what_waits_is_skipped(waiting: Bench) -> None:
    say(waiting, f"movej({FAR}, v=0.5)", "write_output_integer_register(0, 1)")
    waiting.step(200)
    assert waiting.controller.arm.moving
    assert say(waiting, "skipbuffer", "abort") == ["ack: 2: skipbuffer", "ack: 2: abort"]
    waiting.step(400)
    assert not waiting.controller.arm.moving
    assert 0.05 < waiting.controller.arm.q[0] < 1.0
    assert waiting.controller.output_ints[0] == 0
    assert waiting.events("abort") == []
    say(waiting, "write_output_integer_register(0, 2)")
    waiting.step(2)
    assert waiting.controller.output_ints[0] == 2


def test_the_program_goes_on_after_end_interpreter(waiting: Bench) -> None:
    say(waiting, "end_interpreter()")
    waiting.step(3)
    assert waiting.controller.output_ints[1] == 9
    assert say(waiting, "count = 1", "") == ["discard: no program is running: count = 1", ""]


def test_a_statement_that_fails_ends_the_program_and_is_named(waiting: Bench) -> None:
    say(waiting, "x = 1", "y = x / 0")
    waiting.step(3)
    assert waiting.controller.program is None
    assert "line 1: ZeroDivisionError: division by zero in 'y = x / 0'" in waiting.events("abort")[0]["reason"]


def test_it_is_not_entered_twice(waiting: Bench) -> None:
    say(waiting, "interpreter_mode()")
    waiting.step(3)
    assert "must not be called within interpreter mode" in waiting.events("abort")[0]["reason"]
