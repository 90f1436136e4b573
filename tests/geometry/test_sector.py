"""Flat sector: mpmath, its inverse, and the paper's own sector."""

import math

import mpmath as mp
import pytest
from hypothesis import assume, given

from coneskin.core.errors import GeometryError
from coneskin.geometry.frustum import Frustum, Sector, roll_up, unroll

from .frustum_cases import RTOL, close, exact, frusta


@given(frusta())
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


@given(frusta())
def test_roll_up_undoes_unroll(frustum):
    # a flat ring one or two roundings wide has two equal arcs: its sector is a rectangle of no width
    assume(frustum.height > 0.0 or frustum.slant > 1e-15 * max(frustum.radius1, frustum.radius2))
    back = roll_up(unroll(frustum), frustum.wrap)
    size = frustum.radius1 + frustum.radius2 + frustum.height
    for name in ("radius1", "radius2"):
        assert getattr(back, name) == pytest.approx(getattr(frustum, name), rel=RTOL)
    # near a flat disc one rounding of theta0 moves the height by sqrt(2 eps) s: the input cannot say more
    assert abs(back.height**2 - frustum.height**2) <= 8 * RTOL * size**2


def test_published_cone():
    """A 3-4-5 cone: radii 3 and 6, height 4 -> slant 5, r1 = 5, r2 = 10, theta0 = 2 pi 3/5 = 216 deg."""
    sector = unroll(Frustum(3.0, 6.0, 4.0))
    assert (sector.slant, sector.r1, sector.r2) == (5.0, pytest.approx(5.0), pytest.approx(10.0))
    assert math.degrees(sector.theta0) == pytest.approx(216.0)


def test_paper_sector_rolls_into_a_link():
    """r1 = 100, r2 = 200 mm, theta0 = 90 deg (read off the paper's figures) wraps a cone of 25 and 50 mm."""
    link = roll_up(Sector(0.1, 0.1 * math.pi / 2, 0.2 * math.pi / 2, math.pi / 2))
    assert (link.radius1, link.radius2) == (pytest.approx(0.025), pytest.approx(0.05))
    assert link.half_angle == pytest.approx(math.asin(0.25))


def test_impossible_sectors_are_refused():
    with pytest.raises(GeometryError, match=r"\|arc2 - arc1\| = theta0 \* slant"):
        Sector(1.0, 1.0, 2.0, 0.5)
    with pytest.raises(GeometryError, match="needs a slant"):
        Sector(0.0, 0.1, 0.1, 1.0)
    with pytest.raises(GeometryError, match="wrap must be at least theta0"):
        roll_up(Sector(0.1, 0.2, 0.4, 2.0), 1.0)


def test_numbers_of_numpy_become_floats() -> None:
    """So a sector is printed as the numbers it is, and the live loop computes with no slower type."""
    import numpy as np

    frustum = Frustum(np.float64(0.04), np.float32(0.0625), np.int64(1), np.float64(2.0))
    assert repr(frustum) == "Frustum(radius1=0.04, radius2=0.0625, height=1.0, wrap=2.0)"
    assert "np." not in repr(unroll(frustum))
    sector = Sector(np.float64(0.25), np.float64(0.25), np.float32(0.5), np.int64(1))
    assert repr(sector) == "Sector(slant=0.25, arc1=0.25, arc2=0.5, theta0=1.0)"
    assert "np." not in repr(roll_up(sector, np.float64(2.0)))
