"""DXF files: read by group codes, rolled onto the cone with 40 digits, and compared between the styles."""

import math
import sys

import mpmath as mp
import pytest

from coneskin.core.errors import GeometryError, MissingExtra
from coneskin.geometry.drawing.cut_sheet import cut_sheets, make_test_piece
from coneskin.geometry.drawing.dxf import to_dxf
from coneskin.geometry.drawing.electrode_layout import ElectrodePlan, lay_out_sheet
from coneskin.geometry.drawing.layer_stack import PAPER_STACK, LayerStack
from tests.support.sweep import sweep

from ..drawing_readers import dxf_entities, dxf_header, dxf_layers, dxf_pairs, dxf_texts, read_dxf
from ..sheet_cases import SHEETS

mp.mp.dps = 40
SEAM = 0.01  # mm, what the seam may be off: the promise to the maker

#: a cone, a tube, a disc, and a cone that is cut as a tube; then every sheet that closes
KINDS = [
    ("widening", "loose"),
    ("cylinder", "bonded"),
    ("flipped disc", "loose"),
    ("nearer cylinder, snapped", "bonded"),
]
EVERY_KIND = [(name, how) for name in SHEETS if name != "partial wrap" for how in ("loose", "bonded")]


def surface(point, radius1, radius2, height, wrap, mirrored):
    """rho, phi, z of a point of the drawing [mm] once it is wrapped on the cone: by the apex, not by our formulas."""
    x, y = mp.mpf(-point.real if mirrored else point.real), mp.mpf(point.imag)
    d, slant = radius2 - radius1, mp.sqrt(height**2 + (radius2 - radius1) ** 2)
    if d == 0:
        return radius1, x / radius1 + wrap / 2, y
    r1 = radius1 * slant / abs(d)
    along = r1 + y if d > 0 else r1 - y  # from the apex
    r, theta = mp.sqrt(x**2 + along**2), mp.atan2(x, along)
    z = (r - r1) * (height / slant) * (1 if d > 0 else -1)
    return r * abs(d) / slant, theta * slant / abs(d) + wrap / 2, z


def rolled(point, *cone):
    rho, phi, z = surface(point, *cone)
    return rho * mp.cos(phi), rho * mp.sin(phi), z


def layer_cone(link, stack, index):
    """Radii and height [mm] of the cone of a layer, from the definition, with 40 digits."""
    d, h = mp.mpf(link.radius2) - mp.mpf(link.radius1), mp.mpf(link.height)
    grow = mp.mpf(stack.offset(index)) * h / mp.sqrt(h**2 + d**2)
    return (mp.mpf(link.radius1) + grow) * 1000, (mp.mpf(link.radius2) + grow) * 1000, h * 1000, mp.mpf(link.wrap)


def seam_edges(strokes, cone, mirrored):
    """The straight edges with the least and the largest azimuth, as functions of 0..1 up the drawing."""
    edges = []
    for stroke in strokes:
        for curve in stroke.curves:
            if abs(curve(0.5) - 0.5 * (curve(0.0) + curve(1.0))) < 1e-9 and abs(curve(1.0) - curve(0.0)) > 5.0:
                phi, turned = (surface(curve(t), *cone, mirrored)[1] for t in (0.0, 1.0))
                if abs(phi - turned) < 1e-3:
                    up = (curve(1.0) - curve(0.0)).imag > 0
                    edges.append((phi, curve if up else (lambda t, c=curve: c(1.0 - t))))
    edges.sort(key=lambda item: item[0])
    return edges[0][1], edges[-1][1]


