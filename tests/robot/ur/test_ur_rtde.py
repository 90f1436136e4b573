"""Motions by the wheel: each mode has its own stop, and what it refuses is an error; on a twin of the wheel."""

from contextlib import nullcontext
from types import SimpleNamespace

import pytest

from coneskin.core.errors import RobotConnectionError, RobotRefused
from coneskin.robot.driver.values import Waypoint
from coneskin.robot.ur import ur_rtde
from coneskin.robot.ur.ur_rtde import Mode, _rtde_errors, stop_time

from .fake_wheel import arm, stops


@pytest.mark.promise("P21")
@pytest.mark.parametrize(
    ("start", "stop"),
    [
        (lambda a: a.move("move_j", [0.0] * 6, 1.0, 1.0), "stopJ"),
        (lambda a: a.move("move_l", [0.0] * 6, 1.0, 1.0), "stopJ"),
        (lambda a: a.move("move_j_ik", [0.0] * 6, 1.0, 1.0), "stopJ"),
        (lambda a: a.move("move_l_fk", [0.0] * 6, 1.0, 1.0), "stopJ"),
        (lambda a: a.move_path([Waypoint.move_j([0.0] * 6)]), "stopJ"),
        (lambda a: a.speed("speed_j", [0.0] * 6, 1.0), "speedStop"),
        (lambda a: a.speed("speed_l", [0.0] * 6, 1.0), "speedStop"),
        (lambda a: a.servo("servo_j", [0.0] * 6, 0.1, 300.0), "servoStop"),
        (lambda a: a.servo("servo_l", [0.0] * 6, 0.1, 300.0), "servoStop"),
    ],
)
def test_each_mode_has_its_own_stop(start, stop):
    a = arm()
    start(a)
    a.stop(5.0)
    assert stops(a.control)[-1] == stop
    assert a.mode is Mode.IDLE


def test_no_motion_starts_on_a_live_thread_of_another_kind():
    a = arm()
    a.move("move_j", [0.0] * 6, 1.0, 1.0)
    a.speed("speed_j", [0.0] * 6, 1.0)
    a.servo("servo_j", [0.0] * 6, 0.1, 300.0)
    a.move("move_l", [0.0] * 6, 1.0, 1.0)
    assert stops(a.control) == ["moveJ", "stopJ", "speedJ", "speedStop", "servoJ", "servoStop", "moveL"]
    a.control.calls.clear()
    a.speed("speed_l", [0.0] * 6, 1.0)
    a.speed("speed_j", [0.0] * 6, 1.0)  # one thread of the wheel's program does both
    a.servo("servo_l", [0.0] * 6, 0.1, 300.0)
    a.speed("speed_l", [0.0] * 6, 1.0)
    a.move_path([Waypoint.move_l([0.0] * 6)])
    a.servo("servo_j", [0.0] * 6, 0.1, 300.0)
    assert stops(a.control) == [
        *("stopJ", "speedL", "speedJ", "speedStop", "servoL", "servoStop", "speedL", "speedStop"),
        *("movePath", "stopJ", "servoJ"),
    ]


@pytest.mark.parametrize(("looks", "runs"), [(3, True), (100_000, False)])
def test_a_program_that_starts_some_looks_after_its_upload_is_waited_for(monkeypatch, looks, runs):
    now = [100.0]

    def sleep(seconds):
        now[0] += seconds

    monkeypatch.setattr(ur_rtde, "time", SimpleNamespace(monotonic=lambda: now[0], sleep=sleep))
    a = arm()
    a.control.playing, a.control.late = False, looks
    with nullcontext() if runs else pytest.raises(RobotRefused, match="does not start ur_rtde's program again"):
        a.revive()
    assert [call[0] for call in a.control.calls] == ["kick", "reuploadScript", *["setWatchdog"] * runs]


def test_a_program_that_the_wheel_still_takes_to_run_starts_again_where_it_takes_no_command():
    """Its states come a moment late, later on a busy computer: a reset right after a stop left nothing running."""
    a = arm()
    taken = iter([False, True])
    a.control.setWatchdog = lambda frequency: a.control._note("setWatchdog", frequency) and next(taken)
    a.revive()
    assert [call[0] for call in a.control.calls] == ["setWatchdog", "kick", "reuploadScript", "setWatchdog"]


def test_a_program_of_another_that_ends_long_after_a_reset_starts_none_of_ours(monkeypatch):
    """The wheel calls any program running, and waits for its answer for as long as that runs."""
    a, clock = arm(), iter([100.0, 110.0])
    monkeypatch.setattr(ur_rtde, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    a.control.setWatchdog = lambda frequency: False
    with pytest.raises(RobotRefused, match=r"another program ran .* took no command for 10.0 s: reset"):
        a.revive()
    assert a.control.calls == []


def test_what_the_wheel_refuses_is_an_error():
    a = arm(accepts=False)
    with pytest.raises(RobotRefused, match="did not take moveJ: its program is not running"):
        a.move("move_j", [0.0] * 6, 1.0, 1.0)
    assert a.mode is Mode.IDLE
    with pytest.raises(RobotConnectionError, match="stopping: broken"), _rtde_errors("stopping"):
        raise RuntimeError("broken")


@pytest.mark.parametrize(
    "start",
    [
        lambda a: a.move("move_j", [0.0] * 6, 1.0, 1.0),
        lambda a: a.speed("speed_j", [0.0] * 6, 1.0),
        lambda a: a.servo("servo_j", [0.0] * 6, 0.1, 300.0),
    ],
)
def test_tool_and_payload_are_set_only_while_nothing_moves(start):
    a = arm()
    start(a)
    for setter in (lambda: a.set("set_tcp", [0.1] * 6), lambda: a.set("set_payload", 1.0, [0.0] * 3)):
        with pytest.raises(RobotRefused, match="must wait until the arm has arrived or was stopped"):
            setter()
    a.stop(5.0)
    a.set("set_tcp", [0.1] * 6)
    a.set("set_payload", 1.5, [0.0, 0.0, 0.04])
    assert a.control.calls[-2:] == [("setTcp", *[0.1] * 6), ("setPayload", 1.5, 0.0, 0.0, 0.04)]
    a.control.accepts = False
    with pytest.raises(RobotRefused, match="did not take setPayload"):
        a.set("set_payload", 1.0, [0.0] * 3)


def test_a_tool_of_zeros_is_none_and_no_packet_of_a_wrong_size():
    a = arm()
    a.ask("getForwardKinematics", [0.1] * 6)
    name, q, tool = a.control.calls[-1]
    assert (name, q) == ("getForwardKinematics", [0.1] * 6)
    assert 0.0 < max(map(abs, tool)) < 1e-9


@pytest.mark.parametrize(("deceleration", "seconds"), [(10.0, 0.65), (2.0, 2.05), (1.0, 3.3), (0.0, 3.3)])
def test_a_stop_has_the_time_that_a_joint_of_3_5_rad_per_s_takes_and_0_3_s_more(deceleration, seconds):
    """0.65 s at 10 rad/s2: docs/safety.md. However gentle it is, it has 3 s to brake."""
    assert stop_time(deceleration) == pytest.approx(seconds)
