"""Plot of traces: its axes hold what is known, whatever is missing."""

import pytest

from coneskin.view.panel import trace_drawings
from coneskin.view.run_course import RunCourse, read_courses
from tests.support.paths import COLLISION

RUN = COLLISION


@pytest.fixture(scope="module")
def course() -> RunCourse:
    return read_courses([RUN])[0]


def test_a_plot_ends_with_the_data_and_has_a_gap_where_frames_are_missing(course: RunCourse) -> None:
    since, until = course.span
    drawn = trace_drawings([course], since - 1.0, until, live=True)
    low, high = (float(drawn.partition(f'data-{end}="')[2].partition('"')[0]) for end in ("low", "high"))
    assert (low, high) == (0.0, 1.0), "of levels, which are 0 to 1"
    assert drawn.count("<path") == 1
    first = float(drawn.partition('d="M')[2].partition(" ")[0])
    assert 480.0 / (1.0 + until - since) == pytest.approx(first, abs=4.0), "nothing is drawn before the first frame"
    assert 'd=""' in trace_drawings([course], since - 5.0, since - 4.0, live=True), "before the run nothing is known"


def test_speeds_are_drawn_as_far_below_zero_as_above(course: RunCourse) -> None:
    drawn = trace_drawings([course], *course.span).partition("joint 1")[0].rpartition("coneskin-plot")[2]
    low, high = (float(drawn.partition(f'data-{end}="')[2].partition('"')[0]) for end in ("low", "high"))
    assert low == -high
