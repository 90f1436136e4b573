from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest

from coneskin.core.recording.block import Block
from coneskin.core.recording.recorder import Recorder
from coneskin.robot.guard.signals.journal import BlockKind, EventName, body_places, contact_force
from coneskin.runs.replay.run import read_run
from coneskin.runs.what_if.what_if import _judge_run
from coneskin.scene.reader import parse_scene
from coneskin.scene.values.scene import BodyScene, Scene
from tests.support.scenes import commissioned, forearm_scene

pytest.importorskip("mujoco", reason="the physics engine is MuJoCo (PyPI: mujoco)")

from coneskin.impact.simulation.collision_run import CollisionRun

START = tuple(math.radians(angle) for angle in (-2.0, -90.0, 90.0, -90.0, -90.0, 0.0))
QD = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
#: in the way of the forearm's leading side, which meets it at 0.21 m/s after 0.2 s
HAND = BodyScene("hand", (-0.192, -0.120, 0.5875), radius=0.04, mass=0.6, stiffness=15e3)


def scene_of(kind: str, more: str = "") -> Scene:
    return commissioned(parse_scene(forearm_scene(reaction=f'kind = "{kind}"\nbare_side = "fast"\n{more}')))


def collide(scene: Scene, body: BodyScene = HAND, **options: object) -> CollisionRun:
    run = CollisionRun(scene, [body], START, **options)  # type: ignore[arg-type]
    run.run(lambda _: (QD, 20.0), longest=1.2)
    return run


@pytest.mark.long
def test_the_force_of_a_contact_stops_the_arm_through_skin_bytes_and_guard_and_the_stop_ends_the_force(
    tmp_path: Path,
) -> None:
    """And the recording of it replays bit for bit."""
    blocks: list[Block] = []
    scene = scene_of("stop")
    run = collide(scene, note=blocks.append)
    contact, outcome = run.event(EventName.CONTACT_LOCATED), run.meter.outcome
    assert contact is not None
    assert contact.details["u"] == pytest.approx(0.13, abs=0.01)
    assert contact.details["phi"] == pytest.approx(math.pi / 2.0, abs=0.1)
    assert outcome.approach == pytest.approx(0.21, abs=0.02)
    assert 0.0 < outcome.noticed <= 0.003  # 2 N after the first millisecond, of which the foam shows half at once
    assert 0.1 < outcome.standstill < 0.2  # 1 rad/s at 10 rad/s2, and the latencies
    assert 50.0 < outcome.clamp < outcome.peak
    unprotected = collide(scene, protection="nothing").meter.outcome
    assert unprotected.clamp > 5.0 * outcome.clamp
    assert math.isnan(unprotected.noticed)

    path = tmp_path / "run.rec"
    header = {"scene": scene.text, "name": scene.name, "folder": str(tmp_path), "clocks": {"monotonic": 100.0}}
    with Recorder(path) as recorder:
        recorder.write(Block(BlockKind.HEADER, 100.0, json.dumps(header).encode()), *blocks)
    recorded = read_run(path)
    assert [event.name for event in recorded.events] == [event.name for event in run.events]
    assert recorded.replay().same
    (row,) = _judge_run(path)
    assert (row["truth"], row["touches"], row["missed"], row["false_alarms"]) == ("virtual skin", 1, 0, 0)
    assert 0.0 < row["delay_median_ms"] <= 3.0
    (pressed, force, (place,)) = [
        (block, force, body_places(block.payload))
        for block in recorded.select(kinds=frozenset({BlockKind.TRUTH}))
        if (force := contact_force(block.payload)) is not None
    ][-1]
    assert pressed.time > 100.0
    assert math.dist(place, HAND.place) * HAND.stiffness == pytest.approx(force, rel=0.02)  # at rest: F = k x


@pytest.mark.long
def test_the_same_seed_gives_the_same_run_bit_by_bit() -> None:
    first: list[Block] = []
    second: list[Block] = []
    one = collide(scene_of("retreat"), note=first.append)
    other = collide(scene_of("retreat"), note=second.append)
    assert one.meter.outcome == other.meter.outcome
    assert first == second
    assert one.plant.q == other.plant.q


@pytest.mark.long
def test_moving_away_takes_the_force_off_that_a_stop_leaves() -> None:
    stop, retreat, comply = (collide(scene_of(kind)).meter.outcome for kind in ("stop", "retreat", "comply"))
    assert stop.peak == pytest.approx(retreat.peak, rel=1e-6)  # until it stands, all brake alike
    assert retreat.clamp < 0.8 * stop.clamp
    assert comply.clamp < stop.clamp - 14.0  # it rests once 15 N are gone, which what stands behind may carry


@pytest.mark.long
def test_a_force_limit_stops_what_presses_with_more_and_lets_less_be() -> None:
    scene = scene_of("stop")
    hard = collide(scene, replace(HAND, stiffness=20e3), protection="force limit").meter.outcome
    assert hard.noticed > 0.01  # not before the force is there
    assert hard.peak > 150.0
    assert hard.standstill > hard.noticed
    light = collide(scene, replace(HAND, stiffness=500.0), protection="force limit").meter.outcome
    assert math.isnan(light.noticed)
    assert light.peak < 150.0


@pytest.mark.long
def test_below_the_force_that_closes_the_layers_nothing_is_felt() -> None:
    feather = replace(HAND, kind="mass", mass=0.0003, stiffness=0.0)  # at 0.2 m/s: v sqrt(k m) = 0.35 N
    run = collide(scene_of("stop"), feather)
    assert 0.05 < run.meter.outcome.peak < 0.5
    assert run.event(EventName.CONTACT) is None


@pytest.mark.long
def test_a_press_beside_the_active_area_is_not_felt() -> None:
    """The link is padded all around, but the sheet ends: there the guard is blind, and the force shows it."""
    text = forearm_scene(reaction='kind = "stop"').replace("height_mm = 260", "height_mm = 260\nwrap_deg = 60")
    run = collide(commissioned(parse_scene(text)))
    assert run.event(EventName.CONTACT) is None
    assert run.meter.outcome.peak > 200.0
