"""The whole chain with the unmodified wheel: virtual skin -> pseudo-terminal -> pyserial -> guard -> ur_rtde -> arm.

The arm is a simulated controller in a process of its own; what it measures decides. Every wait has an end.
"""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from coneskin.core.errors import Collision, RobotConnectionError, RobotRefused, SkinConnectionError
from coneskin.runs.replay.run import read_run
from coneskin.scene.reader import parse_scene
from coneskin.session.session import guard
from tests.support.scenes import START

from .guarded_session import (
    DEADLINE,
    FAR,
    assert_short_slices,
    assert_stopped_on_the_way,
    fast,
    is_reset,
    kill,
    refusal,
    run_until_moving,
    scene_for,
    scene_text,
    until,
)

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the virtual skin needs a pseudo-terminal")
pytest.importorskip("rtde_control", reason="the ur_rtde wheel is not installed (there is none for this Python)")

from coneskin.robot.sim.process import SimulatedController, free_host  # noqa: E402


@pytest.fixture
def controller():
    with SimulatedController(model="UR5e", host=free_host(), start_q=START) as simulated:
        yield simulated


def undisturbed_demo(*words):
    """Run the demo, again as long as this computer is so busy that its arm stops or its retreat ends; its facts."""
    *words, folder = map(str, words)
    for number in range(10):
        done = subprocess.run([sys.executable, *words, f"{folder}{number or ''}"], capture_output=True, text=True)
        facts = json.loads(done.stdout or "{}")
        if not ("run the demo again" in done.stderr or facts.get("cut_short")):
            break
    assert done.returncode == 0, done.stdout + done.stderr
    return facts


@pytest.mark.long
def test_the_demo_that_a_script_touches(tmp_path):
    facts = undisturbed_demo("-m", "coneskin", "demo", "--json", "-o", tmp_path / "run")
    assert facts["contacts"] == 1
    assert facts["same_in_replay"] is True
    assert 0.0 < facts["frame_ms"] <= facts["command_ms"] < facts["slower_ms"] < facts["standstill_ms"]
    assert facts["retreat_mm"] == pytest.approx(20.0, abs=1.0)  # 0.5 mm are left for braking
    assert facts["u_mm"] == pytest.approx(130.0, abs=2.0)  # 12 bits and 0.7 counts of noise: 0.1 mm
    folder = Path(facts["folder"])
    assert {path.name for path in folder.iterdir()} >= {"run.rec", "scene.toml", "summary.json"}
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert summary["picture"] in (
        None,
        "run.png",
    )  # in its own folder: that may be moved, and the reader stand elsewhere


def test_a_touch_raises_in_the_program_and_a_person_lets_it_go_on(controller, tmp_path):
    path = tmp_path / "run.rec"
    with guard(scene_for(controller), recording=path) as session:
        assert_short_slices(session, "guard", "driver")
        assert session.latched_stop == 0
        thread, raised = run_until_moving(controller, session)
        session.touch(0.13, 1.55, duration=0.2)
        thread.join(DEADLINE)
        assert isinstance(raised[0], Collision)
        assert_stopped_on_the_way(controller)
        with pytest.raises(Collision):
            session.arm.move_j(FAR)
        assert session.wait_for(("touch_ended",), DEADLINE) is not None
        until(lambda: is_reset(session))
        assert session.latched_stop == 1
        session.arm.move_j(START, speed=1.0, acceleration=4.0)
        assert controller.state()["q"] == pytest.approx(START, abs=1e-3)
    run = read_run(path)
    assert run.missing == ""
    assert run.replay().same


@pytest.mark.promise("P42")
def test_the_guard_killed_the_driver_stops_the_arm(controller, tmp_path):
    path = tmp_path / "run.rec"
    with guard(scene_for(controller), recording=path) as session:
        thread, raised = run_until_moving(controller, session)
        kill(session, "guard")
        thread.join(DEADLINE)
        assert isinstance(raised[0], RobotConnectionError)
        assert_stopped_on_the_way(controller)
    assert not read_run(path).replay().differences  # up to the last that it sent


@pytest.mark.promise("P39")
@pytest.mark.long
def test_the_driver_killed_the_guard_stops_the_arm(controller):
    with guard(scene_for(controller)) as session:
        thread, raised = run_until_moving(controller, session)
        kill(session, "driver")
        thread.join(DEADLINE)
        assert isinstance(raised[0], RobotRefused | RobotConnectionError)
        assert_stopped_on_the_way(controller)
        latched = session.wait_for(("latched",), DEADLINE)
        assert "the driver process has ended" in latched.details["why"]


@pytest.mark.promise("P39")
@pytest.mark.long
def test_the_driver_frozen_another_way_stops_the_arm(controller):
    with guard(scene_for(controller)) as session:
        thread, raised = run_until_moving(controller, session)
        kill(session, "driver", signal.SIGSTOP)
        session.touch(0.13, 1.55)
        thread.join(DEADLINE)
        assert isinstance(raised[0], Collision)
        assert_stopped_on_the_way(controller)
        assert session.wait_for(("escalated",), DEADLINE).details["path"] == "program"
        kill(session, "driver", signal.SIGKILL)


