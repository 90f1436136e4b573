"""Electrodes, leads, tabs and holes: what touches what, and what must not."""

import math
from contextlib import nullcontext
from itertools import combinations

import numpy as np
import pytest

from coneskin.core.errors import GeometryError
from coneskin.geometry.drawing.electrode_layout import ElectrodePlan, lay_out_sheet
from coneskin.geometry.drawing.layer_stack import PAPER_STACK
from coneskin.geometry.drawing.outline import circle_outline
from coneskin.geometry.drawing.surface_shape import ShapeCorner, ShapeTab, draw_shape, drawing_point
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from tests.support.flat_pattern import locate_flat
from tests.support.sweep import sweep

from ..planar import dense, distance, distances, inside
from ..sheet_cases import SHEETS

SIDES = ("end1", "end2", "edge0", "edge1")
#: every sheet at two sides, every side on half of the sheets; a flat disc has no room for tabs between its two edges
CASES = [
    (name, side)
    for sheet, name in enumerate(SHEETS)
    for turn, side in enumerate(SIDES)
    if (sheet + turn) % 2 == 0 and not ("disc" in name and side.startswith("edge"))
]
SLACK = 5e-5  # m; distances between points 0.25 mm apart on facing lines are too large by less than this at 1 mm


def layers(layout):
    """Outline of each conductive sheet with its electrodes, as cut."""
    for sheet, shape, names, index in (("lower", layout.lower, "CD", 1), ("upper", layout.upper, "AB", 3)):
        cone = PAPER_STACK.surface(PlacedFrustum(layout.sheet), index)
        yield sheet, draw_shape(cone, shape), {name: draw_shape(cone, layout.foils[name]) for name in names}, cone


def off_sheet(outline, rim):
    points = dense(outline)
    return points[~inside(points, rim)]


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(
    "widths",
    [
        {},
        {"tab": 0.0},
        {"margin": 3e-3, "electrode": 3e-3, "lead": 3e-3, "hole": 0.0},
        {"margin": 0.015, "electrode": 0.01},
        {"margin": 1e-4, "setback": 1e-4, "electrode": 2e-3, "lead": 2e-3, "clearance": 4e-3, "hole": 0.0},
    ],
)
def test_a_tube_of_the_least_arc_has_room_and_a_narrower_one_has_none_for_wires_at_an_end(side, widths):
    plan = ElectrodePlan(**widths, wires=side)

    def tube(arc):
        return Frustum(arc / 2.6, arc / 2.6, 0.15, 2.6)

    assert lay_out_sheet(tube(1.001 * plan.least_arc), plan).active_share > 0.0
    if side.startswith("end"):
        with pytest.raises(GeometryError, match=r"less than 1 mm active|do not fit"):
            lay_out_sheet(tube(0.98 * plan.least_arc), plan)


@pytest.mark.parametrize(("name", "side"), sweep(CASES, short=4))
@pytest.mark.long
def test_electrodes_of_a_sheet_keep_apart_and_leads_keep_off_their_sheet(name, side):
    layout = lay_out_sheet(SHEETS[name], ElectrodePlan(wires=side))
    for _, outline, foils, cone in layers(layout):
        (one, a), (two, b) = foils.items()
        assert distance(dense(a), dense(b)) >= layout.plan.clearance - SLACK, f"{one} and {two}"
        across = {"end1": "A", "end2": "B", "edge0": "C", "edge1": "D"}[side]
        if across in foils:  # the lead of the far electrode runs beside its sheet, not on it
            far = layout.field
            lead = dense(foils[across])
            span = {"A": (far.u1, far.u2 - 1e-3), "B": (far.u1 + 1e-3, far.u2)}.get(across)
            keep = []
            for point in lead:
                u, phi = locate_flat(cone, *shifted(cone, point))
                if span and span[0] <= u <= span[1]:
                    keep.append(point)
                if across == "C" and far.phi1 <= phi <= far.phi2 - 1e-3 / layout.sheet.radius_at(0.0) * 2:
                    keep.append(point)
                if across == "D" and far.phi1 + 1e-3 / layout.sheet.radius_at(0.0) * 2 <= phi <= far.phi2:
                    keep.append(point)
            points = np.array(keep)
            assert len(points) > 50
            assert not inside(points, outline).any()
        for foil in (a, b):
            on = inside(dense(foil), outline).mean()
            assert on > 0.15, "an electrode lies on its sheet"


def shifted(cone, point):
    """The drawing is turned by half the wrap against the frame of Frustum.flat."""
    turned = 0.5 * cone.wrap * cone.sin_half_angle
    c, s = math.cos(turned), math.sin(turned)
    x, y = point
    if abs(cone.sin_half_angle) < 1e-6:
        return x + 0.5 * cone.wrap * cone.radius_at(y), y
    apex = -cone.radius1 / cone.sin_half_angle
    return c * x + s * (y - apex), apex - s * x + c * (y - apex)


