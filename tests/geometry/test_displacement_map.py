"""The run-time map: exact at its nodes, second order between them, near real meshes, and over holes, not into them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from coneskin.core.errors import GeometryError
from coneskin.geometry.displacement_map import DisplacementMap, heights_by_ray, measure_displacement
from coneskin.geometry.fit.cones import find_cones
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.mesh import load_mesh, make_mesh
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose
from coneskin.geometry.ray_casting import RayCaster
from tests.support.paths import SHARED_DATA
from tests.support.sweep import sweep

from .synthetic import TILTED, Floats, barrel, frustum, holed, placed

DATA = SHARED_DATA
TURN = 2.0 * math.pi


def wavy(frustum: Frustum, rows: int, columns: int) -> DisplacementMap:
    """Heights of a smooth wave, sampled at the nodes."""
    u, phi = np.meshgrid(np.linspace(0.0, frustum.slant, rows), np.linspace(0.0, frustum.wrap, columns), indexing="ij")
    heights = wave(frustum, u, phi)
    if frustum.wrap == TURN:
        heights[:, -1] = heights[:, 0]
    return DisplacementMap(PlacedFrustum(frustum, TILTED), heights)


def wave(frustum: Frustum, u: Floats, phi: Floats) -> Floats:
    return np.asarray(1e-3 * np.sin(2.0 * phi * TURN / frustum.wrap) * np.cos(3.0 * u / frustum.slant))


def points_of(grid: DisplacementMap, u: Floats, phi: Floats) -> Floats:
    return np.array([grid.point(a, b) for a, b in zip(u.ravel().tolist(), phi.ravel().tolist(), strict=True)])


@pytest.mark.parametrize("f", [Frustum(0.05, 0.03, 0.2), Frustum(0.05, 0.05, 0.2, 3.5), Frustum(0.02, 0.1, 0.05, TURN)])
def test_heights_are_those_that_scipy_interpolates(f: Frustum) -> None:
    """Also beyond the ends and the edges, where those at the rim go on, and after turns of phi."""
    grid = wavy(f, 9, 17)
    rng = np.random.default_rng(2)
    u, phi = rng.uniform(-0.3, 1.3, 400) * f.slant, rng.uniform(-9.0, 9.0, 400)
    u[:4], phi[:4] = (0.0, f.slant, 0.0, f.slant), (0.0, f.wrap, f.wrap, 0.0)
    nodes = np.linspace(0.0, f.slant, 9), np.linspace(0.0, f.wrap, 17)
    around = phi % TURN if f.wrap == TURN else np.clip(phi, 0.0, f.wrap)
    height = RegularGridInterpolator(nodes, grid.heights)((np.clip(u, 0.0, f.slant), around))
    feet, out = grid.placed.place(u, phi)
    np.testing.assert_allclose(points_of(grid, u, phi), feet + height[:, None] * out, rtol=0, atol=1e-14)


def test_nodes_are_hit_and_the_height_is_along_the_normal() -> None:
    f = Frustum(0.05, 0.03, 0.2)
    grid = wavy(f, 9, 17)
    for i, j in ((0, 0), (3, 5), (8, 16), (4, 15)):
        u, phi = f.slant * i / 8, TURN * j / 16
        foot, out = np.array(grid.placed.point(u, phi)), np.array(grid.placed.normal(phi))
        np.testing.assert_allclose(grid.point(u, phi), foot + grid.heights[i, j] * out, rtol=0, atol=1e-15)
        found = grid.placed.locate(grid.point(u, phi))
        assert found[0] == pytest.approx(u, abs=1e-15)
        assert found[2] == pytest.approx(grid.heights[i, j], abs=1e-15)


@pytest.mark.parametrize("wrap", [TURN, 3.5])
def test_the_error_falls_with_the_square_of_the_step(wrap: float) -> None:
    f = Frustum(0.05, 0.03, 0.2, wrap)
    rng = np.random.default_rng(3)
    u, phi = rng.uniform(0.0, f.slant, 5000), rng.uniform(0.0, wrap, 5000)
    grids = [wavy(f, n + 1, 2 * n + 1) for n in (16, 32, 64)]
    errors = [np.abs(grid.placed.locate_all(points_of(grid, u, phi))[2] - wave(f, u, phi)).max() for grid in grids]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.1)


def test_the_map_is_continuous_across_the_seam() -> None:
    grid = wavy(Frustum(0.05, 0.03, 0.2), 9, 17)
    gap = np.subtract(grid.point(0.1, 1e-9), grid.point(0.1, TURN - 1e-9))
    assert np.linalg.norm(gap) < 2e-10


def test_a_tilted_cone_measures_as_itself() -> None:
    mesh = placed(frustum(0.05, 0.03, 0.25, segments=400, rings=4))
    grid = measure_displacement(mesh, PlacedFrustum(Frustum(0.05, 0.03, 0.25), TILTED))
    # flats of 400 segments lie up to 50 mm (1 - cos(pi / 400)) = 1.5 um inside
    assert grid.heights.max() < 1e-8
    assert grid.heights.min() > -2e-6
    assert grid.heights.shape == (129, 257)


def test_a_shift_shows_as_a_first_harmonic() -> None:
    mesh = make_mesh(*frustum(0.05, 0.05, 0.25, segments=400))
    off = PlacedFrustum(Frustum(0.05, 0.05, 0.25), Pose(translation=(3e-4, 0.0, 0.0)))
    grid = measure_displacement(mesh, off, 8, 64)
    phi = np.linspace(0.0, TURN, 65)
    # the second order is shift**2 / (2 radius) = 0.9 um
    np.testing.assert_allclose(grid.heights[4], -3e-4 * np.cos(phi), atol=3e-6)


def test_holes_are_spanned() -> None:
    body = placed(holed())
    tube = PlacedFrustum(Frustum(0.05, 0.05, 0.3), TILTED)
    rays = RayCaster(body)
    grid = measure_displacement(body, tube, 150, 240, rays=rays)
    true = heights_by_ray(
        rays, tube, np.linspace(1e-6, 0.3 - 1e-6, 151), np.linspace(0.0, TURN, 240, endpoint=False), 1e-3
    )
    assert true.min() < -0.0059
    assert grid.heights.min() > -0.0009  # walls of a pit that are no deeper than the limit are followed
    assert grid.heights.max() < 1e-6
    deep = true < -0.001
    assert np.abs(grid.heights[:, :-1][deep]).max() < 2e-5  # spanned at the height of the rim


def test_wide_pits_are_clamped() -> None:
    grid = measure_displacement(
        placed(holed(width=0.03)), PlacedFrustum(Frustum(0.05, 0.05, 0.3), TILTED), max_bridge=0.005, limit=0.002
    )
    assert grid.heights.min() == -0.002


def test_bodies_farther_out_are_not_in_the_way() -> None:
    corners, faces = frustum(0.05, 0.05, 0.25)
    wall = (corners * [0.2, 0.2, 1.0] + [0.09, 0.0, 0.0], faces)
    both = make_mesh(np.concatenate([corners, wall[0]]), np.concatenate([faces, wall[1] + len(corners)]))
    grid = measure_displacement(both, PlacedFrustum(Frustum(0.05, 0.05, 0.25)))
    assert np.abs(grid.heights).max() < 2e-5


@pytest.mark.long
def test_a_barrel_is_followed_to_microns() -> None:
    mesh = placed(barrel())
    for sheet in find_cones(mesh).sheets:
        rays = RayCaster(mesh)
        grid = measure_displacement(mesh, sheet.placed, rays=rays)
        u = np.linspace(0.005, sheet.frustum.slant - 0.005, 77)
        phi = np.linspace(0.0, sheet.frustum.wrap, 131, endpoint=False)
        true = heights_by_ray(rays, sheet.placed, u, phi, 0.001)
        assert np.abs(true).max() > 3e-4
        points = points_of(grid, *np.meshgrid(u, phi, indexing="ij"))
        error = grid.placed.locate_all(points)[2].reshape(true.shape) - true
        # facets of 128 segments and 7.5 mm rings: kinks of 12 and 30 um between nodes
        assert np.abs(error).max() < 1e-5


@pytest.mark.long
@pytest.mark.parametrize(
    "name", sweep(["ur/ur10/collision/upperarm.stl", "ur/ur5e/visual/upperarm.dae", "xarm/uf850_link4.stl"])
)
def test_real_links_are_met_within_a_tenth_of_a_millimetre(name: str) -> None:
    """Inside of the 5 mm at each end that electrodes and fillets take."""
    if not (DATA / name).is_file():
        pytest.skip(f"the link meshes (shared/data/{name}) are not beside the repository")
    mesh = load_mesh(DATA / name)
    rays = RayCaster(mesh)
    (sheet,) = find_cones(mesh, max_sheets=1).sheets
    grid = measure_displacement(mesh, sheet.placed, rays=rays)
    rng = np.random.default_rng(4)
    f = sheet.frustum
    u, phi = rng.uniform(0.005, f.slant - 0.005, 20000), rng.uniform(0.0, f.wrap, 20000)
    pose = np.array(sheet.placed.link_frustum.rotation)
    out = f.normals(phi) @ pose.T
    points = points_of(grid, u, phi)
    # cast at the points of the map, not at its nodes: an independent ray for each
    depth = rays.cast(points + 0.01 * out, -out)[0]
    assert np.abs(depth - 0.01).max() < 1e-4


def test_what_cannot_be_mapped_is_refused() -> None:
    tube = PlacedFrustum(Frustum(0.05, 0.05, 0.3))
    mesh = make_mesh(*frustum(0.05, 0.05, 0.3))
    with pytest.raises(GeometryError, match="along and around must be at least 1 step, got 0 and 256"):
        measure_displacement(mesh, tube, along=0)
    with pytest.raises(GeometryError, match=r"limit must be above 0 m, got 0\.0"):
        measure_displacement(mesh, tube, limit=0.0)
    with pytest.raises(GeometryError, match="no part of it lies within 1 mm of the sheet"):
        measure_displacement(mesh, PlacedFrustum(Frustum(0.09, 0.09, 0.3)))
    with pytest.raises(GeometryError, match=r"at least 2 rows and 2 columns, got \(1, 4\)"):
        DisplacementMap(tube, np.zeros((1, 4)))
    with pytest.raises(GeometryError, match="must end with the column they begin with"):
        DisplacementMap(tube, np.arange(6.0).reshape(2, 3))
    with pytest.raises(GeometryError, match="heights must be finite, got nan"):
        DisplacementMap(tube, np.full((2, 2), np.nan))
