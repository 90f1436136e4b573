"""Single scenes by power series: against NGSolve, against the sampled series, and where they are left to others."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.core.errors import FieldError
from coneskin.skin.field.disc import Disc, Discs
from coneskin.skin.field.fourport import Coupling
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.multipole import solve_discs
from coneskin.skin.field.sheet import SectorSheet
from tests.support.field.reference import load_references
from tests.support.field.solution import disc_arrays, field_model
from tests.support.field.solution import solve_discs as ports_of

CYLINDER, LONG = SectorSheet(0.1, 0.0, 0.25, 2.0), SectorSheet(0.3, 0.0, 0.1, 2.0)
CONE, NARROWING = SectorSheet.of_sector(0.1, 0.1, 1.57), SectorSheet(0.1, -5.0, 0.2, 2.0)


def numbers(model: FieldModel, coupling: Coupling) -> list[float]:
    """The six numbers, as `Coupling.error` measures them: ln G, X, Y, and the rest over the bare sheets."""
    aspect = model.sheet.length / model.sheet.breadth
    upper, lower = model.upper_resistance * aspect, model.lower_resistance / aspect
    return [
        math.log(coupling.conductance[0]),
        coupling.x[0],
        coupling.y[0],
        coupling.xx[0] * upper,
        coupling.xy[0] * math.sqrt(upper * lower),
        coupling.yy[0] * lower,
    ]


def error_of(model: FieldModel, coupling: Coupling, exact: Coupling) -> float:
    return max(abs(a - b) for a, b in zip(numbers(model, coupling), numbers(model, exact), strict=True))


@pytest.mark.parametrize("lower", [1000.0, 150.0])
@pytest.mark.parametrize("sheet", [CYLINDER, LONG, CONE, NARROWING])
@pytest.mark.parametrize("places", [[(0.2, 0.3)], [(0.8, 0.7)], [(0.3, 0.8), (0.7, 0.3)], [(0.2, 0.2), (0.3, 0.8)]])
def test_a_scene_is_that_of_the_sampled_series(
    sheet: SectorSheet, lower: float, places: list[tuple[float, float]]
) -> None:
    """At every corner of the sheet, along it and across: the mirrors, the turns and the pairs in either order."""
    model = FieldModel(sheet, 1000.0, lower)
    scene = [(x * sheet.width, y * sheet.wrap, 0.008, 40.0 * (i + 1)) for i, (x, y) in enumerate(places)]
    found = model._scenes.solve(scene)
    exact, _ = solve_discs(sheet, 1000.0, lower, Discs(*np.array([scene]).transpose(2, 0, 1)), 24, 80)
    assert found is not None
    assert error_of(model, found, exact) < 1e-12


@pytest.mark.long
@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-9])
def test_the_error_that_is_told_holds_against_finite_elements(tolerance: float) -> None:
    """170 sensors of NGSolve; what is asked is kept, and what is told is neither less than the error nor idle."""
    told, true, left = [], [], 0
    for reference in load_references():
        problem = reference.problem
        if not problem.discs or problem.name.startswith("clipped"):
            continue
        scene = list(zip(*(a[0].tolist() for a in np.broadcast_arrays(*disc_arrays(problem))), strict=True))
        coupling = field_model(problem, tolerance)._scenes.solve(scene)
        left += coupling is None
        if coupling is not None:
            volts = ports_of(problem, coupling=coupling).voltages
            told.append(float(coupling.error[0]))
            true.append(float(np.abs(volts - reference.ports.voltages).max()) - reference.estimate)
    assert len(told) > 4 * left
    assert max(told) <= tolerance
    assert all(a >= b for a, b in zip(told, true, strict=True))
    assert np.median(told) > 1e-4 * tolerance


def test_the_error_that_is_told_holds_where_symmetry_hides_the_orders() -> None:
    draw = np.random.default_rng(11)
    for _ in range(25):
        sheet = SectorSheet(0.1, 0.0, 0.1 * 10.0 ** draw.uniform(-0.7, 0.7), 2.0)
        lower = 1000.0 * 10.0 ** draw.choice([0.0, -2.0, 0.8])
        radius = 0.5 * min(sheet.width, sheet.arc) * draw.uniform(0.1, 0.8)
        scene = [(0.05, 1.0, radius, (10.0 ** draw.uniform(-1.0, 1.0) / radius) ** 2 / (1000.0 + lower))]
        exact, _ = solve_discs(sheet, 1000.0, lower, Discs(*np.array([scene]).transpose(2, 0, 1)), 64)
        for tolerance in (1e-3, 1e-5, 1e-7):
            model = FieldModel(sheet, 1000.0, lower, tolerance)
            found = model._scenes.solve(scene)
            if found is not None:
                assert error_of(model, found, exact) <= found.error[0] <= tolerance, (sheet, scene, lower)


@pytest.mark.parametrize("unit", [1e-3, 1e3])
def test_the_error_that_is_told_has_no_unit(unit: float) -> None:
    """Sheets of a thousand times the ohms, with contacts of as much less siemens, are the same field."""
    scene, errors = [(0.04, 0.5, 0.012, 40.0), (0.06, 0.7, 0.008, 900.0)], []
    for scale in (1.0, unit):
        model = FieldModel(CONE, 1000.0 * scale, 150.0 * scale, 1e-5)
        found = model._scenes.solve([(u, phi, radius, g / scale) for u, phi, radius, g in scene])
        assert found is not None
        errors.append(found.error[0])
    assert errors[1] == pytest.approx(errors[0], rel=1e-6)


def test_a_model_answers_one_scene_as_it_answers_many() -> None:
    model = FieldModel(CONE, 1000.0, 300.0, 1e-9)
    many = model.contacts([0.05, 0.04], [0.6, 0.6], 0.01, 30.0)
    for one in (
        model.contacts(0.05, 0.6, 0.01, 30.0),
        model.contacts([0.05], [0.6], 0.01, 30.0),
        model.discs([Disc(0.05, 0.6, 0.01, 30.0)]),
    ):
        assert 1e-13 < one.error[0] <= 1e-9
        for name in ("conductance", "x", "y", "xx", "xy", "yy"):
            assert getattr(one, name) == pytest.approx(getattr(many, name)[:1], rel=1e-9), name


@pytest.mark.parametrize(
    "scene",
    [
        [(0.01, 0.6, 0.01, 1.0)],  # touches end 1
        [(0.05, 0.6, 0.01, math.nan)],
        [(math.nan, 0.6, 0.01, 1.0)],
        [(0.05, 0.6, 0.01, 1.0), (0.05, 0.65, 0.01, 1.0)],  # overlap
        [(0.05, 0.6, 0.01, math.inf), (0.05, 0.6 + 0.02002 / 0.15, 0.01, math.inf)],  # a thousandth of a radius apart
        [(0.045, 0.785, 0.0449, 10.0)],  # fills the sheet
    ],
)
def test_what_cannot_be_or_needs_more_is_left_to_the_multipoles(scene: list[tuple[float, float, float, float]]) -> None:
    assert FieldModel(CONE, 1000.0, 300.0, 1e-9)._scenes.solve(scene) is None


def test_a_disc_that_cannot_be_is_refused_by_name() -> None:
    with pytest.raises(FieldError, match="must lie inside the sheet"):
        FieldModel(CONE, 1000.0, 300.0).contacts(0.005, 0.6, 0.01, 1.0)


def test_no_contact_has_its_centre_and_no_conductance() -> None:
    found = FieldModel(CYLINDER, 1000.0, 300.0)._scenes.solve([(0.05, 0.5, 0.01, 0.0)])
    assert found is not None
    assert found.conductance[0] == 0.0
    assert (found.x[0], found.y[0]) == pytest.approx((0.5, 0.25))
    assert found.xx[0] == 0.0
