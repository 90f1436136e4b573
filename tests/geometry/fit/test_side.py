"""Straight side of a sheet: robust against fillets and holes, raised to the corners of the facets."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.geometry.fit.cone_fit import InfiniteCone
from coneskin.geometry.fit.profile import measure_profile
from coneskin.geometry.fit.side import StraightSide, facet_offset, fit_side
from coneskin.geometry.fit.surface_samples import sample_surface
from coneskin.geometry.mesh import make_mesh
from coneskin.geometry.ray_casting import RayCaster

from ..synthetic import frustum
from .profile_cases import FRAME, Z, profile_of


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
    half = StraightSide(0, 200, 5, 10, side.radius, side.slope)
    assert half.area(profile) == pytest.approx(side.area(profile) * 10 / 31, rel=1e-12)


@pytest.mark.parametrize("segments", [24, 72, 200])
def test_corners_lie_above_the_flats_by_two_thirds_of_the_sagitta(segments: int) -> None:
    mesh = make_mesh(*frustum(0.05, 0.05, 0.3, segments=segments, rings=1))
    samples = sample_surface(mesh, RayCaster(mesh))
    sagitta = 0.05 * (1.0 - math.cos(math.pi / segments))
    rise = facet_offset(mesh, samples, InfiniteCone(np.zeros(3), Z, 0.05, 0.0), 0.001)
    assert rise == pytest.approx(2.0 / 3.0 * sagitta, rel=0.03)


def test_corners_of_a_thinned_mesh_say_nothing() -> None:
    """Flats that straddle the tube: corners between 0.1 mm inside and 0.6 mm outside."""
    corners, faces = frustum(0.05, 0.05, 0.3, segments=25, rings=1)
    out = np.where(np.arange(len(corners)) < 50, np.random.default_rng(1).uniform(-1e-4, 6e-4, len(corners)), 0.0)
    mesh = make_mesh(corners * (1.0 + out / 0.05)[:, None] ** [1, 1, 0], faces)
    samples = sample_surface(mesh, RayCaster(mesh))
    assert facet_offset(mesh, samples, InfiniteCone(np.zeros(3), Z, 0.05, 0.0), 0.001) == 0.0


def test_no_rise_without_samples() -> None:
    mesh = make_mesh(*frustum(0.05, 0.05, 0.3))
    samples = sample_surface(mesh, RayCaster(mesh))
    assert facet_offset(mesh, samples, InfiniteCone(np.zeros(3), Z, 0.09, 0.0), 0.001) == 0.0


def test_what_lies_under_a_partial_sheet() -> None:
    mesh = make_mesh(*frustum(0.05, 0.05, 0.3))
    rays = RayCaster(mesh)
    samples = sample_surface(mesh, rays)
    profile = measure_profile(mesh, rays, FRAME, 0.002, 90)
    side = StraightSide(50, 100, 80, 30, 0.05, 0.0)  # 100..200 mm, 320 to 80 degrees, across the seam
    chosen = samples.points[side.covers(profile, samples, 0.001)]
    azimuth = np.degrees(np.arctan2(*(FRAME.local(chosen)[:, 1::-1].T)))
    assert chosen[:, 2].min() > 0.099
    assert chosen[:, 2].max() < 0.201
    assert azimuth.min() > -43.0
    assert azimuth.max() < 79.0
    assert len(chosen) / len(samples) == pytest.approx(0.1 / 0.35 * 30 / 90, abs=0.01)
