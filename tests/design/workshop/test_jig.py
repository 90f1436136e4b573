"""Jig: closed printable parts that keep clear of link and sheet, reach the datum, and come off without an undercut."""

import io
import itertools
import math

import numpy as np
import pytest
import trimesh

from coneskin.core.errors import GeometryError
from coneskin.design.sheets.sheet_design import DesignOptions, JigPlan, SheetDesign, design_sheets
from coneskin.design.workshop.build_figures import measure_build
from coneskin.design.workshop.jig import Collar, _CollarPart, _LinkExcess, _lip_play, jig_collars
from coneskin.design.workshop.placement import find_placement
from coneskin.geometry.drawing.surface_shape import ShapeTab
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.mesh import Mesh, make_mesh
from coneskin.geometry.placed_frustum import PlacedFrustum, double_cone
from coneskin.geometry.pose import Pose
from coneskin.geometry.solid import to_stl

POSE = Pose.from_xyz_rpy((0.1, 0.2, 0.3), (0.4, 0.5, 0.6))


def sheet(frustum: Frustum, pose: Pose | None = None, **options: object) -> SheetDesign:
    (design,) = design_sheets([PlacedFrustum(frustum, pose or Pose())], DesignOptions(**options))  # type: ignore[arg-type]
    return design


def read_back(part: _CollarPart) -> trimesh.Trimesh:
    """The part as a printing program reads it: from the bytes of its STL file, in millimetres."""
    return trimesh.load(io.BytesIO(to_stl(part.surface, "test")), file_type="stl")


def in_part_frame(design: SheetDesign, collar: Collar, points: np.ndarray) -> np.ndarray:
    """Points of the link's frame [m] where the part stands on the printer: axis z, sleeve down."""
    side, plan = design.place.frustum, design.options.jig
    lift = design.options.stack.thickness * side.sin_half_angle
    sign = -1.0 if collar.end == 1 else 1.0
    step = (min(0.0, -lift) if collar.end == 1 else side.height + max(0.0, -lift)) + sign * plan.clearance
    x, y, z = design.place.link_frustum.inverse().apply_all(points).T
    return np.column_stack([x, sign * y, sign * (z - step) + plan.reach])


def tube(bump: float | None = None, top: float = 0.08) -> Mesh:
    """A tube of 50 mm about z from -0.03 to 0.25; beyond 0.207 a block of 40 deg stands out at an azimuth."""
    phi = np.linspace(0, 2 * math.pi, 361)[:-1]
    z = np.array([-0.03, 0.0, 0.1, 0.2069, 0.207, 0.25])
    radius = np.full((6, 360), 0.05)
    if bump is not None:
        radius[4:, np.abs((phi - bump + math.pi) % (2 * math.pi) - math.pi) < math.radians(20)] = top
    corners = np.stack([radius * np.cos(phi), radius * np.sin(phi), z[:, None] + 0.0 * phi], axis=-1)
    index = np.arange(6 * 360).reshape(6, 360)
    a, b = index[:-1], np.roll(index, -1, axis=1)[:-1]
    d, c = index[1:], np.roll(index, -1, axis=1)[1:]
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    return make_mesh(corners.reshape(-1, 3), faces)


@pytest.mark.parametrize(
    "frustum",
    [
        Frustum(0.054, 0.054, 0.2),
        Frustum(0.04, 0.07, 0.15, math.radians(270)),
        Frustum(0.07, 0.03, 0.1, math.radians(160)),
        Frustum(0.05, 0.048, 0.03),
    ],
)
@pytest.mark.parametrize("parts", [2, 3])
@pytest.mark.long
def test_every_part_is_a_watertight_solid(frustum: Frustum, parts: int) -> None:
    design = sheet(frustum, jig=JigPlan(parts=parts, reach=0.01))
    collars, without = jig_collars(design)
    assert [collar.end for collar in collars] == [1, 2]
    assert without == ()
    for collar in collars:
        for part in collar.parts:
            solid = read_back(part)
            assert solid.is_watertight
            assert solid.is_winding_consistent
            assert solid.body_count == 1
            assert solid.volume == pytest.approx(1e9 * part.surface.volume, rel=1e-4)
            assert solid.extents == pytest.approx(1e3 * np.array(part.surface.extents), abs=1e-3)
        assert len(collar.parts) == (1 if frustum.wrap < math.pi else parts)


