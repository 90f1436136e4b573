from __future__ import annotations

import math
from functools import partial

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.impact.permissible_speed import taylor_integrator
from coneskin.impact.permissible_speed.two_mass_contact import DrivenArm, StruckBody, TwoMassContact
from coneskin.skin.materials import Padding
from tests.support.stored_energy import stored_energy

#: as exactly as it can
integrate = partial(taylor_integrator.integrate, tolerance=1e-13)

WALL = StruckBody(math.inf)
ELASTIC = Padding(loss=0.0)
LINEAR = Padding(thickness=1.0, stiffness=60e3, loss=0.0)


def model(speed: float = 0.4, arm: float = 8.0, body: float = 2.0, padding: Padding = ELASTIC) -> TwoMassContact:
    """Two free masses."""
    return TwoMassContact(DrivenArm(speed, arm), StruckBody(body), padding)


@pytest.mark.parametrize("speed", [1e-3, 0.3, 5.0])
@pytest.mark.parametrize(("arm", "body"), [(5.0, 0.6), (1e3, 1e-3), (1e-3, 1e3), (math.inf, 1.0), (5.0, math.inf)])
def test_two_free_masses_and_a_spring_have_the_peak_and_the_impulse_of_the_formula(
    speed: float, arm: float, body: float
) -> None:
    """ISO/TS 15066, annex A: F = v sqrt(mu k); what a spring gives back is 2 mu v."""
    reduced = 1.0 / (1.0 / arm + 1.0 / body)
    padding = Padding(thickness=10.0, stiffness=60e3, loss=0.0)
    swing = math.sqrt(reduced / 60e3)
    course = integrate(TwoMassContact(DrivenArm(speed, arm), StruckBody(body), padding), 4.0 * swing)
    assert course.peak == pytest.approx(speed * math.sqrt(reduced * 60e3), rel=1e-13)
    assert course.peak_time == pytest.approx(0.5 * math.pi * swing, rel=1e-6)  # a peak is flat
    assert course.impulse == pytest.approx(2.0 * reduced * speed, rel=1e-12)
    assert course.last == 0.0


@pytest.mark.parametrize("loss", [1e-3, 0.3, 5.0])
def test_a_mass_on_a_wall_goes_as_deep_as_the_first_integral_says(loss: float) -> None:
    """Hunt and Crossley (1975): m v dv / (1 + loss v) = -k s ds from v to 0."""
    padding = Padding(thickness=1.0, stiffness=60e3, loss=loss)
    course = integrate(TwoMassContact(DrivenArm(0.5, 5.0), WALL, padding), 0.1)
    work = 5.0 * (0.5 / loss - math.log1p(0.5 * loss) / loss**2)
    assert course.deepest == pytest.approx(math.sqrt(2.0 * work / 60e3), rel=1e-11)


def test_bottoming_out_goes_on_where_the_soft_spring_ends() -> None:
    """The peak of a mass on two springs in a row, by its energy."""
    padding = Padding(thickness=2e-3, stiffness=10e3, hard_stiffness=1e6, loss=0.0)
    course = integrate(TwoMassContact(DrivenArm(0.5, 5.0), WALL, padding), 0.1)
    left = 0.5 * 5.0 * 0.5**2 - stored_energy(padding, 2e-3)
    force, k = 20.0, 1e6  # at its end, and beyond
    beyond = (-force + math.sqrt(force**2 + 2.0 * k * left)) / k
    assert course.deepest == pytest.approx(2e-3 + beyond, rel=1e-12)
    assert course.peak == pytest.approx(force + k * beyond, rel=1e-12)


@settings(max_examples=40, deadline=None)
@given(
    speed=st.floats(1e-3, 5.0),
    arm=st.floats(-3.0, 3.0).map(lambda n: 10.0**n),
    body=st.floats(-3.0, 3.0).map(lambda n: 10.0**n),
    soft=st.floats(3.0, 6.0).map(lambda n: 10.0**n),
    harder=st.floats(0.0, 4.0).map(lambda n: 10.0**n),
    thickness=st.floats(-4.0, -1.0).map(lambda n: 10.0**n),
)
def test_energy_and_momentum_are_kept_without_damping(
    speed: float, arm: float, body: float, soft: float, harder: float, thickness: float
) -> None:
    padding = Padding(thickness, soft, soft * harder, 0.0)
    reduced = 1.0 / (1.0 / arm + 1.0 / body)
    course = integrate(model(speed, arm, body, padding), 8.0 * math.sqrt(reduced / soft))
    for stretch in course.stretches:
        s, w, v = stretch.compression[0], stretch.rate[0], stretch.speed[0]
        energy = 0.5 * arm * (w + v) ** 2 + 0.5 * body * v**2 + stored_energy(padding, s)
        assert energy == pytest.approx(0.5 * arm * speed**2, rel=1e-9)
        assert arm * (w + v) + body * v == pytest.approx(arm * speed, rel=1e-9)
    assert course.impulse == pytest.approx(2.0 * reduced * speed, rel=1e-9)


