"""Assembly: no body meets another, a cable finds the way that there is, and what has no room is left out."""

import math

import numpy as np
import pytest

from coneskin.core.errors import GeometryError
from coneskin.design.sheets.assembly import _clear_of_each_other, sheet_gap
from coneskin.design.sheets.cable_way import SheetBody
from coneskin.design.sheets.sheet_design import DesignOptions, SheetDesign, cover_seams, design_assembly, design_sheets
from coneskin.geometry.fit.axis_plan import FittedSheet
from coneskin.geometry.fit.cones import LinkFit
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.placed_frustum import PlacedFrustum, double_cone
from coneskin.geometry.pose import Pose

THICKNESS = DesignOptions().stack.thickness


def at(height: float, frustum: Frustum, turn: float = 0.0, tilt: float = 0.0) -> PlacedFrustum:
    return PlacedFrustum(frustum, Pose.from_xyz_rpy((0.0, 0.0, height), (tilt, 0.0, turn)))


def tube(low: float, high: float, radius: float = 0.05) -> Mesh:
    phi = np.linspace(0, 2 * math.pi, 73)[:-1]
    ring = np.stack([radius * np.cos(phi), radius * np.sin(phi)], axis=1)
    corners = np.concatenate([np.column_stack([ring, np.full(72, z)]) for z in np.linspace(low, high, 3)])
    faces = []
    for k in (0, 72):
        for i in range(72):
            j = (i + 1) % 72
            faces += [(k + i, k + j, k + 72 + i), (k + j, k + 72 + j, k + 72 + i)]
    return Mesh(corners, np.array(faces))


def with_block(mesh: Mesh, azimuth: float, half: float, height: float) -> Mesh:
    """The tube with a wall across it, from 0.03 to 0.09 m off its axis."""
    phi = azimuth + np.array([-half, half, half, -half])
    r = np.array([0.03, 0.03, 0.09, 0.09])
    wall = np.column_stack([r * np.cos(phi), r * np.sin(phi), np.full(4, height)])
    n = len(mesh.vertices)
    return Mesh(np.vstack([mesh.vertices, wall]), np.vstack([mesh.faces, [[n, n + 1, n + 2], [n, n + 2, n + 3]]]))


def strands(design: SheetDesign) -> np.ndarray:
    return np.concatenate([design.apron.feet, design.way.body().points])


def assert_apart(designs: tuple[SheetDesign, ...]) -> None:
    """By distances of points alone: neither lattice nor search is asked."""
    for one in designs:
        for two in designs:
            if one is two:
                continue
            u, phi, height = two.place.locate_all(strands(one))
            side = two.place.frustum
            inside = (u > 0) & (u < side.slant) & (height > 0) & (height < two.options.stack.thickness)
            if side.wrap < math.tau - 1e-9:
                inside &= (phi > 0) & (phi < side.wrap)
            assert not inside.any(), f"{one.name} in {two.name}"
            gaps = np.linalg.norm(strands(one)[:, None] - strands(two)[None], axis=2)
            assert gaps.min() > 2e-3


@pytest.mark.parametrize(
    "second",
    [
        at(0.1, Frustum(0.05, 0.05, 0.1)),
        at(0.1, Frustum(0.05, 0.03, 0.1)),
        at(0.1, Frustum(0.05, 0.07, 0.1)),
        at(0.0995, Frustum(0.05, 0.05, 0.1), turn=1.0),  # it overlaps by half a millimeter
        at(0.104, Frustum(0.05, 0.05, 0.1), tilt=0.06),  # about an axis of its own
    ],
)
def test_sheets_that_meet_are_drawn_back_to_the_gap(second: PlacedFrustum) -> None:
    first = at(0.0, Frustum(0.05, 0.05, 0.1))
    one, two = _clear_of_each_other([first, second], THICKNESS, 2e-3)
    apart = SheetBody(one, THICKNESS), SheetBody(two, THICKNESS)
    assert min(sheet_gap(apart[0], apart[1]), sheet_gap(apart[1], apart[0]))[0] == pytest.approx(2e-3, abs=2e-6)
    lost = 0.1 - one.frustum.slant, second.frustum.slant - two.frustum.slant
    assert lost[0] == pytest.approx(lost[1], abs=1e-9)