@pytest.mark.parametrize(("name", "assembly"), sweep(dict.fromkeys([*KINDS, *EVERY_KIND]), short=len(KINDS)))
@pytest.mark.long
def test_cut_outlines_rolled_onto_the_cone_meet_at_the_seam_on_every_layer(name, assembly):
    link, stack = SHEETS[name], LayerStack(PAPER_STACK.layers, assembly)
    plan = ElectrodePlan()
    narrow = min(link.radius1, link.radius2)
    for cut, index in zip(cut_sheets(lay_out_sheet(link, plan), stack), (0, 1, 1, 2, 3, 3, 4), strict=True):
        if cut.name.endswith("electrodes"):
            continue
        text = to_dxf([cut])
        mirrored = "INSIDE FACE UP" in dxf_texts(text)
        assert mirrored == (cut.face == "inside")
        strokes = [stroke for stroke in read_dxf(text) if stroke.layer.endswith("_CUT")]
        cone = layer_cone(link, stack, index)
        first, last = seam_edges(strokes, cone, mirrored)
        steps = [i / 8 for i in range(9)]
        worst = 0.0
        for t in steps:
            p, q = rolled(first(t), *cone, mirrored), rolled(last(t), *cone, mirrored)
            gap = mp.sqrt(sum((a - b) ** 2 for a, b in zip(p, q, strict=True)))
            if cut.name.endswith("conductive"):  # cut back on purpose, so that C and D do not touch
                if cut.name == "upper conductive":  # and further on the side of the lead
                    continue
                gap = abs(gap - 2 * mp.hypot(p[0], p[1]) * mp.sin(plan.setback / narrow))
            worst = max(worst, float(gap))
        assert worst < SEAM, f"{cut.name}: the seam is off by {worst:.4f} mm"


@pytest.mark.parametrize("name", SHEETS)
def test_corners_come_to_lie_on_the_ends_of_the_sheet(name):
    """Ends of the substrate, rolled up, are the two end circles: z is 0 and the height, within what a snap may move."""
    link = SHEETS[name]
    for cut, index in zip(cut_sheets(lay_out_sheet(link), PAPER_STACK)[::3], (0, 2, 4), strict=True):
        cone = layer_cone(link, PAPER_STACK, index)
        border = next(s for s in read_dxf(to_dxf([cut])) if s.layer.endswith("_CUT"))
        for curve in border.curves:
            for t in (0.0, 0.5):
                x, y, z = rolled(curve(t), *cone, cut.face == "inside")
                if abs(curve(0.5) - 0.5 * (curve(0.0) + curve(1.0))) < 1e-9 and t == 0.5 and link.height > 0:
                    continue  # the middle of an edge, not a rim
                rho = mp.hypot(x, y)
                ends = [(cone[0], 0.0), (cone[1], cone[2])]
                off = min(mp.hypot(rho - radius, z - height) for radius, height in ends)
                slack = 0.005 if "snapped" in name else 1e-6
                if link.height > 0 or t == 0.0:
                    assert off < slack


def test_file_says_r2010_and_millimetres_and_names_its_layers():
    text = to_dxf(cut_sheets(lay_out_sheet(SHEETS["widening"]), PAPER_STACK, overlap=0.01))
    assert dxf_header(text, "$ACADVER") == "AC1024"  # R2010
    assert dxf_header(text, "$INSUNITS") == "4"  # millimetres
    assert dxf_header(text, "$MEASUREMENT") == "1"
    layers = dxf_layers(text)
    for kind, colour in (("CUT", 1), ("HOLE", 6), ("SCORE", 5), ("FOLD", 3), ("LABEL", 250)):
        assert layers[f"7-upper-substrate_{kind}"] == colour
    assert 7 not in {layers[name] for name in layers if name[0].isdigit() and name != "0"}  # white on paper
    cuts = [s for s in read_dxf(text) if s.layer.endswith(("_CUT", "_HOLE"))]
    assert len(cuts) == 9 + 5 * 3
    assert all(stroke.closed for stroke in cuts)


def test_rims_are_true_arcs_with_the_radius_of_the_sector():
    link = SHEETS["widening"]
    cut = cut_sheets(lay_out_sheet(link), PAPER_STACK)[0]
    grow = 1.25e-3 * link.cos_half_angle
    wanted = {1e3 * (radius + grow) / link.sin_half_angle for radius in (link.radius1, link.radius2)}
    found = set()
    for kind, codes in dxf_entities(to_dxf([cut], "arc-line")):
        single = dict(codes)
        if kind == "ARC" and single[8].endswith("_CUT"):
            found.add(float(single[40]))
    assert sorted(found) == pytest.approx(sorted(wanted), rel=1e-12)


@pytest.mark.parametrize(
    "name", sweep(["near cylinder, 0.0008 deg", "theta0 of 276 deg", "cylinder", "flipped", "disc"], short=2)
)
def test_styles_of_arcs_draw_the_same(name):
    sheets = cut_sheets(lay_out_sheet(SHEETS[name]), PAPER_STACK)
    bulge = read_dxf(to_dxf(sheets))
    pieces = iter(read_dxf(to_dxf(sheets, "arc-line")))
    for stroke in bulge:
        for curve in stroke.curves:
            [other] = next(pieces).curves
            # an ARC has no direction; a radius of 3e6 mm in degrees of 16 digits is good to 1e-8 mm
            same = max(abs(curve(t) - other(t)) for t in (0.0, 0.3, 1.0))
            turned = max(abs(curve(t) - other(1.0 - t)) for t in (0.0, 0.3, 1.0))
            assert min(same, turned) < 1e-6
    assert next(pieces, None) is None


