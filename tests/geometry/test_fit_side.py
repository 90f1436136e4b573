"""The side of a sheet, the corners above the flats, the centres of slices, and what is said of the rest."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.geometry.fit_centre import centred
from coneskin.geometry.fit_cone import Cone
from coneskin.geometry.fit_hull import bare_lengths, hull_note
from coneskin.geometry.fit_profile import AxisFrame, Profile, outer_profile
from coneskin.geometry.fit_samples import surface_samples
from coneskin.geometry.fit_side import Side, facet_offset, fit_side, under
from coneskin.geometry.mesh import make_mesh
from coneskin.geometry.rays import Rays

from .synthetic import Floats, Indices, barrel, flipped, frustum, joined, revolve, rugby

Z = np.array([0.0, 0.0, 1.0])
FRAME = AxisFrame.along(np.zeros(3), Z)


def profile_of(radius: Floats, around: int = 31) -> Profile:
    """A profile whose slices are 1 mm apart and round."""
    grid = np.repeat(radius[:, None], around, axis=1)
    z = np.asarray(0.001 * np.arange(len(radius)), float)
    return Profile(FRAME, z, np.linspace(0.0, 2.0 * math.pi, around, endpoint=False), grid, grid.copy())


def test_fillets_at_the_ends_do_not_bend_the_side() -> None:
    z = np.arange(100)
    radius = 0.05 + 1e-4 * np.maximum(0, z - 90)  # up to 0.9 mm more at one end
    side = fit_side(profile_of(radius), 0, 100, 0, 31, 0.001)
    assert (side.first, side.end) == (0, 100)
    assert side.radius == pytest.approx(0.05, abs=1e-6)
    assert side.slope == pytest.approx(0.0, abs=2e-5)


def test_a_tube_is_not_tilted_to_reach_into_its_fillet() -> None:
    """A tilted side might hold over more of it; the tube is straight, so the last slices are given up."""
    radius = 0.05 + 2e-4 * np.maximum(0, np.arange(100) - 87)
    profile = profile_of(radius)
    side = fit_side(profile, 0, 100, 0, 31, 0.001)
    assert (side.first, side.end) == (0, 93)
    assert side.slope == pytest.approx(0.0, abs=2e-5)


def test_a_side_is_cut_to_where_it_holds() -> None:
    radius = 0.05 + 1e-3 * np.maximum(0, np.arange(100) - 97)
    side = fit_side(profile_of(radius), 0, 100, 0, 31, 0.0015)
    assert (side.first, side.end) == (0, 99)


def test_a_barrel_takes_the_line_of_least_deviation() -> None:
    z = np.linspace(-1.0, 1.0, 101)
    side = fit_side(profile_of(0.05 + 0.0019 * (1.0 - z**2)), 0, 101, 0, 31, 0.001)
    assert (side.first, side.end) == (0, 101)
    assert side.radius == pytest.approx(0.05095, abs=1e-9)
    assert side.rise == 0.0


def test_a_hole_does_not_pull() -> None:
    profile = profile_of(np.full(60, 0.05))
    profile.radius[20:30, 3:6] = 0.044
    side = fit_side(profile, 0, 60, 0, 31, 0.001)
    assert side.radius == pytest.approx(0.05, abs=1e-9)
    assert (side.first, side.end) == (0, 60)  # the bridged profile has no hole


def test_area_of_a_side() -> None:
    profile = profile_of(np.asarray(0.05 - 0.1 * 0.001 * np.arange(200), float))
    side = fit_side(profile, 0, 200, 0, 31, 0.001)
    height, mean = 0.2, 0.05 - 0.1 * 0.0995
    assert side.area(profile) == pytest.approx(2.0 * math.pi * mean * height * math.hypot(1.0, 0.1), rel=1e-9)
    half = Side(0, 200, 5, 10, side.radius, side.slope)
    assert half.area(profile) == pytest.approx(side.area(profile) * 10 / 31, rel=1e-12)


@pytest.mark.parametrize("segments", [24, 72, 200])
def test_corners_lie_above_the_flats_by_two_thirds_of_the_sagitta(segments: int) -> None:
    mesh = make_mesh(*frustum(0.05, 0.05, 0.3, segments=segments, rings=1))
    samples = surface_samples(mesh, Rays(mesh))
    sagitta = 0.05 * (1.0 - math.cos(math.pi / segments))
    rise = facet_offset(mesh, samples, Cone(np.zeros(3), Z, 0.05, 0.0), 0.001)
    assert rise == pytest.approx(2.0 / 3.0 * sagitta, rel=0.03)


def test_corners_of_a_thinned_mesh_say_nothing() -> None:
    """Flats that straddle the tube: corners between 0.1 mm inside and 0.6 mm outside."""
    corners, faces = frustum(0.05, 0.05, 0.3, segments=25, rings=1)
    out = np.where(np.arange(len(corners)) < 50, np.random.default_rng(1).uniform(-1e-4, 6e-4, len(corners)), 0.0)
    mesh = make_mesh(corners * (1.0 + out / 0.05)[:, None] ** [1, 1, 0], faces)
    samples = surface_samples(mesh, Rays(mesh))
    assert facet_offset(mesh, samples, Cone(np.zeros(3), Z, 0.05, 0.0), 0.001) == 0.0


def test_no_rise_without_samples() -> None:
    mesh = make_mesh(*frustum(0.05, 0.05, 0.3))
    samples = surface_samples(mesh, Rays(mesh))
    assert facet_offset(mesh, samples, Cone(np.zeros(3), Z, 0.09, 0.0), 0.001) == 0.0


def test_what_lies_under_a_partial_sheet() -> None:
    mesh = make_mesh(*frustum(0.05, 0.05, 0.3))
    rays = Rays(mesh)
    samples = surface_samples(mesh, rays)
    profile = outer_profile(mesh, rays, FRAME, 0.002, 90)
    side = Side(50, 100, 80, 30, 0.05, 0.0)  # 100..200 mm, 320 to 80 degrees, across the seam
    chosen = samples.points[under(profile, side, samples, 0.001)]
    azimuth = np.degrees(np.arctan2(*(FRAME.local(chosen)[:, 1::-1].T)))
    assert chosen[:, 2].min() > 0.099
    assert chosen[:, 2].max() < 0.201
    assert azimuth.min() > -43.0
    assert azimuth.max() < 79.0
    assert len(chosen) / len(samples) == pytest.approx(0.1 / 0.35 * 30 / 90, abs=0.01)


@pytest.mark.parametrize("body", [rugby(), barrel(), frustum(0.02, 0.12, 0.06)])
def test_slices_centre_an_axis_that_is_off(body: tuple[Floats, Floats]) -> None:
    """Half a degree and half a millimetre are gone in two rounds, on slight cones and steep ones."""
    mesh = make_mesh(*body)
    rays = Rays(mesh)
    length = float(mesh.size[2])
    axis = np.array([0.006, -0.006, 1.0])
    frame = AxisFrame.along(np.array([4e-4, -3e-4, 0.5 * length]), axis / np.linalg.norm(axis))
    for _ in range(2):
        profile = outer_profile(mesh, rays, frame, length / 100, 149)
        count = len(profile.z)
        halves = [(3, count // 2), (count // 2, count - 3)]
        sides = [fit_side(profile, a, b, 0, 149, 0.002) for a, b in halves]
        frame = centred(profile, sides, 0.002, np.array([1.0, 0.0, 0.0]))
    assert math.degrees(math.hypot(*frame.axis[:2])) < 0.003
    offset = frame.origin[:2] - frame.origin[2] * frame.axis[:2]
    assert 1e3 * math.hypot(*offset) < 0.003


def note(body: tuple[Floats, Indices]) -> str:
    mesh = make_mesh(*body)
    return hull_note(mesh, surface_samples(mesh, Rays(mesh)))


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_a_convex_hull_is_recognised(share: float) -> None:
    box = flipped(revolve([(0.0, 0.05), (0.3, 0.05)], segments=4), share)
    assert "100 % of the surface lies on the convex hull" in note(box)
    assert note(revolve([(0.0, 0.06), (0.15, 0.04), (0.3, 0.06)])) == ""
    # the walls between two boxes are inside of their hull
    assert note(joined(box, (box[0] + [0.3, 0.0, 0.0], box[1]))) == ""
    assert note(frustum(0.05, 0.05, 0.3, rings=30)) == ""  # convex, but too fine for a collision body


def test_what_stays_bare_is_said() -> None:
    profile = profile_of(np.full(100, 0.05))
    profile.radius[60:80, :5] = 0.08  # a housing on one side
    profile.radius[90:, :9] = 0.0  # open at the end
    profile.bridged[:] = profile.radius
    side = Side(10, 50, 0, 31, 0.05, 0.0)
    told = bare_lengths(profile, [side], 0.001, 0.025)
    assert [(round(a * 1e3, 1), round(b * 1e3, 1)) for a, b, _ in told] == [(-10.5, -0.5), (39.5, 89.5)]
    assert "round, but shorter than 25 mm" in told[0][2]
    assert (
        "not round: the radius differs by 30.0 mm"
        in bare_lengths(profile, [Side(10, 60, 0, 31, 0.05, 0)], 1e-3, 0.025)[1][2]
    )
