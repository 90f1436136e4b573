"""A guarding program that dies, freezes, forks or blocks, and processes that hang: the arm stands, nothing is left."""

import contextlib
import os
import resource
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from coneskin.core.errors import RobotRefused
from coneskin.runs.replay.run import read_run
from coneskin.session.session import guard
from tests.support.scenes import GOAL, START

from .guarded_session import (
    DEADLINE,
    FAR,
    assert_stopped_on_the_way,
    fast,
    is_reset,
    kill,
    run_until_moving,
    scene_for,
    scene_text,
    until,
    until_undisturbed,
)

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(sys.platform == "win32", reason="the virtual skin needs a pseudo-terminal"),
]
pytest.importorskip("rtde_control", reason="the ur_rtde wheel is not installed (there is none for this Python)")

from coneskin.robot.sim.process import SimulatedController, free_host  # noqa: E402

from .test_external_control import RAW, send  # noqa: E402

STREAM = "while True: g.arm.speed_j([0.4, 0, 0, 0, 0, 0], 4.0); time.sleep(0.02)"
MOVE = f"g.arm.move_j({FAR}, 1.0, 4.0)"
FORK_BELOW_PYTHON = "import ctypes\n    if ctypes.CDLL(None).fork() == 0: time.sleep(600)\n    "
FORK = "import multiprocessing as m; m.get_context('fork').Process(target=time.sleep, args=(600,)).start()\n    "


@pytest.fixture
def controller():
    with SimulatedController(model="UR5e", host=free_host(), start_q=START) as simulated:
        yield simulated


