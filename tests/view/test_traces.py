"""Plot of traces: its axes hold what is known, whatever is missing."""

from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from coneskin.view.run_course import RunCourse, read_courses
from coneskin.view.traces import TracePlot
from tests.support.paths import COLLISION

RUN = COLLISION


class Gui:
    """What a plot needs of viser's panel."""

    def add_folder(self, _label: str) -> Any:
        return nullcontext()

    def add_uplot(self, data: Any, series: Any, scales: Any, **_options: Any) -> SimpleNamespace:
        return SimpleNamespace(data=data, series=series, scales=scales)


@pytest.fixture(scope="module")
def course() -> RunCourse:
    return read_courses([RUN])[0]


def test_a_plot_has_a_range_where_frames_are_missing(course: RunCourse) -> None:
    since, until = course.span
    plot = TracePlot(Gui(), [course], since, until, fixed=True)
    levels = course.history.levels["forearm skin"].values
    shown = plot._plot
    low, high = shown.scales["y"]["range"]
    assert np.isfinite([low, high]).all()
    assert low < min(row[0] for row in levels) <= max(row[0] for row in levels) < high
    plot.move(since - 5.0, since - 4.0)  # before the run: nothing is known
    assert np.isnan(shown.data[1]).all()
    assert shown.scales["y"]["range"] == pytest.approx((-0.05, 1.05))
    plot.move(since - 1.0, until)  # a second without frames before them, which gives uPlot's own search no range
    assert np.isnan(shown.data[1]).any()
    assert shown.scales["y"]["range"][1] == pytest.approx(high)
