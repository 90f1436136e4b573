"""A guard beside a program that knows nothing of it: whatever moves the arm is stopped, and the arm retreats.

The simulated controller runs the programs; nothing of ours but the guard's own sockets and its reader touches it.
"""

import json
import math
import os
import re
import signal
import socket
import subprocess
import sys
import time
from functools import partial
from itertools import count

import pytest

from coneskin.core.errors import Collision, RobotRefused
from coneskin.runs.replay.run import read_run
from coneskin.session.session import guard
from tests.support.scenes import START
from tests.support.sweep import sweep

from .guarded_session import (
    DEADLINE,
    assert_short_slices,
    fast,
    kill,
    push_joints,
    scene_for,
    scene_text,
    until,
    until_undisturbed,
)

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the virtual skin needs a pseudo-terminal")

from coneskin.robot.arm.kinematics import forward  # noqa: E402
from coneskin.robot.arm.models import arm_model  # noqa: E402
from coneskin.robot.sim.process import SimulatedController, free_host  # noqa: E402
from coneskin.robot.sim.urscript.values import values_of  # noqa: E402
from coneskin.robot.ur.rtde_connection import RtdeConnection  # noqa: E402

GOAL = [math.radians(150.0), *START[1:]]
RAW = f"def users():\n  while True:\n    movej({GOAL}, a=4, v=1)\n    movej({START}, a=4, v=1)\n  end\nend\n"
POSE = list(values_of(forward(arm_model("UR5e"), [START[0] + 1.2, *START[1:]])))
RTDE = "import sys, rtde_control\nc = rtde_control.RTDEControlInterface(sys.argv[1])\n"
WHEEL = pytest.mark.skipif(
    subprocess.run([sys.executable, "-c", "import rtde_control"], capture_output=True).returncode != 0,
    reason="the ur_rtde wheel is not installed (there is none for this Python)",
)


@pytest.fixture
def controller(tmp_path):
    program = tmp_path / "play.script"
    program.write_text(RAW)
    host = free_host()
    with SimulatedController(model="UR5e", host=host, start_q=START, program=program) as simulated:
        yield simulated


def external(simulated, changes=None):
    return scene_for(simulated, changes, "external")


def send(host, port, text):
    with socket.create_connection((host, port), DEADLINE) as sock:
        sock.sendall(text.encode())
        if port == 29999:
            with sock.makefile() as lines:  # one reader: its buffer may hold both lines
                lines.readline()
                assert lines.readline() == "Starting program\n"
        sock.shutdown(socket.SHUT_WR)
        while sock.recv(65536):  # closed before the controller has read all, the connection loses what was sent
            pass


class Child:
    """A user's program with ur_rtde, in a process of its own."""

    def __init__(self, code):
        self.code = RTDE + code

    def start(self, host):
        self.process = subprocess.Popen(
            [sys.executable, "-c", self.code, host], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )

    def end(self):
        self.process.kill()
        self.process.wait()


class Bytes:
    """A user's program that the controller runs by itself."""

    def __init__(self, port, text):
        self.port, self.text = port, text

    def start(self, host):
        send(host, self.port, self.text)

    def end(self):
        pass


PROGRAMS = {
    "synchronous moveJ": (lambda: Child(f"print(c.moveJ({GOAL}, 1.0, 4.0))"), [WHEEL]),
    "synchronous moveL": (lambda: Child(f"print(c.moveL({POSE}, 0.8, 4.0))"), [WHEEL]),
    "speedJ streaming": (
        lambda: Child("import time\nwhile c.speedJ([1, 0, 0, 0, 0, 0], 4.0, 0.0):\n  time.sleep(0.002)"),
        [WHEEL],
    ),
    "servoJ streaming": (
        lambda: Child(
            f"import time\nq = {START}\nfor k in range(4000):\n"
            "  q[0] += 0.002\n  c.servoJ(q, 0.0, 0.0, 0.002, 0.1, 300.0)\n  time.sleep(0.0018)"
        ),
        [WHEEL],
    ),
    "raw URScript": (lambda: Bytes(30002, RAW), ()),
    "dashboard play": (lambda: Bytes(29999, "play\n"), ()),
}
SHORT = "raw URScript"  # the program of the short run; the others are long


@pytest.fixture
def run(controller):
    """Start a program, once the guard is there, and wait until it moves the arm."""
    started = []

    def start(name):
        program = PROGRAMS[name][0]()
        started.append(program)
        program.start(controller.host)
        until(lambda: max(map(abs, controller.state()["qd"])) > 0.6)
        return program

    yield start
    for program in started:
        program.end()


def go_back(controller):
    """Move the arm to where its programs begin, without a guard."""
    if math.dist(controller.state()["q"], START) > 1e-3:
        send(controller.host, 30002, f"def back():\n  movej({START}, a=4, v=2)\nend\n")
        until(lambda: math.dist(controller.state()["q"], START) < 1e-3)
        until(lambda: controller.state()["runtime"] == "STOPPED")


