from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest
from numpy.polynomial import polynomial
from scipy.linalg import expm

from coneskin.impact.permissible_speed import taylor_integrator
from coneskin.impact.permissible_speed.contact_course import ContactState, greatest
from coneskin.impact.permissible_speed.taylor_integrator import POINTS, _collocate
from coneskin.impact.permissible_speed.two_mass_contact import DrivenArm, StruckBody, TwoMassContact
from coneskin.skin.materials import Padding

#: as exactly as it can
integrate = partial(taylor_integrator.integrate, tolerance=1e-13)

TURN = 2.0 * math.pi * 16.0


def pressed(body: float, arm: float = 1e3, loss: float = 0.3) -> TwoMassContact:
    """A light body held by a spring, that a heavy arm on its servo presses until it stands."""
    driven = DrivenArm(1.0, arm, arm * TURN**2, 2.0 * arm * TURN, 0.012, 3.0)
    return TwoMassContact(driven, StruckBody(body, 75e3, 20e3, 10.0), Padding(hard_stiffness=1e7, loss=loss))


def start_of(model: TwoMassContact, s: float, w: float, x: float, v: float, way: float) -> ContactState:
    return ContactState(s, w, x, v, way, 0.7, 3.0, model.law.pieces[0][2] * s, model.law.pieces[0][2])


def exact(model: TwoMassContact, start: ContactState, time: float) -> list[float]:
    """State after a time by the matrix exponential: without loss the equations are linear."""
    arm, body = model.arm, model.body
    m1, m2 = 1.0 / arm.mass, 1.0 / body.mass
    k1, c1, k, k2, c2 = arm.stiffness, arm.damping, start.slope, body.support, body.damping
    # s, w, x, v, way, drive, braking
    first = np.array([-m1 * (k1 + k), -m1 * c1, -m1 * k1, -m1 * c1, m1 * k1, m1 * c1, 0.0])
    second = np.array([m2 * k, 0.0, -m2 * k2, -m2 * c2, 0.0, 0.0, 0.0])
    matrix = np.zeros((7, 7))
    matrix[0, 1] = matrix[2, 3] = matrix[4, 5] = 1.0
    matrix[5, 6] = -1.0
    matrix[1], matrix[3] = first - second, second
    state = [start.s, start.w, start.x, start.v, start.way, start.drive, start.braking]
    return (expm(matrix * time) @ state)[:4].tolist()


def test_a_linear_contact_is_that_of_the_matrix_exponential() -> None:
    model = pressed(0.6, 8.0, loss=0.0)
    start = start_of(model, 2e-3, 0.1, 1e-3, 0.3, 4e-3)
    found = _collocate(model, start, 2e-3)
    assert found is not None
    assert found.end == pytest.approx(exact(model, start, 2e-3), rel=1e-12)
    for part in (0.2, 0.6, 1.0):
        inside = [polynomial.polyval(part * 2e-3, series) for series in found.series[:4]]
        assert inside == pytest.approx(exact(model, start, part * 2e-3), rel=1e-7)


def test_a_motion_far_faster_than_the_step_dies_away_as_it_does_in_truth() -> None:
    """A body of a microgram, off its place: what is left is the slow motion, as the matrix exponential has it."""
    model = pressed(1e-9, 8.0, loss=0.0)
    start = start_of(model, 2e-3, 0.1, 1e-3, 0.3, 4e-3)
    found = _collocate(model, start, 3e-3)
    assert found is not None
    assert found.end[0] == pytest.approx(exact(model, start, 3e-3)[0], rel=1e-5)
    assert found.tail > 1e-4  # and says that it did not follow it


def test_each_series_keeps_the_equations_with_loss_at_the_points_and_between() -> None:
    model = pressed(0.2, 8.0, loss=0.8)
    start = start_of(model, 2e-3, 0.1, 1e-3, 0.3, 4e-3)
    length = 4e-4
    found = _collocate(model, start, length)
    assert found is not None
    arm, body = model.arm, model.body
    s, w, x, v, f = found.series
    for time in np.linspace(0.0, length, 9):
        value = [polynomial.polyval(time, series) for series in (s, w, x, v, f)]
        slope = [polynomial.polyval(time, polynomial.polyder(series)) for series in (s, w, x, v)]
        force = model.law.pieces[0][2] * value[0] * (1.0 + model.law.loss * value[1])
        assert value[4] == pytest.approx(force, rel=1e-9)
        assert slope[0] == pytest.approx(value[1], rel=1e-6)
        assert slope[2] == pytest.approx(value[3], rel=1e-6)
        a2 = (force - body.support * value[2] - body.damping * value[3]) / body.mass
        way, drive = start.way + time * (0.7 - 1.5 * time), 0.7 - 3.0 * time
        servo = arm.stiffness * (way - value[0] - value[2]) + arm.damping * (drive - value[1] - value[3])
        assert slope[3] == pytest.approx(a2, rel=1e-6)
        assert slope[1] == pytest.approx((servo - force) / arm.mass - a2, rel=1e-6)


