"""Guarded pick and place beside busy loops: stops that nobody needed, and how soon each touch stops the arm.

    python -m bench busy [--minutes 20] [--loops 4] [--hold 0] [--seed 1]

A program picks and places with a simulated arm. As many processes as ``--loops`` says compute without a pause, and a
skin is touched at random times. Program, guard, driver process and loops run as a user without special rights, on all
cores. Controller and skin stand for hardware of their own: they come first where this is started as root, as nobody
else could let them. ``--hold`` lets the program sort for so many seconds at a time, with Python's lock held.

A processor of a virtual machine stands still while its host gives it no time. The simulated hardware on it does so too,
and no program can prevent it. A thread that comes before all others sees that on each, and the simulated skin says how
late it was itself. A stop in or within STALL_REACH after more than STALL s of that is counted apart.

A touch counts as late where the arm stands later than the budget that its scene gives a stop: v / a and four times
``escalate_ms``, counted from the touch, plus 20 ms for the frames that show it.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import socket
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from bench.faults.setup import CLOCK, give_precedence
from bench.faults.trial import Child
from bench.report import head, quantile, show
from coneskin.core.errors import Collision, ConeSkinError
from coneskin.robot.driver.values import Waypoint
from coneskin.robot.sim.process import SimulatedController, free_host
from coneskin.session.session import guard
from tests.support.scenes import ESCALATE, START, forearm_scene, start_with

SPEED, ACCELERATION, DECELERATION = 1.0, 2.0, 10.0
BUDGET = SPEED / DECELERATION + 4.0 * ESCALATE + 0.02  # s; from a touch to the arm that stands
LEADING_SIDE = 1.55  # rad
BUSY_LOOP = "while True: pass"
STALL, STALL_REACH = 0.02, 0.3  # s


class StallWatch(threading.Thread):
    """Thread before all others on one processor, which sees when nothing at all runs there; needs the right to it."""

    def __init__(self, processor: int) -> None:
        super().__init__(name=f"stall watch {processor}", daemon=True)
        self.stalls: list[tuple[float, float]] = []  # end and length [s]
        self._processor = processor

    def run(self) -> None:
        os.sched_setaffinity(0, {self._processor})
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(90))
        except PermissionError:
            print(f"no stall of processor {self._processor} is seen: start this as root", file=sys.stderr)
            return
        last = time.monotonic()
        while True:
            time.sleep(0.001)
            now = time.monotonic()
            if now - last > STALL:
                self.stalls.append((now, now - last))
            last = now


def near(at: float, stalls: list[tuple[float, float]]) -> bool:
    """Tell whether a time [s] lies in a stall, or shortly after one; each has an end and a length [s]."""
    return any(0.0 <= at - (end - length) <= length + STALL_REACH for end, length in stalls)


def without_rights(*arguments: str) -> list[str]:
    """Return the arguments of a Python that has none of the rights of root, whoever starts it."""
    if os.geteuid() != 0:
        return [*arguments]
    words = ["setpriv", "--bounding-set=-all", "--inh-caps=-all", sys.executable, *arguments]
    return ["-c", f"import os; os.execvp({words[0]!r}, {words!r})"]


def program(scene: str, recording: str, hold: float) -> None:
    """Pick and place until the input ends, reset after each stop, and report each event that matters."""
    over = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), over.set()), daemon=True).start()
    numbers = [random.random() for _ in range(20_000)]

    def tell(event: Any) -> None:
        if event.name in ("activated", "stopping", "standstill", "latched", "refused", "fault", "escalated", "message"):
            say(name=str(event.name), at=event.time, **{k: v for k, v in event.details.items() if k != "name"})

    with guard(scene, recording=Path(recording), on_event=tell, start_timeout=60.0) as session:
        arm, home, there = session.arm, START, start_with(60.0)
        children = session._processes.children.items()
        say(name="pids", pids={name: child.pid for name, child in children})
        while not over.is_set():
            try:
                for place in (home, there):
                    say(name="moves", at=time.monotonic())
                    arm.move_path([Waypoint.move_j(place, SPEED, ACCELERATION)])
                    say(name="arrived", at=time.monotonic())
                    pose = arm.states.read().tcp_pose if hasattr(arm.states, "read") else None
                    if pose is not None:
                        arm.move_l([*pose[:2], pose[2] - 0.05, *pose[3:]], 0.25, 1.2)
                        arm.move_l(list(pose), 0.25, 1.2)
                    begun = time.monotonic()
                    while time.monotonic() - begun < hold:
                        sorted(numbers)
            except (Collision, ConeSkinError) as exc:
                say(name="raised", at=time.monotonic(), why=str(exc))
                while not over.is_set():
                    time.sleep(0.3)
                    try:
                        session.reset()
                        break
                    except ConeSkinError as refused:
                        say(name="refused reset", why=str(refused))


def unlock(host: str) -> None:
    """Release a protective stop, as a person does at the controller's screen."""
    with socket.create_connection((host, 29999), 5.0) as dashboard:
        dashboard.recv(1024)
        for line in (b"close safety popup\n", b"unlock protective stop\n"):
            dashboard.sendall(line)
            dashboard.recv(1024)


def say(**facts: Any) -> None:
    sys.stdout.write(json.dumps(facts, default=str) + "\n")  # whole, because two threads say something
    sys.stdout.flush()


