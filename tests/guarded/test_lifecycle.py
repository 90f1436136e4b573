"""How a guarded arm starts, goes on and ends when something around it is wrong; with the unmodified wheel."""

import os
import resource
import signal
import socket
import subprocess
import sys
import time

import pytest

from coneskin.core import child_process
from coneskin.core.errors import Collision, RobotConnectionError, RobotRefused
from coneskin.runs.replay.run import read_run
from coneskin.session.session import guard
from tests.support.scenes import GOAL, START

from ..robot import wheel
from .guarded_session import (
    DEADLINE,
    assert_stopped_on_the_way,
    await_message,
    fast,
    is_reset,
    kill,
    push_joints,
    refusal,
    run_until_moving,
    scene_for,
    scene_text,
    turn_base,
    until,
    until_undisturbed,
)

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the virtual skin needs a pseudo-terminal")
pytest.importorskip("rtde_control", reason="the ur_rtde wheel is not installed (there is none for this Python)")

from coneskin.robot.sim.process import SimulatedController, free_host  # noqa: E402

RETREAT = 'kind = "retreat"'


@pytest.fixture
def controller(tmp_path):
    log = tmp_path / "log.jsonl"
    with SimulatedController(model="UR5e", host=free_host(), start_q=START, log=log) as simulated:
        yield simulated


# ---- reactions with the real wheel


@pytest.mark.long
def test_slow_by_the_controllers_own_slider_and_back(controller):
    slow = scene_for(controller, {RETREAT: 'kind = "slow"\nslow_to = 0.3\npress_mm = 100'})

    ends = []

    def attempt():
        with guard(slow) as session:
            session.arm.move_j(START, speed=1.0, acceleration=4.0)
            thread, raised = run_until_moving(controller, session, GOAL)
            session.touch(0.13, 1.55, duration=0.3)
            assert session.wait_for(("resumed", "stopping"), DEADLINE) is not None
            until(lambda: controller.state()["slider"] == 1.0 or "stopping" in [event.name for event in session.events])
            thread.join(DEADLINE)
            ends.append((raised, controller.state()))
            return session.events

    names = [event.name for event in until_undisturbed(attempt)]
    assert "resumed" in names, names
    raised, state = ends[-1]
    assert raised == [None]  # it arrives, late, and nobody is told of a collision
    assert state["slider"] == 1.0
    assert state["q"] == pytest.approx(GOAL, abs=1e-3)
    assert [event["fraction"] for event in controller.events("slider")][-2:] == pytest.approx([0.3, 1.0])


@pytest.mark.long
def test_a_slider_that_somebody_else_owns_is_one_clear_line(controller):
    import rtde_io

    other = rtde_io.RTDEIOInterface(controller.host)
    try:
        scene = scene_for(controller, {RETREAT: 'kind = "slow"'})
        with pytest.raises(RobotRefused, match=r"the guard cannot have the speed slider of .* in use"):
            guard(scene).__enter__()
    finally:
        other.disconnect()


@pytest.mark.long
def test_comply_gives_way_and_latches_when_the_push_ends(controller):
    scene = scene_for(controller, {RETREAT: 'kind = "comply"\nspeed_mm_s = 30'})

    def attempt():
        controller.wait_for_standstill()
        push_joints(controller, scene, force=0.0)
        with guard(scene) as session:
            session.arm.move_j(START, speed=1.0, acceleration=4.0)
            thread, raised = run_until_moving(controller, session)
            session.touch(0.13, 1.55, duration=1.0)  # until which it pushes: 30 mm at most
            assert session.wait_for(("stopping",), DEADLINE) is not None
            push_joints(controller, scene)
            thread.join(DEADLINE)
            assert isinstance(raised[0], Collision)
            assert session.wait_for(("latched",), DEADLINE) is not None
            assert_stopped_on_the_way(controller)
        return session.events

    (made,) = (event.details for event in until_undisturbed(attempt) if event.name == "retreated")
    assert made["why"] == "the touch is over"
    assert 0.005 < made["progress"] < 0.03


# ---- a latched arm stays where it is