@pytest.mark.parametrize("frustum", [Frustum(0.05, 0.05, 0.2), Frustum(0.04, 0.06, 0.15)])
def test_the_gap_to_cone_and_sheet_is_the_clearance(frustum: Frustum) -> None:
    """Measured square to both, on the printed facets; on a cone radially, so by 1 / cos more than the normal."""
    design = sheet(frustum, jig=JigPlan(clearance=0.5e-3))
    side, stack = design.place.frustum, design.options.stack
    for collar in jig_collars(design)[0]:
        for part in collar.parts:
            x, y, z = part.surface.vertices.T
            reach = design.options.jig.reach
            z = (z - reach) * (-1 if collar.end == 1 else 1)
            step = in_part_frame(design, collar, np.zeros((1, 3)))[0, 2] - reach
            height = z - step if collar.end == 2 else z + step
            slope = (side.radius2 - side.radius1) / side.height
            gap = (np.hypot(x, y) - side.radius1 - slope * height) * side.cos_half_angle
            inside = part.surface.vertices[:, 2] > reach + 1e-6
            assert gap[inside].min() == pytest.approx(0.5e-3 * side.cos_half_angle, abs=2e-6)
            assert gap[~inside].min() > 0.0
            sleeve = gap[part.surface.vertices[:, 2] < reach - 1e-6]
            assert sleeve.min() == pytest.approx(stack.thickness + 0.5e-3 * side.cos_half_angle, abs=2e-6)


@pytest.mark.long
def test_the_lip_ends_at_the_datum_and_clear_of_what_stands_out() -> None:
    mesh = tube(bump=1.0)
    design = sheet(Frustum(0.05, 0.05, 0.2), POSE)
    one, two = jig_collars(design, mesh.moved(POSE))[0]
    assert one.flush
    assert one.before == pytest.approx(0.0, abs=1e-9)
    assert one.lip == pytest.approx(0.03 - design.options.jig.clearance)
    assert two.stopped
    assert one.play is None
    assert two.play is not None, "the block fixes its azimuth"
    assert math.radians(2.0) <= two.play <= math.radians(8.0)
    points = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).sample(20000, seed=1)
    for collar in (one, two):
        local = in_part_frame(design, collar, POSE.apply_all(points))
        for part in collar.parts:
            solid = trimesh.Trimesh(part.surface.vertices, part.surface.faces, process=False)
            assert solid.is_volume
            assert not solid.contains(local).any(), "no point of the link is in the plastic"


