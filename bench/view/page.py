"""The page beside a guard: first picture, touch to viewer, pictures a second, ten viewers, and what the guard feels.

    python -m bench view [--seconds 8] [--touches 8] [--rounds 3]

One guard, one run: a simulated UR5e, a virtual skin of 1 kHz. First what a viewer has of the page, then what the guard
feels of it (`view_guard.py`): how late a frame is at the guard, which is its host time less the device's clock, less
the least such difference of the run. What is the browser's part is told by a page of viser's with a box, and by viewers
that take all that is sent and draw nothing; what is that of a busy machine, by how long the page's process was ready
and got no processor. Needs the extra `view`, playwright and chromium, which draws in software here.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from bench.faults.setup import give_precedence
from bench.report import head, quantile
from coneskin.core.errors import ConeSkinError
from coneskin.robot.guard.signals.journal import EventName
from coneskin.robot.sim.process import SimulatedController, free_host
from coneskin.scene.reader import parse_scene
from coneskin.session.session import Session, guard
from tests.support.scenes import START, forearm_scene

from .browser import PROCESS_KINDS, drawn_pictures, first_picture, resident
from .guard import guard_rounds, print_lateness
from .viewer import Viewer, processor_time, waited

TIME_LIMITS = "skin_silence_ms = 1000\narm_silence_ms = 1000"
SKIN_TABLE = '"virtual"\nrate_hz = 1000'
MOVED_JOINTS = (0.5, 0.0, 0.0, 0.0, 0.0, 0.0)  # rad, between the two ends of the motion


def page_of(recording: Path) -> tuple[subprocess.Popen[str], str, float]:
    """Start the page beside the guard; its process, address, and how long that took [s]."""
    began = time.monotonic()
    command = [sys.executable, "-m", "coneskin", "view", str(recording), "--no-browser", "--json", "--port", "18300"]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True)
    assert child.stdout is not None
    return child, json.loads(child.stdout.readline())["url"], time.monotonic() - began


class Told(NamedTuple):
    """Time from a touch to the words at a viewer [s]: all, to the guard's stop, and the page's without a processor."""

    whole: float
    guard: float
    waited: float


def touch_to_viewer(session: Session, viewer: Viewer, pid: int) -> Told:
    """Touch the skin, and see when a viewer is told; NaN where that takes longer than 10 s."""
    viewer.touched, before = None, waited(pid)
    touched = session.touch(u=0.13, phi=1.57, duration=0.1)
    session.wait_for(("none",), 0.6)
    while viewer.touched is None and time.monotonic() < touched + 10.0:
        session.wait_for(("none",), 0.2)
    for _ in range(100):
        try:
            session.reset()
            break
        except ConeSkinError:
            session.wait_for(("none",), 0.05)
    while not viewer.active and time.monotonic() < touched + 30.0:
        session.wait_for(("none",), 0.1)
    stop = max((event.time for event in session.events if event.name == EventName.STOPPING), default=float("nan"))
    if viewer.touched is None:
        return Told(float("nan"), stop - touched, float("nan"))
    return Told(viewer.touched - touched, stop - touched, viewer.waited - before)


@contextlib.contextmanager
def moving(session: Session) -> Iterator[None]:
    """Let the arm move to and fro."""
    over = threading.Event()

    def move() -> None:
        away = [a + b for a, b in zip(START, MOVED_JOINTS, strict=True)]
        with contextlib.suppress(ConeSkinError):  # touched by nobody, but the session may end
            while not over.is_set():
                for goal in (away, START):
                    session.arm.move_j(goal, speed=0.5, acceleration=2.0)

    mover = threading.Thread(target=move, daemon=True)
    mover.start()
    try:
        yield
    finally:
        over.set()
        mover.join(20.0)


@contextlib.contextmanager
def served_box() -> Iterator[str]:
    """Serve the page with a box: its address."""
    child = subprocess.Popen([sys.executable, "-m", "bench.view.box"], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    try:
        yield child.stdout.readline().strip()
    finally:
        child.kill()
        child.wait()


def drawn(name: str, page: Any, seconds: float) -> None:
    """Print what a browser draws in some seconds."""
    turns, pictures, spent = drawn_pictures(page, seconds)
    parts = ", ".join(f"{kind} {1e3 * spent[kind] / max(pictures * seconds, 1.0):.0f} ms" for kind in PROCESS_KINDS)
    rates = f"{turns:.1f} turns, {pictures:.1f} pictures a second"
    print(f"browser, {name}: {rates}; processor time of each: {parts}", flush=True)


def look(driver: Any, box_url: str, url: str, moving: Callable[[], Any], seconds: float) -> None:
    """Look at the page in a browser, beside a page with a box, and print what it draws."""
    for name, address in (("a page of viser's with a box", box_url), ("the page", url)):
        browser, page, took, spent = first_picture(driver, address, phase=address == url)
        parts = ", ".join(f"{kind} {1e3 * spent[kind]:.0f} ms" for kind in PROCESS_KINDS)
        print(f"browser, {name}: {took:.2f} s until the first picture; processor time: {parts}", flush=True)
        if address == url:
            drawn("arm stands", page, seconds)
            with moving():
                drawn("arm moves", page, seconds)
        else:
            drawn("a box alone moves", page, seconds)
        browser.close()


@contextlib.contextmanager
def served(recording: Path) -> Iterator[tuple[int, str]]:
    """Serve the page for a while: its process and its address."""
    child, url, took = page_of(recording)
    print(f"page: served {took:.2f} s after its start", flush=True)
    try:
        yield child.pid, url
    finally:
        child.terminate()
        child.wait(60)


def look_without_drawing(session: Session, pid: int, url: str, seconds: float, touches: int) -> None:
    """Look at the page without a browser, and print what comes and when."""
    viewer = Viewer(url, pid)
    session.wait_for(("none",), 1.0)
    told = viewer.pictures
    with moving(session):
        session.wait_for(("none",), seconds)
    print(f"a viewer that draws nothing, arm moves: {(viewer.pictures - told) / seconds:.1f} pictures a second")
    found = [touch_to_viewer(session, viewer, pid) for _ in range(touches)]
    for name, times in zip(("touch to the words at a viewer", "... of which until the guard stops",
                            "... of which the page's process was ready and got no processor"),
                           zip(*found, strict=True), strict=True):  # fmt: skip
        words = ", ".join(f"{1e3 * quantile(times, share):.0f}" for share in (0.0, 0.5, 0.99))
        print(f"{name}: {words} ms (least, median, most of {len(times)})", flush=True)
    before, cpu = resident(pid), processor_time(pid)
    crowd = [viewer, *(Viewer(url, pid) for _ in range(9))]
    told = sum(one.messages for one in crowd)
    session.wait_for(("none",), seconds)
    spent = processor_time(pid) - cpu
    told = sum(one.messages for one in crowd) - told
    print(f"ten viewers: {100.0 * spent / seconds:.0f} % of a core for the page's process, "
          f"{told / 10.0 / seconds:.1f} messages a second each, {before} kB before, "
          f"{resident(pid)} kB after {seconds:g} s")  # fmt: skip
    for one in crowd:
        one.end()


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--touches", type=int, default=8)
    parser.add_argument("--rounds", type=int, default=3, help="of what the guard feels of whom (0: leave it out)")
    parser.add_argument("--no-browser", action="store_true", help="measure without chromium")
    args = parser.parse_args()
    print(head("viser", "playwright"), flush=True)
    scene = parse_scene(forearm_scene(host := free_host(), limits=TIME_LIMITS).replace('"virtual"', SKIN_TABLE))
    with contextlib.ExitStack() as stack:
        recording = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "run.rec"
        driver, box_url = None, ""
        if not args.no_browser:
            from playwright.sync_api import sync_playwright

            driver = stack.enter_context(sync_playwright())
            box_url = stack.enter_context(served_box())
        with SimulatedController("UR5e", host, START) as arm, guard(scene, recording=recording) as session:
            children = session._processes.children
            for hardware in (arm.pid, children["skin"].pid):  # which waits for no processor of this computer
                give_precedence(hardware)
            with served(recording) as (pid, url):
                if driver is not None:
                    look(driver, box_url, url, lambda: moving(session), args.seconds)
                look_without_drawing(session, pid, url, args.seconds, args.touches)
            with moving(session):
                spans = guard_rounds(
                    driver,
                    box_url,
                    lambda: served(recording),
                    lambda seconds: session.wait_for(("none",), seconds),
                    args.rounds,
                    args.seconds,
                    children["guard"].pid,
                )
        print_lateness(recording, spans)
