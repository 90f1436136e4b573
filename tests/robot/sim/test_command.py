"""The simulated controller as a process: it starts, says so, refuses in one line, and always ends."""

from __future__ import annotations

import argparse
import json
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from coneskin.core.errors import RobotConnectionError, RobotTimeout
from coneskin.robot.sim import command, server
from coneskin.robot.sim.command import main
from coneskin.robot.sim.machine.controller import Controller
from coneskin.robot.sim.machine.states import PORTS, Options
from coneskin.robot.sim.process import SimulatedController, free_host
from tests.support.paths import ROOT

COMMAND = [sys.executable, "-m", "coneskin.robot.sim.command"]
PROC = Path("/proc")


def ends(pid: int) -> bool:
    """Return whether a process ends within a minute; a zombie counts as ended."""
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline:
        try:
            if (PROC / str(pid) / "stat").read_text().rpartition(")")[2].split()[0] == "Z":
                return True
        except (FileNotFoundError, ProcessLookupError):
            return True
        time.sleep(0.01)
    return False


needs_proc = pytest.mark.skipif(not (PROC / "self" / "stat").exists(), reason="looks at processes through /proc")


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SimulatedController]:
    """One that every test leaves as it may be found: running."""
    folder = tmp_path_factory.mktemp("simulated")
    program = folder / "play.script"
    program.write_text("def loaded():\n  movej([0.2,-1.5,1.5,-1.5,-1.5,0], a=20, v=2)\nend\n")
    with SimulatedController(host=free_host(), log=folder / "log.jsonl", program=program) as made:
        yield made


@needs_proc
def test_two_arms_run_side_by_side_and_end_with_their_context() -> None:
    with SimulatedController(host=free_host()) as one, SimulatedController("ur5", free_host(), (0.5,) * 6) as two:
        assert one.host != two.host
        assert (one.facts["model"], two.facts["model"]) == ("UR5e", "UR5")
        assert two.state()["q"] == pytest.approx([0.5] * 6)
        pids = [one.pid, two.pid]
        one.freeze()  # one that is frozen when its context ends must end too
    assert all(ends(pid) for pid in pids)


def test_a_program_that_never_waits_holds_no_client_up() -> None:
    with (
        SimulatedController(host=free_host()) as made,
        socket.create_connection((made.host, PORTS["secondary"]), 60.0) as script,
    ):
        script.sendall(b"def p():\n  n = 0\n  while True:\n    n = n + sqrt(n) * 0.5\n  end\nend\n")
        while made.state()["runtime"] != "PLAYING":
            pass
        begin = made.state()["cycle"]
        while made.state()["cycle"] < begin + 100:  # each answer comes between cycles of that program
            pass
        script.sendall(b"def q():\nend\n")
        while made.state()["program"] == "p":
            pass


def test_it_needs_the_standard_library_alone() -> None:
    """With -S no installed package can be imported, and a program still runs."""
    host = free_host()
    words = [sys.executable, "-S", "-m", "coneskin", "sim-ur", "--host", host, "--json"]
    environment = {"PATH": "", "PYTHONPATH": str(ROOT / "src")}
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stdout is not None
        assert json.loads(process.stdout.readline())["ready"]
        long = "# what makes it a program that another process translates\n" * 100
        with socket.create_connection((host, PORTS["secondary"]), 60.0) as script:
            script.sendall(f"def p():\n{long}interpreter_mode()\nend\n".encode())
            with socket.create_connection((host, PORTS["interpreter"]), 60.0) as line:
                reply = b"discard"
                while reply.startswith(b"discard"):
                    line.sendall(b"get_inverse_kin(get_actual_tcp_pose())\n")
                    reply = line.recv(999)
        process.terminate()
    assert reply.startswith(b"ack: 1: get_inverse_kin")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_it_ends_cleanly_on_a_signal(number: signal.Signals) -> None:
    host = free_host()
    process = subprocess.Popen([*COMMAND, "--host", host], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline().startswith(f"simulated UR5e (PolyScope 5.25) ready on {host}: RTDE 30004")
    process.send_signal(number)
    said, problem = process.communicate(timeout=60)
    assert (process.returncode, said, problem) == (0, "", "")


@needs_proc
def test_its_children_end_with_it_even_when_it_is_killed() -> None:
    with SimulatedController(host=free_host()) as simulated:
        pid = str(simulated.pid)
        children: list[int] = []
        while not children:  # the one that translates long programs is started beside the first cycles
            assert simulated.state()["cycle"] < 5000
            tasks = (PROC / pid / "task").iterdir()
            children = [int(word) for task in tasks for word in (task / "children").read_text().split()]
        simulated.kill()
        assert ends(children[0])
        with pytest.raises(RobotConnectionError, match="does not answer"):
            simulated.state()


@needs_proc
def test_it_ends_when_its_parent_has_gone() -> None:
    parent = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "import subprocess, sys; p = subprocess.Popen(sys.argv[1:], stdout=subprocess.PIPE);"
            "print(p.stdout.readline().decode(), flush=True); sys.stdin.read()",
            *COMMAND,
            "--json",
            "--exit-with-parent",
            "--host",
            free_host(),
        ],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert parent.stdout is not None
    facts = json.loads(parent.stdout.readline())
    parent.kill()
    parent.communicate()
    assert ends(facts["pid"])


