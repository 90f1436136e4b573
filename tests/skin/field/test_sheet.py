"""The map to the rectangle: conformal, regular where the cone becomes a cylinder, one to one."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.core.errors import FieldError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.field.sheet import SectorSheet

from ..field_cases import PAPER, SHEETS


@pytest.mark.parametrize("name", list(SHEETS))
def test_locate_inverts_the_map(name: str) -> None:
    sheet = SHEETS[name]
    u, phi = np.linspace(0, sheet.width, 11)[:, None], np.linspace(0, sheet.wrap, 7)[None, :]
    back = sheet.locate(sheet.along(u)[0], sheet.across(phi)[0])
    assert np.allclose(back[0], u, rtol=1e-14, atol=1e-17)
    assert np.allclose(back[1], phi, rtol=1e-15)
    x, rest = sheet.along(u)
    assert np.allclose(x + rest, sheet.length, rtol=1e-15)


@pytest.mark.parametrize("name", list(SHEETS))
def test_flat_distances_are_those_of_the_drawing(name: str) -> None:
    sheet = SHEETS[name]
    if sheet.curvature == 0.0:
        pytest.skip("a rectangle has no polar coordinates")
    u, phi = np.array([0.2, 0.7]) * sheet.width, np.array([0.3, 0.5]) * sheet.wrap
    r, theta = sheet.polar(u, phi)
    drawn = abs(r[0] * np.exp(1j * theta[0]) - r[1] * np.exp(1j * theta[1]))
    assert abs(sheet.flat(u[1], phi[1], (u[0], phi[0]))) == pytest.approx(drawn, rel=1e-13)
    assert np.allclose(sheet.from_polar(r, theta), (u, phi), rtol=1e-12)


def test_cone_tends_to_the_cylinder_linearly() -> None:
    flat = SectorSheet(0.1, 0.0, 0.3, 2.0)
    errors = [
        abs(float(SectorSheet(0.1, k, 0.3, 2.0).along(0.07)[0]) - float(flat.along(0.07)[0])) for k in (1e-3, 1e-6)
    ]
    assert errors[1] == pytest.approx(1e-3 * errors[0], rel=1e-3)
    assert errors[0] == pytest.approx(0.5e-3 * 0.07**2, rel=1e-3)  # log1p(k d)/k = d - k d^2/2


def test_frustum_and_flat_sector_are_one() -> None:
    link = Frustum(0.025, 0.05, 0.1 * math.sqrt(15) / 4, 2 * math.pi)  # rolls to r = 100..200 mm, 90 deg
    sheet = SectorSheet.of_frustum(link)
    assert sheet.angle == pytest.approx(math.pi / 2, rel=1e-14)
    assert (sheet.length, sheet.breadth) == pytest.approx((PAPER.length, PAPER.breadth), rel=1e-14)
    turned = SectorSheet.of_frustum(Frustum(0.05, 0.025, 0.1 * math.sqrt(15) / 4, 2 * math.pi))
    assert turned.length / turned.breadth == pytest.approx(sheet.length / sheet.breadth, rel=1e-14)


def test_edge_distances() -> None:
    u, phi = PAPER.from_polar(0.15, math.radians(30))
    assert PAPER.edge_distances(u, phi) == pytest.approx(
        [0.05, 0.05, 0.15 * math.sin(math.radians(30)), 0.15 * math.sin(math.radians(60))]
    )
    full = SHEETS["full turn"]
    assert np.isinf(full.edge_distances(0.05, 0.5 * full.wrap)[2:]).all()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: SectorSheet(0.0, 0.0, 0.1, 1.0), r"width of the sheet must be positive and finite \[m\], got 0.0"),
        (lambda: SectorSheet(0.1, 0.0, math.nan, 1.0), "arc of the sheet must be positive"),
        (lambda: SectorSheet(0.1, -10.0, 0.1, 1.0), "apex lies outside"),
        (lambda: SectorSheet(0.1, 10.0, 0.7, 1.0), "at most a full turn"),
        (lambda: SectorSheet.of_sector(0.0, 0.1, 1.0), "r1 must be positive"),
        (lambda: SectorSheet(0.1, 0.0, 0.1, 1.0).from_polar(1.0, 0.0), "no polar radius"),
    ],
)
def test_impossible_sheets_are_refused(make, message) -> None:
    with pytest.raises(FieldError, match=message):
        make()
