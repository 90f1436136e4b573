"""What a person sees in a browser: the phase in words, the contact where it was, and that nobody may rely on it."""

import json
from pathlib import Path
from typing import Any

import pytest

from coneskin.core.recording.block import Block
from coneskin.core.recording.recorder import Recorder
from coneskin.robot.guard.signals.journal import BlockKind, EventName
from coneskin.runs.replay.run import read_run
from coneskin.view.html_file import write_html
from coneskin.view.live_page import LivePage
from coneskin.view.live_run import LiveRun
from coneskin.view.page_server import PageServer
from coneskin.view.run_course import RunCourse, read_courses
from coneskin.view.run_page import show_runs
from tests.support.paths import COLLISION

from .browser import browser_page, look_closely, look_closely_at_a_file, magenta, pixels, quiet, violet, wait_for_text

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
            wait_for_text(page, "#coneskin-events div[style*='700']", words if words == "activated" else "touch on")
        wait_for_text(page, ".coneskin-phase", "stopping")
        forward.click()
        wait_for_text(page, "#coneskin-clock", "2.970 s")
        place = look_closely(server, page, point, normal)
        assert magenta(pixels(page, place)) > 5
        assert page.evaluate(SMOOTHED) is False, "a processor draws here"
        page.get_by_label("potential").first.click()
        page.get_by_role("option", name="touch phase, lower sheet").click()
        wait_for_text(page, "#coneskin-potential", " V")
        assert violet(pixels(page, place, 60)) > 50
        page.get_by_role("button", name="|<", exact=True).click()
        wait_for_text(page, "#coneskin-clock", "1.788 s")
        assert magenta(pixels(page, place)) == 0
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
            assert (magenta(pixels(page, place)) > 5) is marked, words
        assert f"{at:.4f} s touch located" in page.inner_text("#coneskin-events"), "the same clock"
        assert [box for box in page.query_selector_all("#root input") if box.is_visible() and "." in box.input_value()
                and not box.input_value().endswith("x")] == [], "no other clock"  # fmt: skip
        assert page.wrong == []


def test_a_page_follows_a_recording_that_grows(tmp_path: Path) -> None:
    run = read_run(RUN)
    blocks = list(run.blocks)
    path = tmp_path / "run.rec"
    located, point, normal = contact(read_courses([RUN])[0])
    with Recorder(path) as recorder, PageServer("live", port=18180) as server, browser_page() as page:
        recorder.write(Block(BlockKind.HEADER, run.start, json.dumps(run.header).encode()), flush=True)
        before = [block for block in blocks if block.time < run.start + located - 0.1]
        recorder.write(*before, flush=True)
        live = LiveRun(path)
        shown = LivePage(server, live.course.stage, lambda: live)
        shown.poll(0.0)
        shown.draw(0.0)
        page.goto(server.url)
        wait_for_text(page, "#coneskin-notice", NOTICE)
        wait_for_text(page, ".coneskin-phase", "active")
        place = look_closely(server, page, point, normal)
        recorder.write(*(b for b in blocks if run.start + located - 0.1 <= b.time <= run.start + located), flush=True)
        assert shown.poll(1.0), "an event has come"
        shown.draw(1.0)
        wait_for_text(page, ".coneskin-phase", "stopping")
        wait_for_text(page, "#coneskin-events", "touch located")
        assert magenta(pixels(page, place)) > 5
        assert quiet(pixels(page, place, 40)) == 0
        assert page.wrong == []
        recorder.close()
        shown.poll(2.0)
        shown.draw(2.0)
        wait_for_text(page, "#coneskin-stale", "the run is over")
        shown.close()
