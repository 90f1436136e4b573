"""Driver process on a mocked arm: the guard comes first, and the arm is stopped when either side ends."""

import math

import pytest

from coneskin.robot.driver.liveness import GUARD_SILENCE, SETPOINT_SILENCE
from coneskin.robot.driver.messages import (
    DatedVelocity,
    EndReaction,
    Heartbeat,
    Release,
    SetJointVelocity,
    StatusReport,
    StopProgram,
)

from .fake_wheel import answers, ask, move, stops


def test_the_program_is_refused_until_the_guard_clears_it(driver):
    served, made, guard, program = driver
    move(program)
    assert served.poll(0.0)
    assert answers(program)[0]["stopped"] is True
    assert "moveJ" not in stops(made.control)
    guard.send(Release(7).encode())
    move(program)
    served.poll(0.0)
    assert stops(made.control) == ["moveJ"]


def test_a_stop_comes_before_what_the_program_asked_and_ends_its_wait(driver):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    move(program)
    served.poll(0.0)
    assert answers(program) == []  # it waits for the end of the move
    move(program)
    guard.send(StopProgram(9.0).encode())
    served.poll(0.0)
    assert stops(made.control) == ["moveJ", "stopJ"]
    assert [answer["stopped"] for answer in answers(program)] == [True, True]
    assert StatusReport("done").encode() in guard.receive()


def test_the_end_of_a_move_is_told(driver):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    move(program)
    served.poll(0.0)
    made.control.running = False
    served.poll(0.0)
    assert answers(program) == [{"number": 1, "ok": True}]


_MOVE = {"do": "move_j", "q": [0.0] * 6, "speed": 1.0, "acceleration": 2.0}
_MEANWHILE = [
    *({"do": "progress"}, {"do": "wait"}, {"do": "set_tcp", "pose": [0.0] * 6}, _MOVE),
    {"do": "speed_j", "qd": [0.1] * 6, "acceleration": 1.0, "duration": 0.5},
    {"do": "servo_j", "q": [0.1] * 6, "duration": 0.5},
]


@pytest.mark.parametrize(
    ("error", "why"),
    [
        (
            ValueError("The value is not within [0;3.14]"),
            "ValueError: moveJ: The value is not within [0;3.14]; speeds are in rad/s, of a straight move in m/s",
        ),
        (RuntimeError("no answer"), "RobotConnectionError: moveJ: no answer"),
    ],
)
def test_what_the_wheel_raises_is_told_with_the_call_that_raised_it(driver, error, why):
    served, made, guard, program = driver
    made.control.moveJ = fail(error)
    guard.send(Release(7).encode())
    move(program)
    served.poll(0.0)
    assert answers(program) == [{"number": 1, "ok": False, "stopped": False, "why": why}]


def fail(error):
    def call(*_):
        raise error

    return call


@pytest.mark.parametrize("meanwhile", [None, *_MEANWHILE], ids=lambda request: request and request["do"])
@pytest.mark.parametrize("end", ["program", "stop that fails", "value that the wheel refuses"])
def test_no_move_that_something_has_ended_is_told_to_have_arrived(driver, meanwhile, end):
    """Whatever another thread of the program asks for when that is found."""
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    move(program)
    served.poll(0.0)
    wheel = made.control
    if end == "program":
        wheel.running = wheel.playing = wheel.accepts = False
    elif end == "stop that fails":
        wheel.stopJ = fail(RuntimeError("no answer"))
    else:
        wheel.moveJ = wheel.speedJ = wheel.servoJ = fail(ValueError("the value is not within [0;3.14]"))
    if meanwhile:
        ask(program, **{**meanwhile, "number": 2})
    for _ in range(3):
        served.poll(0.0)
    told = {answer["number"]: answer for answer in answers(program)}
    assert not told.get(1, {}).get("ok"), told
    if end == "program":
        assert told[1]["stopped"]
        assert "was ended before the arm arrived" in told[1]["why"]
        ask(program, do="wait", number=3)  # of a move that was not waited for
        served.poll(0.0)
        assert answers(program)[0]["ok"] is False


