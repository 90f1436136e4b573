from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose, Vector
from coneskin.robot.arm.inertia import arm_inertia, mass_matrix
from coneskin.robot.arm.kinematics import LINK_INDEX, dh_mesh, link_pose, point_jacobian
from coneskin.robot.arm.models import MODEL_NAMES, arm_model
from coneskin.scene.values.scene import BodyScene
from coneskin.skin.materials import Padding

pytest.importorskip("mujoco", reason="the physics engine is MuJoCo (PyPI: mujoco)")

from coneskin.impact.simulation.mujoco_plant import MujocoPlant
from coneskin.impact.simulation.scene_description import SheetOnLink
from tests.support.effective_mass import effective_mass
from tests.support.plant_state import account_for_energy, part_velocity, plant_mass_matrix, plant_momentum, switch_off

MODEL = arm_model("UR5e")
LINK = LINK_INDEX["forearm"]
CONE = PlacedFrustum(Frustum(0.0376, 0.0372, 0.26), dh_mesh(MODEL, "forearm") @ Pose(translation=(0.0, 0.0, 0.08)))
SHEET = SheetOnLink("forearm skin", LINK, CONE)
Q = tuple(math.radians(angle) for angle in (-40.0, -90.0, 90.0, -90.0, -90.0, 0.0))
QD = (1.5, 0.0, 0.0, 0.0, 0.0, 0.0)
U = 0.13
FREE = tuple(range(6))
SOFT = Padding(thickness=0.02, stiffness=10e3, loss=0.0)


def leading_side() -> tuple[Vector, Vector, float]:
    """Point and normal of the sheet that move fastest along the normal, in the base frame, and how fast [m/s]."""
    pose, rows = link_pose(MODEL, Q, LINK), point_jacobian(MODEL, Q, LINK, CONE.point(U, 0.0))
    velocity = np.array(rows) @ QD
    phi = max(
        np.linspace(0.0, 2.0 * math.pi, 720), key=lambda angle: float(np.dot(pose.rotate(CONE.normal(angle)), velocity))
    )
    point, normal = CONE.point(U, phi), pose.rotate(CONE.normal(phi))
    speed = float(np.dot(normal, np.array(point_jacobian(MODEL, Q, LINK, point)) @ QD))
    return pose.apply(point), normal, speed


def ahead(kind: str = "mass", gap: float = 1e-3, **more: float) -> BodyScene:
    """A ball in the way of the leading side."""
    point, normal, _ = leading_side()
    x, y, z = (p + (0.04 + gap) * n for p, n in zip(point, normal, strict=True))
    return BodyScene(kind, (x, y, z), **{"mass": 2.0, **more})  # type: ignore[arg-type]


def plant(body: BodyScene, padding: Padding = SOFT, off: tuple[int, ...] = FREE, step: float = 1e-4) -> MujocoPlant:
    built = MujocoPlant(MODEL, [SHEET], [body], padding, Q, QD, step)
    switch_off(built, off)
    return built


@pytest.mark.parametrize("name", MODEL_NAMES)
def test_the_arm_of_mujoco_is_the_arm_of_our_tables(name: str) -> None:
    model, source = arm_model(name), np.random.default_rng(3)
    q = list(source.uniform(-3.0, 3.0, 6))
    built = MujocoPlant(model, [], [], SOFT, q)
    wanted = np.array(mass_matrix(model, arm_inertia(model), q))
    np.testing.assert_allclose(plant_mass_matrix(built), wanted, rtol=0, atol=1e-13 * wanted.max())


@pytest.mark.long
def test_energy_is_kept_where_nothing_damps_and_accounted_for_where_something_does() -> None:
    for padding, body in (
        (SOFT, ahead()),
        (Padding(thickness=0.02, loss=0.5), ahead()),
        (SOFT, ahead("hand", stiffness=3000.0, damping=0.4)),
        (Padding(thickness=2e-3, loss=0.2), ahead()),  # it bottoms out
    ):
        arm = plant(body, padding, step=2e-5)
        before, after = account_for_energy(arm, Q, QD, 0.12)
        # the integration is of the first order: its error falls with the step, 0.3 % at five times this one
        assert after == pytest.approx(before, rel=1e-3)
        assert arm.impulse > 0.1


def test_a_free_mass_gets_the_momentum_that_the_contact_has_given() -> None:
    arm = plant(ahead())
    arm.update(Q, QD, 0.12)
    velocity = part_velocity(arm, 0)
    assert not arm.contacts
    # the normal turns with the link while the two touch, so the forces' sum is a little more than the vector's
    assert 2.0 * float(np.linalg.norm(velocity)) == pytest.approx(arm.impulse, rel=2e-3)


def test_angular_momentum_about_the_base_axis_is_kept_while_no_servo_turns_that_joint() -> None:
    arm = plant(ahead(), off=(0,))
    rotor = arm_inertia(MODEL).rotor[0]  # it turns with the joint, about the same axis
    before = plant_momentum(arm)[5] + rotor * arm.qd[0]
    arm.update(Q, (0.0,) * 6, 0.12)
    assert arm.impulse > 0.5
    assert plant_momentum(arm)[5] + rotor * arm.qd[0] == pytest.approx(before, rel=1e-4)