@pytest.mark.promise("P25")
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[*marks, *([] if name == SHORT else [pytest.mark.long])])
        for name, (_, marks) in PROGRAMS.items()
    ],
)
def test_whatever_moves_the_arm_is_stopped_and_the_arm_retreats(controller, run, name, tmp_path):
    far = external(controller, {'kind = "retreat"': 'kind = "retreat"\narm_distance_mm = 300'})  # the whole of its way
    paths = (tmp_path / f"run{number}.rec" for number in count())

    def attempt():
        path = next(paths)
        go_back(controller)
        with guard(far, recording=path) as session:
            assert controller.state()["runtime"] == "STOPPED"  # the guard is armed before there is any program
            program = run(name)
            session.touch(0.13, 1.55, duration=5.0)  # or until the arm moves away
            assert session.wait_for(("latched",), DEADLINE) is not None
            state = controller.wait_for_standstill()
            time.sleep(0.5)
            assert controller.state()["q"] == state["q"], "the arm moves again"
            program.end()
            with pytest.raises(Collision):
                session.check()
        recorded = read_run(path)
        assert recorded.replay().same
        assert recorded.events[-1].name == "ending", recorded.events[-4:]  # its last word too is in the recording
        return recorded.events

    found = until_undisturbed(attempt)
    events = {event.name: event for event in found}
    assert events["standstill"].details["paths"] == ["program"], [e.name for e in found]
    assert "retreated" in events, events["latched"].details
    assert events["retreated"].details["complete"] is True, events["retreated"].details
    # 0.5 mm are left for braking, and one look of 2 ms at 150 mm/s
    assert events["retreated"].details["progress"] == pytest.approx(0.030, abs=0.001)


@pytest.mark.long
def test_it_gives_way_to_a_push(controller, run):
    scene = external(controller, {"retreat": "comply", "distance_mm = 30": "distance_mm = 200"})

    def attempt():
        push_joints(controller, scene, force=0.0)
        with guard(scene) as session:
            run("raw URScript")
            session.touch(0.13, 1.55, duration=1.0, force=20.0)
            assert session.wait_for(("stopping",), DEADLINE) is not None
            push_joints(controller, scene)
            assert session.wait_for(("latched",), DEADLINE) is not None
            controller.wait_for_standstill()
        return session.events

    (over,) = (event.details for event in until_undisturbed(attempt) if event.name == "retreated")
    assert over["why"] == "the touch is over"
    assert 0.005 < over["progress"] < 0.2


@pytest.mark.promise("P43")
@pytest.mark.long
@pytest.mark.parametrize(("gone", "number"), [(("guard",), signal.SIGKILL), (("guard", "watchdog"), signal.SIGSTOP)])
def test_without_its_guard_a_retreat_ends(controller, run, gone, number):
    far = "distance_mm = 400\ntime_budget_s = 30\nspeed_mm_s = 50"

    def attempt():
        with guard(external(controller, {"distance_mm = 30": far})) as session:
            run("raw URScript")
            session.touch(0.13, 1.55, duration=0.2)
            assert session.wait_for(("retreating", "latched"), DEADLINE) is not None
            until(lambda: any(controller.state()["qd"]) or over(session))
            for name in gone:
                kill(session, name, number)
            stopped_at = controller.wait_for_standstill()["q"]
            time.sleep(0.3)
            assert controller.state()["q"] == stopped_at
            for name in gone:
                kill(session, name, signal.SIGCONT)
            return session.events

    def over(session):
        return any(event.name in ("retreated", "latched") for event in session.events)

    assert "retreating" in [event.name for event in until_undisturbed(attempt)]


@pytest.mark.long
def test_with_its_registers_taken_it_does_not_start(controller):
    with RtdeConnection(controller.host) as other:
        other.ask_inputs(("input_int_register_47",))
        with pytest.raises(RobotRefused, match="input_int_register_47"):
            guard(external(controller)).__enter__()
        with guard(external(controller, {"retreat": "stop"})):
            pass  # one that only stops needs none


@pytest.mark.long
def test_a_program_that_moves_a_latched_arm_is_stopped_again(controller, run):
    with guard(external(controller)) as session:
        run("raw URScript")
        session.touch(0.13, 1.55, duration=0.2)
        assert session.wait_for(("latched",), DEADLINE) is not None
        seen = len(session.events)
        send(controller.host, 30002, RAW)  # a user's program that heals itself
        again = session.wait_for(("latched",), DEADLINE, after=seen)
        assert "then something moved the arm" in again.details["why"]
        controller.wait_for_standstill()
        session.reset()
        send(controller.host, 30002, RAW)
        until(lambda: fast(controller))


@pytest.mark.promise("P42")
@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_without_its_guard_the_watchdog_stops_the_arm(controller, run, number):
    with guard(external(controller)) as session:
        run("raw URScript")
        kill(session, "guard", number)
        controller.wait_for_standstill()
        if number is signal.SIGSTOP:
            kill(session, "guard", signal.SIGCONT)
            latched = session.wait_for(("latched",), DEADLINE)
            # what it misses first depends on how much the sockets and the port kept for it
            assert any(word in latched.details["why"] for word in ("no ", "silent", "frames are missing"))
        time.sleep(0.3)
        assert not any(controller.state()["qd"])


