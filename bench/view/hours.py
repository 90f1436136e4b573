"""Page that stays open: memory of its server and of the browser, while an hour of touches goes by.

    python -m bench view-hours [--hours 1] [--rate 2] [--looks 8]

The collision of tests/data is written again and again into a recording that grows, with its times shifted, `--rate`
times as fast as it was; `coneskin view` follows it, and a browser has the page open. A look collects the browser's
garbage first. Needs the extra `view`, playwright and chromium.
"""

from __future__ import annotations

import argparse
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

from bench.report import head
from coneskin.core.recording.block import Block
from coneskin.core.recording.recorder import Recorder

from .browser import CHROMIUM_FLAGS, CHROMIUM_PROGRAM, memory_of, resident
from .collisions import collisions_again, header_of
from .page import page_of

WRITE_STEP = 0.05  # s of the run that are written together: the recorder's own


class Writer(threading.Thread):
    """Writer of a recording in which a collision comes again and again.

    Attributes:
        shown: how much of it was written [s].
        collisions: how often.
    """

    def __init__(self, recorder: Recorder, rate: float) -> None:
        super().__init__(daemon=True)
        self._recorder, self._rate = recorder, rate
        self.shown, self.collisions, self.over = 0.0, 0, threading.Event()
        recorder.write(header_of(), flush=True)

    def run(self) -> None:
        """Write until it is over."""
        began, start = time.monotonic(), None
        found: list[Block] = []
        for self.collisions, block in collisions_again():
            start = block.time if start is None else start
            while block.time - start > self.shown:
                self._recorder.write(*found, flush=True)
                found = []
                if self.over.wait(WRITE_STEP / self._rate):
                    return
                self.shown = self._rate * (time.monotonic() - began)
            found.append(block)


def main() -> None:
    """Measure and print."""
    from playwright.sync_api import sync_playwright

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=1.0, help="of the run")
    parser.add_argument("--rate", type=float, default=2.0, help="times as fast as it was recorded")
    parser.add_argument("--looks", type=int, default=8)
    args = parser.parse_args()
    print(head("viser", "playwright"), flush=True)
    with (
        tempfile.TemporaryDirectory() as folder,
        Recorder(Path(folder) / "run.rec") as recorder,
        sync_playwright() as driver,
    ):
        writer = Writer(recorder, args.rate)
        writer.start()
        child, url, _ = page_of(Path(folder) / "run.rec")
        browser = driver.chromium.launch(executable_path=CHROMIUM_PROGRAM, args=list(CHROMIUM_FLAGS))
        page = browser.new_page(viewport={"width": 480, "height": 320})
        page.set_default_timeout(300_000)
        page.goto(url)
        page.wait_for_selector(".coneskin-phase")
        tools = page.context.new_cdp_session(page)
        tools.send("Performance.enable")
        began, since = time.monotonic(), writer.shown
        print("run [min]  wall [min]  collisions  server [MB]  heap [MB]  nodes  renderer [MB]  gpu [MB]", flush=True)
        for look in range(args.looks + 1):
            due = 3600.0 * args.hours * look / args.looks
            while writer.shown - since < due:
                time.sleep(1.0)
            print(row(writer, tools, child.pid, since, began), flush=True)
        writer.over.set()
        writer.join()
        browser.close()
        child.terminate()
        child.wait(60)


def row(writer: Writer, tools: Any, server: int, since: float, began: float) -> str:
    """One line of the table."""
    tools.send("HeapProfiler.collectGarbage")
    numbers = {item["name"]: item["value"] for item in tools.send("Performance.getMetrics")["metrics"]}
    memory = memory_of()
    return (
        f"{(writer.shown - since) / 60.0:9.1f}  {(time.monotonic() - began) / 60.0:10.1f}  {writer.collisions:10d}  "
        f"{resident(server) / 1e3:11.1f}  {numbers['JSHeapUsedSize'] / 1e6:9.1f}  {numbers['Nodes']:5.0f}  "
        f"{memory['renderer'] / 1e3:13.1f}  {memory['gpu-process'] / 1e3:8.1f}"
    )