@pytest.mark.parametrize("end", ["stop", "reset", "reset of an ended program"])
def test_nothing_is_waited_for_after_a_stop_of_the_program_or_a_reset(driver, end):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    move(program)
    served.poll(0.0)
    if end == "stop":
        ask(program, do="stop", number=2, acceleration=2.0)
    else:
        guard.send(StopProgram(9.0).encode())
        made.control.playing = end == "reset"
        served.poll(0.0)
        guard.send(Release(8).encode())
    served.poll(0.0)
    answers(program)
    ask(program, do="wait", number=3)
    served.poll(0.0)
    assert [(answer["number"], answer["ok"]) for answer in answers(program)] == [(3, True)]


def test_a_retreat_and_its_halt(driver):
    served, made, guard, _ = driver
    guard.send(DatedVelocity(10.0, SetJointVelocity((0.1, 0, 0, 0, 0, 0), 2.0)).encode())
    served.poll(0.0)
    guard.send(EndReaction(8.0).encode())
    served.poll(0.0)
    assert stops(made.control) == ["speedJ", "speedStop"]


@pytest.mark.parametrize("side", ["guard", "program"])
def test_when_either_side_ends_the_arm_is_stopped(driver, side):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    move(program)
    served.poll(0.0)
    (guard if side == "guard" else program).close()
    served.run()
    assert stops(made.control)[-1] == "stopJ"


def test_an_error_of_the_wheel_goes_to_the_guard(driver):
    served, made, guard, _ = driver
    made.control.accepts = False
    guard.send(DatedVelocity(10.0, SetJointVelocity((0.1, 0, 0, 0, 0, 0), 2.0)).encode())
    served.poll(0.0)
    notes = [StatusReport.decode(message) for message in guard.receive()]
    assert notes[0].kind == "error"
    assert "speedJ" in notes[0].text


def test_the_program_starts_again_only_after_command_0(driver):
    """The register of a latched speedJ is still there: a new program would execute it at once (see test_lifecycle)."""
    served, made, guard, _ = driver
    served.poll(0.0)
    made.control.playing = False
    made.control.calls.clear()
    served._kicked = -1.0
    served.poll(0.0)
    assert made.control.calls == []  # no kick without a program: each would be a line on the terminal
    guard.send(Release(7).encode())
    served.poll(0.0)
    assert [call[0] for call in made.control.calls] == ["kick", "reuploadScript", "setWatchdog"]
    guard.send(Release(7).encode())
    served.poll(0.0)
    assert "reuploadScript" not in [call[0] for call in made.control.calls[3:]]


def test_a_program_that_does_not_start_again_is_an_error(driver):
    served, made, guard, program = driver
    made.control.playing = made.control.accepts = False
    guard.send(Release(7).encode())
    served.poll(0.0)
    assert "does not start ur_rtde's program again" in StatusReport.decode(guard.receive()[-1]).text
    move(program)
    served.poll(0.0)
    assert answers(program)[0]["stopped"] is True


def test_a_silent_guard_counts_as_dead(driver, now):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    move(program)
    served.poll(0.0)
    for _ in range(40):
        now[0] += 0.05
        guard.send(Heartbeat().encode())
        served.poll(0.0)
    assert "stopJ" not in stops(made.control)
    now[0] += GUARD_SILENCE - 0.01
    served.poll(0.0)
    assert "stopJ" not in stops(made.control)
    now[0] += 0.02
    served.poll(0.0)
    assert stops(made.control)[-1] == "stopJ"
    (answer,) = answers(program)
    assert (answer["ok"], answer["stopped"]) == (False, True)
    assert "silent" in answer["why"]
    assert "silent" in StatusReport.decode(guard.receive()[-1]).text
    guard.send(Heartbeat().encode())
    move(program, now[0])
    served.poll(0.0)
    assert answers(program)[0]["stopped"] is True  # alive again is not enough: the guard has to clear it


@pytest.mark.promise("P43")
def test_a_guard_that_falls_silent_while_it_moves_the_arm_does_not_move_it_on(driver, now):
    served, made, guard, _ = driver
    for message in (Release(7), StopProgram(10.0), DatedVelocity(10.0, SetJointVelocity((0.1,) * 6, 4.0))):
        guard.send(message.encode())
    served.poll(0.0)
    before = len(stops(made.control))
    now[0] += SETPOINT_SILENCE - 0.01
    served.poll(0.0)
    assert len(stops(made.control)) == before
    now[0] += 0.02
    served.poll(0.0)
    assert stops(made.control)[before:] == ["speedStop"]
    assert f"silent for {SETPOINT_SILENCE:g} s" in StatusReport.decode(guard.receive()[-1]).text
    now[0] += 100.0  # the arm stands, and no heartbeat is due any more
    served.poll(0.0)
    assert stops(made.control)[before:] == ["speedStop"]