@pytest.mark.promise("P45")
@pytest.mark.parametrize("number", sweep([signal.SIGKILL, signal.SIGSTOP]))
@pytest.mark.long
def test_without_both_the_guarding_program_stops_the_arm(controller, run, number):
    with guard(external(controller)) as session:
        assert_short_slices(session, "guard", "watchdog")
        run("raw URScript")
        for name in ("watchdog", "guard"):
            kill(session, name, number)
        controller.wait_for_standstill()
        time.sleep(0.3)
        assert not any(controller.state()["qd"])
        for name in ("watchdog", "guard"):
            kill(session, name, signal.SIGCONT)


@pytest.mark.promise("P40")
@pytest.mark.long
@pytest.mark.parametrize("name", ["watchdog", "second"])
def test_a_watchdog_that_is_frozen_is_missed(controller, run, name):
    with guard(external(controller)) as session:
        run("raw URScript")
        kill(session, name, signal.SIGSTOP)
        latched = session.wait_for(("latched",), DEADLINE)
        assert ("second" in latched.details["why"]) == (name == "second")
        controller.wait_for_standstill()
        kill(session, name, signal.SIGCONT)


@pytest.mark.long
def test_without_its_watchdog_the_guard_stops_the_arm_and_does_not_arm_again(controller, run):
    with guard(external(controller)) as session:
        run("raw URScript")
        kill(session, "watchdog")
        latched = session.wait_for(("latched",), DEADLINE)
        assert "guard watchdog has ended" in latched.details["why"]
        controller.wait_for_standstill()
        with pytest.raises(RobotRefused, match="guard watchdog has ended"):
            session.reset()


@pytest.mark.promise("P24")
@pytest.mark.long
@pytest.mark.parametrize(("fault", "left"), [("close scripts", "command"), ("close dashboard", "program")])
def test_a_way_to_stop_that_is_gone_stops_the_arm_by_another(controller, run, fault, left):
    with guard(external(controller)) as session:
        run("raw URScript")
        controller.call(fault)
        standing = session.wait_for(("standstill",), DEADLINE)
        assert standing.details["paths"] == [left]
        assert session.wait_for(("latched",), DEADLINE) is not None
        controller.wait_for_standstill()
        with pytest.raises(RobotRefused, match="which a stop may need"):
            session.reset()


@pytest.mark.promise("P24")
@pytest.mark.long
def test_with_all_connections_gone_at_once_the_watchdog_opens_new_ones(controller, run):
    with guard(external(controller, {"[arm]": "[arm]\nslider_stop = false"})) as session:
        run("raw URScript")
        guarding = session._processes.children["guard"].pid
        os.kill(guarding, signal.SIGSTOP)  # so that it sees both at once
        controller.call("close scripts")
        controller.call("close dashboard")
        os.kill(guarding, signal.SIGCONT)
        standing = session.wait_for(("standstill",), DEADLINE)
        assert "watchdog" in standing.details["paths"]
        assert session.wait_for(("latched",), DEADLINE) is not None
        controller.wait_for_standstill()


@pytest.mark.long
def test_leaving_the_guard_stops_the_arm(controller, run):
    with guard(external(controller)):
        run("dashboard play")
    assert not any(controller.state()["qd"])


@pytest.mark.long
def test_the_arm_is_not_ours_to_move(controller):
    with (
        guard(external(controller)) as session,
        pytest.raises(RobotRefused, match="another program moves the arm"),
    ):
        session.arm.move_j(GOAL)


def fast_or_over(controller, child):
    return fast(controller) or child.poll() is not None


@pytest.mark.long
def test_the_command_line_beside_a_program(controller, tmp_path):
    """``coneskin guard`` as a user runs it; its exit code says that a collision ended it."""
    for at in (5, 15, 45):  # s; before it the guard has to be active and the arm on its way
        touched = f"[[source.touch]]\nstart_s = {at}\nend_s = {at}.3\nu_mm = 130\nphi_deg = 89\n[reaction]"
        (tmp_path / "scene.toml").write_text(scene_text(controller.host, {"[reaction]": touched}, "external"))
        command = [sys.executable, "-m", "coneskin", "guard", str(tmp_path / "scene.toml"), "--once", "--json"]
        child = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        try:
            lines = iter(child.stdout.readline, "")
            assert any(json.loads(line)["name"] == "activated" for line in lines)
            send(controller.host, 29999, "play\n")
            until(partial(fast_or_over, controller, child))
            in_time = child.poll() is None
            _, said = child.communicate(timeout=DEADLINE)
        finally:
            child.kill()
            child.wait()
        assert child.returncode == 3, said
        if in_time:
            break
        send(controller.host, 30002, "def stand():\n  stopj(4)\nend\n")
        controller.wait_for_standstill()
    (u_mm,) = re.findall(r"was touched at u = ([0-9.]+) mm", said)
    assert float(u_mm) == pytest.approx(130.0, abs=1.0)  # noise, and the ramp of the touch
    controller.wait_for_standstill()
