"""Changes of a run that a page in a file plays: at each time the last of them is what the run says."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest

from coneskin.view.level_changes import LevelChanges
from coneskin.view.stage.level_scale import level_words
from coneskin.view.strand import read_strands
from coneskin.view.trace_drawing import trace_drawings
from tests.support.paths import COLLISION

RUN = COLLISION


def test_the_last_change_is_the_level_of_the_run_within_a_percent() -> None:
    (strand,) = read_strands([RUN])
    since, until = strand.span
    changes = LevelChanges(strand.stage.sheets)
    times = [since + (until - since) * k / 400 for k in range(401)]
    for time in times:
        changes.take(time - since, strand.moment(time))
    data = changes.data()
    (levels,), (words,), (sheet,) = data["levels"], data["words"], strand.stage.sheets
    assert 3 < len(levels) < 401, "what has not changed is not said again"
    assert all(a[1] != b[1] for a, b in pairwise(levels))
    for time in times:
        percent = [level for at, level in levels if at <= time - since + 1e-4][-1]
        assert percent == pytest.approx(100.0 * strand.moment(time).levels[sheet.name], abs=0.5)
        assert words[percent] == level_words(sheet, percent / 100)
    assert data["forces"] == [], "no physics, no force"


def test_a_force_is_said_when_its_words_change() -> None:
    (strand,) = read_strands([RUN])
    moment = strand.moment(strand.span[0])
    changes = LevelChanges(strand.stage.sheets)
    for time, force in enumerate((0.0, 0.04, 12.34, 12.32, 0.0)):
        changes.take(float(time), replace(moment, force=force))
    assert changes.data()["forces"] == [(0.0, "0.0 N"), (2.0, "12.3 N"), (4.0, "0.0 N")]


def test_a_drawn_trace_reaches_from_its_least_to_its_largest_value() -> None:
    strands = read_strands([RUN])
    drawn = trace_drawings(strands, *strands[0].span)
    assert drawn.count("<option") == drawn.count('class="coneskin-trace"') == 3
    assert drawn.count(" hidden") == 2, "the first is shown"
    course = drawn.partition('<path d="')[2].partition('"')[0]
    heights = [float(point.split()[1]) for point in course.replace("L", "M").split("M")[1:]]
    assert min(heights) == pytest.approx(120.0 * 0.05 / 1.1, abs=0.1), "a margin of 5 % above"
    assert max(heights) == pytest.approx(120.0 * 1.05 / 1.1, abs=0.1)
    assert all(math.isfinite(height) for height in heights)