def test_a_short_step_errs_by_the_sixteenth_power_of_its_length() -> None:
    """Radau's points have the order of twice their number less one, and one step errs by a power more."""
    model = pressed(0.6, 8.0, loss=0.0)
    start = start_of(model, 2e-3, 0.1, 1e-3, 0.3, 4e-3)
    errors = []
    for length in (0.03, 0.015):
        found = _collocate(model, start, length)
        assert found is not None
        errors.append(abs(found.end[0] - exact(model, start, length)[0]))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0 * POINTS, abs=2.0)


def test_an_arm_of_infinite_mass_goes_as_it_is_driven() -> None:
    model = TwoMassContact(DrivenArm(0.4), StruckBody(0.6, 75e3, 20e3, 10.0), Padding())
    start = start_of(model, 2e-3, 0.1, 1e-3, 0.3, 4e-3)
    found = _collocate(model, start, 2e-3)
    assert found is not None
    s, w, x, v = found.end
    assert s + x == pytest.approx(3e-3 + 0.4 * 2e-3 - 0.5 * 3.0 * 2e-3**2, rel=1e-13)
    assert w + v == pytest.approx(0.4 - 3.0 * 2e-3, rel=1e-12)


def test_a_body_of_ten_grams_that_stays_pressed_is_that_of_sixty_digits() -> None:
    """The number is that of ``bench/impact/reference.py``."""
    assert integrate(pressed(1e-2), 0.1).last == pytest.approx(1317.433237406499, rel=1e-12)


@pytest.mark.parametrize("body", [1e-2, 3e-3])
def test_a_body_of_grams_that_stays_pressed_is_that_of_the_series_alone(
    body: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    course = integrate(pressed(body), 0.1)
    assert any(len(stretch.force) == POINTS + 1 for stretch in course.stretches)
    monkeypatch.setattr(taylor_integrator, "_STEPS_TO_IMPLICIT", 10**9)
    alone = integrate(pressed(body), 0.1)
    assert all(len(stretch.force) > POINTS + 1 for stretch in alone.stretches)
    for name in ("peak", "last", "deepest", "impulse"):
        assert getattr(course, name) == pytest.approx(getattr(alone, name), rel=1e-11), name
    for time in np.linspace(0.01, 0.1, 50):
        assert course.force(time) == pytest.approx(alone.force(time), rel=1e-9)


@pytest.mark.parametrize("body", [1e-2, 1e-3, 1e-4])
def test_a_pressed_body_takes_no_more_steps_the_lighter_it_is(body: float) -> None:
    """The series alone takes 46 267 at 1 g, and ten times as many at 0.1 g."""
    assert len(integrate(pressed(body)).stretches) < 250


@pytest.mark.parametrize("arm", [1e-3, 1.0, 1e3, math.inf])
@pytest.mark.parametrize("body", [1e-4, 1e-2, 1.0])
def test_however_light_it_is_it_rests_as_springs_in_series_say(arm: float, body: float) -> None:
    driven = DrivenArm(0.2, reaction=0.012, deceleration=3.0)
    if math.isfinite(arm):
        driven = DrivenArm(0.2, arm, 1e3 * TURN**2, 2e3 * TURN, 0.012, 3.0)
    model = TwoMassContact(driven, StruckBody(body, 75e3, 20e3, 50.0))
    course = integrate(model, 1.0)
    assert course.last == pytest.approx(model.static(course.stopping_distance)[0], rel=1e-9)
    assert course.peak < 1.5 * course.rest


def test_the_greatest_value_is_found_in_the_first_part_of_a_step_and_not_behind_it() -> None:
    two_tops = polynomial.polyint(-polynomial.polyfromroots([0.1, 0.4, 0.55]))  # it falls from 0.1 to 0.4
    assert greatest(list(two_tops), 1.0) == pytest.approx((0.1, polynomial.polyval(0.1, two_tops)))
    assert greatest([0.0, 2.2, -1.0], 1.0) == pytest.approx((1.0, 1.2))  # its top is at 1.1
