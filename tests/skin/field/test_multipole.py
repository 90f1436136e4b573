"""The exact solver: against finite differences, its own convergence, and the laws that every sensor obeys."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.core.errors import FieldError
from coneskin.skin.field.disc import Disc
from coneskin.skin.field.fourport import angular_phase, radial_phase
from coneskin.skin.field.model import FieldModel, solve
from coneskin.skin.field.sheet import SectorSheet
from tests.support.field import rim_solution
from tests.support.sweep import sweep

from ..field_cases import PAPER, SHEETS, finite_differences, guide_volts

pytestmark = pytest.mark.long


@pytest.mark.parametrize(("name", "lower"), [("paper", 1.0), ("narrowing", 4.0), ("cylinder", 4.0)])
def test_finite_differences_agree(name: str, lower: float) -> None:
    sheet = SHEETS[name]
    model = FieldModel(sheet, 1.0, lower)
    u, phi, radius = 0.4 * sheet.width, 0.3 * sheet.wrap, 0.11 * min(sheet.width, sheet.breadth)
    g = (3.0 / radius) ** 2 / (1.0 + lower)
    ours = guide_volts(model, model.contacts(u, phi, radius, g))[0]
    reference = finite_differences(model, u, phi, radius, g)
    # 110 cells: the scheme and the sampled rim leave 2e-5 to 8e-5; the area effect itself is above 2e-3.
    assert np.abs(ours - reference).max() < 1.5e-4
    shifted = guide_volts(model, model.contacts(u * 1.02, phi, radius, g))[0]
    assert np.abs(shifted - reference).max() > 1e-3  # 2 % away would be seen


@pytest.mark.parametrize("name", list(SHEETS))
@pytest.mark.parametrize("lower", [1.0, 0.2])
def test_error_falls_geometrically_with_the_order(name: str, lower: float) -> None:
    sheet = SHEETS[name]
    model = FieldModel(sheet, 1.0, lower)
    u, phi = 0.55 * sheet.width, 0.4 * sheet.wrap
    radius = 0.5 * float(sheet.edge_distances(u, phi).min())
    volts = [guide_volts(model, model.contacts(u, phi, radius, order=m))[0] for m in (1, 3, 5, 7, 9, 40)]
    error = [float(np.abs(v - volts[-1]).max()) for v in volts[:-1]]
    assert error[0] > 1e-8
    for before, after in itertools.pairwise(error):
        assert after < max(0.2 * before, 1e-14)  # exp(-4 rate) with rate = acosh(2) or ln(r/a) > 0.4


@pytest.mark.parametrize("tolerance", sweep([1e-4, 1e-8, 1e-12], short=0))
def test_automatic_order_keeps_the_tolerance(tolerance: float) -> None:
    rng = np.random.default_rng(5)
    for sheet in SHEETS.values():
        for lower in (1.0, 7.0, 0.01):
            u, phi = rng.uniform(0.02, 0.98, 12) * sheet.width, rng.uniform(0.02, 0.98, 12) * sheet.wrap
            radius = sheet.edge_distances(u, phi).min(axis=1) / (1.0 + 10.0 ** rng.uniform(-1.5, 1.0, 12))
            rough = FieldModel(sheet, 1.0, lower, tolerance=tolerance)
            fine = FieldModel(sheet, 1.0, lower, tolerance=1e-15)
            got = guide_volts(rough, rough.contacts(u, phi, radius))
            best = guide_volts(fine, fine.contacts(u, phi, radius))
            assert np.abs(got - best).max() < 3.0 * tolerance  # an estimate from two orders, not a bound


def test_figure_11c_of_the_design_study_is_minus_a_squared_over_2r() -> None:
    """The mean of the guides C and D at (150 mm, 45 deg), perfect bond, equal sheets: closed form of the law."""
    model = FieldModel(PAPER, 1.0, 1.0)
    for a, published in ((1, -0.003), (5, -0.083), (10, -0.331), (15, -0.747), (20, -1.330)):
        u, phi = PAPER.from_polar(0.15, math.radians(45))
        volts = model.read(model.contacts(u, phi, a * 1e-3), radial_phase()).electrodes[0]
        r = 0.2 * 0.5 ** float(volts[2:].mean())
        assert (r - 0.15) * 1e3 == pytest.approx(published, abs=6e-4)
        assert (r - 0.15) == pytest.approx(-((a * 1e-3) ** 2) / 0.3, rel=0.01)


@pytest.mark.parametrize("name", list(SHEETS))
def test_a_weak_contact_has_no_area_error(name: str) -> None:
    """The mean of a harmonic function over a disc is its value in the middle."""
    sheet = SHEETS[name]
    model = FieldModel(sheet, 1.0, 3.0)
    u, phi = 0.35 * sheet.width, 0.6 * sheet.wrap
    radius = 0.8 * float(sheet.edge_distances(u, phi).min())
    x, y = float(sheet.along(u)[0]) / sheet.length, phi / sheet.wrap
    errors = []
    for g in (1e-3 / radius**2, 1e-6 / radius**2, 1e-300):
        volts = guide_volts(model, model.contacts(u, phi, radius, g))[0]
        errors.append(max(abs(volts[2] - (1.0 - x)), abs(volts[4] - y)))
    assert errors[1] < 2e-3 * errors[0]  # proportional to the conductance
    assert errors[2] < 4e-16  # two roundings


def test_no_contact_and_perfect_bond_are_the_limits() -> None:
    model = FieldModel(PAPER, 1.0, 2.0)
    bond = model.contacts(0.05, 0.7, 0.01)
    near = model.contacts(0.05, 0.7, 0.01, 1e16)
    assert near.conductance[0] == pytest.approx(bond.conductance[0], rel=1e-5)  # ka = 1.7e6, D_0 = 1/ka
    nothing = model.contacts(0.05, 0.7, 0.01, 0.0)
    assert nothing.conductance[0] == nothing.xx[0] == nothing.yy[0] == 0.0
    with pytest.raises(FieldError, match=r"without contact nothing fixes the potential of C and D"):
        model.read(nothing, radial_phase())
    read = model.read(nothing, radial_phase(adc=1e6))
    assert np.allclose(read.terminals[0], [0.0, 1.0, 0.0, 0.0], atol=1e-15)


def test_two_discs_far_apart_and_as_one() -> None:
    """A second contact without conductance changes nothing; two halves of a dumb-bell join continuously."""
    model = FieldModel(PAPER, 1.0, 1.0)
    one = model.discs([Disc(0.05, 0.7, 0.008, 2e4)])
    with_ghost = model.discs([Disc(0.05, 0.7, 0.008, 2e4), Disc(0.07, 1.2, 0.006, 0.0)])
    assert np.allclose(one.matrix(), with_ghost.matrix(), rtol=1e-12, atol=1e-16)
    swapped = [Disc(0.05, 0.4, 0.008, 2e4), Disc(0.07, 1.2, 0.006, 5e3)]
    assert np.allclose(model.discs(swapped).matrix(), model.discs(swapped[::-1]).matrix(), rtol=1e-13)
    weak = [Disc(d.u, d.phi, d.radius, 1e-6) for d in swapped]
    alone = sum(model.discs([d]).matrix() for d in weak)
    assert np.allclose(model.discs(weak).matrix(), alone, rtol=1e-7)  # they add up to first order in g


def test_batch_equals_singles_and_broadcasts() -> None:
    model = FieldModel(PAPER, 1.0, 3.0)
    u, phi = np.array([0.02, 0.05, 0.09]), np.array([0.2, 0.8, 1.4])
    batch = model.contacts(u, phi, 0.004, [1e3, math.inf, 0.5])
    for i, g in enumerate((1e3, math.inf, 0.5)):
        single = model.discs([Disc(u[i], phi[i], 0.004, g)])
        assert np.allclose(batch.matrix()[i], single.matrix()[0], rtol=1e-12)
    scenes = model.contacts(np.array([[0.02, 0.05], [0.03, 0.06]]), 0.7, 0.004, 1e3)
    assert len(scenes) == 2
    coupling = model.contacts(u, phi, 0.004, 1e3)
    radial, angular = model.read(coupling, radial_phase()), model.read(coupling, angular_phase())
    assert radial.terminals.shape == angular.currents.shape == (3, 4)
    assert solve(model, [Disc(0.02, 0.2, 0.004, 1e3)], radial_phase())[0].terminals[0] == pytest.approx(
        radial.terminals[0], rel=1e-13
    )


@settings(max_examples=25)
@given(
    taper=st.one_of(st.just(0.0), st.floats(-0.99999, -1e-3), st.floats(1e-3, 1e6)),
    aspect=st.floats(-2.0, 2.0),
    lower=st.floats(-4.0, 4.0),
    place=st.tuples(st.floats(0.05, 0.95), st.floats(0.05, 0.95)),
    size=st.floats(-6.0, -0.2),
    ka=st.floats(-6.0, 6.0),
)
def test_reciprocity_and_charge_conservation(taper, aspect, lower, place, size, ka) -> None:
    width = 0.1
    kappa = taper / width
    arc = width * 10.0**aspect
    arc = min(arc, 2 * math.pi / abs(kappa)) if kappa else arc
    sheet = SectorSheet(width, kappa, arc, 1.0)
    model = FieldModel(sheet, 1.0, 10.0**lower, tolerance=1e-8)
    u, phi = place[0] * width, place[1]
    radius = 10.0**size * float(sheet.edge_distances(u, phi).min())
    g = (10.0**ka / radius) ** 2
    coupling = model.contacts(u, phi, radius, g)
    y = model.admittance(coupling)[0]
    size_y = np.abs(y).max()
    assert (y == y.T).all()
    assert np.abs(y.sum(axis=0)).max() <= 4e-16 * size_y * 4  # four roundings
    assert np.linalg.eigvalsh(y).min() > -1e-12 * size_y  # passive
    radial, angular = model.read(coupling, radial_phase()), model.read(coupling, angular_phase())
    for read in (radial, angular):
        assert np.abs(read.currents.sum()) <= 1e-15 * np.abs(read.currents).max()
        assert np.isfinite(read.terminals).all()
        assert read.terminals.min() > -1e-9
        assert read.terminals.max() < 1.0 + 1e-9
    # Reciprocity between the phases: (V_C - V_D)/I_1 = -(V_A - V_B)/I_2 at the same supply.
    i1, i2 = radial.currents[0, 1], angular.currents[0, 2]
    cross1 = (radial.electrodes[0, 2] - radial.electrodes[0, 3]) * i2
    cross2 = (angular.electrodes[0, 0] - angular.electrodes[0, 1]) * i1
    assert cross1 == pytest.approx(-cross2, rel=1e-9, abs=5e-16 * (i1 + i2))  # roundings of the potentials


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"u": math.nan}, r"u of a contact must be finite \[m\], got nan"),
        ({"radius": -1e-3}, r"radius of a contact must be positive \[m\], got -0.001"),
        ({"radius": 0.0}, r"radius of a contact must be positive"),
        ({"conductance": -1.0}, r"conductance of a contact must be 0 or more \[S/m\^2\], got -1.0"),
        ({"conductance": math.nan}, r"conductance of a contact must be 0 or more"),
        ({"u": 0.2}, r"centre of a contact must lie on the sheet"),
        ({"phi": -0.1}, r"centre of a contact must lie on the sheet"),
        ({"u": 0.005}, r"a disc must lie inside the sheet.*0.005 m away, the radius is 0.01 m"),
    ],
)
def test_impossible_contacts_are_refused(change: dict, message: str) -> None:
    model = FieldModel(PAPER, 1.0, 1.0)
    contact = {"u": 0.05, "phi": 0.7, "radius": 0.01, "conductance": 1.0} | change
    with pytest.raises(FieldError, match=message):
        model.contacts(**contact)


def test_overlap_order_and_resistance_are_refused() -> None:
    model = FieldModel(PAPER, 1.0, 1.0)
    with pytest.raises(FieldError, match=r"discs must not overlap: contacts 0 and 1 of scene 0 lie 0.004 m inside"):
        model.discs([Disc(0.05, 0.7, 0.01), Disc(0.066, 0.7, 0.01)])
    with pytest.raises(FieldError, match="at least one contact"):
        model.discs([])
    with pytest.raises(FieldError, match="order must be at least 1, got 0"):
        model.contacts(0.05, 0.7, 0.01, order=0)
    for bad in (0.0, -1.0, math.inf, math.nan):
        with pytest.raises(FieldError, match="upper_resistance must be positive"):
            FieldModel(PAPER, bad, 1.0)
    with pytest.raises(FieldError, match="tolerance must be in"):
        FieldModel(PAPER, 1.0, 1.0, tolerance=0.0)


def beside_the_apex(ratio: float, far: float, angle: float, lower: float, ka: float) -> tuple[FieldModel, Disc]:
    """Return a sensor by r1 over its width, and a disc that all but touches an edge, its middle at `far` times r1."""
    sheet = SectorSheet.of_sector(0.1 * ratio, 0.1, angle)
    u, phi = 0.1 * ratio * far, 0.5 * angle
    radius = 0.98 * float(sheet.edge_distances(u, phi).min())
    return FieldModel(sheet, 1.0, lower), Disc(u, phi, radius, (ka / radius) ** 2 / (1.0 + lower))


@pytest.mark.parametrize(("lower", "ka", "limit"), [(500.0, 3.0, 1e-12), (1e6, 10.0, 1e-10), (1.0, math.inf, 1e-12)])
def test_beside_the_apex_it_is_solved_to_its_tolerance(lower: float, ka: float, limit: float) -> None:
    """Against points on the rim, with truncation and quadrature of their own; at 1 : 1e6 these scatter by 4e-11."""
    model, disc = beside_the_apex(1e-3, 21.0, 2.5, lower, ka)
    found, reference = model.discs([disc]), rim_solution.solve_rims(model.sheet, 1.0, lower, [disc], 24)
    ours, theirs = (rim_solution.guide_volts(model.sheet, 1.0, lower, w) for w in (found.matrix()[0], reference))
    assert np.abs(ours - theirs).max() < limit
    assert found.error[0] <= 1e-12


def test_what_is_not_solved_is_refused() -> None:
    """A perfect bond 1e-5 radii from an edge, between very unequal sheets; one that all but touches the apex."""
    model = FieldModel(PAPER, 1.0, 3e-5, tolerance=1e-6)
    with pytest.raises(FieldError, match=r"scene 0 \(u=0.0200002 m.*only to about .* of the supply, the tolerance is"):
        model.contacts(0.02 * (1 + 1e-5), 0.7, 0.02)
    model, disc = beside_the_apex(1e-6, 1000.0, 6.0, 500.0, math.inf)
    with pytest.raises(FieldError, match="leave more room to the apex"):
        model.discs([disc])


def test_a_disc_that_touches_an_edge_is_solved() -> None:
    """No point may lie where it touches: both distances vanish there, and their ratio was noise of 1e-5."""
    model = FieldModel(PAPER, 1.0, 2.0)
    touching, beside = (model.contacts(0.02 * (1 + gap), 0.7, 0.02) for gap in (0.0, 1e-9))
    assert touching.error[0] <= 1e-12
    assert touching.conductance[0] == pytest.approx(beside.conductance[0], rel=1e-7)
    assert touching.x[0] == pytest.approx(beside.x[0], abs=1e-8)
