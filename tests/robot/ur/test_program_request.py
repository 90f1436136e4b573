"""Requests of the program to the driver process: what is taken, what is void, and what is answered."""

import json

import pytest

from coneskin.robot.driver.messages import (
    Heartbeat,
    Release,
    StatusReport,
    StopProgram,
)

from .fake_wheel import answers, ask, move, path, stops


def test_a_tool_is_set_for_the_program_unless_the_guard_forbids_it(driver):
    served, made, guard, program = driver
    ask(program, do="set_tcp", pose=[0.1] * 6)
    served.poll(0.0)
    assert answers(program)[0]["stopped"] is True
    guard.send(Release(7).encode())
    ask(program, do="set_tcp", pose=[0.1] * 6)
    ask(program, do="set_payload", mass=2.0, centre=[0.0] * 3, number=2)
    served.poll(0.0)
    assert answers(program) == [{"number": 1, "ok": True}, {"number": 2, "ok": True}]
    assert stops(made.control) == ["setTcp", "setPayload"]
    ask(program, do="move_j_ik", pose=[0.1] * 6, speed=1.0, acceleration=2.0, number=3)
    ask(program, do="set_tcp", pose=[0.2] * 6, number=4)
    served.poll(0.0)
    (refused,) = answers(program)
    assert (refused["number"], refused["ok"], refused["stopped"]) == (4, False, False)
    assert stops(made.control)[-1] == "moveJ_IK"


@pytest.mark.parametrize(
    "request_", [{"do": "dance"}, {"do": "move_j"}, {"do": "move_j", "q": 1}, {}, {"do": "speed_j", "qd": []}]
)
def test_a_bad_request_is_answered(driver, request_):
    served, _, guard, program = driver
    guard.send(Release(7).encode())
    program.send(json.dumps(request_).encode())
    served.poll(0.0)
    assert answers(program)[0]["ok"] is False


def test_a_number_beyond_all_floats_is_answered_and_does_not_end_the_driver(driver):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    ask(program, do="move_j", q=[0.0] * 6, speed=1.0, acceleration=10**400)
    assert served.poll(0.0)
    assert answers(program)[0]["ok"] is False
    assert "moveJ" not in stops(made.control)


@pytest.mark.parametrize("sent", [1e9, float("inf")])
def test_a_request_from_later_holds_no_longer_than_one_from_now(driver, now, sent):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    ask(program, do="speed_j", qd=[0.5] * 6, acceleration=2.0, duration=0.5, sent=sent)
    served.poll(0.0)
    now[0] += 0.49
    guard.send(Heartbeat().encode())
    served.poll(0.0)
    assert stops(made.control) == ["speedJ"]
    now[0] += 0.02
    guard.send(Heartbeat().encode())
    served.poll(0.0)
    assert "speedStop" in stops(made.control)


@pytest.mark.promise("P41")
def test_a_request_that_has_waited_for_long_is_void_and_says_its_number(driver, now):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    served.poll(0.0)
    ask(program, do="move_j", q=[0.0] * 6, speed=1.0, acceleration=2.0, number=41, sent=now[0] - 0.21)
    ask(program, do="speed_j", qd=[1.0] * 6, acceleration=2.0, duration=0.5, number=42, sent=now[0] - 3.0)
    ask(program, do="stop", acceleration=2.0, number=43, sent=now[0] - 3.0)  # a stop is never too late
    served.poll(0.0)
    told = answers(program)
    assert [(answer["number"], answer["ok"]) for answer in told] == [(41, False), (42, False), (43, True)]
    assert "it is void: it was sent 3.00 s ago" in told[1]["why"]
    assert stops(made.control) == ["stopJ"]


