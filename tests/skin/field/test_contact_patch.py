"""The second method that judges the disc solver: against the exact disc, its refinement, and centroids of the weak."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.skin.field.fourport import angular_phase, radial_phase
from coneskin.skin.field.model import FieldModel
from tests.support.field.contact_patch import ContactPatch, disc, ellipse, rectangle, solve_patch
from tests.support.sweep import sweep

from ..field_cases import PAPER, SHEETS


def volts(model: FieldModel, coupling) -> np.ndarray:
    return np.concatenate([model.read(coupling, p(adc=1e9)).terminals for p in (radial_phase, angular_phase)], axis=1)


@pytest.mark.parametrize("name", ["narrowing", "cylinder"])
@pytest.mark.parametrize("ka", sweep([3.0, 0.3, 30.0, math.inf]))
def test_a_round_patch_is_the_disc_and_converges(name: str, ka: float) -> None:
    sheet = SHEETS[name]
    for lower in (1.0, 4.0):
        model = FieldModel(sheet, 1.0, lower)
        u, phi = 0.45 * sheet.width, 0.35 * sheet.wrap
        radius = 0.5 * float(sheet.edge_distances(u, phi).min())
        g = (ka / radius) ** 2 / (1.0 + lower)
        exact = volts(model, model.contacts(u, phi, radius, g))
        errors = [
            float(np.abs(volts(model, solve_patch(model, ContactPatch(u, phi, disc(radius), g), n, r)) - exact).max())
            for n, r in ((16, 4), (24, 7), (32, 14))
        ]
        assert errors[0] < 5e-4
        assert errors[1] < 1e-4
        assert errors[2] < max(0.45 * errors[1], 1e-9)  # twice the rings: order 1.3 and better


@pytest.mark.parametrize(
    ("name", "u", "phi", "outline"),
    [
        ("corner", 0.004, 0.04, disc(0.015)),
        ("middle off the sheet", -0.005, 0.7, disc(0.015)),
        ("ellipse", 0.05, 0.6, ellipse(0.02, 0.01, 0.5)),
        ("rectangle over an edge", 0.05, 0.02, rectangle(0.01, 0.02, 0.3)),
    ],
)
def test_any_outline_converges(name: str, u: float, phi: float, outline) -> None:
    model = FieldModel(PAPER, 1.0, 1.0)
    patch = ContactPatch(u, phi, outline, 3e4)  # ka = 3.7
    best = volts(model, solve_patch(model, patch, 48, 14))
    coarse, fine = (np.abs(volts(model, solve_patch(model, patch, *n)) - best).max() for n in ((16, 4), (32, 8)))
    assert fine < 2.5e-4
    assert fine < 0.7 * coarse or fine < 6e-5


def test_a_weak_patch_has_the_centroid_and_conductance_of_its_area() -> None:
    """First order in the conductance: G = g times area, (X, Y) = mean of (x/L, y/T), by quadrature elsewhere."""
    model = FieldModel(SHEETS["narrowing"], 1.0, 3.0)
    sheet = model.sheet
    u, phi, outline = 0.004, 0.05, disc(0.02)  # over the corner
    coupling = solve_patch(model, ContactPatch(u, phi, outline, 1e-9), 48, 8)
    n = 1500
    x = (np.arange(n) + 0.5) / n * 0.3 * sheet.length
    y = (np.arange(n) + 0.5) / n * 0.3 * sheet.breadth
    us, phis = sheet.locate(x[:, None], y[None, :])
    inside = np.abs(sheet.flat(us, phis, (u, phi))) < 0.02
    weight = inside * sheet.stretch(us) ** 2
    area = weight.sum() * (x[1] - x[0]) * (y[1] - y[0])
    assert coupling.conductance[0] == pytest.approx(1e-9 * area, rel=1e-3)
    assert coupling.x[0] == pytest.approx((weight * x[:, None]).sum() / weight.sum() / sheet.length, rel=1e-3)
    assert coupling.y[0] == pytest.approx((weight * y[None, :]).sum() / weight.sum() / sheet.breadth, rel=1e-3)


def test_reciprocity_charge_and_profile() -> None:
    model = FieldModel(PAPER, 1.0, 2.0)
    g, a = 2e4, 0.012

    def hertz(along, across):
        return g * np.sqrt(np.maximum(0.0, 1.0 - (along**2 + across**2) / a**2))

    y = model.admittance(solve_patch(model, ContactPatch(0.05, 0.7, disc(a), hertz), 32, 8))[0]
    assert (y == y.T).all()
    assert np.abs(y.sum(axis=0)).max() < 1e-15 * np.abs(y).max() * 8
    weak = solve_patch(model, ContactPatch(0.05, 0.7, disc(a), lambda p, q: hertz(p, q) * 1e-12), 32, 12)
    # the mean of the Hertz profile is 2/3; cells at their centroids leave 1 %
    assert weak.conductance[0] == pytest.approx(2 / 3 * g * 1e-12 * math.pi * a * a, rel=0.01)
