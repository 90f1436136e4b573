"""Sheets for links: bodies of which the answer is known, and the real ones of the shared data."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from coneskin.core.errors import GeometryError, MeshError
from coneskin.geometry.fit.axis_plan import FittedSheet
from coneskin.geometry.fit.cones import LinkFit, find_cones
from coneskin.geometry.frustum import unroll
from coneskin.geometry.mesh import Mesh, load_mesh
from tests.support.paths import SHARED_DATA
from tests.support.sweep import sweep

from ..synthetic import (
    TILTED,
    Floats,
    Indices,
    barrel,
    exploded,
    flipped,
    frustum,
    holed,
    noisy,
    placed,
    revolve,
    rugby,
    shoulder,
)
from ..test_mesh import write_stl
from .shared_fits import cones

DATA = SHARED_DATA
AXIS = np.array(TILTED.rotation)[:, 2]
BASE = np.array(TILTED.translation)


def link(name: str) -> Mesh:
    if not (DATA / name).is_file():
        pytest.skip(f"the link meshes (shared/data/{name}) are not beside the repository")
    return load_mesh(DATA / name)


def axis_of(sheet: FittedSheet) -> Floats:
    return np.asarray(np.array(sheet.placed.link_frustum.rotation)[:, 2])


def off(sheet: FittedSheet) -> tuple[float, float]:
    """Angle of a synthetic body's sheet to the true axis [deg] and distance from it [mm]."""
    gap = np.array(sheet.placed.link_frustum.translation) - BASE
    tilt = math.degrees(math.asin(min(1.0, float(np.linalg.norm(np.cross(axis_of(sheet), AXIS))))))
    return tilt, 1e3 * float(np.linalg.norm(gap - (gap @ AXIS) * AXIS))


def surface_misses(sheet: FittedSheet, body_radius: dict[str, float] | None = None, count: int = 200) -> Floats:
    """Radius of the sheet's points about the true axis minus what the body has there, for a double cone [m]."""
    b = body_radius or {"r1": 0.04, "belt": 0.07, "r2": 0.04, "h1": 0.15, "h2": 0.15}
    rng = np.random.default_rng(1)
    misses = []
    for u, phi in rng.uniform(0.0, 1.0, (count, 2)) * [sheet.frustum.slant, sheet.frustum.wrap]:
        p = np.array(sheet.placed.point(u, phi)) - BASE
        z = float(p @ AXIS)
        rho = float(np.linalg.norm(p - z * AXIS))
        ends = (b["r1"], b["belt"], 0.0, b["h1"]) if z < b["h1"] else (b["belt"], b["r2"], b["h1"], b["h1"] + b["h2"])
        misses.append(rho - np.interp(z, ends[2:], ends[:2]))
    return np.array(misses)


# Rays are cast at 149 azimuths and the corners of 128 facets lie on the body: what is left is their sampling.
@pytest.mark.parametrize(
    ("spoil", "tilt", "shift", "miss"),
    [
        (lambda b: b, 1e-4, 1e-3, 1e-5),
        pytest.param(flipped, 1e-4, 1e-3, 1e-5, marks=pytest.mark.long),
        pytest.param(lambda b: flipped(b, 0.5), 1e-4, 1e-3, 1e-5, marks=pytest.mark.long),
        pytest.param(exploded, 1e-4, 1e-3, 1e-5, marks=pytest.mark.long),
        # 0.2 mm of noise over 3000 corners and a lever of 0.1 m: some 0.01 degrees, some 0.02 mm
        pytest.param(lambda b: noisy(b, 2e-4), 0.03, 0.06, 2e-4, marks=pytest.mark.long),
    ],
    ids=["clean", "flipped", "half-flipped", "exploded", "noisy"],
)
def test_a_rugby_ball_is_two_cones_that_share_the_belt(spoil, tilt: float, shift: float, miss: float) -> None:  # type: ignore[no-untyped-def]
    fit = find_cones(placed(spoil(rugby())))
    one, two = fit.sheets
    assert off(one)[0] < tilt
    assert off(one)[1] < shift
    assert one.frustum.radius2 == pytest.approx(two.frustum.radius1, abs=1e-12)
    end_of_one = one.placed.link_frustum.apply((0.0, 0.0, one.frustum.height))
    assert end_of_one == pytest.approx(two.placed.link_frustum.translation, abs=1e-12)
    assert one.frustum.radius2 == pytest.approx(0.07, abs=miss)
    assert math.degrees(one.frustum.half_angle) == pytest.approx(math.degrees(math.atan(0.2)), abs=0.05)
    assert one.frustum.half_angle * two.frustum.half_angle < 0.0
    for sheet in fit.sheets:
        assert np.abs(surface_misses(sheet)).max() < miss
        assert sheet.max_deviation <= 0.001
        assert sheet.length_share == pytest.approx(0.5, abs=0.01)
    assert fit.nearest is None
    assert fit.reason == ""