def test_a_taken_port_is_one_line_that_names_it(capfd: pytest.CaptureFixture[str]) -> None:
    host = free_host()
    with socket.socket() as taken:
        taken.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # an earlier test may just have left the port
        taken.bind((host, 29999))
        taken.listen()
        assert main(["--host", host]) == 1
        said = capfd.readouterr()
        assert said.out == ""
        (line,) = said.err.splitlines()
        assert f"cannot listen on {host} port 29999 (dashboard)" in line
        with pytest.raises(RobotConnectionError, match=r"did not start: .*port 29999"):
            SimulatedController(host=host).__enter__()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--model", "ur99"], "arm must be one of"),
        (["--version", "five"], "--version must be MAJOR.MINOR such as 5.25, got 'five'"),
        (
            ["--start-q-deg", "0", "0", "200", "0", "0", "0"],
            "the start position of joint 3 of the UR5e must be from -180 to 180 deg, got 200 deg",
        ),
        (
            ["--start-q-deg", "0", "nan", "0", "0", "0", "0"],
            "joint 2 of the UR5e must be from -360 to 360 deg, got nan",
        ),
        (["--start-delay-ms", "inf"], "--start-delay-ms must be from 0 to 60000, got inf"),
        (["--start-delay-ms", "-1"], "--start-delay-ms must be from 0 to 60000, got -1"),
        (["--unlock-after-s", "nan"], "--unlock-after-s must be from 0 to 3600, got nan"),
        (["--log", "/nowhere/at/all"], "--log /nowhere/at/all cannot be written"),
        (["--program", "/nowhere/at/all"], "--program /nowhere/at/all: the file cannot be read"),
        (["--programs", "/nowhere/at/all"], "--programs must be a folder, got /nowhere/at/all"),
        (["--external-control", "here"], "--external-control must be HOST:PORT such as 127.0.0.1:50002, got 'here'"),
        (["--external-control", "a:70000"], "--external-control must be HOST:PORT such as 127.0.0.1:50002"),
        (["--host", "not a host"], "cannot listen on not a host"),
    ],
)
def test_a_mistake_is_one_line(arguments: list[str], words: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 1
    (line,) = capfd.readouterr().err.splitlines()
    assert words in line


def test_one_that_is_not_ready_in_time_is_ended() -> None:
    simulated = SimulatedController(host=free_host(), ready_within=0.0)
    with pytest.raises(RobotTimeout, match="not ready within 0 s"):
        simulated.__enter__()
    with pytest.raises(RobotConnectionError, match="is not running"):
        _ = simulated.pid


def test_freeze_and_thaw_keep_the_arm_where_it_was(simulated: SimulatedController) -> None:
    simulated.freeze()
    with pytest.raises(RobotConnectionError, match="does not answer"):
        simulated.call("state", timeout=0.05)
    simulated.thaw()
    before = simulated.state()["cycle"]
    assert simulated.state()["cycle"] >= before


def test_an_unknown_fault_lists_those_there_are(simulated: SimulatedController) -> None:
    with pytest.raises(RobotConnectionError, match="refuses 'earthquake'"):
        simulated.call("earthquake")


def test_raw_programs_on_all_script_ports_and_play(simulated: SimulatedController) -> None:
    for number, port in enumerate((30001, 30002, 30003)):
        with socket.create_connection((simulated.host, port)) as sock:
            sock.sendall(f"def p{number}():\n  set_standard_digital_out({number}, True)\nend\n".encode())
            while simulated.state()["digital_outputs"] < 2 ** (number + 1) - 1:
                pass
    with socket.create_connection((simulated.host, 29999)) as sock:
        lines = sock.makefile("rw", newline="\n")
        assert lines.readline() == "Connected: Universal Robots Dashboard Server\n"
        lines.write("play\n")
        lines.flush()
        assert lines.readline() == "Starting program\n"
    while simulated.state()["q"][0] != pytest.approx(0.2):
        pass
    names = [event["program"] for event in simulated.events("program")]
    assert names == ["p0", "p1", "p2", "loaded"]


def test_help_has_an_example(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--help"])
    assert "coneskin sim-ur --model ur10e" in capsys.readouterr().out


def test_ports_beyond_this_computer_are_announced_loudly(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """No other computer's address is there to listen on, so this one's own counts as one."""
    arguments = argparse.Namespace(host=free_host(), version="5.25", json=True)
    for loopback, local in (("127.", True), ("203.", False)):
        monkeypatch.setattr(server, "_LOOPBACK_PREFIX", loopback)
        controller = Controller(Options())
        with server.Server(controller, arguments.host, faults=True) as served:
            command._announce(arguments, controller, served)
            assert served.local is local
            assert served.fault_address is not None
            assert served.fault_address[0] == (arguments.host if local else "127.0.0.1")
        said = capsys.readouterr().err
        assert ("WARNING: it listens on" in said and "asks for no password" in said) is not local
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    assert parser.parse_args([]).host == "127.0.0.1"


def test_nothing_takes_faults_unless_it_is_asked_for() -> None:
    with server.Server(Controller(Options()), free_host()) as served:
        assert served.fault_address is None
        assert set(served._listeners) == set(server.PORTS)