def test_a_short_blow_is_that_of_two_masses_and_a_spring() -> None:
    """Closed form: impulse 2 v mu, peak v sqrt(k mu), mu = m M / (m + M), M the arm's effective mass."""
    point, normal, speed = leading_side()
    body = ahead(mass=0.3)
    arm = plant(body, Padding(thickness=0.02, stiffness=60e3, loss=0.0))
    heavy = effective_mass(MODEL, arm_inertia(MODEL), Q, LINK, link_pose(MODEL, Q, LINK).inverse().apply(point), normal)
    reduced = heavy * 0.3 / (heavy + 0.3)
    arm.update(Q, QD, 0.05)
    assert arm.impulse == pytest.approx(2.0 * speed * reduced, rel=0.02)  # the arm swings on for 8 ms
    assert arm.peak == pytest.approx(speed * math.sqrt(60e3 * reduced), rel=0.02)


def test_a_stiff_arm_presses_a_hand_as_far_as_springs_in_series_let_it() -> None:
    body, padding = ahead("hand", gap=-0.004, stiffness=5e3, damping=1.0), Padding(thickness=0.02, stiffness=20e3)
    arm = MujocoPlant(MODEL, [SHEET], [body], padding, Q)
    arm.update(Q, (0.0,) * 6, 0.4)
    (contact,) = arm.contacts
    # 4 mm over 5 and 20 N/mm and the arm's own servos, which are 30 times as stiff
    assert contact.force == pytest.approx(0.004 / (1 / 5e3 + 1 / 20e3), rel=0.04)
    assert arm.presses[0, 0].u == pytest.approx(U, abs=2e-4)
    assert padding.elastic(contact.depth) == pytest.approx(contact.force, rel=1e-3)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["person", "grip"])
def test_a_person_pushes_with_the_force_wanted_after_the_delay(kind: str) -> None:
    _, normal, _ = leading_side()
    x, y, z = (-(2 * 0.04 + 2 * 0.0374 + 0.01) * n for n in normal)
    body = ahead(kind, gap=-0.001, stiffness=5e3, damping=1.0, force=30.0, delay=0.1)
    body = BodyScene(kind, body.place, (x, y, z), mass=0.6, stiffness=5e3, damping=1.0, force=30.0, delay=0.1)
    arm = MujocoPlant(MODEL, [SHEET], [body], Padding(), Q)
    arm.update(Q, (0.0,) * 6, 0.09)
    assert arm.force < 5.0
    arm.update(Q, (0.0,) * 6, 0.9)
    assert [contact.force for contact in arm.contacts] == pytest.approx([30.0] * len(arm.parts), rel=0.02)


@pytest.mark.long
def test_a_hand_caught_between_two_links_presses_with_no_more_than_it_wants_to() -> None:
    """It once took what it felt at its back for what it pressed with, gave way into it, and so on: 3 kN."""
    _, normal, _ = leading_side()
    x, y, z = (-(2 * 0.04 + 2 * 0.0374 + 0.01) * n for n in normal)
    body = BodyScene("grip", ahead(gap=-0.001).place, (x, y, z), mass=0.6, stiffness=5e3, damping=1.0, force=30.0)
    inward = link_pose(MODEL, Q, LINK).inverse().rotate(normal)
    frame, way = CONE.link_frustum, 2.0 * 0.0374 + 2.0 * 0.04 - 0.006
    a, b, c = (at + way * n for at, n in zip(frame.translation, inward, strict=True))
    other = SheetOnLink("behind", LINK, PlacedFrustum(CONE.frustum, Pose(frame.rotation, (a, b, c))))
    arm = MujocoPlant(MODEL, [SHEET, other], [body], SOFT, Q)
    arm.update(Q, (0.0,) * 6, 1.5)
    front, back = (next(c.force for c in arm.contacts if (c.sheet, c.part) == (n, 0)) for n in (0, 1))
    assert front - back == pytest.approx(30.0, rel=0.02)
    assert front + back == pytest.approx(0.006 * 10e3, rel=0.1)  # what the gap of the two pads makes of it


@pytest.mark.parametrize("kind", ["wall", "post"])
def test_what_does_not_give_way_is_pressed_as_deep_as_the_arm_went(kind: str) -> None:
    _, normal, _ = leading_side()
    along = link_pose(MODEL, Q, LINK).rotate(dh_mesh(MODEL, "forearm").rotate((0.0, 0.0, 1.0)))
    across = np.cross(normal, along)
    ball = ahead(gap=-0.002 if kind == "post" else -0.042)
    nx, ny, nz = (-n for n in normal)
    cx, cy, cz = across.tolist()
    body = BodyScene(kind, ball.place, (nx, ny, nz) if kind == "wall" else (cx, cy, cz), radius=0.04)
    arm = MujocoPlant(MODEL, [SHEET], [body], Padding(), Q)
    arm.update(Q, (0.0,) * 6, 0.2)
    (contact,) = arm.contacts
    assert contact.depth == pytest.approx(0.002, abs=1.5e-4)  # the servos yield a little
    assert contact.force == pytest.approx(Padding().elastic(contact.depth), rel=1e-3)
