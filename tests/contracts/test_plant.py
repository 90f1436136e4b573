"""What moves behind the simulated controller: exact tracking, physics, physics in another process; one contract."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import pytest

from coneskin.core.channel import Channel, pair
from coneskin.robot.arm.models import arm_model
from coneskin.robot.sim.machine.controller import Controller
from coneskin.robot.sim.machine.states import Options
from coneskin.robot.sim.motion.arm import CYCLE
from coneskin.robot.sim.motion.motion import SpeedJoints
from coneskin.robot.sim.motion.plant import (
    KinematicPlant,
    Plant,
    PlantState,
    RemotePlant,
    decode_targets,
    encode_state,
)
from coneskin.scene.reader import parse_scene
from coneskin.scene.values.scene import BodyScene
from tests.support.scenes import START, forearm_scene

QD = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]


def physics() -> Plant:
    pytest.importorskip("mujoco", reason="the physics engine is MuJoCo (PyPI: mujoco)")
    from coneskin.impact.simulation.mujoco_plant import ScenePlant

    far = BodyScene("hand", (2.0, 0.0, 0.0), mass=0.6, stiffness=1e3)
    return ScenePlant(replace(parse_scene(forearm_scene()), bodies=(far,)), START)


class ServedPlant(RemotePlant):
    """A plant at the other end of a channel, which answers after each cycle: in lock-step."""

    def __init__(self) -> None:
        served = physics()  # first: where it skips, nothing is open yet
        ours, theirs = pair()
        super().__init__(Channel(ours), START, arm_model("UR5e"))
        self._other, self._served = Channel(theirs), served

    def update(self, q: Sequence[float], qd: Sequence[float]) -> PlantState:
        state = super().update(q, qd)
        for message in self._other.receive():
            self._other.send(encode_state(self._served.update(*decode_targets(message))))
        return state

    def close(self) -> None:
        super().close()
        self._other.close()


@pytest.fixture(params=[KinematicPlant, physics, ServedPlant], ids=["kinematic", "physics", "physics at a channel"])
def make(request: pytest.FixtureRequest) -> Iterator[Callable[[], Plant]]:
    made: list[Plant] = []

    def build() -> Plant:
        made.append(request.param())
        return made[-1]

    yield build
    for plant in made:
        plant.close()
        plant.close()  # may be called again


def drive(plant: Plant) -> list[tuple[list[float], list[float]]]:
    """Turn the base for 0.2 s and stop; what was measured in each cycle."""
    controller = Controller(Options("UR5e", start_q=START), plant=plant)
    controller.arm.motion = SpeedJoints(QD, 10.0)
    measured = []
    for cycle in range(250):
        if cycle == 100:
            controller.arm.motion = None
        controller.arm.update(1.0, hold=False)
        controller._update_plant()
        assert not controller.plant_lost
        measured.append((list(controller.arm.measured.q), list(controller.arm.measured.qd)))
    assert controller.arm.measured.current == pytest.approx([0.0] * 6, abs=1e-9)  # nothing was met
    return measured


def test_it_follows_its_targets_and_comes_to_rest_where_they_do(make: Callable[[], Plant]) -> None:
    measured = drive(make())
    assert max(qd[0] for _, qd in measured) == pytest.approx(1.0, abs=0.15)  # a servo may overshoot
    way = 0.5 * 1.0**2 / 10.0 + (100 * CYCLE - 0.1) * 1.0 + 0.5 * 1.0**2 / 10.0
    assert measured[-1][0] == pytest.approx([START[0] + way, *START[1:]], abs=2e-3)
    assert measured[-1][1] == pytest.approx([0.0] * 6, abs=1e-3)
    moved = [b[0][0] - a[0][0] for a, b in pairwise(measured)]
    turned = [0.5 * CYCLE * (a[1][0] + b[1][0]) for a, b in pairwise(measured)]
    assert moved == pytest.approx(turned, abs=2e-5)  # speeds are those of the positions


def test_the_same_targets_give_the_same_measurements_bit_by_bit(make: Callable[[], Plant]) -> None:
    assert drive(make()) == drive(make())


def test_at_rest_it_stays_at_rest(make: Callable[[], Plant]) -> None:
    plant = make()
    for _ in range(50):
        state = plant.update(START, [0.0] * 6)
    assert list(state.q) == pytest.approx(START, abs=1e-12)
    assert math.hypot(*state.qd) < 1e-12
