"""Picture of the stack: what is said of a part stands beside the parts."""

import pytest

from coneskin.design.sheet_pictures import draw_stack
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
