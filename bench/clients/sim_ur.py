"""Latency of commands to the simulated controller, through the real ur_rtde wheel and this machine's loopback.

    python -m bench sim-ur [--calls 300] [--stops 30] [--json]

First table, arm at rest: time from the call to its bytes in the controller, to the cycle that executes them, and to its
return. Second table, arm at 1 rad/s (0.1 m/s): time from the call to the first slower sample and to standstill, both as
an RTDE client of the bench sees them. The wheel runs in a child process with a time limit. All times in milliseconds.
"""

from __future__ import annotations

import argparse
import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time
from bisect import bisect_left
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from bench.report import head, quantile
from coneskin.robot.sim.process import SimulatedController, free_host
from coneskin.robot.ur.rtde_codec import PacketKind, Recipe, pack, pack_outputs_request, split

START_JOINTS = (0.0, -1.4, 1.5, -1.7, -1.4, 0.2)
# command -> event in the controller's log for its arrival, and for its execution
LOG_EVENTS = {
    "stopJ": ("received", "motion"),
    "stopJ async": ("received", "motion"),
    "speedStop": ("received", "motion"),
    "speedJ first": ("received", "motion"),
    "speedJ streaming": ("received", "retarget"),
    "triggerProtectiveStop": ("received", "protective_stop"),
    "getForwardKinematics": ("received", "taken"),
    "getJacobian": ("received", "taken"),
    "setSpeedSlider": ("slider", ""),
    "dashboard stop": ("dashboard", ""),
    "raw stopj on 30003": ("script", "motion"),
}


class Reader(threading.Thread):
    """RTDE client that records the speed of the leading joint and the time at which it came."""

    def __init__(self, host: str) -> None:
        super().__init__(daemon=True)
        self.socket = socket.create_connection((host, 30004))
        self.recipe = Recipe(("timestamp", "actual_qd"))
        self.socket.sendall(pack_outputs_request(self.recipe.names) + pack(PacketKind.START))
        self.samples: list[tuple[float, float]] = []

    def run(self) -> None:
        rest = b""
        while data := self.socket.recv(4096):
            now = time.monotonic()
            packets, rest = split(rest + data)
            for packet in packets:
                if packet.kind is PacketKind.DATA:
                    qd = self.recipe.unpack(packet.payload)[1]
                    self.samples.append((now, max(abs(v) for v in qd)))  # type: ignore[union-attr]

    def speed(self) -> float:
        return self.samples[-1][1] if self.samples else 0.0

    def wait(self, condition: Callable[[float], bool]) -> None:
        while not condition(self.speed()):
            time.sleep(0.0005)


