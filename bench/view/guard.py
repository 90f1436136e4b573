"""Guard beside a page, for bench `view`: how late frames are, with all who look at the page told apart.

The arm moves to and fro all the time. In each round there is no page, a page that nobody looks at, one with viewers
that draw nothing, one with a browser, and a browser that draws a box while nobody looks at the page. "Giving way": in
the scheduling class that runs only while nothing else wants to (SCHED_IDLE), which stands for another computer, or for
a GPU; what it shares with the guard then is a core's caches. Linux first divides its time among sessions (autogroup in
sched(7)), so the page and its viewers are in sessions of their own, as in another terminal. How long the guard's
process was ready and got no processor tells the page's cost on a machine that is busy with other things as well.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from bench.report import quantile
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.runs.replay.run import read_run
from coneskin.skin.wire import FrameDecoder

from .browser import browser_processes, drawn_pictures, first_picture
from .viewer import waited

Spans = dict[str, list[tuple[float, float, float]]]

_SETTLE_TIME = 2.0  # s after a change, before anything is measured


def guard_rounds(
    driver: Any,
    box_url: str,
    serve: Callable[[], contextlib.AbstractContextManager[tuple[int, str]]],
    wait: Callable[[float], object],
    rounds: int,
    seconds: float,
    pid: int,
) -> Spans:
    """Measure each case in each round.

    Args:
        driver: playwright's; None for no browser.
        box_url: of a page with a box that moves.
        serve: starts the page; its process and address.
        wait: lets the session go on for a time [s].
        rounds: how often.
        seconds: of each case.
        pid: of the guard's process.

    Returns:
        when each case was measured [s, monotonic], and for how long the guard's process waited for a processor [s].
    """
    spans: Spans = {}

    def span(name: str, meanwhile: Callable[[float], object] = wait) -> None:
        wait(_SETTLE_TIME)
        began, before = time.monotonic(), waited(pid)
        meanwhile(seconds)
        spans.setdefault(name, []).append((began, time.monotonic(), waited(pid) - before))

    for _ in range(rounds):
        span("no page")
        with serve() as (_pid, url):
            span("page, nobody looks")
            for count in (1, 10):
                with _crowd(url, count):
                    span(f"page, {count} that draw nothing, giving way")
            if driver is None:
                continue
            for name, address, phase in (("page, browser", url, True), ("page, browser with a box", box_url, False)):
                browser, page, _took, _spent = first_picture(driver, address, phase=phase)
                for words, way in (("", None), (", giving way", _give_way)):
                    if way is not None:
                        way()
                    drawn = _Drawn(page)
                    span(name + words, drawn)
                    print(f"{name}{words}: {drawn.rate:.1f} pictures a second", flush=True)
                browser.close()
    return spans


def print_lateness(recording: Path, spans: Spans) -> None:
    """Print how late the frames of each case were at the guard, together and round by round."""
    decoder, late = FrameDecoder(), []
    for block in read_run(recording).select(kinds=frozenset({BlockKind.SKIN})):
        late += [(block.time, block.time - 1e-6 * frame.clock_us) for frame in decoder.feed(block.payload)]
    least = min(value for _, value in late)
    for name, times in spans.items():
        parts = [[1e3 * (value - least) for at, value in late if since <= at < until] for since, until, _ in times]
        ready = sum(spent for *_, spent in times) / sum(until - since for since, until, _ in times)
        whole = [value for part in parts for value in part]
        each = ", ".join(f"{quantile(part, 0.99):.2f}" for part in parts)
        middle, late_one = quantile(whole, 0.5), quantile(whole, 0.99)
        print(f"a frame at the guard, {name}: {middle:.2f} ms (median), {late_one:.2f} (p99; rounds: {each}), "
              f"{max(whole):.1f} (most) of {len(whole)}; it waited {1e3 * ready:.2f} ms a second")  # fmt: skip


class _Drawn:
    """Pictures a second of a browser, counted while it is called."""

    def __init__(self, page: Any) -> None:
        self._page, self.rate = page, 0.0

    def __call__(self, seconds: float) -> None:
        self.rate = drawn_pictures(self._page, seconds)[1]


@contextlib.contextmanager
def _crowd(url: str, count: int) -> Iterator[None]:
    """Let viewers look from a process that gives way."""
    program = [sys.executable, "-m", "bench.view.viewer", url, "--viewers", str(count)]
    child = subprocess.Popen(program, start_new_session=True)
    try:
        yield
    finally:
        child.kill()
        child.wait()


def _give_way() -> None:
    """Put all threads of the browser below this process into the class that runs only while nothing else wants to."""
    for pid in browser_processes():
        for task in Path(f"/proc/{pid}/task").iterdir():
            with contextlib.suppress(ProcessLookupError):  # a thread that has just ended
                os.sched_setscheduler(int(task.name), os.SCHED_IDLE, os.sched_param(0))
