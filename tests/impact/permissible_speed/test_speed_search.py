from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.impact.permissible_speed.limits_file import ForceLimits
from coneskin.impact.permissible_speed.speed_map import _keeps, permissible_speed
from coneskin.impact.permissible_speed.two_mass_contact import DrivenArm, StruckBody, TwoMassContact
from coneskin.skin.materials import Padding


@pytest.mark.parametrize(("arm", "body", "k"), [(10.0, 0.6, 75e3), (5.0, 4.4, 50e3), (20.0, 40.0, 25e3)])
def test_for_free_masses_it_is_the_speed_of_the_standards_formula(arm: float, body: float, k: float) -> None:
    """ISO/TS 15066, annex A: v = F / sqrt(mu k)."""
    padding = Padding(thickness=1.0, stiffness=1e9, loss=0.0)  # as good as none
    limits = ForceLimits(140.0, 140.0)
    found = permissible_speed(lambda v: [TwoMassContact(DrivenArm(v, arm), StruckBody(body, k), padding)], limits)
    exact = 140.0 / math.sqrt(k / (1.0 / arm + 1.0 / body))
    assert exact * 0.995 < found <= exact * 1.0001


@pytest.mark.long
@settings(max_examples=20, deadline=None)
@given(
    mass=st.floats(1.0, 60.0),
    lever=st.floats(0.05, 1.0),
    body=st.floats(0.3, 40.0),
    support=st.sampled_from([0.0, 5e3, 30e3]),
    tissue=st.floats(5e3, 150e3),
    share=st.floats(0.02, 0.98),
)
def test_no_slower_speed_breaks_the_limits(
    mass: float, lever: float, body: float, support: float, tissue: float, share: float
) -> None:
    """The search halves: it is right where the force grows with the speed."""
    limits = ForceLimits(150.0, 120.0)

    def contact(speed: float) -> TwoMassContact:
        arm = DrivenArm(speed, mass, mass * 1e4, mass * 200.0, 0.012, 9.0 * lever)
        return TwoMassContact(arm, StruckBody(body, tissue, support))

    found = permissible_speed(lambda v: [contact(v)], limits)
    assert found > 0.0
    assert _keeps(contact(found), limits)
    assert _keeps(contact(share * found), limits)
    if found < 4.9:
        assert not _keeps(contact(1.02 * found), limits)


def test_a_hard_wall_with_a_slow_reaction_lets_nothing_move() -> None:
    stiff = Padding(thickness=1e-4, stiffness=1e6, hard_stiffness=1e7)

    def contact(speed: float) -> TwoMassContact:
        return TwoMassContact(DrivenArm(speed, reaction=5.0, deceleration=0.01), StruckBody(math.inf), stiff)

    assert permissible_speed(lambda v: [contact(v)], ForceLimits(10.0, 10.0)) == 0.0


def test_what_keeps_the_limits_at_the_top_may_have_it() -> None:
    limits = ForceLimits(1e4, 1e4)
    found = permissible_speed(lambda v: [TwoMassContact(DrivenArm(v, 1.0), StruckBody(0.01))], limits, top=2.0)
    assert found == 2.0


def test_of_several_contacts_the_one_that_allows_the_least_counts() -> None:
    limits = ForceLimits(140.0, 140.0)

    def contact(speed: float, arm: float) -> TwoMassContact:
        return TwoMassContact(DrivenArm(speed, arm), StruckBody(4.4, 50e3))

    light, heavy = (permissible_speed(lambda v, arm=arm: [contact(v, arm)], limits) for arm in (2.0, 20.0))  # type: ignore[misc]
    assert heavy < 0.9 * light
    for arms in ((2.0, 20.0), (20.0, 2.0)):
        assert permissible_speed(lambda v, arms=arms: [contact(v, arm) for arm in arms], limits) == heavy  # type: ignore[misc]
