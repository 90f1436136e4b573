"""Page of one tree beside that of another, by the processor time that the browser takes: what a busy computer can tell.

    git clone -q . /tmp/before && git -C /tmp/before checkout -q 13b7922
    python bench/view_compare.py /tmp/before [--rounds 5] [--seconds 4]

The collision of tests/data, its arm moving 30 times a second, in a new browser each time: the other tree, this one, a
box alone. The least of the rounds is told, of the first picture and of each that follows. Needs the extra `view`,
playwright and chromium, which draws in software here.
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import sys
import time
from pathlib import Path

from report import head
from view_browser import PROCESSES, drawn_pictures, first_picture

ROOT = Path(__file__).parents[1]
RUN = ROOT / "tests" / "data" / "collision.rec"
MOVING = (2.0, 2.9)  # s of the run that are shown to and fro
PERIOD = 1.0 / 30.0  # s between two pictures


def serve(port: int) -> None:
    """Serve the page of the tree that is imported, until this process is ended."""
    from coneskin.view.live_page import LivePage
    from coneskin.view.live_run import LiveRun
    from coneskin.view.page_server import PageServer

    server = PageServer("compared", port=port)
    live = LiveRun(RUN)
    page = LivePage(server, live.course.stage, lambda: live)
    page.look(0.0)
    page.draw(0.0)
    print(server.url, flush=True)
    nodes, step = page._nodes, 0
    assert nodes is not None
    while True:
        step += 1
        since, until = MOVING
        with server.together():
            nodes.show(live.course.moment(since + (until - since) * abs(math.sin(step / 40))))
        time.sleep(PERIOD)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("other", type=Path, nargs="?", help="folder of the other tree")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--serve", type=int, metavar="PORT", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.serve is not None:
        serve(args.serve)
    if args.other is None:
        parser.error("name the folder of the other tree")
    from playwright.sync_api import sync_playwright

    print(head("viser", "playwright"), flush=True)
    box = [sys.executable, str(ROOT / "bench" / "view_box.py")]
    served: dict[str, tuple[list[str], Path]] = {
        "the other tree": ([sys.executable, __file__, "--serve", "18500"], args.other),
        "this tree": ([sys.executable, __file__, "--serve", "18510"], ROOT),
        "a box alone": (box, ROOT),
    }
    children = []
    try:
        urls = {}
        for name, (command, tree) in served.items():
            environment = {**os.environ, "PYTHONPATH": str(tree / "src")}
            child = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)
            children.append(child)
            assert child.stdout is not None
            urls[name] = child.stdout.readline().strip()
        found: dict[str, list[tuple[float, ...]]] = {name: [] for name in urls}
        with sync_playwright() as driver:
            for _ in range(args.rounds):
                for name, url in urls.items():
                    browser, page, _took, first = first_picture(driver, url, phase=name != "a box alone")
                    _turns, rate, spent = drawn_pictures(page, args.seconds)
                    each = [spent[kind] / max(rate * args.seconds, 1.0) for kind in PROCESSES]
                    found[name].append((*(first[kind] for kind in PROCESSES), *each))
                    browser.close()
    finally:
        for child in children:
            child.kill()
            child.wait()
    for name, rows in found.items():
        runs, draws, run, draw = (1e3 * min(row[k] for row in rows) for k in range(4))
        print(f"{name}: first picture {runs:.0f} ms in the renderer and {draws:.0f} ms in the drawing process, "
              f"each later one {run:.0f} and {draw:.0f} ms (least of {len(rows)})")  # fmt: skip


if __name__ == "__main__":
    main()
