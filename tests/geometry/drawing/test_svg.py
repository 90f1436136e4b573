"""SVG files: read back by the specification and compared with the DXF of the same sheet."""

import re
from xml.etree import ElementTree

import pytest

from coneskin.geometry.drawing.cut_sheet import LINE_COLOURS, cut_sheets, nest_sheets
from coneskin.geometry.drawing.dxf import to_dxf
from coneskin.geometry.drawing.electrode_layout import lay_out_sheet
from coneskin.geometry.drawing.layer_stack import PAPER_STACK
from coneskin.geometry.drawing.svg import to_svg

from ..drawing_readers import read_dxf, read_svg
from ..sheet_cases import SHEETS

AGREE = 1e-3  # mm, the promise; both files hold 1e-6 mm


def matched(dxf, svg):
    """Strokes of the SVG in the order of the DXF, moved to its origin: the SVG is sorted by kind."""
    assert len(dxf) == len(svg)
    kinds = list(LINE_COLOURS)
    dxf = sorted(dxf, key=lambda s: (s.layer.rsplit("_")[0], kinds.index(s.layer.rsplit("_")[1].lower())))
    shift = dxf[0].curves[0](0.0) - svg[0].curves[0](0.0)
    return zip(dxf, svg, strict=True), shift


@pytest.mark.parametrize("name", SHEETS)
@pytest.mark.long
def test_svg_and_dxf_agree(name):
    sheets = cut_sheets(lay_out_sheet(SHEETS[name]), PAPER_STACK, overlap=0.0 if "disc" in name else 0.008, kerf=0.1e-3)
    pairs, shift = matched(read_dxf(to_dxf(sheets)), read_svg(to_svg(sheets)))
    worst = 0.0
    for one, two in pairs:
        assert one.closed == two.closed
        assert one.layer.lower() == two.layer.lower()
        for a, b in zip(one.curves, two.curves, strict=True):
            worst = max(worst, *(abs(a(t) - b(t) - shift) for t in (0.0, 0.25, 0.5, 1.0)))
    assert worst < AGREE


def test_combined_drawing_agrees_too():
    sheets = nest_sheets(cut_sheets(lay_out_sheet(SHEETS["flipped"]), PAPER_STACK))
    pairs, shift = matched(read_dxf(to_dxf(sheets)), read_svg(to_svg(sheets)))
    assert shift == pytest.approx(-5.0 - 5.0j, abs=1e-5)  # nest begins at 0, 0; the SVG has a border of 5 mm
    for one, two in pairs:
        assert all(abs(a(0.5) - b(0.5) - shift) < AGREE for a, b in zip(one.curves, two.curves, strict=True))


def test_size_is_in_mm_and_arcs_are_arcs():
    sheets = cut_sheets(lay_out_sheet(SHEETS["widening"]), PAPER_STACK)[:1]
    text = to_svg(sheets, "a <title> & more")
    root = ElementTree.fromstring(text)
    x0, y0, x1, y1 = sheets[0].bounds
    assert float(root.get("width").removesuffix("mm")) == pytest.approx((x1 - x0) * 1e3 + 10.0, abs=1e-6)
    assert float(root.get("height").removesuffix("mm")) == pytest.approx((y1 - y0) * 1e3 + 10.0, abs=1e-6)
    assert root.find("{http://www.w3.org/2000/svg}title").text == "a <title> & more"
    cut = re.search(r'_cut" [^>]*>\s*<path d="([^"]*)"', text)[1]
    assert " A " in cut
    assert " C " not in cut
    assert cut.endswith("Z")


def test_rims_of_kilometres_are_written_without_their_far_centre():
    """Renderers with single precision carry a radius of 3e6 mm to a quarter of a millimetre."""
    text = to_svg(cut_sheets(lay_out_sheet(SHEETS["near cylinder, 0.0008 deg"]), PAPER_STACK))
    radii = [float(word) for word in re.findall(r" A ([\d.]+) ", text)]
    assert radii  # of the holes
    assert max(radii) <= 1e4
    assert " C " in text


def test_each_layer_is_a_group_with_colours_of_the_palette():
    sheets = cut_sheets(lay_out_sheet(SHEETS["widening"]), PAPER_STACK)
    root = ElementTree.fromstring(to_svg(sheets))
    space = "{http://www.w3.org/2000/svg}"
    groups = root.findall(f"{space}g")
    mode = "{http://www.inkscape.org/namespaces/inkscape}groupmode"
    assert [(g.get("id"), g.get(mode)) for g in groups] == [(sheet.slug, "layer") for sheet in sheets]
    colours = {f"#{r:02x}{g:02x}{b:02x}" for r, g, b in LINE_COLOURS.values()}
    for group in groups:
        for inner in group.findall(f"{space}g"):
            stroke, fill = inner.get("stroke"), inner.get("fill")
            assert (stroke in colours and fill == "none") or (fill == "#000000" and stroke == "none")
    assert "#ffffff" not in colours
