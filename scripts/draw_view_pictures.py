"""Pictures of the pages in docs/images, from the recording of the tests, by chromium without a screen.

python scripts/draw_view_pictures.py [--output docs/images]
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
RUN = ROOT / "tests" / "data" / "collision.rec"
FLAGS = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox")
_JUMP = """(text) => [...document.querySelectorAll('#coneskin-events div')]
  .find((row) => row.textContent.includes(text)).click()"""
_PATIENT = 120_000.0  # ms; without a GPU the first picture takes its time


def draw(page: Any, recordings: list[Path], moment: str, target: Path) -> None:
    """Write runs into a file, open it, jump to an event, and take its picture."""
    with tempfile.TemporaryDirectory() as folder:
        names = []
        for number, recording in enumerate(recordings, 1):
            run = Path(folder) / f"run {number}"
            run.mkdir()
            (run / "run.rec").write_bytes(recording.read_bytes())
            names.append(run.name)
        command = [sys.executable, "-m", "coneskin", "view", *names, "--html", "page.html"]
        subprocess.run(command, cwd=folder, check=True)
        page.goto(f"file://{folder}/page.html")
        page.wait_for_selector("#root [role=slider]", state="attached")
        page.wait_for_selector("#coneskin-events div")
        page.evaluate(_JUMP, moment)
        page.evaluate("() => document.querySelectorAll('.mantine-Notifications-root').forEach((e) => e.remove())")
        for _ in range(2):
            page.evaluate("() => new Promise((done) => setTimeout(done, 1500))")
        page.screenshot(path=str(target))


def main() -> None:
    """Draw all pictures."""
    from playwright.sync_api import sync_playwright

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=ROOT / "docs" / "images")
    args = parser.parse_args()
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path="/usr/bin/chromium", args=list(FLAGS))
        page = browser.new_page(viewport={"width": 1100, "height": 620})
        page.set_default_timeout(_PATIENT)
        draw(page, [RUN], "standstill", args.output / "view.png")
        draw(page, [RUN, RUN], "retreating", args.output / "view-two-runs.png")
        browser.close()


if __name__ == "__main__":
    main()