@settings(max_examples=30, deadline=None)
@given(speed=st.floats(0.01, 5.0), arm=st.floats(0.1, 100.0), body=st.floats(0.1, 100.0))
def test_without_damping_the_way_out_is_the_way_in_backwards(speed: float, arm: float, body: float) -> None:
    course = integrate(model(speed, arm, body), 0.5)
    assert course.force(-1e-9) == course.force(course.end + 1e-9) == 0.0
    for since in (0.1, 0.4, 0.9):
        t = since * course.peak_time
        assert course.force(course.peak_time + t) == pytest.approx(course.force(course.peak_time - t), rel=1e-6)


@settings(max_examples=30, deadline=None)
@given(
    speed=st.floats(0.01, 5.0),
    arm=st.floats(-1.0, 3.0).map(lambda n: 10.0**n),
    body=st.floats(-1.0, 3.0).map(lambda n: 10.0**n),
    loss=st.floats(0.0, 10.0),
    hard=st.floats(4.0, 7.0).map(lambda n: 10.0**n),
)
def test_damping_takes_energy_and_never_pulls(speed: float, arm: float, body: float, loss: float, hard: float) -> None:
    padding = Padding(hard_stiffness=hard, loss=loss)
    course = integrate(model(speed, arm, body, padding), 0.2)
    before = 0.5 * arm * speed**2
    for stretch in course.stretches:
        s, w, v = stretch.compression[0], stretch.rate[0], stretch.speed[0]
        energy = 0.5 * arm * (w + v) ** 2 + 0.5 * body * v**2 + stored_energy(padding, s)
        assert energy <= before * (1.0 + 1e-9)
        before = min(before, energy)
        assert all(course.force(stretch.start + part * stretch.duration) >= -1e-9 for part in (0.3, 0.7))


def test_a_heavy_arm_with_stiff_servos_is_felt_as_one_of_infinite_mass() -> None:
    """The limit of a rigid arm: what is driven exactly along its way. With servos of 15 Hz it goes beyond a little."""
    driven = integrate(TwoMassContact(DrivenArm(0.3, reaction=0.01, deceleration=3.0), StruckBody(0.6, support=20e3)))
    for mass, turn, near in ((1e6, 94.0, 0.05), (1e6, 3e3, 1e-3)):
        arm = DrivenArm(0.3, mass, mass * turn**2, 2.0 * mass * turn, 0.01, 3.0)
        course = integrate(TwoMassContact(arm, StruckBody(0.6, support=20e3)))
        assert course.peak == pytest.approx(driven.peak, rel=near)
        assert course.last == pytest.approx(driven.last, rel=near)


def test_no_damping_is_the_limit_of_little() -> None:
    none = integrate(model(padding=ELASTIC), 0.1).peak
    for loss in (1e-3, 1e-6):
        assert integrate(model(padding=Padding(loss=loss)), 0.1).peak == pytest.approx(none, rel=2.0 * loss)


def test_the_arm_brakes_a_reaction_time_after_the_layers_close() -> None:
    """At a constant speed into a wall, the force closes them where loss and spring say."""
    padding = Padding(loss=0.3)
    arm = DrivenArm(0.2, reaction=0.02, deceleration=4.0)
    course = integrate(TwoMassContact(arm, WALL, padding, closing_force=0.5))
    assert course.closed == pytest.approx(0.5 / (10e3 * 0.2 * (1.0 + 0.3 * 0.2)), rel=1e-12)
    assert course.braked == pytest.approx(course.closed + 0.02, rel=1e-15)
    way = 0.2 * course.braked + 0.2**2 / 8.0
    assert course.stopping_distance == pytest.approx(way, rel=1e-13)
    assert course.rest == pytest.approx(padding.elastic(way), rel=1e-12)
    assert course.last == pytest.approx(course.rest, rel=1e-9)


def test_what_is_too_light_to_close_the_layers_stops_nothing() -> None:
    course = integrate(model(speed=0.2, body=3e-4, padding=Padding()))
    assert 0.05 < course.peak < 0.5
    assert math.isinf(course.closed)
    assert math.isinf(course.stopping_distance)


def test_a_held_body_is_pressed_at_rest_as_springs_in_series_say() -> None:
    arm = DrivenArm(0.1, 8.0, 70e3, 1500.0, 0.01, 5.0)
    body = StruckBody(0.6, tissue=50e3, support=20e3, damping=60.0)
    course = integrate(TwoMassContact(arm, body, Padding(stiffness=10e3)))
    soft = 1.0 / (1 / 10e3 + 1 / 50e3 + 1 / 20e3 + 1 / 70e3)
    assert course.last == pytest.approx(soft * course.stopping_distance, rel=1e-9)


