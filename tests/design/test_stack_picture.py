"""Pictures of the parts: what is said of a part stands beside it, and the seam is cut where it is."""

import math

import pytest

from coneskin.design.sheet_pictures import draw_parts, draw_seam, draw_stack
from coneskin.design.sheets.sheet_design import DesignOptions, design_sheets
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum

figures = pytest.importorskip("matplotlib.figure", reason="the extra coneskin[pictures] is not installed")


@pytest.mark.parametrize(
    "frustum", [Frustum(0.054, 0.054, 0.249), Frustum(0.04, 0.07, 0.15, 4.7), Frustum(0.07, 0.04, 0.15)]
)
def test_no_part_reaches_into_what_is_said_of_it(frustum: Frustum) -> None:
    figure = figures.Figure()
    (design,) = design_sheets((PlacedFrustum(frustum),), DesignOptions())
    draw_stack(figure, design)
    (axes,) = figure.axes
    farthest = max(x for part in axes.patches for x, _ in part.get_xy())
    labels = [text for text in axes.texts if "drawing:" in text.get_text()]
    assert [label.get_text()[0] for label in labels] == list("1324657")
    assert all(label.get_position()[0] > farthest for label in labels)
    assert {label.get_position()[0] for label in labels} == {labels[0].get_position()[0]}


def test_each_electrode_carries_its_letter_where_it_is_seen_from_outside() -> None:
    figure = figures.Figure()
    (design,) = design_sheets((PlacedFrustum(Frustum(0.04, 0.07, 0.15, 4.7)),), DesignOptions())
    draw_stack(figure, design)
    seen = [(text.get_text(), *text.get_position()) for text in figure.axes[0].texts if text.get_text() in set("ABCD")]
    assert [name for name, *_ in seen] == list("CDCDABAB"), "parts 3, 2, 6 and 5 in their order on the link"
    for (one, x1, y1), (_, x2, y2) in zip(seen[::2], seen[1::2], strict=True):
        assert (x2 < x1 and y1 == pytest.approx(y2)) if one == "C" else y2 < y1, "D is left of C, B at end 1"


@pytest.mark.parametrize("wrap", [2 * math.pi, 4.7])
def test_the_section_of_the_seam_shows_each_layer_where_it_ends(wrap: float) -> None:
    """Layers and foils stand as far from their edges as the layout has them; the blind angle is the layout's."""
    figure = figures.Figure()
    (design,) = design_sheets((PlacedFrustum(Frustum(0.05, 0.05, 0.15, wrap)),), DesignOptions())
    draw_seam(figure, design)
    (axes,) = figure.axes
    layout, words = design.layout, [text.get_text() for text in axes.texts]
    spans = [box.get_datalim(axes.transData) for box in axes.collections]
    starts = [span.x0 for span in spans if span.x0 >= 0.0]
    plan, arc = layout.plan, 50.0
    assert starts.count(0.0) >= 3, "rim of three layers"
    for phi in (layout.field.phi1 - plan.electrode / 0.05, plan.setback / 0.05):
        assert any(start == pytest.approx(phi * arc, abs=1e-6) for start in starts)
    blind = 2 * math.pi - (layout.active.phi2 - layout.active.phi1)
    assert f"no touch is located here: {blind * arc:.1f} mm, {math.degrees(blind):.1f} deg" in words
    assert any(word.endswith("mm bare") for word in words) == (wrap < 5.0)
    assert {"C", "D", f"lead of {plan.led_across}"} <= set(words)


def test_each_part_is_drawn_with_its_own_size() -> None:
    figure = figures.Figure()
    (design,) = design_sheets((PlacedFrustum(Frustum(0.04, 0.07, 0.15)),), DesignOptions())
    draw_parts(figure, design)
    for axes, cut in zip(figure.axes, design.cuts, strict=False):
        x0, y0, x1, y1 = (1e3 * value for value in cut.bounds)
        assert f"{x1 - x0:.1f} mm wide, {y1 - y0:.1f} mm deep" in axes.get_title()
        drawn = [x for line in axes.lines for x in line.get_xdata()]
        assert max(drawn) - min(drawn) == pytest.approx(x1 - x0, abs=0.2)