@pytest.mark.parametrize(("name", "side"), sweep(CASES, short=4))
def test_tabs_of_all_four_stick_out_at_the_chosen_side_and_keep_apart(name, side):
    layout = lay_out_sheet(SHEETS[name], ElectrodePlan(wires=side))
    cone = PAPER_STACK.surface(PlacedFrustum(layout.sheet), 3)
    rim = draw_shape(cone, layout.rim)
    tabs = {which: off_sheet(draw_shape(cone, foil), rim) for which, foil in layout.foils.items()}
    for one, two in combinations("ABCD", 2):
        assert distance(tabs[one], tabs[two]) > 1e-3
    u0, u1, half = 0.0, cone.slant, 0.5 * cone.wrap
    edges = {"end1": (u0, None), "end2": (u1, None), "edge0": (None, -half), "edge1": (None, half)}
    for points in tabs.values():
        assert len(points) > 50
        u, phi = edges[side]
        side_points = np.array(
            [
                drawing_point(cone, t * u1 if u is None else u, half + (phi if phi is not None else (2 * t - 1) * half))
                for t in np.linspace(0, 1, 3000)
            ]
        )
        # the foot is on an arc and the tip is straight, so corners of the tip are a little further out
        assert distances(points, side_points).max() == pytest.approx(layout.plan.tab, rel=0.15)


@pytest.mark.parametrize(("name", "side"), sweep(CASES, short=4))
@pytest.mark.long
def test_holes_go_through_every_layer_and_disturb_nothing(name, side):
    layout = lay_out_sheet(SHEETS[name], ElectrodePlan(wires=side))
    assert len(layout.holes) == 3
    for _, outline, foils, cone in layers(layout):
        for u, phi in layout.holes:
            ring = dense(circle_outline(*drawing_point(cone, u, phi), 0.5 * layout.plan.hole), 0.1e-3)
            assert inside(ring, outline).all()
            assert distance(ring, dense(outline)) >= 1e-3 - SLACK
            for foil in foils.values():
                assert not inside(ring, foil).any()
                assert distance(ring, dense(foil)) >= 0.9e-3
    for u, phi in layout.holes:  # in the dead margin of both sheets at once: no current flows there
        assert not layout.field.u1 - layout.plan.electrode < u < layout.field.u2 + layout.plan.electrode
        assert not layout.field.phi1 < phi < layout.field.phi2
    mirrored = {(round(u, 9), round(layout.sheet.wrap - phi, 9)) for u, phi in layout.holes}
    assert mirrored != {(round(u, 9), round(phi, 9)) for u, phi in layout.holes}, "a mirrored layer must not fit"


@pytest.mark.parametrize("name", [name for name in SHEETS if "cylinder" not in name])
def test_edge_electrodes_are_wedges_between_rays(name):
    """Their borders point at the apex, so equipotentials are rays; a strip of constant width would miss it by 6 mm."""
    layout = lay_out_sheet(SHEETS[name])
    cone = PAPER_STACK.surface(PlacedFrustum(layout.sheet), 1)
    apex = complex(0.0, -cone.radius1 / cone.sin_half_angle)
    for which in "CD":
        for phi in (layout.field.phi1, layout.field.phi2):
            near = [
                s
                for s in draw_shape(cone, layout.foils[which]).segments()
                if s.bulge == 0.0
                and s.length > 0.5 * cone.slant
                and abs(locate_flat(cone, *shifted(cone, s.at(0.5)))[1] - phi) < 0.01
            ]
            for segment in near:
                a, b = complex(*segment.start), complex(*segment.end)
                miss = abs(((apex - a) / (b - a)).imag) * abs(b - a)
                assert miss < 1e-9 * abs(apex - a)
                assert miss < layout.plan.electrode / 100


def test_published_wedge():
    """A strip of 5 mm ends at asin(e/r): 2.87 deg at r = 100 and 1.43 deg at r = 200 mm; the wedge at one angle."""
    disc = Frustum(0.100, 0.200, 0.0)
    layout = lay_out_sheet(disc, ElectrodePlan(electrode=5e-3, margin=6e-3))
    wedge = layout.field.phi1 - 6e-3 / 0.1
    assert math.degrees(wedge) == pytest.approx(2.865, abs=1e-3)
    assert math.degrees(math.asin(0.05)) == pytest.approx(2.87, abs=0.005)
    corners = [step for step in layout.foils["D"] if isinstance(step, ShapeCorner)]
    inner = max(step.phi for step in corners)
    assert {step.u for step in corners if step.phi == inner} == {1e-3, 0.099}  # the same ray from end to end


@pytest.mark.parametrize("name", SHEETS)
def test_nothing_is_narrower_than_asked_for(name):
    sheet, plan = SHEETS[name], ElectrodePlan()
    layout = lay_out_sheet(sheet, plan)
    for u in (0.0, sheet.slant):
        rho = sheet.radius_at(u)
        assert rho * layout.field.phi1 >= plan.margin + plan.electrode - 1e-12
        assert rho * (sheet.wrap - layout.field.phi2) >= plan.margin + plan.electrode - 1e-12
    assert layout.field.u1 == pytest.approx(12e-3)
    assert layout.field.u2 == pytest.approx(sheet.slant - 12e-3)


