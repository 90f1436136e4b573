"""Strands: the clock of a page, and the events that count by it."""

import pytest

from coneskin.core.errors import RecordingError
from coneskin.robot.guard.signals.journal import EventName
from coneskin.runs.replay.run import read_run
from coneskin.view import run_course
from coneskin.view.run_course import event_lines, read_courses
from tests.support.paths import COLLISION

RUN = COLLISION


def test_the_events_of_one_run_count_from_its_start() -> None:
    (course,) = read_courses([RUN])
    lines = event_lines([course])
    assert [event for _, event, _ in lines] == course.history.events
    for time, event, text in lines:
        assert time == pytest.approx(event.time - read_run(RUN).start)
        assert text.startswith(f"{time:.4f} s  ")
        assert "run 1" not in text


def test_the_events_of_two_runs_count_from_the_first_touch_and_say_whose_they_are() -> None:
    courses = read_courses([RUN, RUN])
    lines = event_lines(courses)
    assert len(lines) == 2 * len(courses[0].history.events)
    assert [time for time, *_ in lines] == sorted(time for time, *_ in lines)
    touches = [text for _, event, text in lines if event.name == EventName.CONTACT]
    assert [text[:26] for text in touches] == ["0.0000 s  run 1: touch on ", "0.0000 s  run 2: touch on "]
    assert min(time for time, *_ in lines) < 0.0


def test_a_run_that_a_page_has_no_room_for_is_refused_before_it_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_course, "_MAX_RUN_SIZE", RUN.stat().st_size - 1)
    monkeypatch.setattr(run_course, "read_run", lambda _: pytest.fail("it is read"))
    with pytest.raises(RecordingError, match=r"has 0\.0995 MB, and a page shows at most .* coneskin runs cut"):
        read_courses([RUN])
