"""Pictures and the film of the pages in docs/images, by chromium without a screen.

python scripts/draw_view_pictures.py [--output docs/images] [--only view,view-two-runs,view-potential,studio,view.gif]

The recording of the tests, and one of the collision in docs/do/impact.md, which MuJoCo makes anew (extra `physics`).
"""

from __future__ import annotations

import argparse
import io
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
RUN = ROOT / "tests" / "data" / "collision.rec"
FLAGS = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox")
SIZE = {"width": 1100, "height": 620}
_JUMP = """(text) => [...document.querySelectorAll('#coneskin-events div')]
  .find((row) => row.textContent.includes(text)).click()"""
_CLEAR = "() => document.querySelectorAll('.mantine-Notifications-root').forEach((e) => e.remove())"
_DRAWN = "() => new Promise((done) => setTimeout(() => requestAnimationFrame(() => requestAnimationFrame(done)), 300))"
_PATIENT = 120_000.0  # ms; without a GPU the first picture takes its time
_SHOWN = "(text) => [...document.querySelectorAll('#coneskin-events b, #coneskin-events div')].some((e) => " \
         "e.style.fontWeight == 700 && e.textContent.includes(text))"  # fmt: skip
#: has the page of a file show a time of its clock [s]
_SEEK = """(time) => {
  const data = JSON.parse(document.getElementById('coneskin-data').textContent);
  const line = document.getElementById('coneskin-timeline'), box = line.getBoundingClientRect();
  const at = box.left + box.width * (time - data.since) / data.duration;
  line.dispatchEvent(new MouseEvent('click', { clientX: at, clientY: box.top + 2 }));
}"""
_FILM = (0.44, 0.94, 1.0 / 30.0)  # s of the collision: from, until, and between two pictures, as many as the file has
_SLOWER = 8.0  # times that the film is slower than the collision
_COLOURS = 96  # of the film's palette


def collision(folder: Path) -> Path:
    """Make the collision of docs/do/impact.md, and return its recording."""
    from coneskin.core.recording.block import Block
    from coneskin.core.recording.recorder import Recorder
    from coneskin.impact.simulation.collision_run import CollisionRun, follow_waypoints
    from coneskin.robot.guard.signals.journal import BlockKind
    from coneskin.scene.reader import parse_scene

    page = (ROOT / "docs" / "do" / "impact.md").read_text(encoding="utf-8")
    found = re.search(r'```toml title="scene.toml"\n(.*?)```', page, re.DOTALL)
    assert found is not None
    scene = parse_scene(found.group(1), "scene.toml")
    assert scene.motion is not None
    first, *rest = scene.motion.waypoints
    blocks: list[Block] = []
    run = CollisionRun(scene, scene.bodies, first, note=blocks.append)
    run.run(follow_waypoints(rest, scene.motion.speed, scene.motion.acceleration), longest=3.0)
    target = folder / "collision" / "run.rec"
    target.parent.mkdir()
    header = {"scene": scene.text, "name": scene.name, "folder": ".", "clocks": {"monotonic": 100.0}}
    with Recorder(target) as recorder:
        recorder.write(Block(BlockKind.HEADER, 100.0, json.dumps(header).encode()), *blocks)
    return target


def draw_file(page: Any, recordings: list[Path], moment: str, target: Path) -> None:
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
        page.evaluate(_CLEAR)
        for _ in range(2):
            page.evaluate("() => new Promise((done) => setTimeout(done, 1500))")
        page.screenshot(path=str(target))


def served(page: Any, command: list[str], folder: Path, look: Callable[[Any], None]) -> None:
    """Look at the page that a command serves."""
    words = [sys.executable, "-m", "coneskin", *command, "--no-browser", "--json", "--port", "18450"]
    child = subprocess.Popen(words, cwd=folder, stdout=subprocess.PIPE, text=True)
    try:
        assert child.stdout is not None
        page.goto(json.loads(child.stdout.readline())["url"])
        look(page)
    finally:
        child.terminate()
        child.wait(30)


def look_at_potential(page: Any, target: Path) -> None:
    """Take the picture of the potential on a touched sheet."""
    forward = page.get_by_role("button", name=">", exact=True)
    for words in ("activated", "touch on", "located"):
        forward.click()
        page.wait_for_function(_SHOWN, arg=words)
    page.get_by_label("potential").first.click()
    page.get_by_role("option", name="touch phase, lower sheet").click()
    page.wait_for_selector("#coneskin-potential")
    page.evaluate(_CLEAR)
    for _ in range(4):
        page.evaluate(_DRAWN)
    page.screenshot(path=str(target))


def film(page: Any, recording: Path, target: Path) -> None:
    """Write a run into a file, open it, and take picture after picture of it."""
    from PIL import Image

    folder = recording.parents[1]
    subprocess.run(
        [sys.executable, "-m", "coneskin", "view", "collision", "--html", "film.html"], cwd=folder, check=True
    )
    page.goto(f"file://{folder}/film.html")
    page.wait_for_selector("#root [role=slider]", state="attached")
    page.evaluate(_CLEAR)
    pictures = []
    since, until, step = _FILM
    for number in range(round((until - since) / step) + 1):
        page.evaluate(_SEEK, since + step * number)
        page.evaluate(_DRAWN)
        taken = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
        pictures.append(taken.crop((0, 0, taken.width, 560)).resize((770, 392), Image.Resampling.LANCZOS))
    palette = pictures[-1].quantize(_COLOURS, dither=Image.Dither.NONE)
    drawn = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    each = round(1e3 * _SLOWER * step)
    lasting = [each] * (len(drawn) - 1) + [2000]
    drawn[0].save(target, save_all=True, append_images=drawn[1:], duration=lasting, loop=0, optimize=True)


def look_at_studio(page: Any, target: Path) -> None:
    """Take the picture of the studio."""
    page.wait_for_selector("#coneskin-flat svg")
    page.evaluate(_CLEAR)
    for _ in range(4):
        page.evaluate(_DRAWN)
    page.screenshot(path=str(target))


def main() -> None:
    """Draw all pictures."""
    from playwright.sync_api import sync_playwright

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=ROOT / "docs" / "images")
    parser.add_argument("--only", default="view,view-two-runs,view-potential,studio,view.gif")
    args = parser.parse_args()
    wanted = args.only.split(",")
    with tempfile.TemporaryDirectory() as name, sync_playwright() as driver:
        folder = Path(name)
        browser = driver.chromium.launch(executable_path="/usr/bin/chromium", args=list(FLAGS))
        page = browser.new_page(viewport=SIZE)
        page.set_default_timeout(_PATIENT)
        if "view.gif" in wanted:
            film(page, collision(folder), args.output / "view.gif")
        if "view-potential" in wanted:
            target = args.output / "view-potential.png"
            served(page, ["view", str(RUN.relative_to(ROOT))], ROOT, lambda page: look_at_potential(page, target))
        if "view" in wanted:
            draw_file(page, [RUN], "standstill", args.output / "view.png")
        if "view-two-runs" in wanted:
            draw_file(page, [RUN, RUN], "retreating", args.output / "view-two-runs.png")
        if "studio" in wanted:
            import trimesh

            profile = [(0.0, 0.0), (0.04, 0.0), (0.05, 0.2), (0.0, 0.2)]  # m
            trimesh.creation.revolve(profile, sections=64).export(folder / "forearm.stl")
            target = args.output / "studio.png"
            served(page, ["studio", "forearm.stl", "-o", "skin"], folder, lambda page: look_at_studio(page, target))
        browser.close()


if __name__ == "__main__":
    main()