def main() -> None:
    """Run the pick and place, and print what stopped it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=20.0)
    parser.add_argument("--loops", type=int, default=4)
    parser.add_argument("--hold", type=float, default=0.0, metavar="SECONDS")
    parser.add_argument("--period", type=float, default=6.0, metavar="SECONDS", help="between touches, on average")
    parser.add_argument("--limits", default="", help="lines of [monitoring], separated by ;")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="folder for the recording")
    args = parser.parse_args()
    print(head("ur-rtde"))
    rng, events, touches = random.Random(args.seed), list[dict[str, Any]](), list[float]()
    lags: list[tuple[float, float]] = []  # of the simulated skin: until when, and over which time [s]
    looked = 0.0
    watches = [StallWatch(processor) for processor in sorted(os.sched_getaffinity(0))]
    for watch in watches:
        watch.start()
    with ExitStack() as stack:
        folder = args.keep or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        folder.mkdir(exist_ok=True)
        controller = SimulatedController("UR5e", free_host(), START, log=folder / "log.jsonl", unlock_after_s=0.0)
        stack.enter_context(controller)
        give_precedence(controller.pid)
        skin = Child("-m", "bench.faults.virtual_skin", str(folder / "port"), str(args.seed), "ladder", "1")
        stack.callback(skin.close)
        skin.hear(30.0)
        text = forearm_scene(controller.host, port=str(folder / "port"), limits=args.limits.replace(";", "\n"))
        (folder / "scene.toml").write_text(text, encoding="utf-8")
        for _ in range(args.loops):
            loop = subprocess.Popen([sys.executable, *without_rights("-c", BUSY_LOOP)], start_new_session=True)
            stack.callback(loop.wait)
            stack.callback(loop.kill)
        files = str(folder / "scene.toml"), str(folder / "run.rec")
        run = Child(*without_rights("-m", "bench.loop.busy", "--program", *files, f"{args.hold}"))
        stack.callback(run.close, 10.0)
        began, end, next_touch, moving_since = CLOCK(), CLOCK() + 60.0 * args.minutes, 0.0, None
        while CLOCK() < end:
            event = run.hear(0.05)
            if event:
                events.append(event)
                if event["name"] not in ("moves", "arrived", "refused", "refused reset"):
                    print(f"{CLOCK() - began:8.2f} s  {event}", flush=True)
            name = event.get("name")
            if name == "moves":
                moving_since, next_touch = CLOCK(), CLOCK() + 0.5 + 0.6 * rng.random()
                if rng.random() > 3.5 / args.period:
                    next_touch = float("inf")
            elif name in ("arrived", "stopping", "raised"):
                moving_since = None
            elif name == "refused" and "safety system" in str(event["reasons"]):
                unlock(controller.host)
            if moving_since is not None and CLOCK() >= next_touch:
                moving_since = None
                asked = {"u": 0.13, "phi": LEADING_SIDE, "after": 0.0, "duration": 0.2, "force": 5.0, "rise": 0.01}
                touches.append(float(skin.ask(touches=[{**asked, "sensor": "0"}])["at"]))
            elif not event and run._process.poll() is not None:
                break
            if CLOCK() - looked > 0.25:
                late, before, looked = float(skin.ask(anew=True)["late"]), looked, CLOCK()
                lags += [(looked, looked - before)] if late > STALL and before else []
        if run._process.poll() is not None:
            print(run.errors)
        stood = [event["monotonic"] for event in controller.events("standstill")]
        moved = [e["monotonic"] for e in controller.events("motion") if e["kind"] != "StopJoints"]
    stalls = [stall for watch in watches for stall in watch.stalls]
    judge(events, touches, stood, moved, CLOCK() - began, stalls, lags)


def judge(
    events: list[dict[str, Any]],
    touches: list[float],
    stood: list[float],
    moved: list[float],
    seconds: float,
    stalls: list[tuple[float, float]],
    lags: list[tuple[float, float]],
) -> None:
    """Print how long each touch took, and what else has stopped the arm."""
    stops = [event for event in events if event["name"] == "stopping"]
    times, late, unseen, explained = [], [], 0, set()
    for touched in touches:
        stop = next((s for s in stops if -0.3 <= s["at"] - touched < 0.5), None)  # one may be under way
        end = next((at for at in stood if at >= touched), None)
        if stop is None or end is None:
            unseen += 1
            continue
        explained |= {stop["stop"]} if stop["at"] >= touched else set()
        if max((at for at in stood if at < stop["at"]), default=0.0) > max(
            (at for at in moved if at < stop["at"]), default=0.0
        ):
            continue  # it had just arrived
        times.append(end - touched)
        late += [end - touched] if end - touched > BUDGET else []
    others = [s for s in stops if s["stop"] not in explained]
    alone = [s for s in others if "; then " not in s["why"]]  # the others repeat the stop of an arm that stands
    needless = [s for s in alone if not near(s["at"], [*stalls, *lags])]
    rows = [
        ["minutes", f"{seconds / 60.0:.1f}"],
        ["moves that arrived", sum(e["name"] == "arrived" for e in events)],
        ["touches", len(touches)],
        ["touches without a stop", unseen],
        ["standing after the touch, median", f"{1e3 * quantile(times, 0.5):.0f} ms"],
        ["... longest", f"{1e3 * max(times, default=0.0):.0f} ms"],
        [f"... later than {1e3 * BUDGET:.0f} ms", len(late)],
        ["further stop paths used", sum(e["name"] == "escalated" for e in events)],
        ["stops repeated on a standing arm", len(others) - len(alone)],
        [f"times a processor stood still for more than {1e3 * STALL:g} ms", len(stalls)],
        ["... longest", f"{1e3 * max((length for _, length in stalls), default=0.0):.0f} ms"],
        [f"quarters of a second in which the simulated skin was late by more than {1e3 * STALL:g} ms", len(lags)],
        ["stops at such a time", len(alone) - len(needless)],
        ["stops without a touch", len(needless)],
    ]
    show("Pick and place beside busy loops", ["", "value"], rows)
    for stop in needless:
        print(f"  {stop['why']}")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--program"]:
        program(sys.argv[2], sys.argv[3], float(sys.argv[4]))
    else:
        main()