@pytest.mark.promise("P51")
@pytest.mark.parametrize(
    ("request_", "start", "stop"),
    [
        ({"do": "speed_j", "qd": [0.5] * 6, "acceleration": 2.0, "duration": 0.5}, "speedJ", "speedStop"),
        ({"do": "servo_j", "q": [0.5] * 6, "duration": 0.5}, "servoJ", "servoStop"),
        ({"do": "speed_l", "twist": [0.5] * 6, "acceleration": 2.0, "duration": 0.5}, "speedL", "speedStop"),
        ({"do": "servo_l", "pose": [0.5] * 6, "duration": 0.5}, "servoL", "servoStop"),
    ],
)
def test_speeds_and_positions_are_not_kept_for_a_program_that_sends_no_more(driver, now, request_, start, stop):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    for _ in range(5):  # renewed in time
        ask(program, sent=now[0], **request_)
        served.poll(0.0)
        now[0] += 0.4
        guard.send(Heartbeat().encode())
        served.poll(0.0)
    assert stop not in stops(made.control)
    guard.receive()
    now[0] += 0.11
    guard.send(Heartbeat().encode())
    served.poll(0.0)
    assert stops(made.control)[-1] == stop
    reports = [StatusReport.decode(message) for message in guard.receive()]
    assert any(report.kind == "remark" and "no new speed or servo command" in report.text for report in reports)
    count = len(stops(made.control))
    now[0] += 0.1
    served.poll(0.0)
    assert len(stops(made.control)) == count  # once
    ask(program, sent=now[0], **request_)  # the program may go on
    served.poll(0.0)
    assert stops(made.control)[-1] == start


@pytest.mark.parametrize(
    "refused",
    [
        {"do": "speed_j", "qd": [0.5] * 6, "acceleration": 2.0, "duration": 0.0},
        {"do": "servo_j", "q": [0.5] * 6, "duration": 20.0},
        {"do": "move_j", "q": [0.0] * 6, "speed": 1.0, "acceleration": 0.0},
        {"do": "move_l", "pose": [0.0] * 6, "speed": 1.0, "acceleration": float("nan")},
        {"do": "move_j", "q": [0.0] * 6, "speed": 1.0, "acceleration": 0.01},  # a stop with it would take minutes
        {"do": "stop", "acceleration": "x"},
        {"do": "dance"},
        {"do": "speed_j"},
    ],
)
def test_a_request_that_is_refused_does_not_renew_what_is_under_way(driver, now, refused):
    """The program caught what the refusal raised, and hung: its speeds moved the arm without end."""
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    ask(program, do="speed_j", qd=[0.5] * 6, acceleration=2.0, duration=0.3, sent=now[0])
    served.poll(0.0)
    now[0] += 0.1
    ask(program, sent=now[0], **refused)
    served.poll(0.0)
    assert [answer["ok"] for answer in answers(program)] == [True, False]
    now[0] += 0.21
    served.poll(0.0)
    assert stops(made.control)[-1] == "speedStop"


@pytest.mark.parametrize("duration", [0.0, -1.0, 10.1, float("nan"), None, "x"])
def test_a_duration_that_cannot_be_moves_nothing(driver, duration):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    ask(program, do="speed_j", qd=[0.5] * 6, acceleration=2.0, duration=duration)
    served.poll(0.0)
    assert answers(program)[0]["ok"] is False
    assert "speedJ" not in stops(made.control)


def test_a_path_is_announced_before_its_program_starts_anew_and_gets_a_watchdog_at_once(driver):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    path(program)
    served.poll(0.0)
    assert [call[0] for call in made.control.calls] == ["setWatchdog", "movePath", "setWatchdog", "kick"]
    (_, *entries), _ = made.control.calls[-3:-1]
    assert entries == [
        ("movej", "joints", [1.05, 1.4, 0.02]),
        ("movel", "pose", [0.3, 1.2, 0.0]),
        ("movep", "pose", [0.25, 1.2, 0.0]),
    ]
    assert [StatusReport.decode(m).kind for m in guard.receive()][-2:] == ["restarts", "restarted"]
    assert answers(program) == []  # it waits
    made.control.running = False
    served.poll(0.0)
    assert answers(program) == [{"number": 1, "ok": True}]


