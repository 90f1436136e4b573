"""What a person sees in a browser: the phase in words, the contact where it was, and that nobody may rely on it."""

import json
import threading
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
import pytest

from coneskin.core.recording.block import Block
from coneskin.core.recording.recorder import Recorder
from coneskin.robot.guard.signals.journal import BlockKind, EventName
from coneskin.runs.replay.run import read_run
from coneskin.view.html_file import write_html
from coneskin.view.live_page import LivePage, LiveRun
from coneskin.view.page_server import PageServer
from coneskin.view.run_course import RunCourse, read_courses
from coneskin.view.run_page import show_runs
from tests.support.paths import COLLISION

from .browser import (
    SIZE,
    browser_page,
    look_closely,
    look_closely_at_a_file,
    magenta,
    pixels,
    quiet,
    shown_trace,
    violet,
    wait_for_pixels,
    wait_for_text,
)

RUN = COLLISION
NOTICE = "No safety display"
SMOOTHED = "() => document.querySelector('canvas[data-engine]').getContext('webgl2').getContextAttributes().antialias"
JUMP = """(words) => [...document.querySelectorAll('#coneskin-events div')]
  .find((row) => row.textContent.includes(words)).click()"""
pytestmark = pytest.mark.long


def contact(course: RunCourse) -> tuple[float, Any, Any]:
    """When the demo's touch was located, and where that was in the base frame, with its normal."""
    at = next(event for event in course.history.events if event.name == EventName.CONTACT_LOCATED)
    moment = course.moment(at.time - course.zero)
    (mark,) = moment.marks
    (sheet,) = course.stage.sheets
    pose = moment.poses[sheet.link]
    return at.time - course.zero, pose.apply(mark.point), pose.rotate(mark.normal)


def test_a_recording_is_scrubbed_to_its_touch() -> None:
    courses = read_courses([RUN])
    _, point, normal = contact(courses[0])
    with PageServer("a run", port=18180) as server, browser_page() as page:
        show_runs(server, courses)
        page.goto(server.url)
        wait_for_text(page, "#coneskin-notice", NOTICE)
        wait_for_text(page, ".coneskin-phase", "nothing is known of the guard")
        forward = page.get_by_role("button", name=">", exact=True)
        for words in ("activated", "stop: touch"):
            forward.click()
            wait_for_text(page, "#coneskin-events div.now", words if words == "activated" else "touch on")
        wait_for_text(page, ".coneskin-phase", "stopping")
        forward.click()
        wait_for_text(page, "#coneskin-clock", "2.970 s")
        place = look_closely(server, page, point, normal)
        wait_for_pixels(page, place, lambda found: magenta(found) > 5)
        assert page.evaluate(SMOOTHED) is False, "a processor draws here"
        page.get_by_label("potential").first.click()
        page.get_by_role("option", name="touch phase, lower sheet").click()
        wait_for_text(page, "#coneskin-potential", " V")
        wait_for_pixels(page, place, lambda found: violet(found) > 50, 60)
        page.get_by_role("button", name="|<", exact=True).click()
        wait_for_text(page, "#coneskin-clock", "1.788 s")
        wait_for_pixels(page, place, lambda found: magenta(found) == 0)
        for words in ("a run", "play", "traces"):
            assert words in page.inner_text("body")
        assert page.wrong == []


def test_a_file_without_python_jumps_to_the_touch(tmp_path: Path) -> None:
    write_html(tmp_path / "run.html", read_courses([RUN, RUN]))
    with browser_page() as page:
        requests: list[str] = []
        page.on("request", lambda request: requests.append(request.url))
        page.goto(f"file://{tmp_path / 'run.html'}")
        wait_for_text(page, "#coneskin-notice", NOTICE)
        page.wait_for_selector("#root [role=slider]", state="attached")
        page.evaluate(JUMP, "touch located")
        wait_for_text(page, "#coneskin-clock", "0.021 s")
        wait_for_text(page, ".coneskin-phase", "stopping")
        level = read_courses([RUN, RUN])[0].moment(0.0214).levels["forearm skin"]
        wait_for_text(page, ".coneskin-level", f"level {level:.2f}")
        marks = [float(mark.evaluate("(mark) => mark.style.left.slice(0, -1)"))
                 for mark in page.query_selector_all(".coneskin-level-mark")]  # fmt: skip
        assert marks == [pytest.approx(100.0 * level, abs=0.5)] * 2, "a bar for each run"
        page.locator("#coneskin-traces select").select_option("joint speed [rad/s]")
        shown = [trace.inner_text() for trace in page.query_selector_all(".coneskin-trace") if trace.is_visible()]
        assert len(shown) == 1
        assert "joint 6" in shown[0]
        line = page.locator("#coneskin-events div", has_text="run 2: touch located")
        line.hover()
        assert line.evaluate("(line) => line.scrollHeight <= line.clientHeight && line.scrollWidth <= line.clientWidth")
        assert [url for url in requests if not url.startswith(("file:", "data:", "blob:"))] == []
        assert page.wrong == []


