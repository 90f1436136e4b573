"""Words and bars of touch levels, and forces where a calibration knows them."""

from dataclasses import replace

import pytest

from coneskin.runs.replay.run import read_run
from coneskin.skin.calibration import ForceTable
from coneskin.view.stage.level_scale import level_bars, level_colour, level_words
from coneskin.view.stage.stage import SheetSurface, set_stage
from tests.support.paths import COLLISION

RUN = COLLISION


@pytest.fixture(scope="module")
def sheet() -> SheetSurface:
    run = read_run(RUN)
    return set_stage(run.scene(), run.place_sensors(), "run").sheets[0]


def test_a_level_is_said_with_its_force_where_that_is_known(sheet: SheetSurface) -> None:
    table = ForceTable((2.0, 10.0, 40.0), (0.2, 0.5, 0.8), 0.1)
    known = sheet._replace(sensor=replace(sheet.sensor, force_table=table))
    assert level_words(sheet, 0.5).endswith("level 0.50")
    assert level_words(known, 0.5).endswith("level 0.50, 10 +- 1 N")
    assert level_words(known, 0.1).endswith("level 0.10")
    assert level_words(known, 0.9).endswith("level 0.90, above 40 N")
    assert "40 N" in level_bars([known], {sheet.name: 0.3})


def test_a_bar_shows_the_level_and_physics_its_force(sheet: SheetSurface) -> None:
    bars = level_bars([sheet], {sheet.name: 0.25}, 48.66)
    assert "left:25.0%" in bars
    assert "48.7 N" in bars
    assert "coneskin-force" not in level_bars([sheet], {sheet.name: 0.25})


def test_a_name_is_no_html(sheet: SheetSurface) -> None:
    foreign = sheet._replace(name="<b>x")
    assert "<b>x" not in level_bars([foreign], {"<b>x": 0.0})


def test_the_bars_colours_are_those_of_the_sheet(sheet: SheetSurface) -> None:
    red, green, blue = level_colour(1.0, sheet.touch_level)
    assert f"rgb({red},{green},{blue}) 100.0%" in level_bars([sheet], {sheet.name: 0.0})