@pytest.mark.parametrize(("speed", "bottomed_out"), [(0.1, False), (0.3, True)])
def test_a_contact_that_has_come_to_rest_is_not_integrated_any_more(speed: float, bottomed_out: bool) -> None:
    """Its last stretch is the balance of the springs of padding and servos, by hand."""
    padding = Padding(thickness=2e-3, stiffness=10e3, hard_stiffness=1e6, loss=1.0)
    course = taylor_integrator.integrate(
        TwoMassContact(DrivenArm(speed, 8.0, 40e3, 400.0, 0.012, 5.0), WALL, padding), 2.0
    )
    soft = course.stopping_distance / (1 / 10e3 + 1 / 40e3)
    hard = (course.stopping_distance - 2e-3 + 20.0 / 1e6) / (1 / 1e6 + 1 / 40e3)  # 20 N at 2 mm
    last = course.stretches[-1]
    assert last.force == (pytest.approx(hard if bottomed_out else soft, rel=1e-12),)
    assert last.start < 1.1
    assert last.start + last.duration == pytest.approx(2.0)


@pytest.mark.parametrize("speed", [0.0, 1e-6, 5.0])
@pytest.mark.parametrize("body", [1e-3, 1e3])
@pytest.mark.parametrize("arm", [1e-3, 1e3, math.inf])
def test_the_stiffest_contacts_stay_finite(speed: float, body: float, arm: float) -> None:
    """1e7 N/m, 1 g to 1 t, 0 to 5 m/s."""
    stiff = Padding(thickness=1e-3, stiffness=1e4, hard_stiffness=1e7)
    course = integrate(TwoMassContact(DrivenArm(speed, arm, reaction=0.01), StruckBody(body), stiff), 0.02)
    assert math.isfinite(course.peak)
    assert course.peak <= speed * math.sqrt(1e7 / (1.0 / arm + 1.0 / body)) * (1.0 + 0.3 * speed) + 1e-12
    assert course.impulse >= 0.0


def test_a_contact_so_slow_that_its_layers_close_later_rests_as_one_that_closes_them_in_time() -> None:
    """Otherwise the slowest of all would count as one that nothing stops."""
    body = StruckBody(0.6, support=1e3, damping=20.0)
    contact = TwoMassContact(DrivenArm(1e-4, 8.0, 72e3, 1500.0, 0.01, 5.0), body)
    assert math.isinf(integrate(contact).closed)
    assert integrate(contact).rest == pytest.approx(0.5, abs=0.01)
    assert integrate(contact, 8.0).closed == pytest.approx(contact.way_to_close / 1e-4, rel=0.01)


def test_a_free_body_that_is_pushed_along_has_no_force_at_rest() -> None:
    course = integrate(TwoMassContact(DrivenArm(1e-3, 8.0, 72e3, 1500.0, 0.01, 5.0), StruckBody(1.0)))
    assert math.isinf(course.closed)
    assert course.rest == 0.0


@pytest.mark.parametrize(("part", "mode"), [(0.5, 0), (1.5, 1)])
def test_a_padding_that_follows_again_is_bottomed_out_only_beyond_its_thickness(part: float, mode: int) -> None:
    run = taylor_integrator._Integration(model(padding=Padding()), 1.0, True, math.inf, 1e-6)
    run.mode, run.s = taylor_integrator._RELEASED, part * run.law.pieces[1][0]
    run._switch("follow")
    assert run.mode == mode


@settings(max_examples=30, deadline=None)
@given(
    speed=st.floats(0.01, 5.0),
    arm=st.floats(0.0, 3.0).map(lambda n: 10.0**n),
    body=st.floats(-3.0, 1.0).map(lambda n: 10.0**n),
    loss=st.sampled_from([0.0, 0.3, 2.0]),
    support=st.sampled_from([0.0, 20e3]),
    hard=st.floats(4.0, 7.0).map(lambda n: 10.0**n),
)
def test_without_a_wish_a_contact_is_exact_to_a_millionth(
    speed: float, arm: float, body: float, loss: float, support: float, hard: float
) -> None:
    driven = DrivenArm(speed, arm, arm * 1e4, 2e2 * arm, 0.012, 3.0)
    struck = StruckBody(body, 75e3, support, 0.6 * math.sqrt(support * body))
    contact = TwoMassContact(driven, struck, Padding(hard_stiffness=hard, loss=loss))
    found, exact = taylor_integrator.integrate(contact, 0.05), integrate(contact, 0.05)
    assert found.peak == pytest.approx(exact.peak, rel=1e-6)
    assert found.last == pytest.approx(exact.last, abs=1e-6 * exact.peak)
    assert found.deepest == pytest.approx(exact.deepest, rel=1e-6)
    assert found.impulse == pytest.approx(exact.impulse, rel=1e-6)
    assert len(found.stretches) <= len(exact.stretches)