def test_the_ends_of_sheets_about_axes_across_each_other_are_no_joint() -> None:
    """A corner of one comes within 15 mm of the other's: nothing is to be joined there, and no label says so."""
    tube = Frustum(0.04, 0.04, 0.1)
    across = PlacedFrustum(tube, Pose.from_xyz_rpy((0.0, 0.06, 0.145), (-0.5 * math.pi, 0.0, 0.0)))
    for second, joined in ((across, 0), (at(0.11, tube), 1)):
        for one in design_sheets([at(0.0, tube), second], DesignOptions()):
            assert len(one.joints) == joined
            assert min(one.gaps.values()) < 0.02


def test_sheets_apart_stay_as_they_are() -> None:
    places = [at(0.0, Frustum(0.05, 0.05, 0.1)), at(0.2, Frustum(0.03, 0.03, 0.1))]
    assert _clear_of_each_other(places, THICKNESS, 1e-3) == places


@pytest.mark.long
def test_a_sheet_between_two_others_is_drawn_back_for_its_wires() -> None:
    """Three coaxial sheets 4 mm apart: tabs of 12 mm do not fit between them."""
    places = [at(0.104 * k, Frustum(0.05, 0.05, 0.1)) for k in range(3)]
    designs = design_sheets(places, mesh=tube(-0.1, 0.42))
    assert_apart(designs)
    assert len(designs) == 3
    assert all(design.way.side in ("end1", "end2") for design in designs)
    assert 0.012 < 0.3 - sum(design.place.frustum.slant for design in designs) < 0.03


@pytest.mark.long
@pytest.mark.parametrize("wrap_deg", [150.0, 200.0])
def test_a_sheet_whose_ends_are_taken_is_wired_at_an_edge(wrap_deg: float) -> None:
    places = [at(0.104 * k, Frustum(0.05, 0.05, 0.1, math.radians(wrap_deg))) for k in range(3)]
    designs = design_sheets(places, mesh=tube(-0.1, 0.42))
    assert_apart(designs)
    assert designs[1].way.side in ("edge0", "edge1")
    assert designs[1].place.frustum.slant == pytest.approx(0.1)


def test_a_cable_goes_around_what_stands_in_its_way() -> None:
    place = at(0.0, Frustum(0.05, 0.05, 0.2))
    options = DesignOptions(wires="end2")
    (free,) = design_sheets([place], options, mesh=tube(-0.1, 0.3))
    middle = float(free.way.surface[-1, 1])
    mesh = with_block(tube(-0.1, 0.3), middle, 0.2, 0.222)
    (design,) = design_sheets([place], options, mesh=mesh)
    beyond = design.way.points[design.way.points[:, 2] > 0.222][0]
    off = abs(math.remainder(np.arctan2(beyond[1], beyond[0]) - middle, math.tau))
    assert off > 0.2, "beside the wall, not through it"
    half = 0.5 * design.way.connector_length
    assert design.way.tie_length == min(design.way.lengths, key=lambda gone: abs(gone - half)), "half-way"
    assert design.way.connector_length == pytest.approx(options.connector, abs=6e-3)
    assert abs(math.remainder(float(free.way.surface[-1, 1]) - middle, math.tau)) < 0.2


def test_tabs_are_bent_up_where_the_link_stands_out() -> None:
    mesh = tube(-0.1, 0.3)
    grown = np.array(mesh.vertices)
    grown[:72] *= (3.0, 3.0, 1.0)  # a cone of 27 degrees up to half of the height: it stands out beyond end 1
    (design,) = design_sheets(
        [at(0.1, Frustum(0.05, 0.05, 0.15))], DesignOptions(wires="end1"), mesh=Mesh(grown, mesh.faces)
    )
    assert design.apron.slope > 0.0
    (flat,) = design_sheets([at(0.1, Frustum(0.05, 0.05, 0.15))], DesignOptions(wires="end1"), mesh=mesh)
    assert flat.apron.slope == 0.0