@pytest.mark.promise("P19")
@pytest.mark.long
@pytest.mark.parametrize("revive", [True, False])
def test_the_arm_never_starts_by_itself_when_the_control_program_starts_again(controller, revive):
    """The register still says speedJ, and a program that starts again executes it: without our care it does."""
    for _ in range(20):  # the wheel itself is late now and then: nothing runs, or it has cleared the register
        got = wheel.run("start_again_after_a_stop", controller.host, revive)
        assert not (revive and got["moved"]), got
        if got["runs"] and got["moved"] is not revive:
            break
    assert (got["moves"], got["stands"], got["runs"], got["moved"]) == (True, True, True, not revive), got


@pytest.mark.long
def test_after_a_stop_by_another_way_a_person_lets_it_move_again(controller):
    with guard(scene_for(controller)) as session:
        turn_base(controller, session)
        kill(session, "driver", signal.SIGSTOP)  # so that another way has to end the program
        session.touch(0.13, 1.55, duration=0.2)
        assert session.wait_for(("latched",), DEADLINE) is not None
        assert controller.wait_for_standstill()["runtime"] == "STOPPED"
        kill(session, "driver", signal.SIGCONT)
        assert session.wait_for(("touch_ended",), DEADLINE) is not None
        until(lambda: is_reset(session) and controller.state()["runtime"] == "PLAYING")
        stood = controller.state()["q"]
        session.arm.move_j([stood[0] + 0.2, *stood[1:]], 1.0, 4.0)
        assert controller.state()["q"][0] == pytest.approx(stood[0] + 0.2, abs=1e-3)


# ---- processes


@pytest.mark.promise("P53")
@pytest.mark.long
@pytest.mark.parametrize("name", ["guard", "driver"])
def test_sigterm_stops_the_arm(controller, name):
    with guard(scene_for(controller)) as session:
        thread, raised = run_until_moving(controller, session)
        kill(session, name, signal.SIGTERM)
        thread.join(DEADLINE)
        assert isinstance(raised[0], RobotRefused | RobotConnectionError)
        assert_stopped_on_the_way(controller)


@pytest.mark.promise("P42")
def test_a_guard_that_hangs_is_missed_by_the_driver(controller):
    with guard(scene_for(controller)) as session:
        thread, raised = run_until_moving(controller, session)
        kill(session, "guard", signal.SIGSTOP)
        assert_stopped_on_the_way(controller)
        kill(session, "guard", signal.SIGCONT)
        thread.join(DEADLINE)
        assert isinstance(raised[0], RobotRefused)
        assert session.wait_for(("latched",), DEADLINE) is not None


