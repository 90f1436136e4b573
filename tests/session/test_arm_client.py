"""Requests of several threads over one channel: each gets its own answer, whoever has read it."""

import math
import threading

import pytest

from coneskin.core.channel import Channel, decode_json, encode_json, pair, wait_readable
from coneskin.core.errors import Collision, KinematicsError, RobotConnectionError, RobotRefused
from coneskin.robot.arm.models import arm_model
from coneskin.robot.driver.values import Waypoint
from coneskin.session.arm_client import ArmClient, _ArmRequests


@pytest.fixture
def ends():
    program, driver = (Channel(end) for end in pair())
    yield program, driver
    program.close()
    driver.close()


def asked(driver):
    """The next request that has come, and the number that it has."""
    wait_readable([driver], 60.0)
    (message,) = driver.receive()
    return decode_json(message)


def answer(driver, number, **values):
    driver.send(encode_json({"number": number, "ok": True, **values}))


def call(function, into):
    thread = threading.Thread(target=lambda: into.append(function()))
    thread.start()
    return thread


def test_a_thread_that_waits_for_a_move_does_not_keep_the_answer_of_another(ends) -> None:
    """Two threads read one channel: each threw away what the other one waited for."""
    program, driver = ends
    requests = _ArmRequests(program, lambda stopped: None)
    moved, stopped = [], []
    first = call(lambda: requests.do(do="move"), moved)
    number = asked(driver)["number"]
    second = call(lambda: requests.do(do="stop"), stopped)
    answer(driver, asked(driver)["number"], what="stop")
    second.join(60.0)
    assert [(one["what"]) for one in stopped] == ["stop"]
    assert moved == []
    answer(driver, number, what="move")
    first.join(60.0)
    assert [(one["what"]) for one in moved] == ["move"]


def test_a_request_that_was_held_up_until_it_was_void_is_sent_again_while_its_caller_waits(ends) -> None:
    program, driver = ends
    requests = _ArmRequests(program, lambda stopped: None)
    moved = []
    thread = call(lambda: requests.do(do="move"), moved)
    first = asked(driver)
    driver.send(encode_json({"number": first["number"], "ok": False, "stopped": False, "void": True, "why": "late"}))
    again = asked(driver)
    assert again["number"] != first["number"]
    assert again["sent"] >= first["sent"]
    answer(driver, again["number"], what="move")
    thread.join(60.0)
    assert [one["what"] for one in moved] == ["move"]


def test_answers_that_nobody_waits_for_any_more_are_not_kept(ends) -> None:
    program, driver = ends
    gone = []

    def check(stopped):
        if gone:
            raise RobotRefused("the guard has stopped the arm")

    requests = _ArmRequests(program, check)
    raised = []

    def ask():
        with pytest.raises(RobotRefused) as error:
            requests.do(do="move")
        raised.append(error.value)

    thread = call(ask, [])
    number = asked(driver)["number"]
    gone.append(True)
    thread.join(60.0)
    assert len(raised) == 1
    answer(driver, number)
    gone.clear()
    thread = call(lambda: requests.do(do="again"), raised)
    answer(driver, asked(driver)["number"], what="again")
    thread.join(60.0)
    assert raised[1]["what"] == "again"
    assert requests._answers == {}


@pytest.mark.parametrize(
    ("reply", "error", "words"),
    [
        ({"ok": False, "stopped": False, "why": "no"}, RobotRefused, "move: no"),
        ({"ok": False, "stopped": True, "why": "no"}, Collision, "touched"),
    ],
)
def test_what_is_refused_is_raised(ends, reply, error, words) -> None:
    program, driver = ends

    def check(stopped):
        if stopped:
            raise Collision("touched", None, True, "")

    thread = threading.Thread(target=lambda: driver.send(encode_json({"number": asked(driver)["number"], **reply})))
    thread.start()
    with pytest.raises(error, match=words):
        _ArmRequests(program, check).do(do="move")
    thread.join()


def test_a_driver_process_that_has_ended_is_told(ends) -> None:
    program, driver = ends
    driver.close()
    with pytest.raises(RobotConnectionError, match="the driver process has ended"):
        _ArmRequests(program, lambda stopped: None).do(do="move")


@pytest.mark.parametrize(
    ("waypoints", "words"),
    [
        ([], "a path needs at least one way point"),
        ([Waypoint.move_j([0.0] * 6), Waypoint.move_j([90.0] * 6)], r"q\[0\] must be within"),
        ([Waypoint.move_l([0.0] * 5)], "the target of way point 0 must be 6 finite numbers"),
        ([Waypoint.move_l([0.0] * 6, speed=0.0)], "way point 0 needs a speed and an acceleration above 0"),
        ([Waypoint.move_p([0.0] * 6, blend=-0.1)], "a blend"),
        ([Waypoint.move_l([0.0] * 6, acceleration=float("nan"))], "got"),
    ],
)
def test_a_path_that_cannot_be_is_refused_before_anything_is_sent(ends, waypoints, words) -> None:
    program, driver = ends
    arm = ArmClient(program, lambda stopped: None, arm_model("UR5e"), "nowhere")
    with pytest.raises(KinematicsError, match=words):
        arm.move_path(waypoints)
    assert driver.receive() == []


def test_a_way_point_may_be_slow_and_the_last_has_no_blend(ends) -> None:
    program, driver = ends
    arm = ArmClient(program, lambda stopped: None, arm_model("UR5e"), "nowhere")
    slow = Waypoint.move_l([0.0] * 6, speed=1e-3, acceleration=1e-3)
    assert arm._waypoint(0, slow).speed == 1e-3
    thread = call(lambda: arm.move_path([Waypoint.move_j([0.0] * 6, blend=0.1)] * 2), [])
    request = asked(driver)
    answer(driver, request["number"])
    thread.join(60.0)
    assert [point[-1] for point in request["waypoints"]] == [0.1, 0.0]


def test_a_payload_is_a_mass_and_its_centre(ends) -> None:
    program, driver = ends
    arm = ArmClient(program, lambda stopped: None, arm_model("UR5e"), "nowhere")
    for wrong in ((-0.1,), (math.nan,), (1.0, (0.0, 0.0)), (1.0, (0.0, 0.0, math.inf))):
        with pytest.raises(KinematicsError, match="a payload is a mass from 0 kg on"):
            arm.set_payload(*wrong)
    assert driver.receive() == []
    thread = call(lambda: arm.set_payload(0, [0.0, 0.01, 0.05]), [])
    request = asked(driver)
    answer(driver, request["number"])
    thread.join(60.0)
    assert (request["do"], request["mass"], request["centre"]) == ("set_payload", 0.0, [0.0, 0.01, 0.05])


def test_a_request_that_is_too_long_is_refused_and_not_waited_for(ends) -> None:
    """A path of 100 000 way points was dropped by the channel, and its program waited for ever."""
    program, _ = ends
    refused: list[str] = []

    def ask() -> None:
        try:
            requests.do(do="move_path", waypoints="x" * 5_000_000)
        except RobotRefused as exc:
            refused.append(str(exc))

    requests = _ArmRequests(program, lambda stopped: None)
    asking = threading.Thread(target=ask, daemon=True)
    asking.start()
    asking.join(60.0)
    program.hang_up()
    assert len(refused) == 1
    assert "move_path: the driver process does not take 50000" in refused[0]
