"""File of a page: which file it replaces. What it shows is tested in a browser."""

from itertools import pairwise
from pathlib import Path

import pytest

from coneskin.core.errors import RecordingError
from coneskin.view.html_file import _bar_changes, write_html
from coneskin.view.page_server import page_client
from coneskin.view.panel import trace_drawings
from coneskin.view.run_course import read_courses
from coneskin.view.stage.level_scale import level_words
from tests.support.paths import COLLISION


def test_a_recording_is_not_replaced_by_a_page(tmp_path: Path) -> None:
    """`view --html runs/*/run.rec` names the first of them as the page."""
    named = tmp_path / "run.rec"
    named.write_bytes(COLLISION.read_bytes())
    with pytest.raises(RecordingError, match="exists already and is no page"):
        write_html(named, read_courses([COLLISION]))
    assert named.read_bytes() == COLLISION.read_bytes()


def test_a_page_is_replaced(tmp_path: Path) -> None:
    pytest.importorskip("viser", reason="viser is not installed: no page is written")
    page = tmp_path / "run.html"
    page.write_text(page_client()[:200], encoding="utf-8")
    write_html(page, read_courses([COLLISION]))
    assert page.stat().st_size > 10_000


def test_the_last_change_is_the_level_of_the_run_within_a_percent() -> None:
    (course,) = read_courses([COLLISION])
    since, until = course.span
    times = [since + (until - since) * k / 400 for k in range(401)]
    data = _bar_changes(course, since, [time - since for time in times])
    (levels,), (words,), (sheet,) = data["levels"], data["words"], course.stage.sheets
    assert 3 < len(levels) < 401, "what has not changed is not said again"
    assert all(a[1] != b[1] for a, b in pairwise(levels))
    for time in times:
        percent = [level for at, level in levels if at <= time - since + 1e-4][-1]
        assert percent == pytest.approx(100.0 * course.moment(time).levels[sheet.name], abs=0.5)
        assert words[percent] == level_words(sheet, percent / 100)
    assert data["forces"] == [], "no physics, no force"


def test_a_force_is_said_when_its_words_change() -> None:
    (course,) = read_courses([COLLISION])
    for time, force in enumerate((0.0, 0.04, 12.34, 12.32, 0.0)):
        course.history.forces.append(course.zero + time, (force,))
    assert _bar_changes(course, 0.0, range(5))["forces"] == [(0.0, "0.0 N"), (2.0, "12.3 N"), (4.0, "0.0 N")]


def test_a_drawn_trace_reaches_as_high_as_its_values() -> None:
    courses = read_courses([COLLISION])
    drawn = trace_drawings(courses, *courses[0].span)
    assert drawn.count("<option") == drawn.count('class="coneskin-trace"') == 3
    assert drawn.count('class="coneskin-trace" hidden') == 2, "the first is shown"
    course = drawn.partition('<path d="')[2].partition('"')[0]
    heights = [float(point.split()[1]) for point in course.replace("L", "M").split("M")[1:]]
    values = [value for (value,) in courses[0].history.levels["forearm skin"].values]
    assert min(heights) == pytest.approx(120.0 * (1.0 - max(values)), abs=0.1), "levels are drawn from 0 to 1"
    assert max(heights) == pytest.approx(120.0 * (1.0 - min(values)), abs=0.1)