@pytest.mark.promise("P44")
@pytest.mark.long
def test_guard_and_driver_dead_the_controller_stops_itself(controller):
    """Nobody is left to send a stop: the watchdog that the driver has set ends the program."""
    with guard(scene_for(controller)) as session:
        thread, raised = run_until_moving(controller, session)
        kill(session, "guard", signal.SIGSTOP)
        kill(session, "driver")
        assert_stopped_on_the_way(controller)
        kill(session, "guard")
        thread.join(DEADLINE)
        assert isinstance(raised[0], RobotRefused | RobotConnectionError)


@pytest.mark.promise("P08")
@pytest.mark.long
def test_the_skin_unplugged_stops_the_arm(controller):
    with guard(scene_for(controller)) as session:
        thread, raised = run_until_moving(controller, session)
        kill(session, "skin")
        thread.join(DEADLINE)
        assert isinstance(raised[0], RobotRefused)
        assert_stopped_on_the_way(controller)


@pytest.mark.long
def test_a_frozen_controller_is_a_fault_and_stops_when_it_wakes(controller):
    with guard(scene_for(controller)) as session:
        thread, raised = run_until_moving(controller, session)
        controller.freeze()
        fault = session.wait_for(("fault",), DEADLINE)
        controller.thaw()
        assert "has sent no state" in fault.details["what"]
        assert_stopped_on_the_way(controller)
        thread.join(DEADLINE)
        assert isinstance(raised[0], RobotRefused)


@pytest.mark.long
def test_a_controller_that_stays_frozen_is_told_as_an_arm_that_nobody_saw_stand(controller):
    with guard(scene_for(controller)) as session:
        thread, raised = run_until_moving(controller, session)
        controller.freeze()
        thread.join(DEADLINE)
        controller.thaw()
        assert "standstill of the arm NOT confirmed" in str(raised[0])
        assert_stopped_on_the_way(controller)


@pytest.mark.promise("P49")
@pytest.mark.long
def test_the_program_killed_the_arm_stops(controller, tmp_path):
    """Program and supervisor in one process, killed with SIGKILL: guard and driver see their channels end."""
    (tmp_path / "scene.toml").write_text(scene_text(controller.host))
    code = (
        "import sys\nfrom coneskin.session.session import guard\n"
        "with guard(sys.argv[1]) as g:\n"
        f"    g.arm.move_j({FAR}, 1.0, 4.0)\n"
    )
    program = subprocess.Popen([sys.executable, "-c", code, str(tmp_path / "scene.toml")])
    try:
        until(lambda: fast(controller))
    finally:
        program.kill()
        program.wait()
    assert_stopped_on_the_way(controller)


@pytest.mark.promise("P17")
@pytest.mark.long
def test_a_protective_stop_is_never_unlocked(controller):
    with guard(scene_for(controller)) as session:
        thread, raised = run_until_moving(controller, session)
        controller.call("protective stop")
        thread.join(DEADLINE)
        assert isinstance(raised[0], RobotRefused)
        assert_stopped_on_the_way(controller)
        with pytest.raises(RobotRefused, match="the controller's own safety system holds the arm"):
            session.reset()


def test_a_controller_that_is_not_there_is_one_clear_line():
    scene = parse_scene(scene_text(free_host()))
    with pytest.raises(RobotConnectionError, match=r"cannot reach the controller 127\..*Connection refused"):
        guard(scene, start_timeout=60.0).__enter__()


@pytest.mark.long
def test_a_port_that_is_not_there_is_one_clear_line(controller):
    scene = scene_for(controller, {'kind = "virtual"': 'kind = "serial"\nport = "/dev/ttyNOWHERE"'})
    with pytest.raises(SkinConnectionError, match="/dev/ttyNOWHERE"):
        guard(scene, start_timeout=60.0).__enter__()


@pytest.mark.long
def test_a_touched_skin_does_not_arm(controller):
    touched = "[source.touch]]\nstart_s = 0\nend_s = 100\nu_mm = 100\nphi_deg = 10\n[reaction]"
    scene = scene_for(controller, {"[reaction]": "[" + touched})
    assert "it is touched" in refusal(scene, "it is touched")


@pytest.mark.long
def test_a_second_guard_on_the_same_arm_gives_up_at_once(controller):
    with guard(scene_for(controller)) as first:
        begun = time.monotonic()
        with pytest.raises(RobotRefused, match=r"another (guard on this computer has|program controls) the arm"):
            guard(scene_for(controller), start_timeout=300.0).__enter__()
        assert time.monotonic() - begun < 250.0, "it waited for what cannot come"
        first.check()


@pytest.mark.long
def test_another_arm_than_the_scenes_is_refused(controller):
    with pytest.raises(RobotRefused, match=r"is no UR10e: .* UR5e"):
        guard(scene_for(controller, {"UR5e": "UR10e"}), start_timeout=60.0).__enter__()


@pytest.mark.long
def test_a_target_in_degrees_is_refused_before_anything_moves(controller):
    with guard(scene_for(controller)) as session:
        with pytest.raises(ValueError, match=r"q\[1\] must be within -6.283 to 6.283 rad.*-90 deg are -1.5708 rad"):
            session.arm.move_j([0, -90, 90, -90, -90, 0])
        with pytest.raises(ValueError, match="must be 6 finite numbers"):
            session.arm.move_j([0.0] * 5)
        assert max(map(abs, controller.state()["qd"])) == 0.0
