"""What the examples of the ur_rtde package do, with each of its versions, against the simulated controller.

    python -m pip download --no-deps --only-binary :all: ur-rtde==1.5.8 -d WHEELS     # and other versions
    python bench/ur_clients_wheels.py WHEELS

Each wheel of the folder is unpacked into a scratch folder; each trial is a process with that folder first on its path.
A trial passes where the package's calls succeed and the arm is where they should have brought it, or where what is not
simulated was told by name in the controller's log.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

from coneskin.robot.sim.process import SimulatedController, free_host

_HEAD = """
import sys, time, math
import rtde_control, rtde_receive, rtde_io
host = sys.argv[1]
c = rtde_control.RTDEControlInterface(host)
r = rtde_receive.RTDEReceiveInterface(host)
home = r.getActualQ()
def near(a, b, tolerance=1e-3): assert max(abs(x - y) for x, y in zip(a, b)) < tolerance, (a, b)
def moved(n=6): assert max(abs(x - y) for x, y in zip(r.getActualQ(), home)) > 1e-3
"""
_TAIL = "\nc.stopScript()\n"
TRIALS = {
    "move, asynchronously, and stop": """
q = list(home); q[0] += 0.3
assert c.moveJ(q, 1.0, 2.0); near(r.getActualQ(), q)
p = r.getActualTCPPose(); p[2] += 0.05
assert c.moveL(p, 0.2, 0.5); near(r.getActualTCPPose(), p)
c.moveJ(home, 0.3, 1.0, True); time.sleep(0.3); c.stopJ(2.0); moved()""",
    "path with blends": """
p = r.getActualTCPPose(); path = []
for dx, dy, blend in ((0.05, 0.0, 0.02), (0.05, 0.05, 0.02), (0.0, 0.05, 0.0)):
    path.append([p[0] - dx, p[1] - dy, *p[2:], 0.2, 0.5, blend])
assert c.moveL(path); near(r.getActualTCPPose(), path[-1][:6])""",
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
time.sleep(0.1); near(c.getTCPOffset(), [0, 0, 0.1, 0, 0, 0])""",
    "inputs and outputs": """
io = rtde_io.RTDEIOInterface(host)
io.setStandardDigitalOut(7, True); time.sleep(0.2); assert r.getDigitalOutState(7)
io.setSpeedSlider(0.5); time.sleep(0.2); assert r.getTargetSpeedFraction() == 0.5; io.setSpeedSlider(1.0)""",
    "teach mode": "assert c.teachMode(); time.sleep(0.2); assert c.endTeachMode(); near(r.getActualQ(), home)",
    "contact detection": "assert not c.toolContact([0, 0, 1, 0, 0, 0]); assert c.isSteady()",
    "file recording": """
import os, tempfile
name = os.path.join(tempfile.mkdtemp(), "robot.csv")
r.startFileRecording(name, ["timestamp", "actual_q"]); time.sleep(0.3); r.stopFileRecording()
assert len(open(name).readlines()) > 10""",
    "force mode": """
for _ in range(50):
    c.forceMode([0] * 6, [0, 0, 1, 0, 0, 0], [0, 0, -10, 0, 0, 0], 2, [2, 2, 1.5, 1, 1, 1]); time.sleep(0.002)
c.forceModeStop(); near(r.getActualQ(), home)""",
}
TOLD = {"force mode": "force_mode"}  #: what the controller must have said is not simulated


def run(wheel: Path, name: str, folder: Path) -> str:
    """Return what went wrong in a trial with an unpacked wheel; empty where nothing did."""
    log = folder / "log.jsonl"
    with SimulatedController(host=free_host(), start_q=(0.1, -1.4, 1.5, -1.7, -1.4, 0.2), log=log) as simulated:
        code = _HEAD + TRIALS[name] + _TAIL
        command = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(wheel)!r})\n{code}", simulated.host]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=40, check=False)
        except subprocess.TimeoutExpired:
            return "it took more than 40 s"
        if done.returncode:
            return (done.stderr.strip().splitlines() or ["no message"])[-1][:200]
        said = [event["what"] for event in simulated.events("not_simulated")]
    if TOLD.get(name, "") not in " ".join(said):
        return "the controller did not say what is not simulated"
    return ""


def main() -> int:
    """Run every trial with every wheel; return 1 if one failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("wheels", type=Path, help="folder of ur_rtde's wheels")
    parser.add_argument("--only", default="", help="part of a version")
    args = parser.parse_args()
    failed = 0
    for archive in sorted(args.wheels.glob("ur_rtde-*.whl")):
        version = archive.name.split("-")[1]
        if args.only not in version:
            continue
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch)
            with zipfile.ZipFile(archive) as file:
                file.extractall(folder / "wheel")
            for name in TRIALS:
                problem = run(folder / "wheel", name, folder)
                failed += bool(problem)
                print(f"| {version} | {name} | {'fail: ' + problem if problem else 'pass'} |", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