def test_a_path_that_gets_no_watchdog_is_stopped_and_not_reported_as_restarted(driver):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    served.poll(0.0)
    made.control.setWatchdog = lambda frequency: False
    path(program)
    served.poll(0.0)
    assert stops(made.control) == ["movePath", "stopJ"]
    (answer,) = answers(program)
    assert "did not take the watchdog of a path: it was stopped" in answer["why"]
    assert "restarted" not in [StatusReport.decode(m).kind for m in guard.receive()]


def test_a_stop_that_came_while_a_path_was_taken_is_the_next_thing_that_is_done(driver):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    taken = made.control.movePath

    def take(entries, asynchronous):
        guard.send(StopProgram(9.0).encode())
        return taken(entries, asynchronous)

    made.control.movePath = take
    path(program)
    served.poll(0.0)
    assert answers(program) == []
    served.poll(0.0)
    assert stops(made.control) == ["movePath", "stopJ"]
    assert [answer["stopped"] for answer in answers(program)] == [True]


@pytest.mark.parametrize(
    "waypoints",
    [[], [["j", True, [0.0] * 5, 1.0, 1.0, 0.0]], [["c", True, [0.0] * 6, 1.0, 1.0, 0.0]], [["j"]], 3, [[0.0] * 9]],
)
def test_a_path_that_cannot_be_moves_nothing(driver, waypoints):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    ask(program, do="move_path", waypoints=waypoints)
    served.poll(0.0)
    assert answers(program)[0]["ok"] is False
    assert "movePath" not in stops(made.control)


def test_progress_is_told_and_several_may_wait_for_the_end(driver):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    path(program, wait=False)
    ask(program, do="progress", number=2)
    ask(program, do="wait", number=3)
    ask(program, do="wait", number=4)
    served.poll(0.0)
    assert answers(program) == [
        {"number": 1, "ok": True},
        {"number": 2, "ok": True, "waypoint": 2, "mode": "move"},
    ]
    made.control.running = False
    served.poll(0.0)
    ask(program, do="progress", number=5)
    ask(program, do="wait", number=6)
    served.poll(0.0)
    assert [(a["number"], a.get("waypoint", "-")) for a in answers(program)] == [
        (3, "-"),
        (4, "-"),
        (5, None),
        (6, "-"),
    ]


@pytest.mark.parametrize(
    ("then", "why"),
    [
        ({"do": "stop", "acceleration": 2.0}, "the program itself has stopped the arm"),
        ({"do": "move_j", "q": [0.0] * 6, "speed": 1.0, "acceleration": 2.0}, "another motion of the program"),
    ],
)
def test_who_waits_for_a_move_that_the_program_has_ended_is_told_that_it_did_not_arrive(driver, then, why):
    served, _, guard, program = driver
    guard.send(Release(7).encode())
    move(program)
    served.poll(0.0)
    ask(program, number=2, **then)
    served.poll(0.0)
    first = answers(program)[0]
    assert (first["number"], first["ok"], first["stopped"]) == (1, False, False)
    assert why in first["why"]


def test_a_question_is_answered_while_nothing_moves_with_the_tool_that_is_set(driver):
    served, made, guard, program = driver
    guard.send(Release(7).encode())
    ask(program, do="ask", what="getForwardKinematics", values=[[0.1] * 6])
    ask(program, do="ask", what="stopScript", values=[], number=2)
    ask(program, do="speed_l", twist=[0.1] * 6, acceleration=1.0, duration=0.5, number=3)
    ask(program, do="ask", what="getForwardKinematics", values=[], number=4)
    served.poll(0.0)
    told = answers(program)
    assert told[0] == {"number": 1, "ok": True, "value": [0.5] * 6}
    assert [a["ok"] for a in told] == [True, False, True, False]
    assert "stopScript is not a question" in told[1]["why"]
    assert "must wait until the arm has arrived or was stopped" in told[3]["why"]
    (call,) = [call for call in made.control.calls if call[0] == "getForwardKinematics"]
    assert call[1] == [0.1] * 6
    assert call[2] == pytest.approx([0.0] * 6, abs=1e-11)
    assert any(call[2]), "exact zeros make the wheel send a packet of a wrong size"
