"""Trials of bench `ur-clients` with Universal Robots' C++ client library: its integration tests and its examples."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from coneskin.robot.sim.ports.user_interface import EXTERNAL_CONTROL
from coneskin.robot.sim.process import SimulatedController, free_host

#: joint positions with which Universal Robots' own simulator starts [rad]
START_Q = (-1.6006, -1.7271, -2.2030, -0.8080, 1.5951, -0.0310)
TEST_TIMEOUT = 90.0  # s
_URSIM = {"control": "disabled"}  # as URSim is, against which the library is tested
#: program of tests -> its arguments, and options of the controller
TEST_PROGRAMS: tuple[tuple[str, tuple[str, ...], dict[str, Any]], ...] = (
    ("primary_client_test_headless", (), {}),
    ("rtde_tests", (), {}),
    ("dashboard_client_g5_tests", (), _URSIM),
    ("dashboard_client_g5_tests", (), {"version": "3.15"}),
    ("ur_driver_deprecated_constructor_test", (), {}),
    *(
        (name, ("--headless", headless), {})
        for name, names in (
            ("external_control_program_tests", ("urcap", "headless")),
            ("ur_driver_tests", ("urcap", "headless")),
            ("instruction_executor_test", ("urcap", "headless")),
            ("spline_tests", ("urcap", "headless")),
            ("trajectory_streaming_tests", ("headless",)),
        )
        for headless in (("true" if kind == "headless" else "false") for kind in names)
    ),
)
#: example -> its arguments after the address
EXAMPLE_PROGRAMS: dict[str, tuple[str, ...]] = {
    "dashboard_example": (),
    "direct_torque_control_example": ("2",),
    "driver_example": (),
    "external_fts_through_rtde": ("2",),
    "force_mode_example": ("2",),
    "freedrive_example": ("2",),
    "instruction_executor": (),
    "primary_pipeline_calibration_example": (),
    "primary_pipeline_example": ("2",),
    "rtde_client_example": ("2",),
    "script_command_interface_example": ("2",),
    "script_sender_example": ("2",),
    "send_script": (),
    "spline_example": (),
    "tool_contact_example": ("10",),
    "trajectory_point_interface_example": (),
    "trajectory_streaming_example": (),
}
#: words of tests against a server of their own, which wants a port of the controller on every address: they are not run
OWN_SERVER_WORDS = (
    "FakeTest",
    "fake_server",
    "destroy_client_after_server_stops_sending",
    "RTDEClientTest.test_initialization",
)


#: URScript of the library's wait_program.urp, which PolyScope would write beside it
_WAIT_PROGRAM = "def wait_program():\n  while True:\n    sleep(0.01)\n    sync()\n  end\nend\n"
#: and of its external_control.urp, whose node takes its script from the client
_EXTERNAL_CONTROL = f"def external_control():\n  {EXTERNAL_CONTROL}\nend\n"


class Trial(NamedTuple):
    """One test of one client: "pass", "fail", "skip", or "apart" where it has a server of its own."""

    client: str
    test: str
    result: str
    seconds: float
    why: str = ""


@contextmanager
def controller(**options: Any) -> Iterator[SimulatedController]:
    """Run a controller as the library's tests expect one, a UR5e."""
    model = "UR5" if options.get("version") == "3.15" else "UR5e"
    with SimulatedController(model, free_host(), START_Q, protective_stop="stop", **options) as simulated:
        yield simulated


def urcl(build: Path, source: Path, only: Sequence[str]) -> Iterator[Trial]:
    """Run all tests that ask for a robot, and all examples."""
    for name, arguments, options in TEST_PROGRAMS:
        program = _program(build / "tests", name)
        label = " ".join(["URCL", name, *arguments[1:], options.get("version", "")]).strip()
        if not any(word in name for word in only):
            continue
        if program is None:
            yield Trial(label, "*", "skip", 0.0, f"{name} is not built")
            continue
        yield from suite(label, [str(program), *arguments], source, options)
    for name, arguments in EXAMPLE_PROGRAMS.items():
        if any(word in name for word in only):
            trial = example(build / "examples" / name, arguments, source)
            for try_ in ("second", "third") if trial.result == "fail" else ():
                again = example(build / "examples" / name, arguments, source)
                if again.result != "fail":
                    trial = again._replace(why=f"on the {try_} try; on the first: {trial.why}")
                    break
            yield trial


def _program(folder: Path, name: str) -> Path | None:
    """Return a program of tests; those for both kinds of control are built from the same file."""
    names = (name, f"{name}_headless", f"{name}_urcap")
    return next((folder / found for found in names if os.access(folder / found, os.X_OK)), None)


