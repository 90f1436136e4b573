"""How a guarded arm starts, goes on and ends when something around it is wrong; with the unmodified wheel."""

import os
import resource
import signal
import sys
import time

import pytest

from coneskin.errors import Collision, RobotConnectionError, RobotRefused
from coneskin.replay import read_run, replay
from coneskin.robot import channel
from coneskin.session import guard

from .guarded import GOAL, START, assert_stopped_on_the_way, fast, kill, run_until_moving, scene_for, until

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the virtual skin needs a pseudo-terminal")
pytest.importorskip("rtde_control", reason="the ur_rtde wheel is not installed (there is none for this Python)")

from coneskin.robot.foreign import ForeignStops  # noqa: E402
from coneskin.robot.sim_process import SimulatedController, free_host  # noqa: E402
from coneskin.robot.stop_watch import Way  # noqa: E402
from coneskin.robot.ur_rtde import UrArm  # noqa: E402

RETREAT = 'kind = "retreat"'


@pytest.fixture
def controller():
    with SimulatedController(model="UR5e", host=free_host(), start_q=START) as simulated:
        yield simulated


# ---- reactions with the real wheel


def test_slow_by_the_controllers_own_slider_and_back(controller):
    scene = scene_for(controller, {RETREAT: 'kind = "slow"\nslow_to = 0.3'})
    with guard(scene) as session:
        thread, raised = run_until_moving(controller, session)
        session.touch(0.13, 1.55, duration=0.3)
        until(lambda: controller.state()["slider"] == pytest.approx(0.3))
        until(lambda: 0.2 < controller.state()["qd"][0] < 0.4)
        assert session.wait_for(("resumed",), 5.0) is not None
        until(lambda: controller.state()["slider"] == 1.0)
        thread.join(20)
        assert raised == [None]  # it arrives, late, and nobody is told of a collision
        assert controller.state()["q"] == pytest.approx(GOAL, abs=1e-3)


def test_a_slider_that_somebody_else_owns_is_one_clear_line(controller):
    import rtde_io

    other = rtde_io.RTDEIOInterface(controller.host)
    try:
        scene = scene_for(controller, {RETREAT: 'kind = "slow"'})
        with pytest.raises(RobotRefused, match=r"a slow reaction needs the speed slider .* in use"):
            guard(scene, start_timeout=5.0).__enter__()
    finally:
        other.disconnect()


def test_comply_gives_way_and_latches_when_the_push_ends(controller):
    scene = scene_for(controller, {RETREAT: 'kind = "comply"\nspeed_mm_s = 60'})
    with guard(scene) as session:
        thread, raised = run_until_moving(controller, session)
        session.touch(0.13, 1.55, duration=0.5)
        thread.join(20)
        assert isinstance(raised[0], Collision)
        made = session.wait_for(("retreated",), 5.0)
        assert made.details["why"] == "the touch is over"
        # from about 0.15 s on, when the arm stands, at 60 mm/s and with 50 ms of damping: 18 mm
        assert 0.005 < made.details["progress"] < 0.03
        assert_stopped_on_the_way(controller)


# ---- a latched arm stays where it is


@pytest.mark.parametrize("safe", [True, False])
def test_the_arm_never_starts_by_itself_when_the_control_program_starts_again(controller, safe):
    """The register still says speedJ, and a program that starts again executes it: without our care it does."""
    with UrArm(controller.host, 1.0) as arm, ForeignStops(controller.host) as stops:
        arm.speed_j([0.5, 0.0, 0.0, 0.0, 0.0, 0.0], 4.0)
        until(lambda: controller.state()["qd"][0] > 0.45)
        assert stops.use(Way.SCRIPT, 10.0)
        controller.wait_standing()
        until(lambda: controller.state()["runtime"] == "STOPPED")
        stood = controller.state()["q"]
        if safe:
            arm.revive()
        else:
            arm._control.reuploadScript()
        until(lambda: controller.state()["runtime"] == "PLAYING")
        time.sleep(0.3)
        assert (controller.state()["q"] == stood) is safe
        stops.use(Way.SCRIPT, 10.0)