def test_active_area_of_a_cylinder_by_hand():
    """(434 - 24) mm by (2 pi 54 - 24) mm of 434 mm by 2 pi 54 mm."""
    layout = lay_out_sheet(Frustum(0.054, 0.054, 0.434))
    around = 2 * math.pi * 54
    assert layout.active_share == pytest.approx(410 * (around - 24) / (434 * around), rel=1e-12)
    assert layout.active.phi1 == pytest.approx(layout.field.phi1, rel=1e-14)


def test_tabs_of_a_cylinder_by_hand():
    """From edge 0: a setback of 1 mm and half a lead of 4 mm, a clearance of 1.5 mm, A's lead, two clearances, B's."""
    layout = lay_out_sheet(Frustum(0.054, 0.054, 0.434))
    middles = {name: 0.5 * 54 * sum(corner.phi for corner in fold) for name, fold in layout.folds.items()}
    middle_of_c = 2 * math.pi * 54 - 6 - 6 + 0.5 * 6  # margin and half an electrode before edge 1
    assert middles == pytest.approx({"D": 1 + 2, "A": 6.5 + 2, "B": 6.5 + 4 + 1.5 + 1.5 + 2, "C": middle_of_c})


def test_a_wide_lead_costs_active_area_but_not_the_field():
    plan = ElectrodePlan(electrode=6e-3, lead=6e-3, clearance=3e-3)
    layout = lay_out_sheet(Frustum(0.054, 0.054, 0.434), plan)
    assert layout.active.phi1 > layout.field.phi1
    assert layout.active.phi2 == layout.field.phi2


def test_plans_without_tabs_and_holes():
    layout = lay_out_sheet(SHEETS["widening"], ElectrodePlan(tab=0.0, hole=0.0, margin=2e-3))
    assert layout.holes == ()
    assert layout.folds == {}
    assert not any(isinstance(step, ShapeTab) for foil in layout.foils.values() for step in foil)
    for foil in layout.foils.values():
        draw_shape(PAPER_STACK.surface(PlacedFrustum(layout.sheet), 3), foil)


def test_mistakes_are_said():
    small = Frustum(0.010, 0.010, 0.030)
    with pytest.raises(GeometryError, match=r"measures 30 mm from end to end; margins of 12 mm and electrodes of 6 mm"):
        lay_out_sheet(small, ElectrodePlan(margin=12e-3))
    with pytest.raises(GeometryError, match=r"measures 12\.57 mm around the narrow end.*less than 1 mm active"):
        lay_out_sheet(Frustum(0.002, 0.05, 0.1), ElectrodePlan(wires="end2"))
    with pytest.raises(GeometryError, match="cannot reach an apex"):
        lay_out_sheet(Frustum(0.0, 0.05, 0.1))
    with pytest.raises(GeometryError, match=r"margin must be 0 or finite and at least 0\.1 mm, got -1 mm"):
        ElectrodePlan(margin=-1e-3)
    with pytest.raises(GeometryError, match=r"electrode must be finite and at least 0\.1 mm, got nan mm"):
        ElectrodePlan(electrode=math.nan)
    for name in ("electrode", "setback", "lead", "clearance", "margin", "tab", "hole"):  # 1 nm of lead has no outline
        with pytest.raises(GeometryError, match=f"{name} must be .*at least"):
            ElectrodePlan(**{name: 1e-9})
    with pytest.raises(GeometryError, match=r"setback must be at most the margin \(6 mm\), got 7 mm"):
        ElectrodePlan(setback=7e-3)
    with pytest.raises(GeometryError, match="hole must be at most margin - setback - 2 mm = 3 mm, got 4 mm"):
        ElectrodePlan(hole=4e-3)
    with pytest.raises(GeometryError, match=r"lead must be at most the electrode \(6 mm\), got 8 mm"):
        ElectrodePlan(lead=8e-3)
    with pytest.raises(GeometryError, match="wires must leave at one of end1, end2, edge0, edge1, got 'top'"):
        ElectrodePlan(wires="top")
    with pytest.raises(GeometryError, match="tabs of 12 mm at edge0 run into the other edge of the flat pattern, 0 mm"):
        lay_out_sheet(SHEETS["disc"], ElectrodePlan(wires="edge0"))
    with pytest.raises(GeometryError, match="tabs of 55 mm meet at the apex beyond end1"):
        lay_out_sheet(SHEETS["disc"], ElectrodePlan(tab=55e-3))
    with pytest.raises(GeometryError, match="four tabs of 4 mm do not fit on end1"):
        lay_out_sheet(Frustum(0.05, 0.05, 0.2, math.radians(35.0)))


@pytest.mark.parametrize(("height", "active"), [(0.0249, False), (0.0251, True)])
def test_a_millimetre_between_the_electrodes_is_a_sensor_and_less_is_none(height, active):
    """Margins and electrodes of 6 mm on both sides take 24 mm."""
    with nullcontext() if active else pytest.raises(GeometryError, match="leave less than 1 mm active"):
        lay_out_sheet(Frustum(0.05, 0.05, height), ElectrodePlan(setback=1e-3))