@pytest.mark.long
@pytest.mark.parametrize("degrees", sweep([-45.0, 0.0, 3.0, -60.0, -0.65, 0.05], short=3))
def test_one_cone_of_any_half_angle(degrees: float) -> None:
    height = 0.06 if abs(degrees) > 30.0 else 0.2
    grow = height * math.tan(math.radians(abs(degrees)))
    ends = (0.03, 0.03 + grow) if degrees >= 0.0 else (0.03 + grow, 0.03)
    body, said = placed(frustum(*ends, height)), []
    fit = find_cones(body, progress=said.append)
    assert said == ["sampling the hull", "looking for axes", "measuring profiles"]
    assert fit.notes == body.notes
    (sheet,) = fit.sheets
    sign = 1.0 if axis_of(sheet) @ AXIS > 0.0 else -1.0
    assert off(sheet)[0] < 1e-4
    assert off(sheet)[1] < 1e-3
    assert sign * math.degrees(sheet.frustum.half_angle) == pytest.approx(degrees, abs=0.01)
    assert sheet.frustum.height > 0.98 * height  # ends lie half a slice inside
    mean = 0.5 * (sheet.frustum.radius1 + sheet.frustum.radius2)
    assert mean == pytest.approx(0.5 * sum(ends), abs=5e-6)


@pytest.mark.long
def test_a_barrel_keeps_its_axis_and_its_tolerance() -> None:
    fit = cones(placed(barrel()))
    assert len(fit.sheets) == 2
    # design note: two cones on this barrel deviate by 0.5 mm at least; the mean line by 0.8
    assert all(0.0004 < sheet.max_deviation < 0.001 for sheet in fit.sheets)
    assert off(fit.sheets[0])[0] < 0.001
    assert sum(sheet.length_share for sheet in fit.sheets) > 0.99
    tight = cones(placed(barrel()), tolerance=2e-4, max_sheets=3)
    assert len(tight.sheets) == 3
    assert all(sheet.max_deviation <= 2e-4 + 1e-9 for sheet in tight.sheets)


@pytest.mark.long
def test_a_tube_needs_one_sheet_however_many_are_allowed() -> None:
    assert len(cones(placed(frustum(0.05, 0.05, 0.2)), max_sheets=6).sheets) == 1


@pytest.mark.long
def test_bolt_holes_are_bridged_and_said() -> None:
    (sheet,) = cones(placed(holed())).sheets
    assert sheet.frustum.radius1 == pytest.approx(0.05, abs=2e-6)
    assert 0.0005 < sheet.bridged_share < 0.005  # six holes of 6 mm on a tube of 300 mm
    assert sheet.bridged_depth == pytest.approx(0.006, abs=1e-4)
    # a sheet does not span 20 mm: it ends at the ring of holes
    (short,) = cones(placed(holed(width=0.020)), max_sheets=1).sheets
    assert short.length_share < 0.5