def test_after_a_stop_by_another_way_a_person_lets_it_move_again(controller):
    with guard(scene_for(controller)) as session:
        session.arm.speed_j([0.5, 0.0, 0.0, 0.0, 0.0, 0.0], 4.0)
        until(lambda: controller.state()["qd"][0] > 0.45)
        kill(session, "owner", signal.SIGSTOP)  # so that another way has to end the program
        session.touch(0.13, 1.55, duration=0.2)
        assert session.wait_for(("latched",), 10.0) is not None
        assert controller.wait_standing()["runtime"] == "STOPPED"
        kill(session, "owner", signal.SIGCONT)
        assert session.wait_for(("touch_ended",), 5.0) is not None
        session.reset()
        until(lambda: controller.state()["runtime"] == "PLAYING")
        stood = controller.state()["q"]
        session.arm.move_j([stood[0] + 0.2, *stood[1:]], 1.0, 4.0)
        assert controller.state()["q"][0] == pytest.approx(stood[0] + 0.2, abs=1e-3)


# ---- processes


@pytest.mark.parametrize("name", ["guard", "owner"])
def test_sigterm_stops_the_arm(controller, name):
    with guard(scene_for(controller)) as session:
        thread, raised = run_until_moving(controller, session)
        kill(session, name, signal.SIGTERM)
        thread.join(20)
        assert isinstance(raised[0], RobotRefused | RobotConnectionError)
        assert_stopped_on_the_way(controller)


def test_a_guard_that_hangs_is_missed_by_the_owner(controller):
    with guard(scene_for(controller)) as session:
        thread, raised = run_until_moving(controller, session)
        kill(session, "guard", signal.SIGSTOP)
        assert_stopped_on_the_way(controller)
        kill(session, "guard", signal.SIGCONT)
        thread.join(20)
        assert isinstance(raised[0], RobotRefused)
        assert session.wait_for(("latched",), 10.0) is not None


def test_an_owner_that_hangs_does_not_let_the_guard_arm(controller, monkeypatch):
    spawn = channel.spawn

    def frozen(module, *ends):
        child = spawn(module, *ends)
        if module.endswith("owner"):
            os.kill(child.pid, signal.SIGSTOP)
        return child

    monkeypatch.setattr("coneskin.session.spawn", frozen)
    monkeypatch.setattr("coneskin.session._END", 1.0)
    with pytest.raises(RobotRefused, match="ur_rtde is not ready"):
        guard(scene_for(controller), start_timeout=3.0).__enter__()


def test_a_controller_that_dies_while_the_guard_arms_is_a_refusal(controller):
    scene = scene_for(controller, {"[watch]": "[watch]\nsettle_ms = 1500"})
    session = guard(scene, start_timeout=5.0)
    open_ = session._open

    def opened():
        open_()
        until(lambda: controller.state()["runtime"] == "PLAYING")
        controller.kill()

    session._open = opened
    with pytest.raises((RobotRefused, RobotConnectionError), match="controller"):
        session.__enter__()


# ---- connections


def test_rtde_closed_while_the_dashboard_is_up(controller):
    """ur_rtde then uploads its program again and again, with the old command in the register, until it crashes."""
    with guard(scene_for(controller)) as session:
        session.arm.speed_j([0.5, 0.0, 0.0, 0.0, 0.0, 0.0], 4.0)
        until(lambda: controller.state()["qd"][0] > 0.45)
        controller.call("close rtde")
        controller.wait_standing()
        stood = controller.state()["q"]
        time.sleep(1.5)
        assert controller.state()["q"] == stood, "the arm has started by itself"
        fault = session.wait_for(("fault",), 5.0)
        assert "has closed the connection" in fault.details["what"]
        with pytest.raises((RobotRefused, RobotConnectionError)):
            session.reset()


@pytest.mark.parametrize("fault", ["close dashboard", "close scripts"])
def test_a_way_to_stop_that_is_gone_stops_the_arm(controller, fault):
    with guard(scene_for(controller)) as session:
        thread, raised = run_until_moving(controller, session)
        controller.call(fault)
        thread.join(20)
        assert isinstance(raised[0], RobotRefused)
        assert "which a stop may need" in str(raised[0])
        assert_stopped_on_the_way(controller)


# ---- the recording


def test_a_full_disk_ends_the_recording_and_nothing_else(controller, tmp_path):
    """The system refuses to make the file longer, as a full disk would."""
    path = tmp_path / "run.rec"
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        with guard(scene_for(controller), recording=path) as session:
            thread, raised = run_until_moving(controller, session)
            resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size + 1000, before[1]))
            message = session.wait_for(("message",), 10.0)
            assert "recording ended: cannot write" in message.details["what"]
            assert fast(controller)
            session.touch(0.13, 1.55, duration=0.2)
            thread.join(20)
            assert isinstance(raised[0], Collision)
            assert_stopped_on_the_way(controller)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
    run = read_run(path)
    assert run.missing
    assert replay(run).same  # nothing is lost that was written before