class Program:
    """A program that guards, in a process group of its own; it prints the numbers of its children."""

    def __init__(self, folder: Path, text: str, body: str, before: str = "") -> None:
        (folder / "scene.toml").write_text(text)
        code = (
            f"import sys, time\nfrom coneskin.session.session import guard\n{before}\n"
            "with guard(sys.argv[1]) as g:\n"
            "    print(*(child.pid for child in g._processes.children.values()), flush=True)\n"
            f"    {body}\n"
        )
        self.process = subprocess.Popen(
            [sys.executable, "-c", code, str(folder / "scene.toml")],
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        assert self.process.stdout is not None
        self.children = [int(number) for number in self.process.stdout.readline().split()]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()
        self.process.stdout.close()


def lives(number):
    """Tell whether a process lives; one that nobody has waited for does not."""
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.promise("P49")
@pytest.mark.parametrize("fork", [FORK, FORK_BELOW_PYTHON])
def test_a_program_that_has_forked_and_is_killed_stops_its_arm(controller, tmp_path, fork):
    """A worker of multiprocessing lives on with copies of all that was open; below Python nothing closes them."""
    with Program(tmp_path, scene_text(controller.host), fork + STREAM) as program:
        until(lambda: controller.state()["qd"][0] > 0.35)
        program.process.kill()
        assert program.process.wait(DEADLINE) == -signal.SIGKILL
        controller.wait_for_standstill()
        until(lambda: not any(map(lives, program.children)))


@pytest.mark.parametrize("ending", ["sys.exit(0)", "raise RuntimeError('of a child')", "g.close()"])
def test_a_fork_that_leaves_the_with_touches_nothing_of_the_run(controller, tmp_path, ending):
    """It wrote what its parent had collected into the parent's recording once more, and an end."""
    body = f"import os\n    for _ in range(20):\n        if os.fork() == 0: {ending}; os._exit(0)\n        os.wait()"
    with Program(
        tmp_path, scene_text(controller.host, {"[reaction]": '[recording]\nfolder = "runs"\n[reaction]'}), body
    ) as program:
        assert program.process.wait(DEADLINE) == 0
    run = read_run(next(tmp_path.glob("runs/*")))
    assert run.missing == ""
    assert run.replay().same
    assert [event.name for event in run.events if event.name in ("stopping", "fault", "activated")] == [
        "activated",
        "stopping",
    ]


@pytest.mark.promise("P50")
@pytest.mark.parametrize("control", ["internal", "external"])
def test_a_program_that_is_frozen_stops_its_arm_and_hears_why(controller, tmp_path, control):
    body = f"try: {MOVE}" if control == "internal" else "try:\n        while True: g.check(); time.sleep(0.01)"
    body += "\n    except Exception as exc: print(exc, flush=True); g.wait_for(('never',), 60.0)"
    with Program(tmp_path, scene_text(controller.host, control=control), body) as program:
        if control == "external":
            send(controller.host, 30002, RAW)
        until(lambda: fast(controller))
        program.process.send_signal(signal.SIGSTOP)
        assert_stopped_on_the_way(controller)
        program.process.send_signal(signal.SIGCONT)
        assert "the program that guards: it was suspended for 1500 ms" in program.process.stdout.readline()


@pytest.mark.promise("P50")
def test_a_program_that_keeps_pythons_lock_for_seconds_is_not_stopped(controller, tmp_path):
    """`sorted` of 1.5 million numbers, an import, a C call: with a heartbeat of its own it counted as frozen."""
    goal = [GOAL[0] + 0.5, *GOAL[1:]]
    body = f"g.arm.move_j({goal}, 1.0, 4.0, wait=False); ctypes.PyDLL(None).usleep(3_000_000); g.arm.wait()"
    body += "; print([str(event.name) for event in g.events if event.name in ('stopping', 'fault')])"
    with Program(tmp_path, scene_text(controller.host), body, "import ctypes") as program:
        assert program.process.stdout.readline() == "[]\n"
        assert program.process.wait(DEADLINE) == 0
    assert controller.state()["q"] == pytest.approx(goal, abs=1e-3)


@pytest.mark.promise("P41")
def test_a_frozen_driver_is_not_armed_and_does_not_do_later_what_was_asked(controller):
    """A driver that was frozen for 1.8 s ends itself: where this computer took so long, another is frozen."""
    assert any(has_gone_on_after_a_freeze(controller) for _ in range(10))


def has_gone_on_after_a_freeze(controller):
    with guard(scene_for(controller, {"program_silence_ms = 1500": "program_silence_ms = 500"})) as session:
        session.arm.move_j(START, 2.0, 8.0)
        thread, raised = run_until_moving(controller, session)
        session.touch(0.13, 1.55, duration=0.2)
        thread.join(DEADLINE)
        assert session.wait_for(("latched",), DEADLINE) is not None
        assert session.wait_for(("touch_ended",), DEADLINE) is not None
        kill(session, "driver", signal.SIGSTOP)
        with pytest.raises(RobotRefused, match=r"the driver process: no heartbeat|the driver process has ended"):
            session.reset(timeout=DEADLINE)
        stood = controller.wait_for_standstill()["q"]
        thread, raised = run(session, stood)
        thread.join(DEADLINE)
        assert raised
        kill(session, "driver", signal.SIGCONT)
        assert session.wait_for(("never",), 1.0) is None
        assert controller.state()["q"] == pytest.approx(stood, abs=1e-3)
        until(lambda: is_reset(session) or session._processes.children["driver"].poll() is not None)
        if session._processes.children["driver"].poll() is not None:
            return False
        session.arm.move_j([stood[0] + 0.1, *stood[1:]], 1.0, 4.0)
        assert controller.state()["q"][0] == pytest.approx(stood[0] + 0.1, abs=1e-3)
        return True


def run(session, stood):
    """Ask for a move from a thread; what it raised is in the list that is returned."""
    raised = []

    def move():
        try:
            session.arm.move_j([stood[0] + 1.0, *stood[1:]], 1.0, 4.0)
        except Exception as exc:
            raised.append(exc)

    thread = threading.Thread(target=move)
    thread.start()
    return thread, raised


def test_a_frozen_driver_that_nobody_needs_now_is_a_fault(controller):
    with guard(scene_for(controller)) as session:
        kill(session, "driver", signal.SIGSTOP)
        assert session.wait_for(("latched",), DEADLINE) is not None
        until(lambda: any("the driver process: no heartbeat" in str(e.details.get("what")) for e in session.events))
        kill(session, "driver", signal.SIGCONT)


@pytest.mark.promise("P40")
def test_a_frozen_watchdog_is_a_fault_and_the_arm_is_not_armed_without_it(controller):
    with guard(scene_for(controller, control="external")) as session:
        send(controller.host, 30002, RAW)
        until(lambda: fast(controller))
        kill(session, "watchdog", signal.SIGSTOP)
        controller.wait_for_standstill()
        latched = session.wait_for(("latched",), DEADLINE)
        assert "the guard watchdog: no heartbeat" in latched.details["why"]
        with pytest.raises(RobotRefused, match="the guard watchdog: no heartbeat"):
            session.reset()
        kill(session, "watchdog", signal.SIGCONT)


@pytest.mark.promise("P49")
def test_no_process_outlives_a_killed_program_whose_controller_cannot_be_reached(controller, tmp_path):
    """``ur_rtde`` would wait for the answer to its stop: for a minute, or for five."""
    with Program(tmp_path, scene_text(controller.host), MOVE) as program:
        until(lambda: fast(controller))
        controller.call("cut network")
        program.process.kill()
        until(lambda: not any(map(lives, program.children)), 30.0)
    controller.call("restore network")
    controller.wait_for_standstill()  # the controller's own watchdog


@pytest.mark.promise("P62")
def test_lines_typed_before_a_collision_reset_nothing(controller, tmp_path):
    """Each would have let the arm go on one millisecond after a collision."""
    touches = "".join(
        f"[[source.touch]]\nstart_s = {at}\nend_s = {at}.2\nu_mm = 130\nphi_deg = 89\n" for at in range(3, 60, 3)
    )
    points = [[round(57.29577951308232 * q, 3) for q in place] for place in (GOAL, START)]
    text = scene_text(controller.host, {'kind = "retreat"\ndistance_mm = 30': 'kind = "stop"'})
    text += f"{touches}[motion]\nwaypoints_deg = {points}\nspeed_deg_s = 20\nacceleration_deg_s2 = 100\n"
    (tmp_path / "scene.toml").write_text(text)
    command = [sys.executable, "-m", "coneskin", "guard", str(tmp_path / "scene.toml")]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    codes = []

    def attempt():
        process = subprocess.Popen(command, text=True, bufsize=1, **pipes)
        try:
            process.stdin.write("reset\nreset\nreset\n")
            lines = []
            while 'type "reset"' not in "".join(lines[-1:]):
                lines.append(process.stdout.readline())
                assert lines[-1], lines
            assert any("3 line(s) typed before the arm was latched are ignored" in line for line in lines)
            until(lambda: controller.wait_for_standstill() is not None)
            process.send_signal(signal.SIGTERM)
            lines += process.stdout.readlines()
            assert sum("  activated" in line for line in lines) == 1, lines
            codes.append(process.wait(DEADLINE))
            return lines
        finally:
            process.kill()
            process.wait()
            process.stdin.close()
            process.stdout.close()

    lines = until_undisturbed(attempt)
    assert codes[-1] == 3, lines


def test_a_program_with_more_than_1024_descriptors_guards_as_well(controller, tmp_path):
    before = "import os; many = [os.open(os.devnull, 0) for _ in range(1100)]"
    body = f"print('guarded', flush=True); g.arm.move_j({GOAL}, 1.0, 4.0); print('there', flush=True)"
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(2048, hard), hard))
    try:
        with Program(tmp_path, scene_text(controller.host), body, before) as program:
            assert program.process.stdout.read() == "guarded\nthere\n"
            assert program.process.wait(DEADLINE) == 0
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


@pytest.mark.promise("P52")
def test_a_blocking_on_event_delays_neither_the_fallback_stop_nor_the_recording(controller, tmp_path):
    free = threading.Event()
    seen = []

    def block(event):
        free.wait(60.0)
        seen.append(event)

    scene = scene_for(controller, control="external")
    with guard(scene, on_event=block, recording=tmp_path / "run.rec") as session:
        send(controller.host, 30002, RAW)
        until(lambda: fast(controller))
        for name in ("watchdog", "guard"):
            kill(session, name, signal.SIGSTOP)
        controller.wait_for_standstill()
        until(lambda: any(event.name == "fallback_stop" for event in session.events))
        assert seen == []
        free.set()
        for name in ("watchdog", "guard"):
            kill(session, name, signal.SIGCONT)
    assert [event.name for event in seen] == [event.name for event in session.events][: len(seen)]
