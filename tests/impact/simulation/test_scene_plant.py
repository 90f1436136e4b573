"""The plant of a scene: as exact as lock-step, cheap enough for real time, and never silently wrong."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pytest

from coneskin.robot.sim.motion.arm import CYCLE
from coneskin.robot.sim.motion.plant import PlantLost
from coneskin.scene.reader import parse_scene
from coneskin.scene.values.scene import BodyScene
from coneskin.skin.materials import Padding
from tests.support.scenes import forearm_scene, start_with

pytest.importorskip("mujoco", reason="the physics engine is MuJoCo (PyPI: mujoco)")

from coneskin.impact.simulation.mujoco_plant import ScenePlant
from tests.support.plant_state import part_velocity

START = start_with(-10.0)
PLACE = (-0.192, -0.120, 0.5875)
HAND = BodyScene("hand", PLACE, mass=0.6, stiffness=15e3)
SCENE = parse_scene(forearm_scene())


def collide(bodies: Sequence[BodyScene], period: int = 5, **padding: float) -> ScenePlant:
    """Run into bodies at 1 rad/s, and brake after 0.4 s with 10 rad/s2."""
    plant = ScenePlant(replace(SCENE, bodies=tuple(bodies), padding=Padding(**padding)), START, period)
    q, speed = list(START), 0.0
    for cycle in range(300):
        wanted = 1.0 if cycle < 200 else 0.0
        speed += max(-0.02, min(0.02, wanted - speed))
        q[0] += CYCLE * speed
        plant.update(q, [speed, 0.0, 0.0, 0.0, 0.0, 0.0])
    return plant


@pytest.mark.long
@pytest.mark.parametrize(
    ("body", "padding"),
    [
        (HAND, {}),
        (replace(HAND, stiffness=2e3), {}),
        (BodyScene("mass", PLACE, mass=2.0), {"thickness": 0.02}),
        (replace(HAND, kind="person", force=40.0, delay=0.05, speed=0.25), {}),
    ],
    ids=["hand", "soft hand", "mass", "person"],
)
def test_in_real_time_the_forces_are_those_of_lock_step(body: BodyScene, padding: dict[str, float]) -> None:
    exact, live = (collide([body], period, **padding).physics for period in (1, 5))
    assert exact.peak > 10.0
    assert live.peak == pytest.approx(exact.peak, rel=0.05)
    assert live.impulse == pytest.approx(exact.impulse, rel=0.03)
    assert live.force == pytest.approx(exact.force, rel=0.05, abs=0.5)
    assert live.deepest == pytest.approx(exact.deepest, rel=0.03)
    assert live.q == pytest.approx(exact.q, abs=2e-3)


def test_momentum_goes_from_the_arm_into_a_free_mass_and_no_energy_comes_from_nowhere() -> None:
    plant = collide([BodyScene("mass", PLACE, mass=2.0)], thickness=0.02).physics
    velocity = part_velocity(plant, 0)
    assert plant.impulse > 0.1
    # the normal turns with the link while the two touch, so the forces' sum is a little more than the vector's
    assert 2.0 * sum(v * v for v in velocity) ** 0.5 == pytest.approx(plant.impulse, rel=5e-3)
    # thrown away by a driven arm at v: at most at 2 v
    assert sum(v * v for v in velocity) ** 0.5 < 2.0 * 0.25


def test_contacts_take_current_and_press_the_skin() -> None:
    plant = ScenePlant(replace(SCENE, bodies=(HAND,)), START)
    q, state = list(START), None
    for _ in range(180):
        q[0] += CYCLE
        state = plant.update(q, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    (press,) = plant.physics.presses.values()
    assert press.force == pytest.approx(plant.physics.force)
    assert press.sensor == SCENE.sensors[0].sensor.name
    assert press.u == pytest.approx(0.13, abs=0.01)
    assert state is not None
    assert state.current[0] > 0.1  # the base's motor pushes on: 12 N m/A


def test_an_engine_that_has_diverged_is_lost_and_not_started_anew() -> None:
    plant = ScenePlant(replace(SCENE, bodies=(HAND,)), START)
    plant.physics._d.qvel[0] = float("nan")
    with pytest.raises(PlantLost, match="diverged"):
        plant.update(START, [0.0] * 6)
