"""Trials of bench `ur-clients` with the ur_rtde package: what its examples do, with each of its versions.

Each wheel of a folder is unpacked into a scratch folder; each trial is a process with that folder first on its path.
A trial passes where the package's calls succeed and the arm is where they should have brought it, or where what is not
simulated was told by name in the controller's log.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from coneskin.robot.sim.process import SimulatedController, free_host

from .urcl import Trial

_TRIAL_HEAD = """
import sys, time, math
import rtde_control, rtde_receive, rtde_io
host = sys.argv[1]
c = rtde_control.RTDEControlInterface(host)
r = rtde_receive.RTDEReceiveInterface(host)
home = r.getActualQ()
def near(get, b, tolerance=1e-3):
    for _ in range(100):  # what is received may lag behind on a busy machine
        a = get()
        if max(abs(x - y) for x, y in zip(a, b)) < tolerance:
            return
        time.sleep(0.01)
    raise AssertionError((a, b))
def moved(n=6): assert max(abs(x - y) for x, y in zip(r.getActualQ(), home)) > 1e-3
"""
_TRIAL_TAIL = "\nc.stopScript()\n"
WHEEL_TRIALS = {
    "move, asynchronously, and stop": """
q = list(home); q[0] += 0.3
assert c.moveJ(q, 1.0, 2.0); near(lambda: r.getActualQ(), q)
p = r.getActualTCPPose(); p[2] += 0.05
assert c.moveL(p, 0.2, 0.5); near(lambda: r.getActualTCPPose(), p)
c.moveJ(home, 0.3, 1.0, True); time.sleep(0.3); c.stopJ(2.0); moved()""",
    "path with blends": """
p = r.getActualTCPPose(); path = []
for dx, dy, blend in ((0.05, 0.0, 0.02), (0.05, 0.05, 0.02), (0.0, 0.05, 0.0)):
    path.append([p[0] - dx, p[1] - dy, *p[2:], 0.2, 0.5, blend])
assert c.moveL(path); near(lambda: r.getActualTCPPose(), path[-1][:6])""",
    "speed": """
for _ in range(100):
    t = c.initPeriod(); c.speedJ([0.1, 0, 0, 0, 0, 0], 0.5, 0.002); c.waitPeriod(t)
c.speedStop(); moved()""",
    "servo": """
q = list(home)
for _ in range(200):
    t = c.initPeriod(); c.servoJ(q, 0.5, 0.5, 0.002, 0.1, 300); q[0] += 0.001; c.waitPeriod(t)
c.servoStop(); moved()""",
    "jog": """
c.jogStart([0, 0, 0.05, 0, 0, 0], rtde_control.RTDEControlInterface.FEATURE_BASE)
time.sleep(0.5); c.jogStop(); moved()""",
    "payload and tool": """
assert c.setPayload(1.5, [0, 0, 0.1]); c.setTcp([0, 0, 0.1, 0, 0, 0])
time.sleep(0.1); near(lambda: c.getTCPOffset(), [0, 0, 0.1, 0, 0, 0])""",
    "inputs and outputs": """
io = rtde_io.RTDEIOInterface(host)
io.setStandardDigitalOut(7, True); time.sleep(0.2); assert r.getDigitalOutState(7)
io.setSpeedSlider(0.5); time.sleep(0.2); assert r.getTargetSpeedFraction() == 0.5; io.setSpeedSlider(1.0)""",
    "teach mode": "assert c.teachMode(); time.sleep(0.2); assert c.endTeachMode(); near(lambda: r.getActualQ(), home)",
    "contact detection": "assert not c.toolContact([0, 0, 1, 0, 0, 0]); assert c.isSteady()",
    "file recording": """
import os, tempfile
name = os.path.join(tempfile.mkdtemp(), "robot.csv")
r.startFileRecording(name, ["timestamp", "actual_q"]); time.sleep(0.3); r.stopFileRecording()
assert len(open(name).readlines()) > 10""",
    "force mode": """
