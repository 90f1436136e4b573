from __future__ import annotations

import numpy as np
import pytest

from coneskin.core.errors import KinematicsError
from coneskin.robot.arm.inertia import GRAVITY, arm_inertia, joint_torques, mass_matrix
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.arm.ur_models import MODEL_NAMES, arm_model

#: published weights [kg]: user manuals, "Weight", cable not counted
WEIGHTS = {"UR3": 11.0, "UR5": 18.4, "UR10": 28.9, "UR3e": 11.2, "UR5e": 20.6}
WEIGHTS |= {"UR7e": 20.6, "UR10e": 33.5, "UR16e": 33.1, "UR20": 64.0, "UR30": 63.5}
ARMS = pytest.mark.parametrize("name", MODEL_NAMES)


@ARMS
def test_the_links_can_exist_and_weigh_what_the_arm_weighs(name: str) -> None:
    inertia = arm_inertia(name)
    for link in inertia.links:
        a, b, c = np.linalg.eigvalsh(np.array(link.tensor))
        assert a > 0.0
        assert c < a + b  # no body turns harder about one axis than about the two others together
    moving = sum(link.mass for link in inertia.links)
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