@pytest.mark.long
def test_a_shoulder_gets_a_partial_wrap() -> None:
    sheet = cones(placed(shoulder())).sheets[0]
    assert math.degrees(sheet.frustum.wrap) == pytest.approx(230.0, abs=10.0)
    assert sheet.frustum.radius1 == pytest.approx(0.055, abs=2e-5)
    # the other cylinder comes out along x: the wrap begins and ends alike on both sides of it
    x = np.array(TILTED.rotation)[:, 0]
    middle = np.array(sheet.placed.normal(0.5 * sheet.frustum.wrap))
    assert math.degrees(math.acos(float(-middle @ x))) < 5.0
    edges = [float(np.array(sheet.placed.normal(phi)) @ x) for phi in (0.0, sheet.frustum.wrap)]
    assert edges[0] == pytest.approx(edges[1], abs=0.06)


@pytest.mark.long
def test_a_wrap_asked_for_is_kept() -> None:
    for sheet in cones(placed(shoulder()), wrap=math.radians(180.0)).sheets:
        assert math.degrees(sheet.frustum.wrap) == pytest.approx(180.0, abs=2.5)
    full = cones(placed(shoulder()), wrap=2.0 * math.pi)
    assert all(sheet.frustum.wrap == 2.0 * math.pi for sheet in full.sheets)
    assert len(full.sheets) == 2


@pytest.mark.long
def test_the_seam_looks_where_it_is_asked_to() -> None:
    body = placed(frustum(0.05, 0.04, 0.3))
    for seam in ((1.0, 0.0, 0.0), (0.0, -1.0, 0.3)):
        (sheet,) = cones(body, seam_direction=seam).sheets
        out = np.array(sheet.placed.link_frustum.rotate((1.0, 0.0, 0.0)))
        wanted = np.array(seam) - (np.array(seam) @ AXIS) * AXIS
        assert out @ wanted / np.linalg.norm(wanted) == pytest.approx(1.0, abs=1e-9)


def test_millimetre_files_give_the_same_sheet(tmp_path: Path) -> None:
    """A search sees corners and faces alone."""
    body = frustum(0.05, 0.04, 0.3, segments=32)
    metres = load_mesh(write_stl(tmp_path / "m.stl", body))
    millimetres = load_mesh(write_stl(tmp_path / "mm.stl", body, 1000.0))
    assert metres.vertices == pytest.approx(millimetres.vertices, abs=1e-7)
    assert np.array_equal(metres.faces, millimetres.faces)
    assert any("unit mm guessed" in note for note in millimetres.notes)


def box(width: float, depth: float, height: float) -> tuple[Floats, Indices]:
    corners, faces = revolve([(0.0, math.sqrt(0.5)), (height, math.sqrt(0.5))], segments=4)
    c, s = math.cos(math.pi / 4), math.sin(math.pi / 4)
    turned = corners @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return turned * [width, depth, 1.0], faces


@pytest.mark.long
def test_a_box_is_refused_and_the_nearest_thing_shown() -> None:
    fit = cones(placed(box(0.1, 0.12, 0.3)))
    assert fit.sheets == ()
    assert "100 % of the surface lies on the convex hull" in fit.reason
    assert "allow_hull (--set search.allow_hull=true) if this is the visual mesh" in fit.reason
    assert fit.nearest is not None
    assert fit.nearest.max_deviation > 0.005


@pytest.mark.long
def test_a_link_shorter_than_a_sheet_is_told_so() -> None:
    fit = find_cones(placed(frustum(0.005, 0.005, 0.018)))
    assert fit.reason == "the link is 18.0 mm long, but a sheet needs at least 25 mm"
    assert len(cones(placed(frustum(0.005, 0.005, 0.018)), min_length=0.01).sheets) == 1


@pytest.mark.long
def test_a_narrow_wrap_asked_for_on_a_convex_body_is_given() -> None:
    (sheet,) = cones(placed(frustum(0.05, 0.05, 0.3)), wrap=1.0, max_wires=4).sheets
    assert sheet.frustum.wrap == pytest.approx(1.0, abs=0.05)
    assert sheet.frustum.height > 0.29


