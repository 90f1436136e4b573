"""Images in near edges: coefficients against brute sampling, distances against geometry, touching discs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.skin.field.circles import (
    _edge_images,
    _image_coefficients,
    _image_distance,
    _other_disc,
    _pair_coefficients,
    _pair_distance,
    circle,
)
from coneskin.skin.field.disc import Discs
from coneskin.skin.field.fourport import radial_phase
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.multipole import solve_discs
from coneskin.skin.field.sheet import SectorSheet
from tests.support.field.contact_patch import rectangle_offsets
from tests.support.sweep import sweep

from ..field_cases import PAPER, SHEETS

PLACES = [
    (PAPER, 0.02, 0.3, 0.015),
    (PAPER, 0.085, 0.12, 0.012),
    (SHEETS["narrowing"], 0.085, 2.0, 0.008),
    (SHEETS["cylinder"], 0.02, 0.7, 0.014),
]


def scene(u: float, phi: float, radius: float, g: float = math.inf) -> Discs:
    return Discs(*(np.array([[v]]) for v in (u, phi, radius, g)))


@pytest.mark.parametrize(("sheet", "u", "phi", "radius"), PLACES)
def test_coefficients_are_those_of_the_logarithm(sheet: SectorSheet, u: float, phi: float, radius: float) -> None:
    images = _edge_images(sheet, scene(u, phi, radius), 0)
    assert images
    for image in images:
        zeta, _, fourier = circle(7, 800)
        sampled = fourier @ np.log(_image_distance(image, zeta))[0] @ fourier.T
        assert np.abs(_image_coefficients(image, 7)[0] - sampled).max() < 1e-14


def test_distance_is_that_of_the_mirror_image() -> None:
    """Against the geometry of the drawing: reflection in a straight edge, inversion in an arc."""
    u, phi, radius = 0.02, 0.2, 0.015
    zeta, _, _ = circle(3, 8)
    r, theta = (float(v) for v in PAPER.polar(u, phi))
    z = (r + radius * zeta) * np.exp(1j * theta)
    seen = {image.arc: _image_distance(image, zeta)[0] for image in _edge_images(PAPER, scene(u, phi, radius), 0)}
    straight = np.abs(z[:, None] - z.conj()) ** 2
    assert np.allclose(seen[False] / straight, (seen[False] / straight)[0, 0], rtol=1e-13)
    arc = np.abs(z[:, None] - 0.1**2 / z.conj()) ** 2 * np.abs(z) ** 2
    assert np.allclose(seen[True] / arc, (seen[True] / arc)[0, 0], rtol=1e-13)


@pytest.mark.parametrize("lower", [0.03, 30.0])
@pytest.mark.parametrize("gap", sweep([1e-3, 0.1, 1e-6]))
def test_a_disc_may_touch_an_edge(lower: float, gap: float) -> None:
    sheet = SHEETS["cylinder"]
    model = FieldModel(sheet, 1.0, lower)
    radius = 0.01

    def volts(order: int) -> np.ndarray:
        coupling, _ = solve_discs(sheet, 1.0, lower, scene(radius * (1 + gap), 1.1, radius, 1e5), order)
        return model.read(coupling, radial_phase()).electrodes[0]

    error = [float(np.abs(volts(m) - volts(96)).max()) for m in (4, 8, 16, 32)]
    assert error[1] < 0.2 * error[0]
    assert error[2] < 2e-7
    assert error[3] < 2e-10


@pytest.mark.parametrize("name", ["paper", "narrowing", "cylinder"])
def test_from_disc_to_disc(name: str) -> None:
    sheet = SHEETS[name]
    u, phi = np.array([[0.4, 0.55]]) * sheet.width, np.array([[0.5, 0.35]]) * sheet.wrap
    apart = abs(complex(sheet.flat(u[0, 1], phi[0, 1], (u[0, 0], phi[0, 0]))))
    discs = Discs(u, phi, np.array([[0.5, 0.35]]) * apart, np.array([[math.inf, math.inf]]))
    alpha, beta = _other_disc(sheet, discs, 0, 1)
    zeta, _, fourier = circle(6, 900)
    sampled = fourier @ np.log(_pair_distance(alpha, beta, zeta))[0] @ fourier.T
    assert np.abs(_pair_coefficients(alpha, beta, 6)[0] - sampled).max() < 1e-13
    few, _, _ = circle(2, 6)
    w = [
        complex(float(sheet.along(u[0, k])[0]), float(sheet.across(phi[0, k])[0]))
        + rectangle_offsets(sheet, discs.radius[0, k] * few, float(u[0, k]))
        for k in (0, 1)
    ]
    places = [sheet.locate(v.real, v.imag) for v in w]
    drawn = np.array(
        [
            [abs(complex(sheet.flat(a, b, (c, d)))) for a, b in zip(*places[1], strict=True)]
            for c, d in zip(*places[0], strict=True)
        ]
    )
    ratio = drawn**2 / _pair_distance(alpha, beta, few)[0]
    assert np.allclose(ratio, ratio[0, 0], rtol=1e-12)


@pytest.mark.parametrize("g", [1e4, math.inf])
def test_two_discs_may_all_but_touch(g: float) -> None:
    model = FieldModel(PAPER, 1.0, 3.0)
    for gap in (0.1, 0.01, 1e-4):
        half = 0.01 * (1.0 + gap / 2)
        u, phi = np.array([[0.05 - half, 0.05 + half]]), np.array([[0.7, 0.7]])
        best = model.contacts(u, phi, 0.01, g, order=96).matrix()
        got = model.contacts(u, phi, 0.01, g).matrix()
        assert np.abs(got / best - 1.0).max() < 1e-10
        assert np.abs(model.contacts(u, phi, 0.01, g, order=12).matrix() / best - 1.0).max() < 1e-6


def test_coefficients_of_high_orders_are_finite() -> None:
    """At order 432 products of two binomials overflowed beside an arc, and zero times infinity was no number."""
    arcs = [image for image in _edge_images(PAPER, scene(0.0599, 0.8, 0.04), 0) if image.arc]
    assert arcs
    for image in arcs:
        low, high = _image_coefficients(image, 7), _image_coefficients(image, 432)
        assert np.isfinite(high).all()
        assert np.allclose(high[:, :15, :15], low, rtol=1e-13, atol=1e-16)