@pytest.mark.promise("P43")
def test_a_setpoint_that_was_held_up_with_the_guard_does_not_move_an_arm_that_was_stopped_for_it(driver, now):
    served, made, guard, _ = driver
    setpoint = DatedVelocity(10.0, SetJointVelocity((0.1,) * 6, 4.0))
    for message in (Release(7), StopProgram(10.0), setpoint):
        guard.send(message.encode())
    served.poll(0.0)
    now[0] += SETPOINT_SILENCE + 0.01
    served.poll(0.0)
    sent = len(made.control.calls)
    guard.send(setpoint._replace(decided=now[0]).encode())  # the guard runs again, and decides before it looks
    served.poll(0.0)
    assert "speedJ" not in [call[0] for call in made.control.calls[sent:]]
    guard.send(StopProgram(10.0).encode())  # it has seen what happened
    guard.send(setpoint._replace(decided=now[0]).encode())
    served.poll(0.0)
    assert "speedJ" in [call[0] for call in made.control.calls[sent:]]


@pytest.mark.promise("P43")
@pytest.mark.parametrize(("decided", "moves"), [(9.91, True), (9.89, False), (-math.inf, False), (math.nan, False)])
def test_a_setpoint_that_was_held_up_anywhere_moves_nothing(driver, decided, moves):
    """As where the guard was frozen while it sent the first one, or this process before it read it."""
    served, made, guard, _ = driver
    for message in (Release(7), StopProgram(10.0), DatedVelocity(decided, SetJointVelocity((0.1,) * 6, 4.0))):
        guard.send(message.encode())
    served.poll(0.0)
    assert ("speedJ" in [call[0] for call in made.control.calls]) == moves


def test_a_stop_that_came_during_a_release_is_served_before_the_first_request(driver, now):
    served, made, guard, program = driver
    revive = made.revive

    def take_long() -> None:
        revive()
        guard.send(StopProgram(10.0).encode())
        now[0] += 0.1
        move(program, now[0])

    made.revive = take_long
    guard.send(Release(7).encode())
    served.poll(0.0)
    served.poll(0.0)
    assert "moveJ" not in [call[0] for call in made.control.calls]


def test_a_sign_of_life_is_no_new_speed(driver, now):
    served, made, guard, _ = driver
    for message in (Release(7), StopProgram(10.0), DatedVelocity(10.0, SetJointVelocity((0.1,) * 6, 4.0))):
        guard.send(message.encode())
    served.poll(0.0)
    before = len(stops(made.control))
    for _ in range(4):
        now[0] += 0.03
        guard.send(Heartbeat().encode())
        served.poll(0.0)
    assert stops(made.control)[before:] == ["speedStop"]


def test_speeds_that_waited_are_overtaken_by_what_came_later(driver):
    served, made, guard, _ = driver
    for message in (
        Release(7),
        StopProgram(10.0),
        *[DatedVelocity(10.0, SetJointVelocity((0.1 * k,) * 6, 4.0)) for k in range(9)],
        Heartbeat(),
    ):
        guard.send(message.encode())
    served.poll(0.0)
    assert [call[2] for call in made.control.calls if call[0] == "speedJ"] == [pytest.approx(0.8)]
    for message in (*[DatedVelocity(10.0, SetJointVelocity((0.1 * k,) * 6, 4.0)) for k in range(9)], EndReaction(10.0)):
        guard.send(message.encode())
    served.poll(0.0)
    assert [call[0] for call in made.control.calls if call[0].startswith("speed")] == ["speedJ", "speedStop"]


def test_it_ends_on_request_and_first_limits_its_own_end(driver):
    served, made, guard, program = driver
    order = []
    served._on_end = lambda: order.append([call[0] for call in made.control.calls])
    guard.send(Release(7).encode())
    move(program)
    served.poll(0.0)
    served.end()
    served.run()
    assert order == [["setWatchdog", "moveJ", "kick"]]  # before the stop, which may block for minutes
    assert stops(made.control)[-1] == "stopJ"


def test_the_watchdog_is_kicked(driver):
    served, made, _, _ = driver
    served.poll(0.0)
    assert ("kick",) in made.control.calls


