"""The page beside a guard: first picture, touch to viewer, pictures a second, ten viewers, and what the guard feels.

    python bench/view.py [--seconds 8] [--touches 8]

One guard, one run: a simulated UR5e, a virtual skin of 1 kHz. It is guarded without a page, then with a page and one
browser, then with ten viewers. How late a frame is at the guard is its host time less the device's clock, less the
least such difference of the run. What is the browser's part is told by an empty page of viser's, and by a viewer that
takes all that is sent and draws nothing; what is that of a busy machine, by how long the page's process was ready and
got no processor. Needs the extra `view`, playwright and chromium, which draws in software here.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from report import head, quantile
from view_browser import PROCESSES, drawn_pictures, first_picture, resident

from coneskin.errors import ConeSkinError
from coneskin.replay.run import read_run
from coneskin.robot.guard.journal import BlockKind, EventName
from coneskin.robot.sim.process import SimulatedController, free_host
from coneskin.scene.reader import parse_scene
from coneskin.session.session import Session, guard
from coneskin.skin.wire import FrameDecoder
from coneskin.testing.forearm import START, forearm_scene
from coneskin.view.page_server import PageServer

LIMITS = "skin_silence_ms = 1000\nskin_late_ms = 1000\narm_silence_ms = 1000"
MOVED = (0.5, 0.0, 0.0, 0.0, 0.0, 0.0)  # rad, between the two ends of the motion


def page_of(recording: Path) -> tuple[subprocess.Popen[str], str, float]:
    """Start the page beside the guard; its process, address, and how long that took [s]."""
    began = time.monotonic()
    command = [sys.executable, "-m", "coneskin", "view", str(recording), "--no-browser", "--json", "--port", "18300"]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    return child, json.loads(child.stdout.readline())["url"], time.monotonic() - began


class Viewer:
    """Viewer that takes all that is sent, as a browser does, and draws nothing.

    Attributes:
        touched: when the words came that the arm stops [s, monotonic]; None until then.
        messages: that came.
        active: the newest words are that the guard is active.
        pictures: parcels in which a link has turned.
        waited: how long the page's process had got no processor when the words came [s].
    """

    def __init__(self, url: str, pid: int) -> None:
        self.touched: float | None = None
        self.messages, self.pictures, self.waited, self.active = 0, 0, 0.0, False
        self._pid = pid
        self._url, self._over = url, threading.Event()
        self._thread = threading.Thread(target=self._view, daemon=True)
        self._thread.start()

    def _view(self) -> None:
        import viser
        import zstandard
        from websockets.exceptions import ConnectionClosed
        from websockets.sync.client import connect

        protocol: Any = f"viser-v{viser.__version__}"
        with (
            contextlib.suppress(ConnectionClosed),  # the page has ended
            connect(self._url.replace("http", "ws"), subprotocols=[protocol], max_size=None) as socket,
        ):
            while not self._over.is_set():
                data = socket.recv()
                came = time.monotonic()
                assert isinstance(data, bytes)
                size, packed = (int.from_bytes(data[at : at + 8], "little") for at in (0, 8))
                inner = zstandard.ZstdDecompressor().decompress(data[16 : 16 + packed], size)
                self.messages += 1
                self.pictures += b"SetOrientationMessage" in inner
                if b"coneskin-phase" in inner:
                    self.active = b">active<" in inner
                    if self.touched is None and (b">stopping<" in inner or b">latched" in inner):
                        self.touched, self.waited = came, waited(self._pid)

    def end(self) -> None:
        """Leave."""
        self._over.set()


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
        away = [a + b for a, b in zip(START, MOVED, strict=True)]
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


def lateness(recording: Path, spans: dict[str, tuple[float, float]]) -> dict[str, list[float]]:
    """How late the frames of each span were at the guard [ms]."""
    decoder, late = FrameDecoder(), []
    for block in read_run(recording).select(kinds=frozenset({BlockKind.SKIN})):
        late += [(block.time, block.time - 1e-6 * frame.clock_us) for frame in decoder.feed(block.payload)]
    least = min(value for _, value in late)
    return {
        name: [1e3 * (value - least) for at, value in late if since <= at < until]
        for name, (since, until) in spans.items()
    }


def processor_time(pid: int) -> float:
    """Time that a process has run [s]."""
    return sum(map(int, Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:13])) / os.sysconf(
        "SC_CLK_TCK"
    )


def waited(pid: int) -> float:
    """How long the threads of a process were ready and got no processor, together [s]."""
    tasks = Path(f"/proc/{pid}/task").iterdir()
    return 1e-9 * sum(int((task / "schedstat").read_text().split()[1]) for task in tasks)


@contextlib.contextmanager
def sliding_box(server: PageServer) -> Iterator[None]:
    """Let a box move to and fro on a page, 30 times a second: the least that a picture can take."""
    server.scene.configure_environment_map(hdri=None)
    server.scene.configure_default_lights(enabled=False)
    server.scene.add_light_directional("/sun", position=(1.0, 1.0, 1.0), cast_shadow=False)
    box, over = server.scene.add_box("/box", cast_shadow=False, receive_shadow=False), threading.Event()

    def move() -> None:
        while not over.wait(1.0 / 30.0):
            box.position = (0.0, math.sin(time.monotonic()), 0.0)

    mover = threading.Thread(target=move, daemon=True)
    mover.start()
    try:
        yield
    finally:
        over.set()
        mover.join()


def drawn(name: str, page: Any, seconds: float) -> None:
    """Print what a browser draws in some seconds."""
    turns, pictures, spent = drawn_pictures(page, seconds)
    parts = ", ".join(f"{kind} {1e3 * spent[kind] / max(pictures * seconds, 1.0):.0f} ms" for kind in PROCESSES)
    rates = f"{turns:.1f} turns, {pictures:.1f} pictures a second"
    print(f"browser, {name}: {rates}; processor time of each: {parts}", flush=True)


def look(url: str, span: Callable[[str], None], moving: Callable[[], Any], seconds: float) -> None:
    """Look at the page in a browser, beside an empty page, and print what it draws."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver, PageServer("empty", port=18400) as empty:
        for name, address in (("an empty page of viser's", empty.url), ("the page", url)):
            browser, page, took, spent = first_picture(driver, address, phase=address == url)
            parts = ", ".join(f"{kind} {1e3 * spent[kind]:.0f} ms" for kind in PROCESSES)
            print(f"browser, {name}: {took:.2f} s until the first picture; processor time: {parts}", flush=True)
            if address == url:
                break
            with sliding_box(empty):
                drawn("a box alone moves", page, seconds)
            browser.close()
        for name, context in (("arm stands", contextlib.nullcontext), ("arm moves", moving)):
            with context():
                drawn(name, page, seconds)
        span("page and browser")
        browser.close()


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--touches", type=int, default=8)
    parser.add_argument("--no-browser", action="store_true", help="measure without chromium")
    args = parser.parse_args()
    print(head("viser", "playwright"), flush=True)
    host = free_host()
    spans: dict[str, tuple[float, float]] = {}
    folder = tempfile.TemporaryDirectory()
    recording = Path(folder.name) / "run.rec"
    scene = parse_scene(forearm_scene(host, limits=LIMITS).replace('"virtual"', '"virtual"\nrate_hz = 1000'))

    def span(name: str) -> None:
        began = time.monotonic()
        session.wait_for(("none",), args.seconds)
        spans[name] = began, time.monotonic()

    with SimulatedController("UR5e", host, START), guard(scene, recording=recording) as session:
        span("no page")
        child, url, started = page_of(recording)
        print(f"page: served {started:.2f} s after its start", flush=True)
        if not args.no_browser:
            look(url, span, lambda: moving(session), args.seconds)
        viewer = Viewer(url, child.pid)
        session.wait_for(("none",), 1.0)
        told = viewer.pictures
        with moving(session):
            session.wait_for(("none",), args.seconds)
        print(
            f"a viewer that draws nothing, arm moves: {(viewer.pictures - told) / args.seconds:.1f} pictures a second"
        )
        found = [touch_to_viewer(session, viewer, child.pid) for _ in range(args.touches)]
        for name, times in zip(("touch to the words at a viewer", "... of which until the guard stops",
                                "... of which the page's process was ready and got no processor"),
                               zip(*found, strict=True), strict=True):  # fmt: skip
            words = ", ".join(f"{1e3 * quantile(times, share):.0f}" for share in (0.0, 0.5, 0.99))
            print(f"{name}: {words} ms (least, median, most of {len(times)})", flush=True)
        before, cpu = resident(child.pid), processor_time(child.pid)
        crowd = [viewer, *(Viewer(url, child.pid) for _ in range(9))]
        told = sum(one.messages for one in crowd)
        span("ten viewers")
        spent = processor_time(child.pid) - cpu
        told = sum(one.messages for one in crowd) - told
        print(f"ten viewers: {100.0 * spent / args.seconds:.0f} % of a core for the page's process, "
              f"{told / 10.0 / args.seconds:.1f} messages a second each, {before} kB before, "
              f"{resident(child.pid)} kB after {args.seconds:g} s")  # fmt: skip
        for one in crowd:
            one.end()
        child.terminate()
        child.wait(20)
    for name, late in lateness(recording, spans).items():
        print(f"a frame at the guard, {name}: {quantile(late, 0.5):.2f} ms (median), {quantile(late, 0.99):.2f} (p99), "
              f"{max(late):.1f} (most) of {len(late)}")  # fmt: skip
    folder.cleanup()


if __name__ == "__main__":
    main()
