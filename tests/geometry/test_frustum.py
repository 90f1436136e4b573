"""Frustum and sector: isometry, inverses, limits, mpmath, and the paper's own sector."""

import math

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.errors import GeometryError
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.sector import Sector, roll, unroll

mp.mp.dps = 60

radii = st.one_of(st.just(0.0), st.floats(1e-6, 10.0))
heights = st.one_of(st.just(0.0), st.floats(1e-9, 10.0))
wraps = st.one_of(st.just(2 * math.pi), st.floats(1e-3, 2 * math.pi))


@st.composite
def frusta(draw):
    """Cones of every kind: cylinders, near cylinders, discs, apexes, narrowing ones."""
    radius1 = draw(radii)
    kind = draw(st.sampled_from(["any", "cylinder", "near"]))
    if kind == "any":
        radius2 = draw(radii)
    else:
        radius1 = radius2 = radius1 or 0.05
        if kind == "near":
            radius2 *= 1.0 + draw(st.floats(-1e-6, 1e-6))
    height = draw(heights)
    if radius1 == radius2 == 0.0 or (height == 0.0 and radius1 == radius2):
        radius1, height = 0.05, 0.1
    return Frustum(radius1, radius2, height, draw(wraps))


fractions = st.floats(0.0, 1.0)
#: a handful of roundings of 1.1e-16 each, and the condition of sin and cos at angles up to 2 pi
RTOL = 1e-14


def exact(frustum):
    """s, sin a, cos a with 60 digits, from the frustum's own doubles."""
    rho1, rho2, h = (mp.mpf(x) for x in (frustum.radius1, frustum.radius2, frustum.height))
    s = mp.sqrt(h * h + (rho2 - rho1) ** 2)
    return rho1, rho2, h, s, (rho2 - rho1) / s, h / s


def close(got, want, scale=None):
    """Whether a double agrees with an mpmath number to RTOL of the scale (default: of the number)."""
    return abs(mp.mpf(got) - want) <= RTOL * (abs(want) if scale is None else scale)


@given(frusta())
@settings(deadline=None)
def test_unroll_agrees_with_mpmath(frustum):
    rho1, rho2, _, s, sa, _ = exact(frustum)
    sector = unroll(frustum)
    assert close(sector.slant, s)
    assert close(sector.theta0, frustum.wrap * abs(sa))
    assert close(frustum.half_angle, mp.atan2(rho2 - rho1, mp.mpf(frustum.height)))
    if sector.theta0:
        assert close(sector.r1, rho1 / abs(sa))
        assert close(sector.r2, rho2 / abs(sa))
    else:
        assert sector.r1 == sector.r2 == math.inf


@given(frusta(), fractions, fractions)
@settings(deadline=None)
def test_flat_and_point_agree_with_mpmath(frustum, f, g):
    rho1, _, _, _, sa, ca = exact(frustum)
    u, phi = f * frustum.slant, g * frustum.wrap
    rho = rho1 + mp.mpf(u) * sa
    size = rho1 + rho + u
    x, y = frustum.flat(u, phi)
    if sa:
        r, theta = rho / sa, phi * sa
        assert close(x, r * mp.sin(theta), size)
        assert close(y, r * mp.cos(theta) - rho1 / sa, size)
    else:
        assert close(x, rho * phi, size)
        assert close(y, mp.mpf(u), size)
    for got, want in zip(frustum.point(u, phi), (rho * mp.cos(phi), rho * mp.sin(phi), u * ca), strict=True):
        assert close(got, want, size)


@given(frusta(), fractions, fractions)
@settings(deadline=None)
def test_unflat_and_locate_undo_flat_and_point(frustum, f, g):
    u, phi = f * frustum.slant, g * frustum.wrap
    rho = frustum.radius_at(u)
    size = frustum.radius1 + rho + frustum.slant
    # an error e of the point moves u by e and phi by e / rho; u is further off where radius1 is much the larger
    for u2, phi2 in (frustum.unflat(*frustum.flat(u, phi)), frustum.locate(*frustum.point(u, phi))[:2]):
        assert abs(u2 - u) <= 4 * RTOL * size
        turns = round((phi2 - phi) / (2 * math.pi))  # phi = 0 and phi = 2 pi are the same point of a full cone
        assert abs(phi2 - phi - 2 * math.pi * turns) * rho <= 8 * RTOL * size
        assert turns == 0 or frustum.wrap * abs(frustum.sin_half_angle) > 6.28 or frustum.wrap > 6.28
    assert abs(frustum.locate(*frustum.point(u, phi))[2]) <= 4 * RTOL * size