@pytest.mark.long
def test_a_bent_thing_is_refused_without_blaming_a_hull() -> None:
    corners, faces = noisy(revolve([(0.001 * k, 0.03 + 0.01 * (k % 20 > 9)) for k in range(0, 200, 5)]), 0.0)
    corners = corners * [1.0, 1.5, 1.0]
    fit = find_cones(placed((corners, faces)))
    assert fit.sheets == ()
    assert fit.reason == "no cone fits within 3.4 mm over a length of 25 mm"  # steps all over it count as roughness
    assert any("rough by 1.2 mm" in note for note in fit.notes)


@pytest.mark.long
def test_the_slow_rays_give_the_same_sheets(monkeypatch: pytest.MonkeyPatch) -> None:
    body = placed(frustum(0.05, 0.04, 0.3, segments=32))
    fast = find_cones(body)
    monkeypatch.setitem(body.__dict__, "embree_intersector", None)
    slow = find_cones(body)
    assert slow.sheets[0].frustum.radius1 == pytest.approx(fast.sheets[0].frustum.radius1, abs=1e-6)


def clashes(one: FittedSheet, two: FittedSheet, thickness: float) -> int:
    """Number of points of one sheet's space, of a thickness [m], that lie in the space of another."""
    f = one.frustum
    u, phi, height = (
        part.ravel()
        for part in np.meshgrid(
            np.linspace(0.0, f.slant, 60),
            np.linspace(0.0, f.wrap, 120),
            np.linspace(0.0, thickness, 7),
        )
    )
    points, normals = one.placed.place(u, phi)
    at, around, above = two.placed.locate_all(points + height[:, None] * normals)
    inside = (at > 0.0) & (at < two.frustum.slant) & (above > 0.0) & (above < thickness)
    return int((inside & (around > 0.0) & (around < two.frustum.wrap)).sum())


@pytest.mark.long
def test_two_crossing_tubes_get_sheets_about_both_axes_that_keep_clear() -> None:
    fit = cones(placed(shoulder()))
    one, two = fit.sheets
    assert (one.axis, two.axis) == (0, 1)
    assert two.frustum.wrap == 2.0 * math.pi
    assert two.frustum.radius1 == pytest.approx(0.05, abs=2e-5)
    assert sum(sheet.area_share for sheet in fit.sheets) > 0.57
    assert clashes(one, two, 0.0062) == clashes(two, one, 0.0062) == 0


@pytest.mark.long
def test_the_thickness_of_the_sheets_keeps_them_apart_in_a_corner() -> None:
    one, two = cones(placed(shoulder()), wrap=2.0 * math.pi).sheets
    assert clashes(one, two, 0.0062) == clashes(two, one, 0.0062) == 0
    # flat sheets would meet in the corner, and thick ones made for their places run into each other
    flat = cones(placed(shoulder()), wrap=2.0 * math.pi, thickness=0.0, gap=0.0).sheets
    assert sum(sheet.frustum.height for sheet in flat) > one.frustum.height + two.frustum.height + 0.005
    assert clashes(flat[0], flat[1], 0.0062) > 0


@pytest.mark.long
def test_two_partial_wraps_share_a_tube() -> None:
    """Sheets of 150 degrees on two sides of one tube: neither lies on the other."""
    one, two = cones(placed(frustum(0.05, 0.05, 0.2)), wrap=math.radians(150.0)).sheets
    for sheet in (one, two):  # about the one line, however many axes along it were found
        assert off(sheet)[0] < 0.01
        assert off(sheet)[1] < 0.01
    assert clashes(one, two, 0.006) == clashes(two, one, 0.006) == 0


@pytest.mark.long
def test_a_looser_tolerance_is_never_worse() -> None:
    mesh = placed(noisy(shoulder(), 1e-4))
    areas = [
        sum(sheet.frustum.area for sheet in cones(mesh, tolerance=tolerance).sheets)
        for tolerance in (5e-4, 1e-3, 1.4e-3, 3e-3)
    ]
    # a slice of 512 is 0.2 %, and a sheet more or less may be worth 5 % of the hull
    assert all(b > 0.99 * a for a, b in itertools.pairwise(areas))


