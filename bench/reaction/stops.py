"""Time from a stop command to deceleration and standstill, and false escalations to the next stop path.

Real processes, real wheel, simulated controller.

    python -m bench stops [--stops 30]

The arm is moved by ur_rtde (asynchronous moveJ), then by a program that knows nothing of the guard (URScript); on an
idle machine, then with a busy process on each core; with default limits. A touch stops the arm, and a reset lets it go
on. From the guard's events: command -> first measured deceleration, command -> standstill; escalations (the next stop
path was used although the first one worked); stops for a reason other than the touch.

It does not show a real controller, whose start of a program and braking are not known here.
"""

import argparse
import math
import os
import socket
import statistics
import subprocess
import sys
import threading
import time

from bench.report import head
from coneskin.core.errors import ConeSkinError
from coneskin.robot.sim.process import SimulatedController, free_host
from coneskin.scene.reader import parse_scene
from coneskin.session.session import Session, guard
from coneskin.testing.forearm import START, forearm_scene, start_with

GOAL = start_with(150.0)
RAW = f"def users():\n  while True:\n    movej({GOAL}, a=8, v=1)\n    movej({START}, a=8, v=1)\n  end\nend\n"


def main() -> None:
    """Run the turns and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stops", type=int, default=30)
    args = parser.parse_args()
    print(head() + "\n")
    print(f"{'ms':34}{'stops':>6}{'slower med':>12}{'worst':>8}{'standing med':>14}{'worst':>8}", end="")
    print(f"{'escalated':>11}{'other':>7}")
    for busy in (False, True):
        for control in ("internal", "external"):
            load = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(busy * os.cpu_count())]  # type: ignore[operator]
            try:
                row(f"{control}, {'busy' if busy else 'idle'} machine", *measure(control, args.stops))
            finally:
                for child in load:
                    child.kill()
                    child.wait()


def row(name: str, slower: list[float], standing: list[float], escalated: int, other: list[str]) -> None:
    """Print one line of the table."""
    values = [f(x) * 1e3 if x else math.nan for x in (slower, standing) for f in (statistics.median, max)]
    print(f"{name:34}{len(standing):6}{values[0]:12.1f}{values[1]:8.1f}{values[2]:14.1f}{values[3]:8.1f}", end="")
    print(f"{escalated:11}{len(other):7}", flush=True)
    for why in sorted(set(other)):
        print(f"    {other.count(why)} x {why}")


def measure(control: str, stops: int) -> tuple[list[float], list[float], int, list[str]]:
    """Touch a moving arm this many times; return delays to deceleration and standstill [s], and what went wrong."""
    slower: list[float] = []
    standing: list[float] = []
    escalated, other = 0, []
    with SimulatedController(model="UR5e", host=free_host(), start_q=START) as simulated:
        scene = parse_scene(forearm_scene(simulated.host, control))
        with guard(scene) as session:
            for _ in range(stops):
                seen = len(session.events)
                planner = start(session, control, simulated.host)
                while max(map(abs, simulated.state()["qd"])) < 0.9:
                    time.sleep(0.01)
                    if session.wait_for(("stopping",), 0.0, after=seen):
                        break
                session.touch(0.13, 1.55, duration=0.1)
                if session.wait_for(("latched",), 10.0, after=seen) is None:
                    raise SystemExit("the arm did not stand within 10 s")
                planner.join()
                events = {event.name: event for event in reversed(session.events[seen:])}
                if events["stopping"].details["why"] != "touch":
                    other.append(events["stopping"].details["why"])
                else:
                    begin = events["stopping"].time
                    slower.append(events["decelerating"].time - begin)
                    standing.append(events["standstill"].time - begin)
                escalated += sum(event.name == "escalated" for event in session.events[seen:])
                again(session)
    return slower, standing, escalated, other


def start(session: Session, control: str, host: str) -> threading.Thread:
    """Move the arm from a thread, through the session or past it."""

    def internal() -> None:
        try:
            session.arm.move_j(GOAL, 1.0, 8.0)
            session.arm.move_j(START, 1.0, 8.0)
        except ConeSkinError:
            pass  # the touch

    def external() -> None:
        with socket.create_connection((host, 30002), 5.0) as sock:
            sock.sendall(RAW.encode())
            time.sleep(0.1)

    thread = threading.Thread(target=internal if control == "internal" else external)
    thread.start()
    return thread


def again(session: Session) -> None:
    """Reset as soon as nothing touches the skin."""
    for _ in range(100):
        try:
            session.reset()
            return
        except ConeSkinError:
            time.sleep(0.05)
    raise SystemExit("the guard does not reset")