def ridged_tube(along: bool) -> tuple[Mesh, np.ndarray]:
    """A tube of 50 mm with a sharp ridge of 2 mm, narrower than any grid of rays, along it or around; and the ridge."""
    fine = np.radians([80.2, 80.35, 80.5])  # between two columns of a jig
    phi = np.concatenate([np.arange(0.0, 360.0, 5.0), np.degrees(fine)])
    phi = np.radians(np.sort(phi))
    z = np.array([-0.03, 0.0, 0.2, 0.2051, 0.2053, 0.2055, 0.25])
    radius = np.full((len(z), len(phi)), 0.05 / math.cos(math.radians(2.5)))
    ridge = np.isclose(phi, fine[1])
    if along:
        radius[:, ridge] += 2e-3
    else:
        radius[4] += 2e-3
    corners = np.stack([radius * np.cos(phi), radius * np.sin(phi), z[:, None] + 0.0 * phi], axis=-1)
    index = np.arange(corners.size // 3).reshape(radius.shape)
    a, b = index[:-1], np.roll(index, -1, axis=1)[:-1]
    d, c = index[1:], np.roll(index, -1, axis=1)[1:]
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    top = corners[-2:, ridge] if along else corners[4]
    share = np.linspace(0.0, 1.0, 60)[:, None]
    ends = top.reshape(-1, 3)
    line = np.concatenate([(1.0 - share) * p + share * q for p, q in itertools.pairwise(ends)])
    return make_mesh(corners.reshape(-1, 3), faces), line[(line[:, 2] > 0.2005) & (line[:, 2] < 0.214)]


@pytest.mark.parametrize("along", [True, False])
@pytest.mark.long
def test_a_ridge_between_the_rays_keeps_its_clearance(along: bool) -> None:
    mesh, ridge = ridged_tube(along)
    design = sheet(Frustum(0.0502, 0.0502, 0.2))
    (two,) = [collar for collar in jig_collars(design, mesh)[0] if collar.end == 2]
    away = ridge * [1.0, 1.0, 0.0] / np.hypot(ridge[:, 0], ridge[:, 1])[:, None]
    solids = [trimesh.Trimesh(part.surface.vertices, part.surface.faces, process=False) for part in two.parts]
    azimuth = np.arctan2(ridge[:, 1], ridge[:, 0])
    covered = np.abs(np.sin(azimuth)) > 0.1  # not in the slots between the parts
    for lift, inside in ((0.0, False), (0.28e-3, False), (0.29e-3 + 2e-3, True)):
        local = in_part_frame(design, two, ridge + lift * away)
        hit = np.any([solid.contains(local) for solid in solids], axis=0)
        assert (hit[covered] == inside).all(), f"{1e3 * lift:.2f} mm above the ridge"


def test_a_part_is_whole_where_a_block_begins_at_the_sheet_and_leaves_no_lip() -> None:
    """The block is 0.2 mm from the sheet's end, less than the step is; beside it the lip is whole."""
    mesh = tube(bump=1.0)
    design = sheet(Frustum(0.05, 0.05, 0.2068))
    (two,) = [collar for collar in jig_collars(design, mesh)[0] if collar.end == 2]
    assert two.play is not None
    block = np.array([[0.06 * math.cos(a), 0.06 * math.sin(a), 0.20705] for a in np.linspace(0.7, 1.3, 20)])
    for part in two.parts:
        solid = trimesh.Trimesh(part.surface.vertices, part.surface.faces, process=False)
        assert solid.is_volume
        assert not solid.contains(in_part_frame(design, two, block)).any()


@pytest.mark.parametrize("way", [-1.0, 1.0])
@pytest.mark.long
def test_a_collar_turned_by_more_than_its_play_meets_what_stands_out(way: float) -> None:
    mesh = tube(bump=1.0)
    design = sheet(Frustum(0.05, 0.05, 0.2))
    (two,) = [collar for collar in jig_collars(design, mesh)[0] if collar.end == 2]
    assert two.play is not None
    fine = np.linspace(1.0 - math.radians(20), 1.0 + math.radians(20), 200)
    points = np.array([[r * math.cos(a), r * math.sin(a), 0.2071] for r in (0.0535, 0.055, 0.057) for a in fine])
    for turn, meets in ((0.0, False), (way * two.play, True)):
        pose = Pose.from_xyz_rpy((0.0, 0.0, 0.0), (0.0, 0.0, turn))
        local = in_part_frame(design, two, pose.apply_all(points))
        solids = [trimesh.Trimesh(part.surface.vertices, part.surface.faces, process=False) for part in two.parts]
        assert any(solid.contains(local).any() for solid in solids) == meets


def test_facets_of_a_mesh_do_not_show_where_a_collar_belongs() -> None:
    """A tube of twelve facets of 1.7 mm; the collar would fit at twelve azimuths, and the link is round."""
    phi = np.linspace(0.0, 2.0 * math.pi, 13)[:-1]
    ends = [np.stack([0.05 * np.cos(phi), 0.05 * np.sin(phi), np.full(12, z)], axis=1) for z in (-0.03, 0.25)]
    faces = [f for k in range(12) for f in ((k, (k + 1) % 12, 12 + k), ((k + 1) % 12, 12 + (k + 1) % 12, 12 + k))]
    body = make_mesh(np.concatenate(ends), np.array(faces))
    side, turned = Frustum(0.05, 0.05, 0.2), np.linspace(0.2, 3.0, 161)
    link = _LinkExcess(side, 0.2, 1.0, 0.04, body, Pose())
    lips = [(turned, np.full(161, 0.015), np.zeros(161, bool))]
    facets = 0.05 * (1.0 - math.cos(math.pi / 12.0))
    assert _lip_play(link, lips, 0.015, 0.3e-3) is not None
    assert _lip_play(link, lips, 0.015, 0.3e-3, facets) is None


@pytest.mark.long
@pytest.mark.parametrize(
    ("room", "said"),
    [
        (0.4, "end 1 lies where the link ends"),
        (0.7, "end 1 lies 0.7 mm before the outermost place of the link"),
        (4.2, "end 1 lies 4.2 mm before the outermost place of the link"),
        (4.4, "flush"),
        (40.2, "flush"),
        (40.4, ""),
    ],
)
def test_a_lip_holds_from_4_mm_on_and_is_flush_up_to_40(room: float, said: str) -> None:
    """Less the clearance of 0.3 mm."""
    design = sheet(Frustum(0.05, 0.05, 0.1), Pose(translation=(0.0, 0.0, -0.03 + 1e-3 * room)))
    (collar, *_), without = jig_collars(design, tube())
    if room < 4.3:
        assert collar.end == 2
        assert without[0].startswith(said)
    else:
        assert (collar.end, collar.flush) == (1, said == "flush")


@pytest.mark.long
@pytest.mark.parametrize(("rise", "stopped"), [(7.9e-3, False), (8.1e-3, True)])
def test_what_stands_out_by_more_than_8_mm_is_not_gripped(rise: float, stopped: bool) -> None:
    collars, _ = jig_collars(sheet(Frustum(0.05, 0.05, 0.2)), tube(bump=1.0, top=0.05 + rise))
    assert collars[1].stopped is stopped


def test_printed_sizes_are_those_of_the_workshop() -> None:
    """Clearance 0.3, wall 3, slots of 4, rims of 2 x 1.5 beside a strap, notches of 1, 8 mm above tabs: all in mm."""
    design = sheet(Frustum(0.05, 0.05, 0.2), wires="end1")
    one, two = jig_collars(design)[0]
    outside = 0.05 + design.options.stack.thickness
    for collar in (one, two):
        first, second = collar.parts
        assert second.start - first.end == pytest.approx(4e-3 / outside)
    x, y, z = 1e3 * two.parts[0].surface.vertices.T
    lip, sleeve, seat, rim = 50.3, 56.3, 59.3, 60.8
    assert {*np.round(np.hypot(x, y), 3)} == {lip, lip + 3.0, lip + 2.0, sleeve, seat, rim, seat - 1.0, rim - 1.0}
    assert {0.0, 2.0, 18.0, 20.0, 35.0} <= {*np.round(z, 3)}, "rims of the strap's seat, the step, and the lip of 15"
    x, y = np.concatenate([part.surface.vertices[:, :2] for part in one.parts]).T
    above = np.isclose(np.hypot(x, y), 0.058)
    azimuths = np.degrees(np.arctan2(-y[above], x[above]))  # turned over
    tabs = [
        math.degrees(math.remainder(step.phi, math.tau))
        for foil in design.layout.foils.values()
        for step in foil
        if isinstance(step, ShapeTab)
    ]
    room = math.degrees((0.5 * design.layout.plan.lead + 3e-3) / 0.05)
    assert (azimuths.min(), azimuths.max()) == pytest.approx((min(tabs) - room, max(tabs) + room), abs=1.0)


def test_no_part_has_an_undercut() -> None:
    """Pulled off away from the link along its middle, a part never meets the link."""
    design = sheet(Frustum(0.05, 0.05, 0.2))
    bumpy = tube(bump=0.6)
    for collar in jig_collars(design, bumpy)[0]:
        for part in collar.parts:
            away = np.arctan2(part.surface.vertices[:, 1], part.surface.vertices[:, 0])
            middle = 0.5 * (part.start + part.end) * (-1 if collar.end == 1 else 1)
            off = (away - middle + math.pi) % (2 * math.pi) - math.pi
            assert np.abs(off).max() < 0.5 * math.pi, "each part spans less than half a turn"
    from coneskin.geometry.solid import without_undercut

    phi = np.linspace(-1.5, 1.5, 61)
    bump = np.where(np.abs(phi - 0.5) < 0.2, 1.5, 1.0)[None]
    opened = without_undercut(bump, phi)[0]
    assert (opened >= bump[0]).all()
    width = opened * np.abs(np.sin(phi))
    assert (np.diff(width[phi >= 0.0]) >= -1e-12).all()
    assert (np.diff(width[phi <= 0.0]) <= 1e-12).all()


def test_sheets_that_meet_have_collars_at_their_free_ends_only() -> None:
    one, two = design_sheets(double_cone(0.04, 0.07, 0.04, 0.15, 0.15))
    first, said = jig_collars(one, None, (), (one, two))
    assert [collar.end for collar in first] == [1]
    assert "at end 2 it meets the sheet beside it" in said[0]
    second, said = jig_collars(two, None, (one,), (one, two))
    assert [collar.end for collar in second] == [2]
    assert "at end 1 it meets the sheet beside it" in said[0]


def test_a_link_that_ends_with_its_sheet_has_no_lip() -> None:
    design = sheet(Frustum(0.05, 0.05, 0.279), Pose(translation=(0.0, 0.0, -0.03)))
    collars, said = jig_collars(design, tube())
    assert collars == ()
    assert "end 1 lies where the link ends: keep the sheet flush with its rim" in said


def test_an_end_too_near_to_the_rim_for_a_lip_is_as_far_from_it_as_its_place_says() -> None:
    design = sheet(Frustum(0.05, 0.05, 0.2716), Pose(translation=(0.0, 0.0, -0.0258)))
    collars, said = jig_collars(design, tube())
    place = find_placement(design.place, tube())
    assert collars == ()
    assert place.before is not None
    assert place.beyond is not None
    assert "flush" not in "".join(said)
    assert f"end 1 lies {1e3 * place.before:.1f} mm before the outermost place of the link" in said[0]
    assert f"end 2 lies {1e3 * place.beyond:.1f} mm before the outermost place of the link" in said[1]


@pytest.mark.parametrize("height", [0.0, 0.02])
def test_a_disc_has_nothing_to_grip(height: float) -> None:
    collars, said = jig_collars(sheet(Frustum(0.06, 0.16, height)))
    assert collars == ()
    assert "sheet 1 is too flat for collars" in said[0]


def test_no_jig_and_wrong_dimensions() -> None:
    assert jig_collars(sheet(Frustum(0.05, 0.05, 0.2), jig=JigPlan("none"))) == ((), ())
    with pytest.raises(GeometryError, match=r"wall of the jig must be 1\.5 to 20 mm, got 1 mm"):
        JigPlan(wall=1e-3)
    with pytest.raises(GeometryError, match="split into 2 to 8 parts, got 1"):
        JigPlan(parts=1)


def test_the_file_of_the_design_names_the_parts() -> None:
    design = sheet(Frustum(0.05, 0.05, 0.2))
    data = measure_build(design, 0).as_data(design)["jig"]
    assert [part["file"] for part in data[0]["parts"]] == ["jig/end-1-part-1.stl", "jig/end-1-part-2.stl"]
    assert all(part["volume_cm3"] > 5.0 for collar in data for part in collar["parts"])
