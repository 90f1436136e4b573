"""A network that is cut while an external program moves the arm: the controller ends the program by itself."""

import subprocess
import sys

import pytest

from coneskin.robot.ur.input_writers import heartbeat_lines
from coneskin.session.session import guard
from tests.support.scenes import START

from .guarded_session import DEADLINE, FAR, assert_stopped_on_the_way, await_message, fast, refusal, scene_for, until

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the virtual skin needs a pseudo-terminal")

from coneskin.robot.sim.process import SimulatedController, free_host  # noqa: E402

from .test_external_control import send  # noqa: E402

MOVES = f"while True:\n    movej({FAR}, a=4, v=1)\n    movej({START}, a=4, v=1)\n  end\nend\n"
WITHOUT = f"def users():\n  {MOVES}"
WITH = f"def users():\n  {heartbeat_lines(1.0).replace(chr(10), chr(10) + '  ')}{MOVES}"
REQUIRED = {"[arm]": '[arm]\ncontroller_heartbeat = "required"'}


@pytest.fixture
def controller(tmp_path):
    log = tmp_path / "log.jsonl"
    with SimulatedController(model="UR5e", host=free_host(), start_q=START, log=log) as simulated:
        yield simulated


def assert_ended_by_the_watchdog(controller):
    """By the controller's own clock: 1 / 1 Hz, and what was on its way, more on a busy computer."""
    (cut,) = (event for event in controller.events("fault") if event["line"] == "cut network")
    ended = controller.events("watchdog")[-1]
    assert ended["silence"] == pytest.approx(1.0, abs=0.003)
    assert 0.0 < ended["time"] - cut["time"] < 2.0


@pytest.mark.promise("P54")
@pytest.mark.long
def test_a_program_with_the_lines_ends_when_the_network_is_cut(controller):
    with guard(scene_for(controller, REQUIRED, "external")) as session:
        send(controller.host, 30002, WITH)
        until(lambda: fast(controller))
        controller.call("cut network")
        until(lambda: controller.state()["runtime"] == "STOPPED")
        assert_ended_by_the_watchdog(controller)
        controller.wait_for_standstill()
        controller.call("restore network")
        assert session.wait_for(("latched",), DEADLINE) is not None


@pytest.mark.long
def test_a_motion_that_ur_rtde_sends_with_the_lines_ends_when_the_network_is_cut(controller):
    """The way of docs/do/guard-external.md: it needs no file of the control script, which the wheel does not hold."""
    pytest.importorskip("rtde_control", reason="the ur_rtde wheel is not installed (there is none for this Python)")
    code = (
        "import sys, rtde_control\n"
        "control = rtde_control.RTDEControlInterface(sys.argv[1])\n"
        "print('connected', flush=True)\n"
        "sys.stdin.readline()\n"
        "control.sendCustomScriptFunction('guarded_move', sys.argv[2])\n"
    )
    command = [sys.executable, "-c", code, controller.host, f"{heartbeat_lines(1.0)}movej({FAR}, a=4, v=1)\n"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as user:
        try:
            assert user.stdout.readline() == "connected\n"
            with guard(scene_for(controller, control="external")):
                user.stdin.write("\n")
                user.stdin.flush()
                until(lambda: fast(controller))
                assert controller.state()["program"] == "guarded_move"
                controller.call("cut network")
                until(lambda: controller.state()["runtime"] == "STOPPED")
                assert_ended_by_the_watchdog(controller)
                assert_stopped_on_the_way(controller)
                controller.call("restore network")
        finally:
            user.kill()


@pytest.mark.promise("P54")
@pytest.mark.long
def test_a_program_without_the_lines_is_stopped_where_they_are_required(controller):
    with guard(scene_for(controller, REQUIRED, "external")) as session:
        send(controller.host, 30002, WITHOUT)
        latched = session.wait_for(("latched",), DEADLINE)
        assert "goes on if the network is cut" in latched.details["why"]
        controller.wait_for_standstill()


@pytest.mark.long
def test_beside_a_program_without_the_lines_the_guard_does_not_become_active(controller):
    send(controller.host, 30002, WITHOUT)
    until(lambda: fast(controller))
    why = refusal(scene_for(controller, REQUIRED, "external"), "goes on if the network is cut")
    assert "goes on if the network is cut" in why


@pytest.mark.promise("P54")
@pytest.mark.long
def test_without_the_lines_it_is_said_where_they_are_not_required(controller):
    with guard(scene_for(controller, control="external")) as session:
        send(controller.host, 30002, WITHOUT)
        await_message(session, "goes on if the network is cut")