def test_flattened_lines_stay_within_the_tolerance_of_the_arc():
    link, tolerance = SHEETS["widening"], 0.02
    cut = cut_sheets(lay_out_sheet(link), PAPER_STACK)[0]
    rho1, rho2, _, _ = layer_cone(link, PAPER_STACK, 0)
    radii = [float(rho) / link.sin_half_angle for rho in (rho1, rho2)]
    border = next(s for s in read_dxf(to_dxf([cut], "flattened", tolerance * 1e-3)) if s.layer.endswith("_CUT"))
    seen = 0
    for chord in border.curves:
        for radius in radii:
            a, middle = (abs(chord(t) + 1j * radii[0]) - radius for t in (0.0, 0.5))
            if abs(a) < 1e-6 and abs(chord(1.0) + 1j * radii[0]) - radius < 1e-6 and abs(middle) < 1.0:
                seen += 1
                assert 0.0 < -middle <= tolerance
    assert 50 < seen < 200  # 0.65 m of rims in pieces of sqrt(8 r tolerance) = 6 mm at most


def test_an_unknown_style_and_a_missing_package_are_said(monkeypatch):
    sheets = cut_sheets(lay_out_sheet(SHEETS["cylinder"]), PAPER_STACK)
    with pytest.raises(GeometryError, match="arcs must be one of bulge, arc-line, flattened, got 'spline'"):
        to_dxf(sheets, "spline")
    with pytest.raises(GeometryError, match="tolerance must be above 0"):
        to_dxf(sheets, "flattened", 0.0)
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    with pytest.raises(MissingExtra, match=r"ezdxf: pip install 'coneskin\[design\]'"):
        to_dxf(sheets)


def test_kerf_moves_every_border_by_half_of_it():
    layout, kerf = lay_out_sheet(SHEETS["flipped"]), 0.3
    plain, wide = (list(read_dxf(to_dxf(cut_sheets(layout, PAPER_STACK, kerf=k * 1e-3)[:1]))) for k in (0.0, kerf))
    for before, after in zip(plain, wide, strict=True):
        inward = {"CUT": 1.0, "HOLE": -1.0}.get(before.layer.rsplit("_")[-1], 0.0)
        for a, b in zip(before.curves, after.curves, strict=True):
            ahead = (a(0.5001) - a(0.4999)) / abs(a(0.5001) - a(0.4999))
            out = -1j * ahead  # the outlines run counter-clockwise
            assert ((b(0.5) - a(0.5)) / out).real == pytest.approx(inward * kerf / 2, abs=2e-6)  # ends differ a little


def test_angles_are_in_degrees_within_a_turn():
    for kind, codes in dxf_entities(to_dxf(cut_sheets(lay_out_sheet(SHEETS["disc"]), PAPER_STACK), "arc-line")):
        if kind == "ARC":
            sweep = (float(dict(codes)[51]) - float(dict(codes)[50])) % 360.0
            assert 0.0 < sweep <= 90.0 + 1e-9
            assert math.isfinite(sweep)


@pytest.mark.parametrize("corner", [(0.0, 0.0), (-0.02, 0.01)])
def test_the_extents_of_a_file_hold_all_of_it(corner):
    """A corner at the origin is one too, which ezdxf takes for none: a reader shows what the header says."""
    piece = make_test_piece("foam")
    x1, y1, _, _ = piece.bounds
    text = to_dxf([piece.moved(corner[0] - x1, corner[1] - y1)])
    points = [point for entity in read_dxf(text) for curve in entity.curves for point in (curve(0.0), curve(1.0))]
    for name, bound in (("$EXTMIN", min), ("$EXTMAX", max)):
        pairs = dxf_pairs(text)
        start = pairs.index((9, name))
        found = tuple(float(value) for _, value in pairs[start + 1 : start + 3])
        assert found == pytest.approx((bound(p.real for p in points), bound(p.imag for p in points)))
