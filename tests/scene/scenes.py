"""Scenes and runs that several tests use; no hardware and no process."""

import json
import math
import re
from collections.abc import Iterator
from pathlib import Path

from coneskin.core.recording.block import Block
from coneskin.core.recording.recorder import Recorder
from coneskin.robot.driver.messages import StatusReport
from coneskin.robot.guard.signals.journal import BlockKind, GuardEvent, Output
from coneskin.robot.ur import rtde_codec as rtde
from coneskin.scene.build import build_core
from coneskin.scene.reader import parse_scene
from coneskin.scene.values.scene import Scene
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from tests.support.paths import ROOT

DOCUMENT = ROOT / "docs" / "look-up" / "scene.md"
SKIN_ONLY, SERIAL_RETREAT, DOUBLE_CONE, TWO_PORTS = re.findall(
    r"```toml.*?\n(.*?)```", DOCUMENT.read_text(encoding="utf-8"), re.DOTALL
)
FULL = (
    DOUBLE_CONE
    + """
[monitoring]
settle_ms = 50

[recording]
folder = "runs"
"""
)
Q = (-0.7, -1.6, 1.6, -1.6, -1.6, 0.0)


def arm_payload(time: float, speed: float = 0.0) -> bytes:
    """Return what a controller sends while joint 1 turns at this speed [rad/s]."""
    names = ("timestamp", "actual_q", "actual_qd", "robot_mode", "safety_status_bits", "runtime_state")
    names += ("actual_current", "target_current")
    still = (0.0,) * 5
    return rtde.Recipe(names).pack([time, Q, (speed, *still), 7, 1, 2, (0.0,) * 6, (0.0,) * 6])


def inputs(scene: Scene, touch: ScriptedTouch, end: float = 1.5) -> Iterator[Block]:
    """Return the inputs of a guard in a run: skin, arm and driver; the arm stops 50 ms after the touch."""
    assert scene.source is not None
    skin = VirtualSkin([item.sensor for item in scene.sensors], [touch], rate_hz=scene.source.settings["rate"], seed=7)
    start = 1000.0
    yield Block(BlockKind.DRIVER, start, StatusReport("ready").encode())
    due = heard = 0.0
    for time, data in skin.packets():
        if time > end:
            return
        if time >= heard:
            heard += 0.02
            yield Block(BlockKind.PROGRAM, start + time, b"")
            yield Block(BlockKind.DRIVER, start + time, StatusReport("released", "1").encode())
        while scene.arm is not None and due <= time:
            since = max(0.0, due - touch.start - 0.005)
            yield Block(BlockKind.ARM, start + due, arm_payload(due, max(0.0, 0.5 - 10.0 * since)))
            due += 0.002
        yield Block(BlockKind.SKIN, start + time, data)


def record(path: Path, text: str = FULL, touch: ScriptedTouch | None = None) -> list[GuardEvent]:
    """Record a run of a scene as a session does; what happened."""
    scene = parse_scene(text, "scene.toml", path.parent)
    touch = touch or ScriptedTouch(0.6, 0.8, 0.07, math.pi / 2, sensor=scene.sensors[-1].sensor.name)
    core, events = build_core(scene), []
    header = {"scene": scene.text, "name": scene.name, "folder": str(path.parent), "clocks": {"monotonic": 1000.0}}
    with Recorder(path) as recorder:
        recorder.write(Block(BlockKind.HEADER, 1000.0, json.dumps(header).encode()))
        for block in inputs(scene, touch):
            outputs: list[Output] = []
            core.feed(block, outputs)
            happened = [output for output in outputs if isinstance(output, GuardEvent)]
            recorder.write(block, *(event.block() for event in happened))
            events += happened
    return events
