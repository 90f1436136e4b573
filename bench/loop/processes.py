"""Processor time of each process of a guarded session while nothing happens, beside bare programs.

    make build/compiled/done
    python -m bench processes [--seconds 10] [--rounds 3] [--only pure]

A simulated arm stands under guard, with one virtual skin of 1 kHz, and with eight of 250 Hz. At the same time run
two bare programs:

    bare loop     poll, read and send: it reads frames at 1 kHz and states at 500 Hz, as the guard with one skin does
    bare ur_rtde  one that opens the same connections as the driver process, and then only keeps them; with the time
                  slices of ours, because the wheel looks for bytes as often as it is let run

All figures are shares of a core, from the kernel's count of the time that the threads of a process have run. The pure
and the compiled build take turns.
"""

from __future__ import annotations

import argparse
import json
import os
import select
import socket
import statistics
import subprocess
import sys
import time
from contextlib import ExitStack, suppress
from pathlib import Path

from bench.report import head, show
from coneskin.core.version import code_build
from coneskin.robot.sim.process import SimulatedController, free_host
from coneskin.scene.reader import parse_scene
from coneskin.session.session import guard
from tests.support.scenes import forearm_scene

from .compiled import TREES, paths
from .far_end import FarEnd

PATIENT_LIMITS = "skin_silence_ms = 1000\narm_silence_ms = 1000\nprogram_silence_ms = 1500"
LINKS = ("upper_arm", "shoulder", "wrist_1", "wrist_2", "wrist_3", "base")
SEVERAL_RATE = 250.0  # Hz of each skin where there are several; the virtual ones are played by one process in Python
OTHER_SKIN = """
[[link.sensor]]
name = "skin {number}"
id = {number}
radius1_mm = 48
radius2_mm = 48
height_mm = 120
xyz_mm = [0, 0, {along}]
"""
BARE_RTDE = """
import sys
import rtde_control
from coneskin.core.child_process import shorten_time_slice
shorten_time_slice()
control = rtde_control.RTDEControlInterface(sys.argv[1])
print("ready", flush=True)
sys.stdin.readline()
control.stopScript()
control.disconnect()
"""


def scene_text(host: str, skins: int) -> str:
    """Return the scene of an arm with so many skins; the last one is the second one of the forearm."""
    text = forearm_scene(host, limits=PATIENT_LIMITS)
    others = "".join(
        ("" if number == len(LINKS) + 1 else f'[[link]]\nname = "{LINKS[number - 1]}"')
        + OTHER_SKIN.format(number=number, along=360 if number == len(LINKS) + 1 else 80)
        for number in (skins - 1 > len(LINKS)) * [len(LINKS) + 1] + list(range(1, min(skins, len(LINKS) + 1)))
    )
    rate = 1000.0 if skins == 1 else SEVERAL_RATE
    return text.replace("[source]", f"{others}[source]\nrate_hz = {rate:g}")


def ran(pid: int) -> float:
    """Return how long the threads of a process have run [s]."""
    total = 0
    for task in Path(f"/proc/{pid}/task").iterdir():
        with suppress(OSError):  # a thread that has ended meanwhile
            total += int((task / "schedstat").read_text().split()[0])
    return total * 1e-9


def bare_loop() -> None:
    """Read frames and states, and send something for each wake, until the standard input ends."""
    ours, theirs = socket.socketpair()
    with FarEnd(1000.0) as far:
        poll = select.poll()
        for descriptor in (far.slave, far.states.fileno(), sys.stdin.fileno()):
            poll.register(descriptor, select.POLLIN)
        print("ready", flush=True)
        while True:
            for descriptor, _ in poll.poll(2):
                if descriptor == sys.stdin.fileno():
                    return
                data = os.read(descriptor, 4096)
                if not data:
                    sys.exit("the far end has no more frames: measure for less long")  # its share would stand still
                ours.send(data)
                theirs.recv(4096)


def measure(skins: int, seconds: float) -> dict[str, float]:
    """Return the share of a core of each process [%], and of the two bare programs."""
    with ExitStack() as stack:
        arm = stack.enter_context(SimulatedController(host=free_host()))
        other = stack.enter_context(SimulatedController(host=free_host({arm.host})))
        bare = {
            "bare loop": [sys.executable, "-m", "bench.loop.processes", "--bare"],
            "bare ur_rtde": [sys.executable, "-c", BARE_RTDE, other.host],
        }
        session = stack.enter_context(guard(parse_scene(scene_text(arm.host, skins))))
        pids = {"program": os.getpid(), **{name: child.pid for name, child in session._processes.children.items()}}
        for name, command in bare.items():
            child = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
            stack.callback(child.wait)
            assert child.stdin is not None
            assert child.stdout is not None
            stack.callback(child.stdin.close)
            child.stdout.readline()
            pids[name] = child.pid
        before, began = {name: ran(pid) for name, pid in pids.items()}, time.monotonic()
        session.wait_for(("none",), seconds)
        took = time.monotonic() - began
        if not all(Path(f"/proc/{pid}/exe").exists() for pid in pids.values()):
            sys.exit("a process has ended before its share was measured")
        found = {name: 100.0 * (ran(pid) - before[name]) / took for name, pid in pids.items()}
        session.check()
    return found


def main() -> None:
    """Let the two builds take turns, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--skins", default="1,8")
    parser.add_argument("--only", choices=list(TREES), help="measure this build alone")
    args = parser.parse_args()
    print(head("ur-rtde"))
    found: dict[tuple[int, str], list[dict[str, float]]] = {}
    for _ in range(args.rounds):
        for skins in map(int, args.skins.split(",")):
            for build in [args.only] if args.only else TREES:
                command = [sys.executable, "-m", "bench.loop.processes", "--child", str(skins), str(args.seconds)]
                done = subprocess.run(command, env=paths(build), stdout=subprocess.PIPE, check=True)
                shares = json.loads(done.stdout)
                if shares.pop("build") != build:
                    parser.error(f"{TREES[build]} is not {build}: make build/compiled/done")
                found.setdefault((skins, build), []).append(shares)
    for skins in sorted({key[0] for key in found}):
        mine = {build: rounds for (number, build), rounds in found.items() if number == skins}
        rows = []
        for name in next(iter(mine.values()))[0]:
            shares = [[each[name] for each in rounds] for rounds in mine.values()]
            rows.append([name, *(f"{of(values):.1f}" for values in shares for of in (min, statistics.median))])
        rows.append(ratio("guard", "bare loop", mine))
        rows.append(ratio("driver", "bare ur_rtde", mine))
        columns = ["", *(f"{build}: {word}" for build in mine for word in ("least", "median"))]
        show(f"% of a core, skins: {skins}, {args.rounds} rounds of {args.seconds:g} s", columns, rows)


def ratio(name: str, floor: str, builds: dict[str, list[dict[str, float]]]) -> list[str]:
    """Return a row: one process divided by a bare program of the same round."""
    cells = []
    for rounds in builds.values():
        ratios = [each[name] / each[floor] for each in rounds]
        cells += [f"{min(ratios):.2f}", f"{statistics.median(ratios):.2f}"]
    return [f"{name} / {floor}", *cells]


if __name__ == "__main__" and sys.argv[1:2] == ["--bare"]:
    bare_loop()
elif __name__ == "__main__" and sys.argv[1:2] == ["--child"]:
    print(json.dumps({"build": code_build(), **measure(int(sys.argv[2]), float(sys.argv[3]))}))
