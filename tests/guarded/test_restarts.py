"""A program that starts again at once, beside a guard: the arm stands, stays, and is called standing only then."""

import subprocess
import sys
import time

import pytest

from coneskin.core.errors import Collision
from coneskin.session.session import guard
from tests.support.scenes import START

from .guarded_session import FAR, kill, scene_for, until

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the virtual skin needs a pseudo-terminal")

from coneskin.robot.sim.process import SimulatedController, free_host  # noqa: E402

from .test_external_control import WHEEL  # noqa: E402

STOP = {'kind = "retreat"\ndistance_mm = 30': 'kind = "stop"'}
#: an ordinary loop around ur_rtde; its waits between two attempts [s]
LOOP = f"""
import sys, time, rtde_control
c = rtde_control.RTDEControlInterface(sys.argv[1])
goals, k = ({FAR}, {START}), 0
while True:
    if c.moveJ(goals[k % 2], 1.0, 4.0):
        k += 1
    else:
        time.sleep(float(sys.argv[2]))
        c.reuploadScript()
"""
#: raw text, sent again and again; its acceleration moves the arm though each upload brakes it first
RESEND = f"""
import socket, sys, time
s = socket.create_connection((sys.argv[1], 30003))
while True:
    s.sendall(b"def users():\\n  movej({FAR}, a=20, v=1)\\nend\\n")
    time.sleep(float(sys.argv[2]))
"""
WAITS = (0.005, 0.02, 0.1, 0.3)


@pytest.fixture
def controller():
    with SimulatedController(model="UR5e", host=free_host(), start_q=START) as simulated:
        yield simulated


@pytest.fixture
def run(controller):
    started = []

    def start(code, wait):
        started.append(
            subprocess.Popen(
                [sys.executable, "-c", code, controller.host, str(wait)],
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
        )
        until(lambda: max(map(abs, controller.state()["qd"])) > 0.15)

    yield start
    for program in started:
        program.kill()
        program.wait()


def assert_it_stays(controller):
    at = controller.state()
    assert not any(at["qd"])
    end = time.monotonic() + 2.0
    while time.monotonic() < end:
        assert controller.state()["q"] == at["q"], "it was told that the arm stands, and it moves"


def assert_the_program_hears_that_it_stands(session):
    until(lambda: any(event.name == "stopping" for event in session.events))
    with pytest.raises(Collision, match="the arm stands"):
        session.check()


@pytest.mark.promise("P26")
@pytest.mark.long
@pytest.mark.parametrize(
    ("code", "wait"),
    [
        *[pytest.param(LOOP, wait, id=f"loop {wait}", marks=WHEEL) for wait in WAITS[::2]],
        *[pytest.param(RESEND, wait, id=f"resend {wait}") for wait in WAITS[1::2]],  # one needs 10 ms to start at all
    ],
)
def test_a_program_that_starts_again_at_once_is_stopped_for_good(controller, run, code, wait):
    with guard(scene_for(controller, STOP, "external")) as session:
        run(code, wait)
        session.touch(0.13, 1.55, duration=0.5)
        assert_the_program_hears_that_it_stands(session)
        assert_it_stays(controller)


@pytest.mark.promise("P21")
@pytest.mark.long
@pytest.mark.parametrize("code", [pytest.param(LOOP, id="loop", marks=WHEEL), pytest.param(RESEND, id="resend")])
def test_with_only_the_data_connection_left_the_slider_stops_it(controller, run, code):
    with guard(scene_for(controller, STOP, "external")) as session:
        run(code, 0.02)
        controller.call("cut scripts")
        controller.call("cut dashboard")
        session.touch(0.13, 1.55, duration=0.5)
        assert_the_program_hears_that_it_stands(session)
        assert_it_stays(controller)
        assert controller.state()["slider"] == 0.0
        assert any(event.details.get("path") == "slider" for event in session.events if event.name == "escalated")


@pytest.mark.long
def test_without_its_guard_a_program_that_starts_again_is_stopped_for_good(controller, run):
    with guard(scene_for(controller, STOP, "external")) as session:
        run(RESEND, 0.02)
        for name in ("watchdog", "guard"):
            kill(session, name)
        until(lambda: any(event.name == "fallback_stop" and event.details["stands"] for event in session.events))
        state = controller.state()
        assert state["safety"] == "PROTECTIVE_STOP" or state["slider"] == 0.0
        assert_it_stays(controller)