def suite(label: str, command: Sequence[str], source: Path, options: dict[str, Any]) -> Iterator[Trial]:
    """Run each test of a program in a process of its own, against one controller, as the library's own ctest does.

    One that does not pass is tried twice again, each time with a new controller.
    """
    with robot(source, options) as host:
        for test in _listed(command):
            if any(word in test for word in OWN_SERVER_WORDS):
                yield Trial(label, test, "apart", 0.0)
                continue
            result, seconds, why = run(command, source, host, test)
            for try_ in ("second", "third") if result == "fail" else ():
                with robot(source, options) as other:
                    again = run(command, source, other, test)
                if again[0] != "fail":
                    result, seconds, why = again[0], again[1], f"on the {try_} try; on the first: {why}"
                    break
            trial = Trial(label, test, result, seconds, why)
            print(
                f"{trial.result:5} {trial.seconds:6.1f} {label} {test} {trial.why[:100]}", file=sys.stderr, flush=True
            )
            yield trial


@contextmanager
def robot(source: Path, options: dict[str, Any]) -> Iterator[str]:
    """Run a controller with the programs that the library brings for its tests, and yield its address."""
    generation = "cb3" if options.get("version") == "3.15" else "e-series"
    with tempfile.TemporaryDirectory() as folder:
        for path in (source / "tests" / "resources" / "dockerursim" / "programs" / generation).iterdir():
            if path.is_file():
                (Path(folder) / path.name).write_bytes(path.read_bytes())
        (Path(folder) / "wait_program.script").write_text(_WAIT_PROGRAM)
        (Path(folder) / "external_control.script").write_text(_EXTERNAL_CONTROL)
        with controller(programs=Path(folder), **options) as simulated:
            yield simulated.host


def _listed(command: Sequence[str]) -> list[str]:
    said = subprocess.run([command[0], "--gtest_list_tests"], capture_output=True, text=True, check=False, timeout=30)
    tests, group = [], ""
    for line in said.stdout.splitlines():
        if line.startswith("  "):
            tests.append(group + line.split()[0])
        elif line.strip().endswith("."):
            group = line.strip()
    return tests


def run(command: Sequence[str], source: Path, host: str, test: str) -> tuple[str, float, str]:
    """Run a test against a controller; return the result, its time [s], and what went wrong."""
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "result.json"
        full = [*command, "--robot_ip", host, f"--gtest_filter={test}", f"--gtest_output=json:{output}"]
        begin = time.monotonic()
        try:
            done = subprocess.run(
                full,
                cwd=source / "tests",
                capture_output=True,
                text=True,
                timeout=TEST_TIMEOUT,
                check=False,
                errors="replace",
            )
        except subprocess.TimeoutExpired as exc:
            return "fail", TEST_TIMEOUT, f"it took more than {TEST_TIMEOUT:g} s; at last {exc.stdout!r}"[-300:]
        seconds = time.monotonic() - begin
        failures = re.findall(r"(?:Failure\n|terminate called|with description|what\(\):).*", done.stdout + done.stderr)
        if output.exists() and not done.returncode:
            (group,) = json.loads(output.read_text())["testsuites"]
            return ("skip" if group["testsuite"][0]["result"] == "SKIPPED" else "pass"), seconds, ""
        return "fail", seconds, " ".join(" ".join(failures).split())[:300] or f"exit code {done.returncode}"


def example(program: Path, arguments: Sequence[str], source: Path) -> Trial:
    """Run an example; it passes where its exit code is 0."""
    label = "URCL examples"
    if not os.access(program, os.X_OK):
        return Trial(label, program.name, "skip", 0.0, "it is not built")
    with robot(source, _URSIM) as host:
        begin = time.monotonic()
        command = [str(program), host, *arguments]
        try:
            done = subprocess.run(
                command, cwd=source, capture_output=True, text=True, timeout=TEST_TIMEOUT, check=False, errors="replace"
            )
            code, said = done.returncode, done.stdout + done.stderr
        except subprocess.TimeoutExpired as exc:
            code, said = -1, f"it took more than {TEST_TIMEOUT:g} s; {exc.stdout!r}"[-300:]
    problem = " ".join(line for line in said.splitlines() if "ERROR" in line or "what()" in line)[-300:] or said[-300:]
    trial = Trial(
        label, program.name, "pass" if code == 0 else "fail", time.monotonic() - begin, problem if code else ""
    )
    print(f"{trial.result:5} {trial.seconds:6.1f} {label} {trial.test} {trial.why[:200]}", file=sys.stderr, flush=True)
    return trial