def test_a_sheet_without_room_for_wires_is_left_out_with_the_reason() -> None:
    """A short sheet all around between two flanges, and a long one beside them."""
    mesh = tube(-0.1, 0.35)
    for height in (-0.001, 0.031):
        for azimuth in np.linspace(0, math.tau, 8, endpoint=False):
            mesh = with_block(mesh, float(azimuth), 0.6, height)
    sides = [at(0.0, Frustum(0.05, 0.05, 0.03)), at(0.15, Frustum(0.05, 0.05, 0.1))]
    fitted = tuple(FittedSheet(place, 1e-4, 1e-4, 0.0, 0.0, 0.3, 0.3, 0.0) for place in sides)
    fit = LinkFit(fitted, None, 1e-3, 0.45, 0.1, (), "", 1)
    designs, (said,) = design_assembly(fit, mesh=mesh)
    assert [design.place.frustum.height for design in designs] == [0.1]
    assert designs[0].name == "sheet 1"
    assert said.startswith("no sheet of radii 50.0 and 50.0 mm, height 30.0 mm, wrap 360 deg: at end")
    assert "the link stands out where the tabs leave" in said
    with pytest.raises(GeometryError, match="sheet 1: at end 1 "):
        design_sheets(sides[:1], mesh=mesh)


def test_a_sheet_that_bars_the_wires_of_a_larger_one_is_left_out() -> None:
    """The larger one ends at walls, and the tabs at its edges would lie on the smaller one beside it."""
    mesh = tube(-0.1, 0.2)
    for height in (-0.001, 0.101):
        for azimuth in np.radians(np.arange(-10.0, 215.0, 20.0)):
            mesh = with_block(mesh, float(azimuth), 0.2, height)
    wide = at(0.0, Frustum(0.05, 0.05, 0.1, math.radians(200.0)))
    narrow = at(0.01, Frustum(0.05, 0.05, 0.08, math.radians(155.0)), turn=math.radians(202.5))
    fitted = tuple(FittedSheet(place, 1e-4, 1e-4, 0.0, 0.0, 0.3, 0.3, 0.0) for place in (narrow, wide))
    designs, (said,) = design_assembly(LinkFit(fitted, None, 1e-3, 0.3, 0.1, (), "", 1), mesh=mesh)
    assert [design.place.frustum.height for design in designs] == [0.1]
    assert said == (
        "no sheet of radii 50.0 and 50.0 mm, height 80.0 mm, wrap 155 deg: "
        "other sheets, with more active area, take its room"
    )
    alone, none = design_assembly(LinkFit(fitted[:1], None, 1e-3, 0.3, 0.1, (), "", 1), mesh=mesh)
    assert len(alone) == 1
    assert not none


def test_no_sheet_that_was_found_has_little_active_area() -> None:
    short = FittedSheet(at(0.0, Frustum(0.05, 0.05, 0.0124, math.radians(182))), 1e-4, 1e-4, 0.0, 0.0, 0.1, 0.1, 0.0)
    long = FittedSheet(at(0.1, Frustum(0.05, 0.05, 0.1)), 1e-4, 1e-4, 0.0, 0.0, 0.3, 0.3, 0.0)
    designs, (said,) = design_assembly(LinkFit((long, short), None, 1e-3, 0.4, 0.1, (), "", 1), mesh=tube(-0.1, 0.3))
    assert [design.place.frustum.height for design in designs] == [0.1]
    assert "rims and electrodes would leave less than 40% of it active" in said


def test_a_strip_over_a_seam_and_its_sheet_lead_their_wires_apart() -> None:
    designs = design_sheets(double_cone(0.04, 0.07, 0.04, 0.15, 0.15), DesignOptions(cover_seam=True))
    assert_apart(cover_seams(designs))