def measure(host: str, calls: int, stops: int) -> dict[str, Any]:
    """Make the calls, in the child; return command -> [time of call, time of return], and the stops."""
    import dashboard_client
    import rtde_control
    import rtde_io

    reader = Reader(host)
    reader.start()
    control = rtde_control.RTDEControlInterface(host)
    io = rtde_io.RTDEIOInterface(host)
    dashboard = dashboard_client.DashboardClient(host)
    dashboard.connect()
    raw = socket.create_connection((host, 30003))
    raw.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    zero, q = [0.0] * 6, list(START_JOINTS)

    def ready() -> None:
        while not control.isProgramRunning():
            time.sleep(0.002)

    def upload() -> None:
        time.sleep(0.03)
        control.reuploadScript()
        time.sleep(0.03)
        ready()

    def unlock() -> None:
        dashboard.unlockProtectiveStop()
        dashboard.stop()
        upload()

    def stop_speed() -> None:
        control.speedStop(20.0)

    def nothing() -> None:
        """Do nothing between two calls."""

    def wait_for_start() -> None:
        time.sleep(0.03)  # the next program would overtake this one before it starts

    paths: list[tuple[str, Callable[[int], object], Callable[[], object], int]] = [
        ("stopJ", lambda _: control.stopJ(10.0), nothing, calls),
        ("speedStop", lambda _: control.speedStop(10.0), nothing, calls),
        ("speedJ first", lambda _: control.speedJ(zero, 10.0, 0.0), stop_speed, calls),
        ("speedJ streaming", lambda i: control.speedJ([1e-4 * (1 + i % 2), *zero[1:]], 10.0, 0.0), nothing, calls),
        ("triggerProtectiveStop", lambda _: control.triggerProtectiveStop(), unlock, calls // 10),
        (
            "getForwardKinematics",
            lambda _: control.getForwardKinematics(q, [0.0, 0.0, 0.1, 0.0, 0.0, 0.0]),
            nothing,
            calls,
        ),
        ("getJacobian", lambda _: control.getJacobian(), nothing, calls),
        ("setSpeedSlider", lambda i: io.setSpeedSlider(1.0 - 0.5 * (i % 2)), nothing, calls),
        ("dashboard stop", lambda _: dashboard.stop(), nothing, calls),
        ("raw stopj on 30003", lambda _: raw.sendall(b"stopj(10)\n"), wait_for_start, calls // 3),
        ("stopJ async", lambda _: control.stopJ(10.0, True), nothing, calls),
    ]
    timed: dict[str, list[tuple[float, float]]] = {}
    for name, call, after, count in paths:
        if name in ("stopJ async",):
            io.setSpeedSlider(1.0)
            upload()
        timed[name] = []
        for index in range(count):
            time.sleep(0.004 + 0.002 * (index * 0.618 % 1.0))  # any phase of the cycle
            begin = time.monotonic()
            call(index)
            timed[name].append((begin, time.monotonic()))
            after()
        if name == "speedJ streaming":
            stop_speed()
    control.stopJ(10.0)
    upload()

    def move() -> None:
        control.moveJ([q[0] + 3.0, *q[1:]], 1.0, 20.0, True)

    def spin() -> None:
        control.speedJ([1.0, *zero[1:]], 20.0, 0.0)

    def slide() -> None:
        control.speedL([0.0, 0.0, 0.1, 0.0, 0.0, 0.0], 2.0, 0.0)

    # name, start, speed at which it counts as running, stop, whether the control program must be uploaded again
    cases: list[tuple[str, Callable[[], None], float, Callable[[], object], bool]] = [
        ("moveJ async: stopJ(10)", move, 0.99, lambda: control.stopJ(10.0), False),
        ("moveJ async: stopL(5)", move, 0.99, lambda: control.stopL(5.0), False),
        ("speedJ: speedStop(10)", spin, 0.99, lambda: control.speedStop(10.0), False),
        ("speedJ: speedJ(0, a=10)", spin, 0.99, lambda: control.speedJ(zero, 10.0, 0.0), False),
        ("speedL: speedStop(5)", slide, 0.05, lambda: control.speedStop(5.0), False),
        ("moveJ: dashboard stop", move, 0.99, dashboard.stop, True),
        ("moveJ: dashboard pause", move, 0.99, dashboard.pause, True),
        ("moveJ: raw stopj(10)", move, 0.99, lambda: raw.sendall(b"stopj(10)\n"), True),
        ("moveJ: setSpeedSlider(0)", move, 0.99, lambda: io.setSpeedSlider(0.0), True),
        ("moveJ: triggerProtectiveStop", move, 0.99, control.triggerProtectiveStop, True),
    ]
    stopped: dict[str, list[tuple[float, float]]] = {}
    for name, start, fast, stop, again in cases:
        stopped[name] = []
        for index in range(stops):
            start()
            reader.wait(lambda speed, fast=fast: speed >= fast)  # type: ignore[misc]
            time.sleep(0.02 + 0.002 * (index * 0.618 % 1.0))
            before = reader.speed()
            begin = time.monotonic()
            stop()
            reader.wait(lambda speed: speed == 0.0)
            since = reader.samples[bisect_left(reader.samples, (begin, 0.0)) :]
            slower = next(t for t, speed in since if speed < before - 1e-3)
            stopped[name].append((slower - begin, next(t for t, speed in since if speed == 0.0) - begin))
            io.setSpeedSlider(1.0)
            if name.endswith("triggerProtectiveStop"):
                time.sleep(0.01)
                dashboard.unlockProtectiveStop()
            if again:
                dashboard.stop()
                upload()
            else:
                control.speedStop(20.0)
            control.moveJ(q, 2.0, 20.0)
    return {"timed": timed, "stopped": stopped}


def cell(values: Sequence[float]) -> str:
    return f"{1e3 * quantile(values, 0.5):7.2f} /{1e3 * quantile(values, 0.99):7.2f}" if values else "            -   "


def rows(timed: dict[str, list[list[float]]], events: list[dict[str, Any]]) -> dict[str, tuple[list[float], ...]]:
    """Return command -> delays from the call to arrival, execution and return [s]."""
    when = {
        kind: [e["monotonic"] for e in events if e["event"] == kind] for kinds in LOG_EVENTS.values() for kind in kinds
    }
    out = {}
    for name, calls in timed.items():
        arrival, execution = LOG_EVENTS[name]
        delays: tuple[list[float], ...] = ([], [], [])
        for begin, end in calls:
            for column, kind in enumerate((arrival, execution)):
                if kind and (at := bisect_left(when[kind], begin)) < len(when[kind]):
                    delays[column].append(when[kind][at] - begin)
            delays[2].append(end - begin)
        out[name] = delays
    return out


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calls", type=int, default=300, help="calls of each command at rest (%(default)s)")
    parser.add_argument("--stops", type=int, default=30, help="stops of each kind while the arm moves (%(default)s)")
    parser.add_argument("--json", action="store_true", help="print the quantiles as JSON")
    parser.add_argument("--measure", metavar="HOST", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.measure:
        print("RESULT " + json.dumps(measure(args.measure, args.calls, args.stops)), flush=True)
        os._exit(0)
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log.jsonl"
        with SimulatedController(host=free_host(), start_q=START_JOINTS, log=log, unlock_after_s=0.0) as simulated:
            command = [sys.executable, "-m", "bench", "sim-ur", "--measure", simulated.host]
            command += ["--calls", str(args.calls), "--stops", str(args.stops)]
            child = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
            events = simulated.events()
    found = [line for line in child.stdout.splitlines() if line.startswith("RESULT ")]
    if not found:
        print(child.stdout + child.stderr, file=sys.stderr)
        return 1
    result = json.loads(found[0].removeprefix("RESULT "))
    table = rows(result["timed"], events)
    if args.json:
        at_rest = {
            name: [[quantile(d, s) for s in (0.5, 0.99)] if d else None for d in ds] for name, ds in table.items()
        }
        moving = {
            name: [[quantile([p[i] for p in pairs], s) for s in (0.5, 0.99)] for i in (0, 1)]
            for name, pairs in result["stopped"].items()
        }
        print(json.dumps({"at_rest": at_rest, "moving": moving}))
        return 0
    print(f"{head()}; ms, median / p99\n")
    print(f"{'arm at rest':30s} {'n':>4s} {'received':>16s} {'executed':>16s} {'returned':>16s}")
    for name, delays in table.items():
        print(f"{name:30s} {len(delays[2]):4d} " + " ".join(cell(column) for column in delays))
    print(f"\n{'moving':30s} {'n':>4s} {'slower':>16s} {'standing':>16s}")
    for name, pairs in result["stopped"].items():
        print(f"{name:30s} {len(pairs):4d} {cell([p[0] for p in pairs])} {cell([p[1] for p in pairs])}")
    return 0
