"""A controller of another make: a driver, and the guard stops its arm without knowing it."""

from __future__ import annotations

import json
from collections.abc import Mapping

import pytest

from coneskin.core.errors import RobotRefused
from coneskin.core.recording.block import Block
from coneskin.robot.driver.messages import StopProgram
from coneskin.robot.driver.protocol import load_driver
from coneskin.robot.driver.values import ControllerState, StopPath, UseStopPath
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.journal import BlockKind, EventName, GuardEvent
from coneskin.robot.reaction.types import Reaction
from coneskin.robot.sim.mock_arm import CompanionProcesses
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.imperfections import Foam, Imperfections
from coneskin.skin.virtual.skin import VirtualSkin
from tests.robot.arm.test_joint_count import SEVEN
from tests.support.guard_rig import CONE, START_Q, make_core, touch


class JsonDriver:
    """Driver of a controller that sends its state as JSON."""

    process = "another.driver_process"
    lost_with: Mapping[str, frozenset[StopPath]] = {"socket": frozenset({StopPath.PROGRAM})}

    def decode_state(self, time: float, payload: bytes) -> ControllerState:
        clock, qd = json.loads(payload)
        return ControllerState(time, clock, tuple(START_Q), (qd, 0.0, 0.0, 0.0, 0.0, 0.0), True, False, True)


def run(core, payload, seconds, start, packets, lose=None):
    """Feed a core in virtual time; what came out."""
    out, companions, known = [], CompanionProcesses(), 0
    for step in range(round(1000 * seconds)):
        now = start + 0.001 * (step + 1)
        for block in list(companions.blocks(now)):
            core.feed(block, out)
        core.feed(Block(BlockKind.SKIN, now, next(packets)[1]), out)
        if step % 2 == 0:
            core.feed(Block(BlockKind.ARM, now, payload(now)), out)
        if lose is not None and now >= lose[0]:
            core.feed(Block(BlockKind.LOST, now, lose[1]), out)
            lose = None
        for output in out[known:]:
            companions.feed(output)
        known = len(out)
    return out


@pytest.fixture
def guarded():
    sensor = Sensor(CONE.frustum, 0, name="one")
    at_once = Imperfections(foam=Foam(delayed=0.0))
    skin = VirtualSkin([sensor], [touch(0.5, 0.7)], imperfections=at_once, model="ladder")
    core = make_core([sensor], Reaction(kind="stop"), driver=JsonDriver())
    return core, skin.packets()


def test_the_guard_stops_an_arm_whose_controller_it_does_not_know(guarded):
    core, packets = guarded

    def payload(now):
        braking = max(0.0, now - 100.51)
        return json.dumps([now, max(0.0, 0.5 - 10.0 * braking)]).encode()

    out = run(core, payload, 0.8, 100.0, packets)
    assert any(isinstance(output, StopProgram) for output in out)
    names = [output.name for output in out if isinstance(output, GuardEvent)]
    assert names[:2] == [EventName.ACTIVATED, EventName.STOPPING]
    assert names.index(EventName.STANDSTILL) < names.index(EventName.LATCHED)
    assert core.phase is Phase.LATCHED


def test_its_own_connections_take_their_stop_paths_with_them(guarded):
    """An arm that does not obey, and a connection that is lost while it moves: its path is not used."""
    core, packets = guarded
    out = run(core, lambda now: json.dumps([now, 0.5]).encode(), 0.8, 100.0, packets, (100.3, b"socket\ngone"))
    used = {output.path for output in out if isinstance(output, UseStopPath)}
    assert used == {StopPath.COMMAND, StopPath.SLIDER, StopPath.PROTECTIVE}


class SevenJointDriver(JsonDriver):
    """The same of an arm whose seventh joint alone moves."""

    def decode_state(self, time: float, payload: bytes) -> ControllerState:
        clock, qd = json.loads(payload)
        return ControllerState(time, clock, (0.1,) * 7, (*(0.0,) * 6, qd), True, False, True)


def test_an_arm_of_seven_joints_counts_as_standing_once_its_seventh_does():
    """Its driver process does not stop it: the guard does, over its own connection, and waits for the seventh joint."""
    sensor = Sensor(CONE.frustum, 0, name="one")
    at_once = Imperfections(foam=Foam(delayed=0.0))
    packets = VirtualSkin([sensor], [touch(0.5, 0.7)], imperfections=at_once, model="ladder").packets()
    core = make_core([sensor], Reaction(kind="stop"), driver=SevenJointDriver(), model=SEVEN, external=True)

    def payload(now):
        speed = 0.5 if now < 100.55 else max(0.0, 0.5 - 10.0 * (now - 100.55))
        return json.dumps([now, speed]).encode()

    out = run(core, payload, 1.8, 100.0, packets)
    events = {output.name: output for output in out if isinstance(output, GuardEvent)}
    assert core.phase is Phase.LATCHED
    assert events[EventName.STANDSTILL].time > 100.6 - 0.01
    assert next(output.path for output in out if isinstance(output, UseStopPath)) is StopPath.PROGRAM


@pytest.mark.parametrize(
    "path", ["no_such_module:X", "coneskin.robot.ur.driver:NO_SUCH", "coneskin.robot.ur.driver", ""]
)
def test_a_driver_that_is_not_there_is_one_line(path):
    with pytest.raises(RobotRefused, match=f"the arm's driver {path!r} cannot be loaded"):
        load_driver(path)
