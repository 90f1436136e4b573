"""Frustum: isometry of its flat pattern, inverses, limits, mpmath."""

import math

import mpmath as mp
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from coneskin.core.errors import GeometryError
from coneskin.geometry.frustum import Frustum, unroll
from tests.support.flat_pattern import locate_flat

from .frustum_cases import RTOL, close, exact, fractions, frusta


@pytest.mark.parametrize("distance", [5e-324, 1e-310, 1e-300])
def test_a_point_a_subnormal_distance_from_an_apex_keeps_its_place(distance):
    """Products underflow there: the error is a spacing of subnormal numbers, not a share of the distance."""
    cone = Frustum(0.0, 0.05, 0.1)
    place = math.hypot(*cone.flat_point(distance, 1.0))
    assert abs(place - distance) <= RTOL * distance + 4 * 4.9e-324 / cone.slant


@example(Frustum(0.0, 0.05, 0.1), 1e-320, 1.0)
@given(frusta(), fractions, fractions)
def test_flat_point_and_point_agree_with_mpmath(frustum, f, g):
    rho1, _, _, _, sa, ca = exact(frustum)
    u, phi = f * frustum.slant, g * frustum.wrap
    rho = rho1 + mp.mpf(u) * sa
    size = rho1 + rho + u
    x, y = frustum.flat_point(u, phi)
    if sa:
        r, theta = rho / sa, phi * sa
        assert close(x, r * mp.sin(theta), size)
        assert close(y, r * mp.cos(theta) - rho1 / sa, size)
    else:
        assert close(x, rho * phi, size)
        assert close(y, mp.mpf(u), size)
    for got, want in zip(frustum.point(u, phi), (rho * mp.cos(phi), rho * mp.sin(phi), u * ca), strict=True):
        assert close(got, want, size)


@example(Frustum(0.05, 0.0, 0.1, 4.0), 1.0, 1.0)
@given(frusta(), fractions, fractions)
def test_locate_flat_and_locate_undo_flat_point_and_point(frustum, f, g):
    u, phi = f * frustum.slant, g * frustum.wrap
    rho = frustum.radius_at(u)
    size = frustum.radius1 + rho + frustum.slant
    # an error e of the point moves u by e and phi by e / rho; u is further off where radius1 is much the larger
    for u2, phi2 in (locate_flat(frustum, *frustum.flat_point(u, phi)), frustum.locate(*frustum.point(u, phi))[:2]):
        assert abs(u2 - u) <= 4 * RTOL * size
        turns = round((phi2 - phi) / (2 * math.pi))  # phi = 0 and phi = 2 pi are the same point of a full cone
        assert abs(phi2 - phi - 2 * math.pi * turns) * rho <= 8 * RTOL * size
        at_apex = 2 * math.pi * rho <= 8 * RTOL * size  # every azimuth is the same point there
        assert turns == 0 or at_apex or frustum.wrap * abs(frustum.sin_half_angle) > 6.28 or frustum.wrap > 6.28
    assert abs(frustum.locate(*frustum.point(u, phi))[2]) <= 4 * RTOL * size


@given(frusta(), st.floats(0.01, 0.99), st.floats(0.01, 0.99), st.floats(-math.pi, math.pi))
def test_flattening_is_an_isometry(frustum, f, g, direction):
    """The image of a short step has the same length on the cone and in the plane."""
    u, phi = f * frustum.slant, g * frustum.wrap
    rho = frustum.radius_at(u)
    step = 1e-5 * min(rho, frustum.slant)
    du, dphi = step * math.sin(direction), step * math.cos(direction) / rho
    ends = [(u - du, phi - dphi), (u + du, phi + dphi)]
    cone = math.dist(*(frustum.point(*end) for end in ends))
    flat = math.dist(*(frustum.flat_point(*end) for end in ends))
    size = frustum.radius1 + rho + frustum.slant
    # a chord is shorter than its arc by step^2/24 of curvature; the difference of positions carries eps * size
    assert abs(cone - flat) <= 1e-9 * step + 1e-15 * size


def test_the_half_angle_vanishes_at_the_predicted_rate():
    """A cone differs from its cylinder by O(a): halving a halves the difference of the flat maps."""
    cylinder = Frustum(0.05, 0.05, 0.3)
    errors = []
    for a in (1e-3, 5e-4, 2.5e-4):
        cone = Frustum(0.05, 0.05 + 0.3 * math.tan(a), 0.3)
        errors.append(math.dist(cone.flat_point(0.2, 2.0), cylinder.flat_point(0.2, 2.0)))
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=2e-3)  # next order is a^2, 1e-3 relative
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=1e-3)


def test_a_narrowing_cone_is_the_widening_one_upside_down():
    up, down = Frustum(0.04, 0.07, 0.15), Frustum(0.07, 0.04, 0.15)
    assert unroll(down).r1 == unroll(up).r2
    assert unroll(down).r2 == unroll(up).r1
    assert down.half_angle == -up.half_angle
    assert down.polar(0.03, 1.0)[0] == pytest.approx(up.polar(up.slant - 0.03, 1.0)[0], rel=RTOL)


@given(frusta(), fractions, fractions)
@settings(max_examples=30)
def test_arrays_agree_with_scalars(frustum, f, g):
    u, phi = f * frustum.slant, g * frustum.wrap
    size = frustum.radius1 + frustum.radius2 + frustum.slant
    for many, one in (
        (frustum.points([u], [phi])[0], frustum.point(u, phi)),
        (frustum.normals([phi])[0], frustum.normal(phi)),
    ):
        np.testing.assert_allclose(many, one, rtol=0, atol=4e-15 * (size + 1))  # the two libraries' sin and cos


@given(frusta(), fractions, fractions)
@settings(max_examples=50)
def test_the_normal_is_a_unit_vector_across_both_directions(frustum, f, g):
    u, phi = f * frustum.slant, g * frustum.wrap
    n = np.array(frustum.normal(phi))
    along = np.subtract(frustum.point(frustum.slant, phi), frustum.point(0.0, phi)) / frustum.slant
    around = np.array([-math.sin(phi), math.cos(phi), 0.0])
    size = 1.0 + (frustum.radius1 + u) / frustum.slant  # the difference of two points carries eps * size
    assert np.linalg.norm(n) == pytest.approx(1.0, abs=1e-15 * 4)
    assert abs(n @ along) <= 1e-15 * 8 * size
    assert abs(n @ around) <= 1e-15


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((-0.1, 0.1, 0.1), "radius1 must be finite and not negative, got -0.1 m"),
        ((0.1, math.nan, 0.1), "radius2 must be finite"),
        ((0.1, 0.1, math.inf), "height must be finite"),
        ((0.1, 0.1, 0.1, 7.0), "wrap must be above 0 and at most a full turn"),
        ((0.1, 0.1, 0.1, 0.0), "wrap must be above 0"),
        ((0.0, 0.0, 0.1), "must not both be 0"),
        ((0.1, 0.1, 0.0), "height must be above 0 where both radii are equal"),
    ],
)
def test_impossible_frusta_are_refused(arguments, words):
    with pytest.raises(GeometryError, match=words):
        Frustum(*arguments)
