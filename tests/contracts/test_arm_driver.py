"""A controller of another make: a driver and a row, and the guard stops its arm without knowing it."""

from __future__ import annotations

import json
import sys
import types
from collections.abc import Mapping

import pytest

from coneskin.core.errors import RobotRefused
from coneskin.core.recording.block import Block
from coneskin.robot.driver import registry
from coneskin.robot.driver.messages import StopProgram
from coneskin.robot.driver.registry import load_driver
from coneskin.robot.driver.values import ControllerState, StopPath, UseStopPath
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.journal import BlockKind, EventName, GuardEvent
from coneskin.robot.reaction.types import Reaction
from coneskin.robot.sim.mock_arm import CompanionProcesses
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.imperfections import Foam, Imperfections
from coneskin.skin.virtual.skin import VirtualSkin
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


def test_a_row_is_all_that_a_driver_needs(monkeypatch):
    module = types.ModuleType("another_maker")
    module.DRIVER = JsonDriver()
    monkeypatch.setitem(sys.modules, "another_maker", module)
    monkeypatch.setitem(registry.DRIVERS, "another", "another_maker:DRIVER")
    assert load_driver("another") is module.DRIVER


@pytest.mark.parametrize(
    "row", ["no_such_module:X", "coneskin.robot.ur.driver:NO_SUCH", "coneskin.robot.ur.driver", ""]
)
def test_a_row_with_a_mistake_says_which(monkeypatch, row):
    monkeypatch.setitem(registry.DRIVERS, "another", row)
    with pytest.raises(RobotRefused, match="of the arm family 'another' cannot be loaded"):
        load_driver("another")


def test_an_unknown_family_lists_the_known_ones():
    with pytest.raises(RobotRefused, match="no driver for the arm family 'martian'; known: ur"):
        load_driver("martian")
