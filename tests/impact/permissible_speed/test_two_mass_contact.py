from __future__ import annotations

import math

import pytest

from coneskin.core.errors import SensorError
from coneskin.impact.permissible_speed.taylor_integrator import integrate
from coneskin.impact.permissible_speed.two_mass_contact import DrivenArm, StruckBody, TwoMassContact, _CompressionLaw
from coneskin.skin.materials import Padding


def test_without_tissue_the_law_is_the_paddings() -> None:
    padding = Padding()
    law = _CompressionLaw.of(padding)
    for depth in (0.0, 1e-3, 6e-3, 8e-3):
        assert law.under(padding.elastic(depth)) == pytest.approx(depth, rel=1e-14)
    assert law.pieces == padding.pieces == ((0.0, 0.0, 10e3), (6e-3, 60.0, 1e6))
    assert law.loss == padding.loss


def test_tissue_and_padding_are_springs_in_series() -> None:
    padding = Padding()
    law = _CompressionLaw.of(padding, 30e3)
    for force in (10.0, 60.0, 200.0):
        depth = force / 10e3 if force <= 60.0 else 6e-3 + (force - 60.0) / 1e6
        assert law.under(force) == pytest.approx(depth + force / 30e3, rel=1e-13)


@pytest.mark.parametrize("way", [1e-4, 4e-3, 0.05])
def test_at_rest_the_forces_are_in_balance(way: float) -> None:
    arm, body = DrivenArm(0.1, 8.0, 70e3, 1.0), StruckBody(0.6, 50e3, 20e3)
    contact = TwoMassContact(arm, body)
    force, compression = contact.static(way)
    assert way == pytest.approx(compression + force / 20e3 + force / 70e3, rel=1e-13)
    assert contact.law.under(force) == pytest.approx(compression, rel=1e-13)


def test_a_free_body_and_a_free_arm_press_nothing_at_rest() -> None:
    assert TwoMassContact(DrivenArm(0.1), StruckBody(1.0)).static(0.01)[0] == 0.0
    assert TwoMassContact(DrivenArm(0.1, 5.0), StruckBody(math.inf)).static(0.01)[0] == 0.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: DrivenArm(-0.1), "arm.speed must be at least 0 and at most 100 m/s, got -0.1 m/s"),
        (lambda: DrivenArm(math.nan), "arm.speed"),
        (lambda: DrivenArm(0.1, 0.0), "arm.mass must be above 0 kg"),
        (lambda: DrivenArm(0.1, stiffness=math.inf), "arm.stiffness must be at least 0 and finite"),
        (lambda: DrivenArm(0.1, deceleration=0.0), "arm.deceleration"),
        (lambda: DrivenArm(0.1, reaction=-1.0), "arm.reaction"),
        (lambda: StruckBody(0.0), "body.mass"),
        (lambda: StruckBody(1.0, tissue=0.0), "body.tissue"),
        (lambda: StruckBody(1.0, support=-1.0), "body.support"),
        (lambda: TwoMassContact(DrivenArm(0.1), StruckBody(1.0), closing_force=-1.0), "closing_force"),
    ],
)
def test_absurd_values_are_refused_by_name_rule_and_unit(make: object, message: str) -> None:
    with pytest.raises(SensorError, match=message):
        make()  # type: ignore[operator]


def test_a_softer_padding_lowers_the_force_by_the_root_of_the_stiffnesses() -> None:
    """Published: padding cut transient forces by about 40 % (Svarny et al. 2022, arXiv 2203.09872, abstract).

    Bare, a body of tissue k is met with v sqrt(mu k); a padding in series makes k k_p / (k + k_p) of it. 40 % less are
    36 % of the stiffness: that of a padding of 0.56 k.
    """
    arm, hard = DrivenArm(0.3, 12.0), Padding(thickness=1.0, stiffness=1e9, loss=0.0)
    bare = integrate(TwoMassContact(arm, StruckBody(2.0, tissue=75e3), hard)).peak
    soft = Padding(thickness=1.0, stiffness=0.5625 * 75e3, loss=0.0)
    padded = integrate(TwoMassContact(arm, StruckBody(2.0, tissue=75e3), soft)).peak
    assert padded == pytest.approx(0.6 * bare, rel=1e-4)
