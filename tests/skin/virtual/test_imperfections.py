"""Force to contact: the foam's delay in closed form, the threshold, and the law of touch."""

from __future__ import annotations

import math

import pytest

from coneskin.core.errors import SensorError
from coneskin.skin.virtual.imperfections import ContactLaw, Foam


def test_layers_close_at_the_papers_threshold() -> None:
    layers = ContactLaw()
    assert layers.touch(0.5) == (0.0, 0.0)
    assert layers.touch(0.5 + 1e-9).siemens > 0.0
    assert layers.touch(1.5) == pytest.approx((4e-3, 20.0))
    assert layers.touch(1.5).siemens == pytest.approx(1e-3, rel=6e-3)  # pi 0.004^2 20 = 1.0053e-3
    # Hertz: eight times the force, twice the radius, twice the pressure
    assert layers.touch(8.5).radius == pytest.approx(2 * layers.touch(1.5).radius)
    assert layers.touch(8.5).conductance == pytest.approx(2**0.95 * 20.0)


def test_a_flat_body_keeps_its_radius_and_presses_harder() -> None:
    layers = ContactLaw()
    assert layers.touch(8.5, 0.004).radius == 0.004
    assert layers.touch(8.5, 0.004).conductance == pytest.approx(8**0.95 * 20.0)
    round_body = layers.touch(3.0)
    assert layers.touch(3.0, round_body.radius) == pytest.approx(round_body)


def test_foam_delays_by_its_closed_form() -> None:
    foam, force, threshold = Foam(0.02, 0.6), 0.9, 0.5
    delay = 0.02 * math.log(0.6 * force / (force - threshold))
    assert foam.seated(foam.advance(0.0, force, delay), force) == pytest.approx(threshold, rel=1e-12)
    # The step is exact: a hundred small ones are one large one.
    state = 0.0
    for _ in range(100):
        state = foam.advance(state, force, 1e-4)
    assert state == pytest.approx(foam.advance(0.0, force, 1e-2), rel=1e-12)


@pytest.mark.parametrize("rate", [300.0, -300.0, 5.0])
def test_foam_follows_a_swing_as_it_follows_many_small_steps(rate: float) -> None:
    foam, steps, time = Foam(0.02, 0.5), 2000, 0.01
    step, state = time / steps, 0.7
    for n in range(steps):  # the midpoint's force: second order, (300 / s * 5 us)^2 / 24 = 1e-7
        state = foam.advance(state, 2.0 - 1.5 * math.cos(0.4 + rate * (n + 0.5) * step), step)
    assert foam.advance_swing(0.7, 2.0, 1.5, rate, 0.4, time) == pytest.approx(state, rel=1e-6)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Foam(0.0), "relaxation_time must be finite and above 0 s"),
        (lambda: Foam(0.1, 1.0), r"delayed must be in \[0, 1\)"),
        (lambda: ContactLaw(threshold_force=-1.0), "threshold_force must be finite and not negative"),
    ],
)
def test_bad_values_are_refused(make, message) -> None:
    with pytest.raises(SensorError, match=message):
        make()
