from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.core.errors import KinematicsError
from coneskin.robot.arm.inertia import GRAVITY, arm_inertia, held_braking, joint_torques, loaded, mass_matrix
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.arm.models import MODEL_NAMES, arm_model

#: published weights [kg]: user manuals, "Weight", cable not counted
WEIGHTS = {"UR3": 11.0, "UR5": 18.4, "UR10": 28.9, "UR3e": 11.2, "UR5e": 20.6}
WEIGHTS |= {"UR7e": 20.6, "UR10e": 33.5, "UR12e": 33.5, "UR15": 40.7, "UR16e": 33.1, "UR20": 64.0, "UR30": 63.5}
ARMS = pytest.mark.parametrize("name", MODEL_NAMES)


@ARMS
def test_the_links_can_exist_and_weigh_what_the_arm_weighs(name: str) -> None:
    inertia = arm_inertia(name)
    for link in inertia.links:
        a, b, c = np.linalg.eigvalsh(np.array(link.tensor))
        assert a > 0.0
        assert c < a + b  # no body turns harder about one axis than about the two others together
    moving = sum(link.mass for link in inertia.links)
    if name in ("UR18", "UR8 Long"):
        pytest.skip("its weight was found nowhere")
    assert 0.72 < moving / WEIGHTS[name] < 1.0  # without the base, which has 2 to 4 kg


@ARMS
def test_the_mass_matrix_is_that_of_pinocchio(name: str) -> None:
    pytest.importorskip("pinocchio", reason="the independent dynamics are pinocchio's (PyPI: pin)")
    from tests.support.pinocchio_arm import pin_mass_matrix

    model, inertia, source = arm_model(name), arm_inertia(name), np.random.default_rng(1)
    for _ in range(10):
        q = list(source.uniform(-2 * np.pi, 2 * np.pi, 6))
        wanted = pin_mass_matrix(model, inertia, q)
        # rounding of sums of about 100 products
        np.testing.assert_allclose(mass_matrix(model, inertia, q), wanted, rtol=0, atol=1e-13 * wanted.max())


@ARMS
def test_the_torques_are_those_of_pinocchio(name: str) -> None:
    pytest.importorskip("pinocchio", reason="the independent dynamics are pinocchio's (PyPI: pin)")
    from tests.support.pinocchio_arm import pin_torques

    model, inertia, source = arm_model(name), arm_inertia(name), np.random.default_rng(2)
    for _ in range(10):
        q, qd, qdd = (list(source.uniform(-size, size, 6)) for size in (2 * np.pi, 3.0, 40.0))
        wanted = pin_torques(model, inertia, GRAVITY, q, qd, qdd)
        found = joint_torques(model, inertia, q, qd, qdd)
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())


@ARMS
def test_an_arm_at_rest_can_hold_itself(name: str) -> None:
    """Stretched out, its shoulder carries the arm with much of its torque left."""
    inertia = arm_inertia(name)
    torques = joint_torques(arm_model(name), inertia, (0.0,) * 6, (0.0,) * 6, (0.0,) * 6)
    shares = [abs(torque) / limit for torque, limit in zip(torques, inertia.torque, strict=True)]
    assert 0.1 < max(shares) < 0.8


def test_an_arm_without_a_known_inertia_is_refused() -> None:
    bare = ArmModel("other", *((0.0,) * 6,) * 3, (-1.0,) * 6, (1.0,) * 6, (1.0,) * 6)
    with pytest.raises(KinematicsError, match="inertias are known for"):
        arm_inertia(bare)


def test_shoulder_and_wrists_of_the_ur30_have_the_tensors_of_the_ur20() -> None:
    """Their masses are the same, and the published tensors are those of another arm."""
    one, other = arm_inertia("UR30").links, arm_inertia("UR20").links
    assert [(one[k].mass, one[k].tensor) for k in (0, 3, 4, 5)] == [
        (other[k].mass, other[k].tensor) for k in (0, 3, 4, 5)
    ]


#: sum of all numbers of a table, without signs, in units of 1e-9: a digit that changes by accident changes it
_TABLE_SUMS = {
    "UR3": 9_112_341_802,
    "UR5": 18_018_369_271,
    "UR10": 31_766_270_000,
    "UR3e": 9_311_901_700,
    "UR5e": 19_142_858_470,
    "UR7e": 19_142_858_470,
    "UR8 Long": 47_911_063_000,
    "UR10e": 32_435_270_000,
    "UR12e": 32_435_270_000,
    "UR15": 40_739_554_000,
    "UR18": 37_726_652_000,
    "UR16e": 29_510_200_000,
    "UR20": 73_700_550_000,
    "UR30": 66_332_380_000,
}


@ARMS
def test_no_digit_of_a_table_has_changed(name: str) -> None:
    links = arm_inertia(name).links
    numbers = [value for link in links for row in ((link.mass,), link.centre, *link.tensor) for value in row]
    assert round(1e9 * sum(map(abs, numbers))) == _TABLE_SUMS[name]


@pytest.mark.parametrize("payload", [0.0, 10.0])
def test_with_the_braking_that_is_held_one_motor_gives_all_that_it_has(payload: float) -> None:
    model, bare = arm_model("UR10e"), arm_inertia("UR10e")
    q, qd = (0.3, -0.2, 0.4, -1.1, 0.9, 0.5), (0.4, 0.9, -0.7, 0.6, 0.5, -0.8)
    centre = (0.0, 0.02, 0.1)
    braking = held_braking("UR10e", payload, centre)
    assert braking is not None
    held, shares = braking(q, qd), []
    for inertia in (bare, loaded(bare, payload, centre)):
        torques = joint_torques(model, inertia, q, qd, [-held * speed / 0.9 for speed in qd])
        shares += [abs(t) / most for t, most in zip(torques, inertia.torque, strict=True)]
    assert max(shares) == pytest.approx(1.0)
    assert braking(q, (0.0,) * 6) == math.inf


def test_what_it_carries_lets_an_arm_brake_no_harder_and_one_unknown_tells_nothing() -> None:
    q, qd = (0.0,) * 6, (0.0, 1.0, 0.0, 0.0, 0.0, 0.0)
    held = [braking(q, qd) for kg in (0.0, 12.5) if (braking := held_braking("UR10e", kg)) is not None]
    assert held == pytest.approx([17.1, 2.1], abs=0.1)  # rad/s2, of `bench deceleration`
    assert held_braking("another arm") is None


def test_a_joint_that_no_motor_holds_has_the_least_braking() -> None:
    braking = held_braking("UR3e", 30.0)
    assert braking is not None
    assert braking((0.0,) * 6, (0.0, 1.0, 0.0, 0.0, 0.0, 0.0)) == 0.5
