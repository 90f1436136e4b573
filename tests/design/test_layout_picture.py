"""The layout of a sheet: every length with its unit, every kind of line explained."""

import itertools
import math
import re

import pytest

from coneskin.design.sheet_pictures import _dimensions, draw_layout, draw_parts, draw_seam
from coneskin.design.sheets.sheet_design import DesignOptions, design_sheets
from coneskin.design.workshop.build_figures import _sheet_wires
from coneskin.geometry.drawing.surface_shape import draw_shape
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum


def test_dimensions_have_units_and_lines_a_legend() -> None:
    module = pytest.importorskip("matplotlib.figure", reason="the extra coneskin[pictures] is not installed")
    figure = module.Figure()
    (design,) = design_sheets((PlacedFrustum(Frustum(0.04, 0.07, 0.15, math.radians(270.0))),), DesignOptions())
    draw_layout(figure, design, _sheet_wires(design.layout, design.way))
    (axes,) = figure.axes
    words = "\n".join(text.get_text() for text in axes.texts)
    numbers = re.findall(r"\d+\.\d+(?! *(?:mm|cm2|deg))\b(?!\d)", words)
    assert numbers == []
    assert len(re.findall(r"\d mm", words)) == 7  # both sides, the slant, two arcs, two radii
    (legend,) = figure.legends
    named = {text.get_text() for text in legend.texts}
    assert any(re.fullmatch(r"cable tie, (2[4-9]|3[0-6]) mm along the cable", name) for name in named)
    assert any(re.fullmatch(r"connector, (5[4-9]|6[0-6]) mm along the cable", name) for name in named)
    assert {"upper conductive layer", "lower conductive layer", "substrates and isolation", "active area"} < named
    lines = [line for line in legend.get_lines() if line.get_marker() in ("", "None")]
    assert {line.get_linestyle() for line in lines} == {"-", "--", ":"}


@pytest.mark.parametrize("wires", ["end1", "end2"])
@pytest.mark.parametrize("wrap_deg", [180.0, 270.0, 360.0])
@pytest.mark.long
def test_wires_are_drawn_from_the_tabs_past_the_tie_to_the_connector(wires: str, wrap_deg: float) -> None:
    module = pytest.importorskip("matplotlib.figure", reason="the extra coneskin[pictures] is not installed")
    figure = module.Figure()
    frustum = Frustum(0.05, 0.06, 0.1, math.radians(wrap_deg))
    (design,) = design_sheets((PlacedFrustum(frustum),), DesignOptions(wires=wires))  # type: ignore[arg-type]
    draw_layout(figure, design, _sheet_wires(design.layout, design.way))
    (axes,) = figure.axes
    marks = [line for line in axes.lines if line.get_marker() in "sD" and len(line.get_xdata()) == 1]
    assert [line.get_marker() for line in marks] == ["s", "D"]
    (tx, ty), (cx, cy) = ((line.get_xdata()[0], line.get_ydata()[0]) for line in marks)
    assert 13.0 < math.dist((tx, ty), (cx, cy)) < 40.0
    last = [(line.get_xdata()[-1], line.get_ydata()[-1]) for line in axes.lines if line.get_linewidth() == 1.2]
    assert len(last) == 4
    (led,) = [line for line in axes.lines if line.get_linewidth() == 2.5]
    start = led.get_xdata()[0], led.get_ydata()[0]
    ends = [end for end in last if math.dist(end, start) < 0.1]
    crossing = sum(text.get_text()[1:3] == ", " for text in axes.texts)
    assert len(ends) + crossing == 4
    assert crossing == (wrap_deg > 200.0)
    rim = [y for line in axes.lines[:1] for y in line.get_ydata()]
    assert cy < min(rim) if wires == "end1" else cy > min(rim)


def test_the_width_is_written_just_below_a_sheet_whose_sector_reaches_far_down() -> None:
    """Of 276 deg: its corners lie 215 mm below the middle of end 1, where the tabs are."""
    module = pytest.importorskip("matplotlib.figure", reason="the extra coneskin[pictures] is not installed")
    (design,) = design_sheets((PlacedFrustum(Frustum(0.05, 0.15, 0.085)),), DesignOptions(wires="end1"))
    axes, cone = module.Figure().add_subplot(), design.cuts[4].surface
    x0, y0, x1, y1 = (1e3 * value for value in draw_shape(cone, design.layout.rim).bounds)
    _dimensions(axes, design, cone, [0.0])
    (written,) = [text for text in axes.texts if text.get_text() == f"{x1 - x0:.2f} mm"]
    x, y = written.get_position()
    assert x == pytest.approx(0.5 * (x0 + x1))
    assert y0 - 0.15 * (y1 - y0) < y < y0 - 1e3 * design.layout.plan.tab


def test_a_cable_that_passes_edge_0_is_drawn_as_one_line() -> None:
    """From edge 330 deg it goes on past 360: on the link a step of 4 mm, not once around it."""
    module = pytest.importorskip("matplotlib.figure", reason="the extra coneskin[pictures] is not installed")
    figure = module.Figure()
    frustum = Frustum(0.05, 0.06, 0.1, math.radians(330.0))
    (design,) = design_sheets((PlacedFrustum(frustum),), DesignOptions(wires="edge1"))
    draw_layout(figure, design, _sheet_wires(design.layout, design.way))
    (led,) = [line for line in figure.axes[0].lines if line.get_linewidth() == 2.5]
    places = list(zip(led.get_xdata(), led.get_ydata(), strict=True))
    assert design.way.surface[-1, 1] > math.tau
    assert max(math.dist(one, two) for one, two in itertools.pairwise(places)) < 7.0


def test_the_section_names_the_edges_at_the_edges_and_only_a_sheet_with_a_flap_speaks_of_one() -> None:
    module = pytest.importorskip("matplotlib.figure", reason="the extra coneskin[pictures] is not installed")
    (design,) = design_sheets((PlacedFrustum(Frustum(0.05, 0.05, 0.1, math.radians(200.0))),), DesignOptions())
    section, parts = module.Figure(), module.Figure()
    draw_seam(section, design)
    (axes,) = section.axes
    named = {text.get_text().strip(): text for text in axes.texts}
    assert named["edge 0"].get_position()[0] == 0.0
    bare = named[next(name for name in named if name.endswith("mm bare"))].get_position()[0]
    assert named["edge of C"].get_position()[0] == pytest.approx(2.0 * bare), "the bare link is between the edges"
    draw_parts(parts, design)
    assert "flap" not in "".join(text.get_text() for axes in parts.axes for text in axes.texts)