@pytest.mark.long
def test_what_is_advised_works_when_followed() -> None:
    mesh = placed(revolve([(0.0, 0.04), (0.05, 0.06), (0.1, 0.04)], segments=9))
    fit = cones(mesh)
    assert fit.sheets == ()
    assert cones(mesh, tolerance=float(f"{1e3 * fit.needed_tolerance:.2f}") * 1e-3).sheets


@pytest.mark.long
def test_a_cone_is_covered_up_to_the_smallest_radius_and_not_to_its_apex() -> None:
    body = placed(revolve([(0.0, 0.001), (0.15, 0.06)], segments=96, rings=30))
    (sheet,) = cones(body, min_radius=0.009).sheets
    assert min(sheet.frustum.radius1, sheet.frustum.radius2) == pytest.approx(0.009, abs=2e-4)
    assert max(sheet.frustum.radius1, sheet.frustum.radius2) == pytest.approx(0.06, abs=5e-4)


@pytest.mark.long
def test_a_cone_is_covered_up_to_where_its_electrodes_find_room() -> None:
    body = placed(revolve([(0.0, 0.001), (0.15, 0.06)], segments=96, rings=30))
    (sheet,) = cones(body, min_arc=0.1).sheets
    narrow = min(sheet.frustum.radius1, sheet.frustum.radius2)
    assert 0.1 <= narrow * sheet.frustum.wrap <= 0.1 + 2.0 * math.pi * 1.3e-3  # a fit may lie a tolerance inside
    assert max(sheet.frustum.radius1, sheet.frustum.radius2) == pytest.approx(0.06, abs=5e-4)


@pytest.mark.long
def test_wires_are_four_for_each_sheet() -> None:
    assert len(cones(placed(shoulder()), max_wires=7).sheets) == 1
    assert len(cones(placed(shoulder()), max_wires=8).sheets) == 2


@pytest.mark.long
def test_a_shallow_dent_counts_as_a_deviation_and_a_deep_one_as_a_hole() -> None:
    """A dent less deep than the tolerance is no hole: the sheet stands off from it, and says by how much."""
    (shallow,) = cones(placed(holed(depth=8e-4)), max_sheets=1).sheets
    assert shallow.bridged_share == 0.0
    assert shallow.max_deviation == pytest.approx(8e-4, abs=5e-5)


@pytest.mark.parametrize(
    ("rule", "words"),
    [
        ({"tolerance": 0.0}, "tolerance must be above 0 mm, got 0 mm"),
        ({"min_length": math.nan}, "min_length must be above 0 mm, got nan mm"),
        ({"max_bridge": -1.0}, "max_bridge must be above 0 mm, got -1000 mm"),
        ({"min_radius": 0.0}, "min_radius must be above 0 mm, got 0 mm"),
        ({"min_arc": -1e-3}, "min_arc must be finite and not negative, got -1 mm"),
        ({"thickness": -1e-3}, "thickness must be finite and not negative, got -1 mm"),
        ({"max_wires": 3}, "max_wires must be a whole number from 4 to 400, got 3"),
        ({"max_sheets": 0}, "max_sheets must be a whole number from 1 to 100, got 0"),
        ({"wrap": 7.0}, "wrap must be above 0 and at most a full turn of 360 deg, got 401.07 deg"),
        ({"min_wrap": 0.0}, "min_wrap must be above 0 and at most a full turn"),
    ],
)
def test_rules_out_of_range(rule: dict[str, float], words: str) -> None:
    with pytest.raises(GeometryError, match=words):
        find_cones(placed(frustum(0.05, 0.04, 0.3)), **rule)  # type: ignore[arg-type]


# ---- real links ----