def test_it_waits_for_its_next_kick_or_for_what_is_void_sooner(driver, now):
    served = driver[0]
    waits = []
    served.poll = waits.append  # it ends run, because it returns None
    served._kicked = now[0] - 0.005
    served.run()
    served._expires = now[0] + 0.004
    served.run()
    served._expires, served._patience, served._heard = math.inf, GUARD_SILENCE, now[0] - GUARD_SILENCE + 0.002
    served.run()
    assert waits == pytest.approx([0.035, 0.004, 0.002])


def test_a_stop_of_the_program_that_fails_leaves_no_stream_going_on(driver):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    ask(program, do="speed_j", qd=[0.5] * 6, acceleration=2.0, duration=0.5)
    served.poll(0.0)
    guard.receive()

    def fail(_):
        raise RuntimeError("the wheel has lost it")

    made.control.speedStop = fail
    ask(program, do="stop", acceleration=2.0, number=2)
    served.poll(0.0)
    assert stops(made.control) == ["speedJ", "stopJ"]
    (note,) = (StatusReport.decode(message) for message in guard.receive())
    assert (note.kind, "a stop of the program has failed" in note.text) == ("error", True)
    move(program)
    served.poll(0.0)
    assert [answer["ok"] for answer in answers(program)] == [True, False, False]
    assert stops(made.control) == ["speedJ", "stopJ"]


def test_a_stop_does_not_wait_behind_all_that_threads_have_asked_for(driver):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    taken = made.control.speedJ

    def take(*values):
        guard.send(StopProgram(9.0).encode())  # while the first of them is carried out
        return taken(*values)

    made.control.speedJ = take
    for number in range(1, 4):
        ask(program, do="speed_j", qd=[0.5] * 6, acceleration=2.0, duration=0.5, number=number)
    served.poll(0.0)
    assert stops(made.control) == ["speedJ", "speedStop"]
    assert [(answer["number"], answer["ok"]) for answer in answers(program)] == [(1, True), (2, False), (3, False)]


def test_the_retreat_of_the_guard_does_not_end_with_the_speeds_of_the_program(driver, now):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    ask(program, do="speed_j", qd=[0.5] * 6, acceleration=2.0, duration=0.05, sent=now[0])
    served.poll(0.0)
    guard.send(DatedVelocity(10.0, SetJointVelocity((0.1,) * 6, 4.0)).encode())
    served.poll(0.0)
    now[0] += 0.09
    served.poll(0.0)
    assert "speedStop" not in stops(made.control)


def test_a_release_is_acknowledged_by_its_number_and_not_where_the_program_does_not_start(driver):
    served, made, guard, _ = driver
    guard.send(Release(41).encode())
    served.poll(0.0)
    assert StatusReport("released", "41").encode() in guard.receive()
    made.control.playing = made.control.accepts = False
    guard.send(Release(42).encode())
    served.poll(0.0)
    assert StatusReport("released", "42").encode() not in guard.receive()


def test_it_says_before_a_call_that_may_block_for_how_long(driver):
    served, _, guard, _ = driver
    announced = []
    served._work = announced.append
    guard.send(StopProgram(7.0).encode())
    served.poll(0.0)
    assert announced == [0.0, pytest.approx(3.5 / 7.0 + 0.3), 0.0]


def test_a_stop_that_the_program_asks_for_is_not_ended_by_the_watchdog_and_one_of_the_guard_comes_first(driver):
    """At 3 rad/s it takes 0.3 s and more, in which nothing kicks: the program ended, and that was a fault."""
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    served.poll(0.0)
    for number, end in enumerate(
        ({"do": "stop", "acceleration": 2.0}, {"do": "servo_j", "q": [0.0] * 6, "duration": 1.0})
    ):
        ask(program, do="speed_j", qd=[0.5] * 6, acceleration=2.0, duration=1.0)
        made.control.calls.clear()
        ask(program, number=2, **end)
        served.poll(0.0)
        calls = [call for call in made.control.calls if call[0] in ("setWatchdog", "speedStop")]
        assert [call[0] for call in calls] == ["setWatchdog", "speedStop", "setWatchdog"], number
        assert (1.0 / calls[0][1], calls[2][1]) == (pytest.approx(3.5 / 2.0 + 0.3), 4.0)  # as long as it may take
    made.control.calls.clear()
    guard.send(StopProgram(9.0).encode())
    served.poll(0.0)
    assert [call[0] for call in made.control.calls if call[0] != "kick"] == ["servoStop"]
