"""The cone fit: its Jacobian, its recovery of known cones, its limit at the cylinder, and what it refuses."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.geometry.fit.cone_fit import InfiniteCone, _slopes, fit_cone, perpendicular_vectors
from coneskin.geometry.fit.surface_samples import SurfaceSamples

from ..synthetic import Floats

GATES = (0.02, 0.005, 0.002)


def unit(*v: float) -> Floats:
    return np.asarray(np.array(v) / np.linalg.norm(v))


def on_cone(
    cone: InfiniteCone, height: float, count: int = 1500, turn: float = 2.0 * math.pi, seed: int = 1
) -> SurfaceSamples:
    """Exact points and normals of a cone, from height / 2 below its origin to height / 2 above."""
    rng = np.random.default_rng(seed)
    z, phi = rng.uniform(-0.5, 0.5, count) * height, rng.uniform(0.0, turn, count)
    e1, e2 = perpendicular_vectors(cone.axis)
    out = np.outer(np.cos(phi), e1) + np.outer(np.sin(phi), e2)
    rho = cone.radius + z * math.tan(cone.half_angle)
    points = cone.origin + rho[:, None] * out + np.outer(z, cone.axis)
    normals = math.cos(cone.half_angle) * out - math.sin(cone.half_angle) * cone.axis
    return SurfaceSamples(points, normals, np.zeros(count, np.int64), 1.0)


def off_axis(one: InfiniteCone, two: InfiniteCone) -> tuple[float, float]:
    """Angle between two axes [deg] and distance of the second origin from the first axis [mm]."""
    gap = two.origin - one.origin
    tilt = math.degrees(math.asin(min(1.0, float(np.linalg.norm(np.cross(one.axis, two.axis))))))
    return tilt, 1e3 * float(np.linalg.norm(gap - (gap @ one.axis) * one.axis))


@settings(max_examples=60)
@given(
    half_angle=st.floats(-1.2, 1.2),
    radius=st.floats(0.005, 0.5),
    tilt=st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.2, 1)),
    seed=st.integers(0, 1000),
)
def test_jacobian_is_the_slope_of_the_distances(
    half_angle: float, radius: float, tilt: tuple[float, float, float], seed: int
) -> None:
    cone = InfiniteCone(np.array([0.1, -0.2, 0.3]), unit(*tilt), radius, half_angle)
    points = cone.origin + np.random.default_rng(seed).normal(0.0, 0.3, (40, 3))
    rho = cone.cylindrical_coordinates(points)[0]
    points = points[rho > 0.02]
    e1, e2 = perpendicular_vectors(cone.axis)
    step = 1e-6

    def at(change: Floats) -> Floats:
        tilt1, tilt2, shift1, shift2, dc, dangle = change
        axis = unit(*(cone.axis + tilt1 * e1 + tilt2 * e2))
        angle = half_angle + dangle
        moved = InfiniteCone(
            cone.origin + shift1 * e1 + shift2 * e2,
            axis,
            (radius * math.cos(half_angle) + dc) / math.cos(angle),
            angle,
        )
        return moved.distances(points)

    numeric = np.stack([(at(d) - at(-d)) / (2.0 * step) for d in step * np.eye(6)], axis=1)
    # truncation ~ step**2 * z**2 / rho**3 = 1e-12 * 1 / 1e-5, rounding ~ eps / step = 2e-10
    x, y, z = (points @ way - cone.origin @ way for way in (e1, e2, cone.axis))
    found = _slopes(x, y, z, np.sqrt(x * x + y * y), half_angle).T
    np.testing.assert_allclose(found, numeric, rtol=0, atol=1e-6)


@pytest.mark.parametrize("degrees", [-60.0, -20.0, -0.65, -1e-6, 0.0, 1e-9, 0.05, 5.0, 45.0, 60.0])
def test_exact_cones_are_recovered(degrees: float) -> None:
    true = InfiniteCone(np.array([0.02, -0.03, 0.1]), unit(0.3, -0.4, 0.8), 0.08, math.radians(degrees))
    samples = on_cone(true, 0.08)
    begin = InfiniteCone(true.origin + 0.003, unit(*(true.axis + 0.04)), 0.083, true.half_angle + 0.05)
    found = fit_cone(samples, begin, GATES)
    assert found is not None
    tilt, shift = off_axis(true, found)
    # the last gate rests when a step is below 1e-4 of it; Gauss-Newton is then exact to the square of that
    assert tilt < 1e-5
    assert shift < 1e-5
    assert math.degrees(found.half_angle) == pytest.approx(degrees, abs=1e-5)
    at_origin = found.radius + float((true.origin - found.origin) @ found.axis) * math.tan(found.half_angle)
    assert at_origin == pytest.approx(true.radius, abs=1e-8)


def test_the_origin_of_the_start_may_be_far_along_the_axis() -> None:
    true = InfiniteCone(np.zeros(3), unit(0.3, -0.4, 0.8), 0.08, math.radians(30.0))
    far = InfiniteCone(
        true.origin + 0.1 * true.axis, true.axis, 0.08 + 0.1 * math.tan(true.half_angle), true.half_angle
    )
    found = fit_cone(on_cone(true, 0.08), far, (0.002,))
    assert found is not None
    assert off_axis(true, found)[0] < 1e-5
    assert abs(float((found.origin - true.origin) @ true.axis)) < 0.01  # amid the points
    np.testing.assert_allclose(found.distances(on_cone(true, 0.08).points), 0.0, atol=1e-9)


def test_points_near_the_gate_hardly_pull() -> None:
    """A sixth of the side bulges by nine tenths of the gate: weight (1 - 0.81)^2 = 0.04."""
    true = InfiniteCone(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.05, 0.0)
    exact = on_cone(true, 0.2, 3000)
    bulge = np.where(np.arctan2(exact.points[:, 1], exact.points[:, 0]) > 2.0 * math.pi / 3.0, 4.5e-4, 0.0)
    found = fit_cone(
        SurfaceSamples(exact.points + bulge[:, None] * exact.normals, exact.normals, exact.faces, 1.0), true, (5e-4,)
    )
    assert found is not None
    assert off_axis(true, found)[1] < 0.04  # three times that with equal weights


def test_a_partial_cone_is_recovered() -> None:
    true = InfiniteCone(np.zeros(3), unit(0.0, 0.2, 1.0), 0.06, math.radians(4.0))
    samples = on_cone(true, 0.1, turn=math.radians(150.0))
    begin = InfiniteCone(np.array([0.002, 0.001, 0.0]), unit(0.02, 0.2, 1.0), 0.061, 0.05)
    found = fit_cone(samples, begin, GATES)
    assert found is not None
    assert off_axis(true, found)[0] < 1e-4


def test_points_off_the_cone_do_not_pull() -> None:
    true = InfiniteCone(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.05, 0.0)
    tube = on_cone(true, 0.2)
    rng = np.random.default_rng(3)
    # half a flange, so near to the side that only its normals emit it, and a housing beside the tube
    rho, phi = rng.uniform(0.0501, 0.0504, 3000), rng.uniform(0.0, math.pi, 3000)
    flange = np.stack([rho * np.cos(phi), rho * np.sin(phi), np.full(3000, 0.1)], axis=1)
    housing = rng.normal(0.0, 0.02, (800, 3)) + [0.08, 0.0, 0.1]
    samples = SurfaceSamples(
        np.concatenate([tube.points, flange, housing]),
        np.concatenate([tube.normals, np.tile([0.0, 0.0, 1.0], (3000, 1)), np.tile([1.0, 0.0, 0.0], (800, 1))]),
        np.zeros(5300, np.int64),
        1.0,
    )
    begin = InfiniteCone(np.array([0.003, 0.0, 0.0]), unit(0.03, 0.0, 1.0), 0.052, 0.02)
    found = fit_cone(samples, begin, (0.01, 0.002, 0.0005))
    assert found is not None
    tilt, shift = off_axis(true, found)
    # what of the housing crosses the side within half a millimetre and faces out is a dozen points of 1500
    assert tilt < 0.02
    assert shift < 0.02
    assert found.radius == pytest.approx(0.05, abs=2e-5)


def test_noise_averages_out_with_the_root_of_the_count() -> None:
    true = InfiniteCone(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.05, 0.02)
    errors = []
    for count in (500, 8000):
        misses = []
        for seed in range(12):
            exact = on_cone(true, 0.2, count, seed=seed)
            noise = np.random.default_rng(100 + seed).normal(0.0, 2e-4, count)
            noisy = SurfaceSamples(exact.points + noise[:, None] * exact.normals, exact.normals, exact.faces, 1.0)
            found = fit_cone(noisy, true, (0.002,))
            assert found is not None
            misses.append(off_axis(true, found)[1])
        errors.append(float(np.sqrt(np.mean(np.square(misses)))))
    # 16 times the points: a quarter of the error; a dozen seeds know a ratio to about a third
    assert 2.5 < errors[0] / errors[1] < 6.5


def test_too_few_points_and_flat_rings_are_refused() -> None:
    cone = InfiniteCone(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.05, 0.0)
    assert fit_cone(on_cone(cone, 0.1, 20), cone, (0.01,)) is None
    assert fit_cone(on_cone(cone, 0.1), InfiniteCone(np.zeros(3), cone.axis, 0.2, 0.0), (0.01,)) is None
    steep = InfiniteCone(np.zeros(3), cone.axis, 0.05, math.radians(79.0))
    flat = InfiniteCone(np.zeros(3), cone.axis, 0.05, math.radians(85.0))
    assert fit_cone(on_cone(flat, 0.004), steep, (0.02,), angle=0.3) is None


def test_distances_and_alignment() -> None:
    cone = InfiniteCone(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.05, math.radians(30.0))
    samples = on_cone(cone, 0.05, 50)
    np.testing.assert_allclose(cone.distances(samples.points), 0.0, atol=1e-15)
    np.testing.assert_allclose(cone.distances(samples.points + 0.003 * samples.normals), 0.003, atol=1e-15)
    np.testing.assert_allclose(cone.alignment(samples.points, samples.normals), 1.0, atol=1e-12)
