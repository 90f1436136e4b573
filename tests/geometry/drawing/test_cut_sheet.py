"""Cut sheets: areas, faces, labels that can be read, lines that a cutter can follow."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from coneskin.core.errors import GeometryError
from coneskin.geometry.drawing.cut_sheet import LINE_COLOURS, cut_sheets, nest_sheets
from coneskin.geometry.drawing.electrode_layout import ElectrodePlan, lay_out_sheet
from coneskin.geometry.drawing.layer_stack import PAPER_STACK
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from tests.support.sweep import sweep

from ..planar import box, dense, distance, distances, inside
from ..sheet_cases import SHEETS

INDEX = {"lower substrate": 0, "lower conductive": 1, "isolation": 2, "upper conductive": 3, "upper substrate": 4}


@pytest.mark.parametrize("name", SHEETS)
def test_a_substrate_has_the_area_of_its_cone(name):
    """Unrolling is an isometry: area of the drawing is the area of the side, without three holes."""
    layout = lay_out_sheet(SHEETS[name])
    for cut in cut_sheets(layout, PAPER_STACK, snap=0.0):
        if cut.name in ("lower substrate", "isolation", "upper substrate"):
            side = PAPER_STACK.surface(PlacedFrustum(layout.sheet), INDEX[cut.name])
            holes = 3 * np.pi * 0.25 * layout.plan.hole**2
            assert cut.parts[0].area == pytest.approx(side.area - holes, rel=1e-11)


def test_seven_sheets_from_the_link_outwards():
    sheets = cut_sheets(lay_out_sheet(SHEETS["widening"]), PAPER_STACK)
    assert [sheet.slug for sheet in sheets] == [
        "1-lower-substrate",
        "2-lower-electrodes",
        "3-lower-conductive",
        "4-isolation",
        "5-upper-conductive",
        "6-upper-electrodes",
        "7-upper-substrate",
    ]
    assert [part.name for part in sheets[1].parts + sheets[5].parts] == [f"electrode {which}" for which in "CDAB"]
    # a mark, three holes, a border; on the cover, whose outside is up, no mark, but nine crosses
    assert [len(sheet.parts[0].strokes) for sheet in sheets[::6]] == [5, 22]


def test_faces_are_those_on_which_the_next_thing_is_glued_unless_asked_otherwise():
    layout = lay_out_sheet(SHEETS["widening"])
    faces = {sheet.name: sheet.face for sheet in cut_sheets(layout, PAPER_STACK)}
    # a film conducts on one face: those of both sheets carry the electrodes, and face each other
    assert {faces[f"lower {part}"] for part in ("substrate", "conductive", "electrodes")} == {"outside"}
    assert {faces[f"upper {part}"] for part in ("conductive", "electrodes")} == {"inside"}
    assert faces["upper substrate"] == "outside", "on it nothing is glued: its labels are read on the link"
    bonded = cut_sheets(layout, replace(PAPER_STACK, assembly="bonded"))
    assert bonded[6].face == "inside", "part 5 is glued on it"
    for wanted in ("outside", "inside"):
        for sheet in cut_sheets(layout, PAPER_STACK, face_up=wanted):
            assert sheet.face == wanted
            words = " ".join(label.text for part in sheet.parts for label in part.labels)
            assert f"{wanted.upper()} FACE UP" in words


@pytest.mark.long
def test_a_part_seen_from_inside_is_the_mirror_image():
    layout = lay_out_sheet(SHEETS["widening"])
    pairs = [cut_sheets(layout, PAPER_STACK, face_up=face) for face in ("outside", "inside")]
    for one, two in zip(*pairs, strict=True):
        for a, b in zip(one.parts, two.parts, strict=True):
            assert a.area == pytest.approx(b.area, rel=1e-14)
            for p, q in zip(a.strokes, b.strokes, strict=True):
                mirrored = dense(p.outline) * (-1.0, 1.0)
                assert distances(dense(q.outline), mirrored).max() < 0.2e-3
                assert distances(mirrored, dense(q.outline)).max() < 0.2e-3
            for p, q in zip(a.labels, b.labels, strict=True):
                assert (p.x, p.y, p.angle) == pytest.approx((-q.x, q.y, -q.angle))
                assert p.height == pytest.approx(q.height, rel=0.2)  # "outside" is longer than "inside"


@pytest.mark.parametrize(
    ("name", "side"), sweep((n, "edge1" if turn % 2 and "disc" not in n else "end1") for turn, n in enumerate(SHEETS))
)
def test_labels_lie_inside_clear_of_every_line_and_of_each_other(name, side):
    layout = lay_out_sheet(SHEETS[name], ElectrodePlan(wires=side))
    for sheet in cut_sheets(layout, PAPER_STACK):
        for part in sheet.parts:
            assert part.labels, f"{part.name} is not named"
            border = next(stroke.outline for stroke in part.strokes if stroke.kind == "cut")
            boxes = [box(label) for label in part.labels]
            lines = np.concatenate([dense(stroke.outline) for stroke in part.strokes])
            for label, points in zip(part.labels, boxes, strict=True):
                assert inside(points, border).all(), label.text
                assert distance(points, lines) > 0.3e-3, label.text
                assert label.height >= 0.7e-3, f"{label.text} cannot be read"
            for (i, a), (j, b) in combinations(enumerate(boxes), 2):
                assert distance(a, b) > 0.3e-3, (part.labels[i].text, part.labels[j].text)


def test_the_name_of_a_narrow_electrode_leaves_a_fifth_of_its_foil_free_above_and_below():
    """A name that fills its strip is cut off where the cutter is a little aside."""
    width = 4e-3
    layout = lay_out_sheet(SHEETS["cylinder"], ElectrodePlan(electrode=width))
    foils = [part for sheet in cut_sheets(layout, PAPER_STACK)[1::4] for part in sheet.parts]
    assert [label.text[:1] for foil in foils for label in foil.labels] == [*"CDAB"]
    for foil in foils:
        assert all(0.5 * (width - label.height) >= 0.2 * width - 1e-9 for label in foil.labels), foil.name


@pytest.mark.parametrize(
    ("name", "side"),
    sweep(
        [("partial wrap", s) for s in ("end1", "end2", "edge0", "edge1")]
        + [("cylinder", "edge0"), ("widening", "end2"), ("flipped disc", "end1")],
    ),
)
@pytest.mark.long
def test_no_two_strokes_run_on_each_other(name, side):
    """A cutter would burn twice. Marks may end on a border, but not run along it."""
    layout = lay_out_sheet(SHEETS[name], ElectrodePlan(wires=side))
    overlap = 0.0 if side.startswith("edge") or "disc" in name else 0.008
    for sheet in cut_sheets(layout, PAPER_STACK, overlap=overlap):
        strokes = [stroke.outline for part in sheet.parts for stroke in part.strokes]
        for one, two in combinations(strokes, 2):
            a, b = dense(one), dense(two)
            for points, outline, others in ((a, one, b), (b, two, a)):
                ends = np.array([outline.vertices[0][:2], outline.vertices[-1][:2]])
                if not outline.closed:
                    far = np.sqrt(((points[:, None, :] - ends[None, :, :]) ** 2).sum(axis=2).min(axis=1))
                    points = points[far > 1.5e-3]
                touching = distances(points[::4], others) < 0.15e-3
                # a mark that ends on this line touches it within a millimetre and a half on either side
                assert touching.sum() <= 4


def test_flap_closes_the_seam_on_the_upper_substrate_only():
    layout = lay_out_sheet(SHEETS["widening"])
    plain, with_flap = (cut_sheets(layout, PAPER_STACK, overlap=width) for width in (0.0, 0.010))
    for a, b in zip(plain[:-1], with_flap[:-1], strict=True):
        assert a == b
    grown = with_flap[-1].parts[0].area - plain[-1].parts[0].area
    assert grown == pytest.approx(0.010 * layout.sheet.slant, rel=1e-9)
    assert [stroke.kind for stroke in with_flap[-1].parts[0].strokes].count("fold") == 1


def test_materials_count_what_is_cut():
    """Length of all cuts of the isolation of a cylinder, by hand."""
    layout = lay_out_sheet(Frustum(0.05, 0.05, 0.2))
    part = cut_sheets(layout, PAPER_STACK)[3].parts[0]
    width = 2 * np.pi * 53e-3
    holes = 3 * np.pi * 2.5e-3
    assert part.cut_length == pytest.approx(2 * (width + 0.2) + holes, rel=1e-12)


@pytest.mark.parametrize("name", SHEETS)
def test_nested_sheets_keep_their_distance(name):
    sheets = nest_sheets(cut_sheets(lay_out_sheet(SHEETS[name]), PAPER_STACK), 0.010)
    boxes = [sheet.bounds for sheet in sheets]
    assert min(box[0] for box in boxes) == pytest.approx(0.0, abs=1e-15)
    assert min(box[1] for box in boxes) == pytest.approx(0.0, abs=1e-15)
    for a, b in combinations(boxes, 2):
        apart = max(a[0] - b[2], b[0] - a[2], a[1] - b[3], b[1] - a[3])
        assert apart >= 0.010 - 1e-12


def test_palette_has_no_two_alike_and_no_white():
    assert len(set(LINE_COLOURS.values())) == len(LINE_COLOURS)
    assert (255, 255, 255) not in LINE_COLOURS.values()


def test_mistakes_are_said():
    layout = lay_out_sheet(SHEETS["widening"])
    with pytest.raises(GeometryError, match=r"kerf must be finite and not negative, got -0\.1 mm"):
        cut_sheets(layout, PAPER_STACK, kerf=-1e-4)
    with pytest.raises(GeometryError, match="overlap must be finite and not negative, got nan mm"):
        cut_sheets(layout, PAPER_STACK, overlap=float("nan"))
    with pytest.raises(GeometryError, match="is larger than a detail"):
        cut_sheets(layout, PAPER_STACK, kerf=3e-3)
    with pytest.raises(GeometryError, match="an overlap of 8 mm runs into the other edge of the flat pattern, 0 mm"):
        cut_sheets(lay_out_sheet(SHEETS["disc"]), PAPER_STACK, overlap=8e-3)
    with pytest.raises(GeometryError, match="an overlap would cover the tabs at edge1"):
        cut_sheets(lay_out_sheet(SHEETS["widening"], ElectrodePlan(wires="edge1")), PAPER_STACK, overlap=5e-3)
