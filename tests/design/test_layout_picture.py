"""The layout of a sheet: every length with its unit, every kind of line explained."""

import math
import re

import pytest

from coneskin.design.layout_picture import draw_layout
from coneskin.design.sheets import DesignOptions, design_sheets
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum


def test_dimensions_have_units_and_lines_a_legend() -> None:
    module = pytest.importorskip("matplotlib.figure", reason="the extra coneskin[pictures] is not installed")
    figure = module.Figure()
    (design,) = design_sheets((PlacedFrustum(Frustum(0.04, 0.07, 0.15, math.radians(270.0))),), DesignOptions())
    draw_layout(figure, design)
    (axes,) = figure.axes
    words = "\n".join(text.get_text() for text in axes.texts)
    numbers = re.findall(r"\d+\.\d+(?! *(?:mm|cm2|deg))\b(?!\d)", words)
    assert numbers == []
    assert len(re.findall(r"\d mm", words)) == 7  # both sides, the slant, two arcs, two radii
    (legend,) = figure.legends
    named = {text.get_text() for text in legend.texts}
    assert {"upper conductive layer", "lower conductive layer", "substrates and isolation", "active area"} < named
    assert {line.get_linestyle() for line in legend.get_lines()} == {"-", "--", ":"}