@given(frusta(), st.floats(0.01, 0.99), st.floats(0.01, 0.99), st.floats(-math.pi, math.pi))
@settings(deadline=None)
def test_flattening_is_an_isometry(frustum, f, g, direction):
    """The image of a short step has the same length on the cone and in the plane."""
    u, phi = f * frustum.slant, g * frustum.wrap
    rho = frustum.radius_at(u)
    step = 1e-5 * min(rho, frustum.slant)
    du, dphi = step * math.sin(direction), step * math.cos(direction) / rho
    ends = [(u - du, phi - dphi), (u + du, phi + dphi)]
    cone = math.dist(*(frustum.point(*end) for end in ends))
    flat = math.dist(*(frustum.flat(*end) for end in ends))
    size = frustum.radius1 + rho + frustum.slant
    # a chord is shorter than its arc by step^2/24 of curvature; the difference of positions carries eps * size
    assert abs(cone - flat) <= 1e-9 * step + 1e-15 * size


@given(frusta())
@settings(deadline=None)
def test_roll_undoes_unroll(frustum):
    back = roll(unroll(frustum), frustum.wrap)
    size = frustum.radius1 + frustum.radius2 + frustum.height
    for name in ("radius1", "radius2"):
        assert getattr(back, name) == pytest.approx(getattr(frustum, name), rel=RTOL)
    # near a flat disc one rounding of theta0 moves the height by sqrt(2 eps) s: the input cannot say more
    assert abs(back.height**2 - frustum.height**2) <= 8 * RTOL * size**2


def test_the_half_angle_vanishes_at_the_predicted_rate():
    """A cone differs from its cylinder by O(a): halving a halves the difference of the flat maps."""
    cylinder = Frustum(0.05, 0.05, 0.3)
    errors = []
    for a in (1e-3, 5e-4, 2.5e-4):
        cone = Frustum(0.05, 0.05 + 0.3 * math.tan(a), 0.3)
        errors.append(math.dist(cone.flat(0.2, 2.0), cylinder.flat(0.2, 2.0)))
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=2e-3)  # next order is a^2, 1e-3 relative
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=1e-3)


def test_published_cone():
    """A 3-4-5 cone: radii 3 and 6, height 4 -> slant 5, r1 = 5, r2 = 10, theta0 = 2 pi 3/5 = 216 deg."""
    sector = unroll(Frustum(3.0, 6.0, 4.0))
    assert (sector.slant, sector.r1, sector.r2) == (5.0, pytest.approx(5.0), pytest.approx(10.0))
    assert math.degrees(sector.theta0) == pytest.approx(216.0)


def test_paper_sector_rolls_into_a_link():
    """r1 = 100, r2 = 200 mm, theta0 = 90 deg (read off the paper's figures) wraps a cone of 25 and 50 mm."""
    link = roll(Sector.from_polar(0.1, 0.2, math.pi / 2))
    assert (link.radius1, link.radius2) == (pytest.approx(0.025), pytest.approx(0.05))
    assert link.half_angle == pytest.approx(math.asin(0.25))


def test_a_narrowing_cone_is_the_widening_one_upside_down():
    up, down = Frustum(0.04, 0.07, 0.15), Frustum(0.07, 0.04, 0.15)
    assert unroll(down).r1 == unroll(up).r2
    assert unroll(down).r2 == unroll(up).r1
    assert down.half_angle == -up.half_angle
    assert down.polar(0.03, 1.0)[0] == pytest.approx(up.polar(up.slant - 0.03, 1.0)[0], rel=RTOL)


@given(frusta(), fractions, fractions)
@settings(deadline=None, max_examples=30)
def test_arrays_agree_with_scalars(frustum, f, g):
    u, phi = f * frustum.slant, g * frustum.wrap
    size = frustum.radius1 + frustum.radius2 + frustum.slant
    for many, one in (
        (frustum.points([u], [phi])[0], frustum.point(u, phi)),
        (frustum.flats([u], [phi])[0], frustum.flat(u, phi)),
        (frustum.normals([phi])[0], frustum.normal(phi)),
    ):
        np.testing.assert_allclose(many, one, rtol=0, atol=4e-15 * (size + 1))  # the two libraries' sin and cos


@given(frusta(), fractions, fractions)
@settings(deadline=None, max_examples=50)
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
        ((0.0, 0.0, 0.1), "must not both be 0 m"),
        ((0.1, 0.1, 0.0), "height must be above 0 m where both radii are equal"),
    ],
)
def test_impossible_frusta_are_refused(arguments, words):
    with pytest.raises(GeometryError, match=words):
        Frustum(*arguments)


def test_impossible_sectors_are_refused():
    with pytest.raises(GeometryError, match=r"\|arc2 - arc1\| = theta0 \* slant"):
        Sector(1.0, 1.0, 2.0, 0.5)
    with pytest.raises(GeometryError, match="needs a slant"):
        Sector.from_polar(0.1, 0.1, 1.0)
    with pytest.raises(GeometryError, match="wrap must be at least theta0"):
        roll(Sector.from_polar(0.1, 0.2, 2.0), 1.0)
