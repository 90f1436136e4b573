"""Picture of the stack: what is said of a part stands beside the parts, and sides have their names."""

import pytest

from coneskin.design.sheet_pictures import draw_parts, draw_seam, draw_stack
from coneskin.design.sheets.sheet_design import DesignOptions, design_sheets
from coneskin.design.workshop.build_figures import measure_build
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


@pytest.mark.parametrize(("wires", "said"), [("end1", "end 1"), ("end2", "end 2"), ("edge1", "the edge of C")])
def test_the_side_of_the_wires_has_the_name_of_the_guide(wires: str, said: str) -> None:
    figure = figures.Figure()
    options = DesignOptions(wires=wires)  # type: ignore[arg-type]
    (design,) = design_sheets((PlacedFrustum(Frustum(0.05, 0.06, 0.1, 4.7)),), options)
    draw_seam(figure, design, measure_build(design, 0, "the frame", None, ()))
    (axes,) = figure.axes
    assert axes.get_title().endswith(f"wires leave at {said}")


def test_each_electrode_that_is_cut_carries_its_letter() -> None:
    """By the outline of the drawing: a letter of the mirrored side, or of the other electrode, lies beside it."""
    from matplotlib.path import Path as Outline

    figure = figures.Figure()
    (design,) = design_sheets((PlacedFrustum(Frustum(0.04, 0.07, 0.15, 4.7)),), DesignOptions())
    draw_parts(figure, design)
    for number, names in {2: "CD", 3: "CD", 5: "AB", 6: "AB"}.items():
        axes = figure.axes[[cut.number for cut in design.cuts].index(number)]
        letters = {text.get_text(): text.get_position() for text in axes.texts if text.get_text() in set("ABCD")}
        assert set(letters) == set(names)
        if names == "CD":
            assert letters["D"][0] < letters["C"][0]  # D is at phi = 0, left as seen from outside
        else:
            assert letters["B"][1] < letters["A"][1]  # B is at end 1
        if number in (2, 6):  # foils alone
            foils = [Outline(line.get_xydata()) for line in axes.lines if line.get_color() == (1.0, 0.0, 0.0)]
            where = [[foil.contains_point(at) for foil in foils].index(True) for at in letters.values()]
            assert len(set(where)) == 2