def test_a_file_shows_the_contact_where_it_was_when_it_was(tmp_path: Path) -> None:
    courses = read_courses([RUN])
    at, point, normal = contact(courses[0])
    write_html(tmp_path / "run.html", courses)
    with browser_page() as page:
        page.goto(f"file://{tmp_path / 'run.html'}")
        page.wait_for_selector("#root [role=slider]", state="attached")
        for words, clock, marked in (("activated", "1.9", False), ("touch located", f"{at:.3f} s", True)):
            page.evaluate(JUMP, words)
            wait_for_text(page, "#coneskin-clock", clock)
            place = look_closely_at_a_file(page, "/run 1", point, normal)
            if marked:
                wait_for_pixels(page, place, lambda found: magenta(found) > 5)
            else:
                assert magenta(pixels(page, place)) <= 5, words
        assert f"{at:.4f} s touch located" in page.inner_text("#coneskin-events"), "the same clock"
        assert [box for box in page.query_selector_all("#root input") if box.is_visible() and "." in box.input_value()
                and not box.input_value().endswith("x")] == [], "no other clock"  # fmt: skip
        assert page.wrong == []


def test_a_page_follows_a_recording_that_grows_and_says_when_it_does_not(tmp_path: Path) -> None:
    """What it says is held against the guard's own record: place, paths, distance, and the trace by its pixels."""
    run = read_run(RUN)
    blocks = list(run.blocks)
    path = tmp_path / "run.rec"
    course = read_courses([RUN])[0]
    located, point, normal = contact(course)
    with Recorder(path) as recorder, PageServer("live", port=18180) as server, browser_page() as page:

        def write_until(time: float, since: float = 0.0) -> None:
            recorder.write(*(b for b in blocks if run.start + since <= b.time < run.start + time), flush=True)

        def serve() -> None:
            while not over.wait(0.03):
                if alive.is_set():
                    live._grown = monotonic()  # as if ticks came all the time
                shown.poll(monotonic())
                shown.draw(monotonic())

        recorder.write(Block(BlockKind.HEADER, run.start, json.dumps(run.header).encode()), flush=True)
        live = LiveRun(path)
        shown = LivePage(server, live.course.stage, lambda before: live if before is None else None)
        over, alive = threading.Event(), threading.Event()
        alive.set()
        server_thread = threading.Thread(target=serve, daemon=True)
        server_thread.start()
        write_until(located - 0.1)
        page.goto(server.url)
        wait_for_text(page, "#coneskin-notice", NOTICE)
        wait_for_text(page, ".coneskin-phase.active", "active")
        wait_for_text(page, "#coneskin-legend", "Dark blue: a sheet of skin")
        place = look_closely(server, page, point, normal)
        wait_for_pixels(page, place, lambda found: quiet(found) > 50)
        assert magenta(pixels(page, place)) == 0
        write_until(located + 1e-6, located - 0.1)
        wait_for_text(page, ".coneskin-phase.stopped", "stopping")
        wait_for_text(page, ".coneskin-card", "u = 130.0 mm, phi = 89.0 deg")
        wait_for_pixels(page, place, lambda found: magenta(found) > 5)
        wait_for_pixels(page, place, lambda found: quiet(found) > 50, 40)  # where it was is marked, not the whole sheet
        write_until(3.842, located + 1e-6)
        for said in ("latched: stands until a manual reset", "driver, stands after 107 ms", "retreated 19.5 mm"):
            wait_for_text(page, "body", said)
        page.wait_for_function("document.querySelector('.coneskin-plot').dataset.until > 3.8")  # drawn twice a second
        page.evaluate("document.querySelector('.coneskin-plot').scrollIntoView()")
        since, until = (float(page.get_attribute(".coneskin-plot", f"data-{end}")) for end in ("since", "until"))
        seen = np.flatnonzero(shown_trace(page) < 0.5)
        levels = course.history.levels["forearm skin"]
        high = [t - run.start for t, (level,) in zip(levels.times, levels.values, strict=True) if level > 0.5]
        width = len(shown_trace(page))
        assert since + (until - since) * seen[0] / width == pytest.approx(high[0], abs=0.03)
        assert since + (until - since) * seen[-1] / width == pytest.approx(high[-1], abs=0.03)
        box = page.query_selector(".coneskin-plot").bounding_box()
        page.mouse.move(box["x"] + 0.5 * (seen[0] + seen[-1]), box["y"] + 30.0)
        wait_for_text(page, ".coneskin-read", "forearm skin 0.")
        page.set_viewport_size({"width": 390, "height": 800})
        wait_for_text(page, "#coneskin-top", "u = 130.0 mm")
        assert page.is_visible("#coneskin-top .coneskin-phase")
        page.set_viewport_size(SIZE)
        over.set()
        wait_for_text(page, "#coneskin-stale", "NOTHING NEW from the page's server")
        server_thread.join()
        over.clear()
        alive.clear()
        server_thread = threading.Thread(target=serve, daemon=True)
        server_thread.start()
        wait_for_text(page, "#coneskin-stale", "NOTHING NEW from the guard")
        assert page.inner_text("#root .coneskin-phase").startswith("was latched: stands until a manual reset, ")
        place = look_closely(server, page, point, normal)
        wait_for_pixels(page, place, lambda found: magenta(found) == 0)  # the scene has faded
        recorder.close()
        wait_for_text(page, "#coneskin-stale", "the run is over")
        over.set()
        server_thread.join()
        shown.close()
        assert page.wrong == []