@pytest.mark.long
def test_ur10_upper_arm() -> None:
    fit = cones(link("ur/ur10/collision/upperarm.stl"))
    sheet = fit.sheets[0]
    assert 0.5 * (sheet.frustum.radius1 + sheet.frustum.radius2) == pytest.approx(0.054, abs=3e-6)
    assert math.degrees(math.acos(min(1.0, axis_of(sheet)[2]))) < 0.05
    assert sheet.placed.link_frustum.translation[:2] == pytest.approx((0.0, -0.045), abs=1e-5)
    assert sheet.frustum.height >= 0.425
    assert abs(math.degrees(sheet.frustum.half_angle)) < 0.002
    assert sheet.max_deviation <= 0.001
    assert sheet.facet_rise == pytest.approx(2.0 / 3.0 * 0.054 * (1.0 - math.cos(math.pi / 72)), rel=0.03)
    assert fit.link_length == pytest.approx(0.7488, abs=1e-4)
    # the housing of the joint is 150 mm across, and open on the side of the tube
    other = fit.sheets[1]
    assert other.axis == 1
    assert 1e3 * other.frustum.radius1 == pytest.approx(75.0, abs=0.5)
    assert math.degrees(other.frustum.wrap) == pytest.approx(200.0, abs=10.0)
    assert abs(axis_of(other)[2]) < 0.01


# radius, length [mm] at least: the table of design/geometry.md, less 2 mm that its 2..98 percentiles may add
@pytest.mark.long
@pytest.mark.parametrize(("name", "radius", "length"), [("upperarm", 42.65, 234.0), ("forearm", 37.5, 259.0)])
def test_ur5e_links_from_exploded_collada(name: str, radius: float, length: float) -> None:
    fit = cones(link(f"ur/ur5e/visual/{name}.dae"), max_sheets=1)
    sheet = fit.sheets[0]
    assert 0.5e3 * (sheet.frustum.radius1 + sheet.frustum.radius2) == pytest.approx(radius, abs=0.2)
    assert 1e3 * sheet.frustum.height >= length
    assert math.degrees(math.acos(min(1.0, axis_of(sheet)[2]))) < 0.1
    assert sheet.max_deviation <= 0.001
    assert any("welded" in note for note in fit.notes)
    if name == "forearm":  # it narrows
        assert -0.10 < math.degrees(sheet.frustum.half_angle) < -0.04
        assert unroll(sheet.frustum).r1 > unroll(sheet.frustum).r2


@pytest.mark.long
def test_hull_like_forearm_is_refused_with_the_reason() -> None:
    fit: LinkFit = cones(link("ur/ur5e/collision/forearm.stl"))
    assert fit.sheets == ()
    assert "convex hull" in fit.reason
    assert "visual mesh" in fit.reason
    assert fit.nearest is not None
    assert fit.nearest.max_deviation > 0.001  # what is permitted


@pytest.mark.long
def test_uf850_link4_is_a_true_cone() -> None:
    sheet = cones(link("xarm/uf850_link4.stl"), max_sheets=1).sheets[0]
    assert abs(math.degrees(sheet.frustum.half_angle)) == pytest.approx(0.65, abs=0.06)
    radii = sorted((1e3 * sheet.frustum.radius1, 1e3 * sheet.frustum.radius2))
    assert radii == pytest.approx([43.9, 45.0], abs=0.15)
    assert 1e3 * sheet.frustum.height == pytest.approx(101.0, abs=1.5)
    assert sheet.max_deviation <= 0.001


def test_what_is_no_mesh_and_no_option_is_refused_with_what_to_do() -> None:
    with pytest.raises(MeshError, match=r"must be a Mesh, got 'x.stl' of the type str: read a file first"):
        find_cones("x.stl")  # type: ignore[arg-type]
    with pytest.raises(
        GeometryError, match=r"tolerence is no option of the search for sheets; did you mean tolerance\?"
    ):
        find_cones(placed(box(0.1, 0.12, 0.3)), tolerence=0.002)
