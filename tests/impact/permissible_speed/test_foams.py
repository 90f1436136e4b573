from __future__ import annotations

import math
import random
from collections.abc import Callable

import pytest

from coneskin.impact.permissible_speed.limits_file import ForceLimits
from coneskin.impact.permissible_speed.speed_map import _speed_within_spread
from coneskin.impact.permissible_speed.taylor_integrator import integrate
from coneskin.impact.permissible_speed.two_mass_contact import DrivenArm, StruckBody, TwoMassContact
from coneskin.skin.materials import Padding
from tests.support.foams import CLOSING_FORCE, KINDS, judge, off, random_case, random_foam
from tests.support.stored_energy import stored_energy

TABLE = ((1e-3, 10.0), (2e-3, 18.0), (3e-3, 36.0), (4e-3, 70.0))


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.long
def test_a_contact_on_a_table_is_that_of_an_integrator_that_shares_no_code(seed: int) -> None:
    chance = random.Random(seed)
    foam, _, at = random_case(chance)
    contact = at(chance.uniform(0.1, 0.8), foam)
    free = TwoMassContact(contact.arm, StruckBody(contact.body.mass, support=contact.body.support), foam)
    course = integrate(free)
    table = off(foam, "as its table says", chance, 1.0)
    peak, lasting, deepest = judge(free, table, foam.loss)
    assert course.peak == pytest.approx(peak, rel=3e-3)
    assert course.deepest == pytest.approx(deepest, rel=3e-3)
    assert max(course.last, course.rest) == pytest.approx(lasting, rel=3e-3, abs=1e-3 * peak)


def test_a_blow_is_as_deep_as_the_energy_under_the_table_says() -> None:
    padding = Padding(table=TABLE, loss=0.0)
    for speed in (0.1, 0.3, 1.0):
        course = integrate(TwoMassContact(DrivenArm(speed, 5.0), StruckBody(math.inf), padding), 0.1)
        assert stored_energy(padding, course.deepest) == pytest.approx(2.5 * speed**2, rel=1e-9)
        assert course.peak == pytest.approx(padding.elastic(course.deepest), rel=1e-9)


def test_the_worst_foam_is_the_softest_pressed_as_the_stiffest() -> None:
    """A slow mass on a wall: within the spread, its energy is least taken up by the softest."""
    padding = Padding(table=TABLE, loss=0.0, spread=0.2)
    wall, depth = StruckBody(math.inf), 3e-3 + 1e-3 * (50.0 - 36.0) / 34.0  # where 1.2 times the table has 60 N

    def found(arm: Callable[[float], DrivenArm], limits: ForceLimits) -> float:
        return _speed_within_spread(lambda v, foam: [TwoMassContact(arm(v), wall, foam)], padding, limits)

    free = found(lambda v: DrivenArm(v, 5.0), ForceLimits(60.0, math.inf))
    assert free == pytest.approx(math.sqrt(2.0 * 0.8 * stored_energy(padding, depth) / 5.0), rel=5e-3)
    stopped = found(lambda v: DrivenArm(v, reaction=0.0), ForceLimits(math.inf, 60.0))  # it goes v^2 / 2 a further
    closes = next(s * CLOSING_FORCE / (0.8 * f) for s, f in TABLE)
    assert stopped == pytest.approx(math.sqrt(2.0 * (depth - closes)), rel=5e-3)


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_no_foam_within_its_spread_presses_more_than_the_limits(kind: str) -> None:
    chance = random.Random(kind)
    for _ in range(6):
        foam, region, at = random_case(chance)
        speed = _speed_within_spread(lambda v, padding, at=at: [at(v, padding)], foam, region.limits)  # type: ignore[misc]
        contact = at(speed, foam)
        deepest = judge(contact, off(foam, "softer", chance, 1.0), foam.loss)[2]
        peak, lasting, _ = judge(contact, off(foam, kind, chance, deepest), foam.loss)
        assert peak <= region.limits.transient
        assert lasting <= region.limits.lasting


def test_random_foams_stiffen_and_can_be_tables() -> None:
    for seed in range(50):
        foam = random_foam(random.Random(seed))
        assert foam.elastic(foam.table[-1][0]) == pytest.approx(foam.table[-1][1])