@pytest.mark.promise("P59")
@pytest.mark.long
@pytest.mark.parametrize("control", ["internal", "external"])
def test_after_a_suspension_of_all_processes_the_arm_is_stopped_at_once_and_latched(controller, tmp_path, control):
    """As when the computer sleeps, or a container is paused: they wake with whatever waits in their buffers."""
    code = (
        "import sys\nfrom coneskin.session.session import guard\n"
        "with guard(sys.argv[1]) as g:\n"
        "    print(*(child.pid for child in g._processes.children.values()), flush=True)\n"
        "    g.wait_for(('stopping',), 60.0)\n"
        "    latched = g.wait_for(('latched',), 60.0)\n"
        "    print([event.details['what'] for event in g.events if event.name == 'fault'], latched, flush=True)\n"
    )
    (tmp_path / "scene.toml").write_text(scene_text(controller.host, control=control))
    command = [sys.executable, "-c", code, str(tmp_path / "scene.toml")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
        try:
            numbers = [program.pid, *map(int, program.stdout.readline().split())]
            with socket.create_connection((controller.host, 30002)) as script:
                if control == "external":
                    script.sendall(b"def p():\n while True:\n  speedj([0.25,0,0,0,0,0],2,0.5)\n end\nend\n")
                    until(lambda: max(map(abs, controller.state()["qd"])) > 0.2)
                for number in numbers:
                    os.kill(number, signal.SIGSTOP)
                asleep = controller.state()["cycle"]
                until(lambda: controller.state()["cycle"] > asleep + 700)  # of 2 ms
                for number in numbers:
                    os.kill(number, signal.SIGCONT)
                controller.wait_for_standstill()
                said = program.stdout.readline()
                assert "the guard did nothing for a while" in said
                assert "latched" in said
        finally:
            program.kill()


@pytest.mark.promise("P60")
@pytest.mark.long
@pytest.mark.parametrize("first", ["internal", "external"])
def test_a_second_session_on_one_arm_is_refused_and_the_first_goes_on(controller, first):
    with guard(scene_for(controller, control=first)) as session:
        second = guard(scene_for(controller, control="external"))
        with pytest.raises(RobotRefused, match="another guard on this computer has the arm at"):
            second.__enter__()
        session.check()
        if first == "internal":
            session.arm.move_j([START[0] + 0.05, *START[1:]], 1.0, 4.0)


@pytest.mark.long
def test_a_driver_that_hangs_does_not_let_the_guard_arm(controller, monkeypatch):
    spawn = child_process.spawn

    def frozen(module, *ends):
        child = spawn(module, *ends)
        if module.endswith("driver_process"):
            os.kill(child.pid, signal.SIGSTOP)
        return child

    monkeypatch.setattr("coneskin.session.child_processes.spawn", frozen)
    monkeypatch.setattr("coneskin.session.child_processes._END_TIMEOUT", 1.0)
    assert "the arm's driver is not ready" in refusal(scene_for(controller), "the arm's driver is not ready")


@pytest.mark.promise("P61")
@pytest.mark.long
def test_a_controller_that_dies_while_the_guard_arms_is_a_refusal(controller):
    scene = scene_for(controller, {"[monitoring]": "[monitoring]\nsettle_ms = 1500"})
    session = guard(scene)
    open_ = session._open

    def opened():
        open_()
        until(lambda: controller.state()["runtime"] == "PLAYING")
        controller.kill()

    session._open = opened
    with pytest.raises((RobotRefused, RobotConnectionError), match="controller"):
        session.__enter__()


# ---- connections


@pytest.mark.promise("P18")
@pytest.mark.long
def test_rtde_closed_while_the_dashboard_is_up(controller):
    """ur_rtde then uploads its program again and again, with the old command in the register, until it crashes."""
    with guard(scene_for(controller)) as session:
        turn_base(controller, session)
        controller.call("close rtde")
        controller.wait_for_standstill()
        stood = controller.state()["q"]
        time.sleep(1.5)
        assert controller.state()["q"] == stood, "the arm has started by itself"
        fault = session.wait_for(("fault",), DEADLINE)
        assert "has closed the connection" in fault.details["what"]
        with pytest.raises((RobotRefused, RobotConnectionError)):
            session.reset()


@pytest.mark.promise("P24")
@pytest.mark.long
@pytest.mark.parametrize("fault", ["close dashboard", "close scripts"])
def test_a_way_to_stop_that_is_gone_stops_the_arm(controller, fault):
    with guard(scene_for(controller)) as session:
        thread, raised = run_until_moving(controller, session)
        controller.call(fault)
        thread.join(DEADLINE)
        assert isinstance(raised[0], RobotRefused)
        assert "which a stop may need" in str(raised[0])
        assert_stopped_on_the_way(controller)


# ---- the recording


@pytest.mark.promise("P55")
@pytest.mark.long
def test_a_full_disk_ends_the_recording_and_nothing_else(controller, tmp_path):
    """The system refuses to make the file longer, as a full disk would."""
    path = tmp_path / "run.rec"
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        with guard(scene_for(controller), recording=path) as session:
            thread, raised = run_until_moving(controller, session)
            resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size + 1000, before[1]))
            await_message(session, "recording ended: cannot write")
            assert fast(controller)
            session.touch(0.13, 1.55, duration=0.2)
            thread.join(DEADLINE)
            assert isinstance(raised[0], Collision)
            assert_stopped_on_the_way(controller)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
    run = read_run(path)
    assert run.missing
    assert not run.replay().differences  # nothing is lost that was written before