for _ in range(50):
    c.forceMode([0] * 6, [0, 0, 1, 0, 0, 0], [0, 0, -10, 0, 0, 0], 2, [2, 2, 1.5, 1, 1, 1]); time.sleep(0.002)
c.forceModeStop(); near(lambda: r.getActualQ(), home)""",
}
TOLD_NAMES = {"force mode": "force_mode"}  #: what the controller must have said is not simulated


#: versions of the controller's software that the package tells apart; the examples run on the last
SOFTWARE_VERSIONS = ("5.4", "5.11", "5.23", "5.25")
_CONNECT_TRIAL = """
import dashboard_client
i = rtde_io.RTDEIOInterface(host); d = dashboard_client.DashboardClient(host); d.connect()
q = r.getActualQ(); q[0] += 0.1
assert c.moveJ(q, 1.0, 2.0); near(lambda: r.getActualQ(), q)
assert i.setSpeedSlider(0.5) and "RUNNING" in d.robotmode()
"""


def wheels(archives: Path) -> Iterator[Trial]:
    """Run every example with every wheel of a folder."""
    for archive in sorted(archives.glob("ur_rtde-*.whl")):
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch)
            with zipfile.ZipFile(archive) as file:
                file.extractall(folder / "wheel")
            label = f"ur_rtde wheel {archive.name.split('-')[1]}"
            for name, lines in WHEEL_TRIALS.items():
                yield _tried(label, name, lines, folder, wheel=folder / "wheel")


def installed_wheel() -> Iterator[Trial]:
    """Run every example with the installed package, and connect it to each version of the controller's software."""
    try:
        label = f"ur_rtde wheel {version('ur_rtde')}, installed"
    except PackageNotFoundError:
        yield Trial("ur_rtde wheel", "*", "skip", 0.0, "ur_rtde is not installed")
        return
    with tempfile.TemporaryDirectory() as scratch:
        for software in SOFTWARE_VERSIONS:
            yield _tried(label, f"PolyScope {software}", _CONNECT_TRIAL, Path(scratch), software)
        for name, lines in WHEEL_TRIALS.items():
            yield _tried(label, name, lines, Path(scratch))


def _tried(
    label: str, name: str, lines: str, folder: Path, software: str = SOFTWARE_VERSIONS[-1], wheel: Path | None = None
) -> Trial:
    """Run a trial, and once more where it fails; say how it went."""
    begin = time.monotonic()
    first = problem = run(lines, TOLD_NAMES.get(name, ""), folder, software, wheel)
    if first:
        begin = time.monotonic()
        problem = run(lines, TOLD_NAMES.get(name, ""), folder, software, wheel)
    why = problem or (first and f"on the second try; on the first: {first}")
    trial = Trial(label, name, "fail" if problem else "pass", time.monotonic() - begin, why)
    print(f"{trial.result:5} {trial.seconds:6.1f} {label} {name} {trial.why[:200]}", file=sys.stderr, flush=True)
    return trial


def run(lines: str, told: str, folder: Path, software: str, wheel: Path | None) -> str:
    """Return what went wrong in a trial with the installed package or an unpacked wheel; empty where nothing did."""
    log = folder / "log.jsonl"
    log.unlink(missing_ok=True)
    start_q = (0.1, -1.4, 1.5, -1.7, -1.4, 0.2)
    with SimulatedController(host=free_host(), start_q=start_q, log=log, version=software) as simulated:
        path = f"import sys; sys.path.insert(0, {str(wheel)!r})\n" if wheel else ""
        command = [sys.executable, "-c", path + _TRIAL_HEAD + lines + _TRIAL_TAIL, simulated.host]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=40, check=False)
        except subprocess.TimeoutExpired:
            return "it took more than 40 s"
        if done.returncode:
            return (done.stderr.strip().splitlines() or ["no message"])[-1][:200]
        said = [event["what"] for event in simulated.events("not_simulated")]
    return "" if told in " ".join(said) else "the controller did not say what is not simulated"
