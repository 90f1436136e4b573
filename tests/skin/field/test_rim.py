"""Discs beside the apex: against a reference with truncation, quadrature and Green function of its own."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.core.errors import FieldError
from coneskin.skin.field.disc import Disc, Discs
from coneskin.skin.field.green import Strip
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.multipole import FIRST, solve_discs
from coneskin.skin.field.rim import _log_weights, _RimPoints, solve_rims
from coneskin.skin.field.sheet import SectorSheet
from tests.support.field import rim_solution
from tests.support.sweep import sweep

from ..field_cases import PAPER

#: r1/width, distance of the centre from end 1 over r1, sector angle, sheet ratio, ka.
APEX = {
    "bond": (1e-5, 24.0, 3.0, 1.0, math.inf),
    "bond, 1 : 500, full turn": (1e-6, 40.0, 6.0, 500.0, math.inf),
    "ka = 3": (1e-5, 24.0, 3.0, 1.0, 3.0),
    "ka = 0.01, 1e4 : 1": (1e-6, 40.0, 6.0, 1e-4, 0.01),
    "ka = 3, where aliasing is the error": (1e-3, 21.0, 2.5, 500.0, 3.0),
    "ka = 10, 1 : 1e6": (1e-3, 21.0, 2.5, 1e6, 10.0),
}


def disc_of(ratio: float, far: float, angle: float, lower: float, ka: float) -> tuple[SectorSheet, Disc]:
    sheet = SectorSheet.of_sector(0.1 * ratio, 0.1, angle)
    u, phi = 0.1 * ratio * far, 0.5 * angle
    radius = 0.98 * float(sheet.edge_distances(u, phi).min())
    return sheet, Disc(u, phi, radius, (ka / radius) ** 2 / (1.0 + lower))


def volts(model: FieldModel, w: np.ndarray) -> np.ndarray:
    return rim_solution.guide_volts(model.sheet, model.upper_resistance, model.lower_resistance, w)


@pytest.mark.parametrize("name", sweep(APEX, short=2))
def test_beside_the_apex_as_the_reference(name: str) -> None:
    case = APEX[name]
    sheet, disc = disc_of(*case)
    model = FieldModel(sheet, 1.0, case[3])
    found = model.discs([disc])
    reference = rim_solution.solve_rims(sheet, 1.0, case[3], [disc], 24)
    limit = 1e-10 if case[3] > 1e5 else 1e-12  # between 1 : 1e6 the reference itself scatters by 4e-11 with its nodes
    assert np.abs(volts(model, found.matrix()[0]) - volts(model, reference)).max() < limit
    assert found.error[0] <= 1e-12
    # What was returned without a word before: multipoles up to 128.
    one = Discs(*(np.array([[v]]) for v in (disc.u, disc.phi, disc.radius, disc.conductance)))
    cut, _ = solve_discs(sheet, 1.0, case[3], one, FIRST)
    off = float(np.abs(volts(model, cut.matrix()[0]) - volts(model, reference)).max())
    assert off <= max(cut.error[0], 1e-15)


@pytest.mark.long
def test_between_sheets_of_1_to_1e6_multipoles_of_a_high_order_agree() -> None:
    """Where the reference scatters: another expansion, at three times the order that is enough elsewhere."""
    case = APEX["ka = 10, 1 : 1e6"]
    sheet, disc = disc_of(*case)
    model = FieldModel(sheet, 1.0, case[3])
    one = Discs(*(np.array([[v]]) for v in (disc.u, disc.phi, disc.radius, disc.conductance)))
    multipoles, _ = solve_discs(sheet, 1.0, case[3], one, 384)
    difference = volts(model, model.discs([disc]).matrix()[0]) - volts(model, multipoles.matrix()[0])
    assert np.abs(difference).max() < 1e-13


@pytest.mark.parametrize("ka", [1e-4, 0.3, 5.0, pytest.param(20.0, marks=pytest.mark.long), math.inf])
def test_where_multipoles_converge_both_agree(ka: float) -> None:
    radius = 0.02
    one = Discs(*(np.array([[v]]) for v in (0.04, 0.8, radius, (ka / radius) ** 2 / 3.0)))
    rims, multipoles = solve_rims(PAPER, 1.0, 2.0, one, 1e-12), FieldModel(PAPER, 1.0, 2.0).contacts(*vars_of(one))
    assert rims.conductance[0] == pytest.approx(multipoles.conductance[0], rel=1e-12)
    assert rims.x[0] == pytest.approx(multipoles.x[0], abs=1e-13)
    assert rims.y[0] == pytest.approx(multipoles.y[0], abs=1e-13)
    for name in ("xx", "xy", "yy"):
        limit = 1e-12 * max(multipoles.xx[0], multipoles.yy[0])
        assert getattr(rims, name)[0] == pytest.approx(getattr(multipoles, name)[0], abs=limit)


def vars_of(discs: Discs) -> tuple[np.ndarray, ...]:
    return discs.u, discs.phi, discs.radius, discs.conductance


def test_two_discs_agree_too() -> None:
    two = Discs(np.array([[0.03, 0.062]]), np.array([[0.8, 0.9]]), np.full((1, 2), 0.015), np.array([[np.inf, 2e4]]))
    rims, multipoles = solve_rims(PAPER, 1.0, 2.0, two, 1e-12), FieldModel(PAPER, 1.0, 2.0).contacts(*vars_of(two))
    assert np.allclose(rims.matrix(), multipoles.matrix(), rtol=1e-12, atol=1e-13)


def test_what_is_not_solved_is_refused() -> None:
    """A perfect bond 1e-5 radii from an edge, between very unequal sheets."""
    model = FieldModel(PAPER, 1.0, 3e-5, tolerance=1e-6)
    with pytest.raises(FieldError, match=r"scene 0 \(u=0.0200002 m.*only to about .* of the supply, the tolerance is"):
        model.contacts(0.02 * (1 + 1e-5), 0.7, 0.02)


def test_a_disc_that_touches_an_edge_is_solved() -> None:
    """No point may lie where it touches: both distances vanish there, and their ratio was noise of 1e-5."""
    model = FieldModel(PAPER, 1.0, 2.0)
    touching, beside = (model.contacts(0.02 * (1 + gap), 0.7, 0.02) for gap in (0.0, 1e-9))
    assert touching.error[0] <= 1e-12
    assert touching.conductance[0] == pytest.approx(beside.conductance[0], rel=1e-7)
    assert touching.x[0] == pytest.approx(beside.x[0], abs=1e-8)


def test_weights_integrate_the_logarithm() -> None:
    """The integral of ln(4 sin^2(t/2)) cos(m t) over a turn is -2 pi/m, and 0 for m = 0."""
    t = 2.0 * math.pi * np.arange(16) / 16
    for m in range(8):
        wanted = -2.0 * math.pi / m * np.cos(m * t) if m else 0.0 * t
        assert np.allclose(_log_weights(16) @ np.cos(m * t), wanted, atol=1e-13)


def test_points_crowd_beside_the_apex() -> None:
    sheet, disc = disc_of(*APEX["bond, 1 : 500, full turn"])
    one = Discs(*(np.array([[v]]) for v in (disc.u, disc.phi, disc.radius, disc.conductance)))
    points = _RimPoints.of(sheet, Strip.of(sheet.length, sheet.breadth), one, 16)
    gap = float(sheet.stretch(disc.u)) / sheet.curvature / disc.radius - 1.0
    theta = np.sort(np.remainder(points.theta[0], 2.0 * math.pi))
    near = np.diff(theta)[np.abs(theta[1:] - math.pi) < gap]
    assert near.max() < 0.5 * gap
    assert np.allclose(np.gradient(points.theta[0], points.t)[2:-2], points.speed[0][2:-2], rtol=0.1)
