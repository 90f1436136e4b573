"""Server of a page that stays open: its memory while hours of a run go by, faster than they would.

    python -m bench view-endurance [--hours 3] [--late 60] [--trace]

The collision of tests/data is written again and again into a recording, 50 ms at a time; after each, the page looks,
and every 200 ms of the run it draws. Nothing waits for a clock, and nobody looks at the page, so what is measured is
its own: the memory of the process after a collection of garbage, the objects that the collector knows, and what the
page and the library's buffer hold. With `--late`, the page looks seldom, as one that gets no processor.
With `--trace`, where in the source what has come since was allocated. Needs the extra `view`.
"""

from __future__ import annotations

import argparse
import gc
import os
import tempfile
import time
import tracemalloc
from pathlib import Path

from bench.report import head
from coneskin.core.recording.block import Block
from coneskin.core.recording.recorder import Recorder
from coneskin.view.live_page import LivePage, LiveRun
from coneskin.view.page_server import PageServer

from .browser import resident
from .collisions import collisions_again, header_of

WRITE_STEP = 0.05  # s of the run that are written together: the recorder's own
DRAW_STEPS = 4  # steps between two pictures
LOOK_PERIOD = 600.0  # s of the run between two lines of the table
_TABLE_HEAD = "run [min]  wall [min]  collisions  server [MB]  objects  frames  states  events  touches  messages"
TRACE_PART = 1 << 24  # bytes of a file of the recording; those before the newest are taken away


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=3.0, help="of the run")
    parser.add_argument(
        "--late", type=float, default=WRITE_STEP, help="s of the run between two looks: of a starved page"
    )
    parser.add_argument("--trace", action="store_true", help="tell where memory was allocated, three times slower")
    args = parser.parse_args()
    print(head("viser"), flush=True)
    print(
        "run [min]  wall [min]  collisions  server [MB]  objects  frames  states  events  touches  messages", flush=True
    )
    with (
        tempfile.TemporaryDirectory() as folder,
        Recorder(Path(folder) / "run.rec", part_size=TRACE_PART, keep=1) as recorder,
        PageServer("endurance", port=18300) as server,
    ):
        first = header_of()
        recorder.write(first, flush=True)
        live = LiveRun(Path(folder) / "run.rec")
        page = LivePage(server, live.course.stage, lambda _: live)
        follow(args, recorder, server, live, page)
        page.close()


def follow(args: argparse.Namespace, recorder: Recorder, server: PageServer, live: LiveRun, page: LivePage) -> None:
    """Write and draw, and print a line of the table every ten minutes of the run."""
    began = time.monotonic()
    start, due, before = None, WRITE_STEP, None
    steps, look = 0, 0.0
    parcel: list[Block] = []
    for number, block in collisions_again():
        start = block.time if start is None else start
        if block.time - start < due:
            parcel.append(block)
            continue
        recorder.write(*parcel, flush=True)
        for old in recorder.parts[:-2]:
            old.unlink(missing_ok=True)
        parcel = [block]
        if steps % round(args.late / WRITE_STEP) == 0:
            page.poll(due)
        if steps % max(DRAW_STEPS, round(args.late / WRITE_STEP)) == 0:
            page.draw(due)
        steps, due = steps + 1, due + WRITE_STEP
        if due - WRITE_STEP >= look:
            print(row(server, live, number, look, began), flush=True)
            if args.trace and look >= LOOK_PERIOD:  # the first ten minutes fill what is kept
                before = told(before)
            look += LOOK_PERIOD
            if look > 3600.0 * args.hours:
                return


def row(server: PageServer, live: LiveRun, collisions: int, at: float, began: float) -> str:
    """One line of the table."""
    gc.collect()
    history = live.course.history
    (levels,) = history.levels.values()
    messages = len(server._server._websock_server._broadcast_buffer.message_from_id)
    return (
        f"{at / 60.0:9.0f}  {(time.monotonic() - began) / 60.0:10.1f}  {collisions:10d}  "
        f"{resident(os.getpid()) / 1e3:11.1f}  {len(gc.get_objects()):7d}  {len(levels.times):6d}  "
        f"{len(history.joints.times):6d}  {len(history.events):6d}  {len(history.contacts._touches):7d}  {messages:8d}"
    )


def told(before: tracemalloc.Snapshot | None) -> tracemalloc.Snapshot:
    """Print where memory was allocated since another snapshot; return that, or the first one."""
    if not tracemalloc.is_tracing():
        tracemalloc.start(1)
    now = tracemalloc.take_snapshot()
    if before is None:
        return now
    for line in now.compare_to(before, "lineno")[:10]:
        print(f"    {line}", flush=True)
    return before
