"""Long run for the benchmark of recordings: an arm that moves with a skin on it, in simulation, without processes."""

from __future__ import annotations

import json
import math
import random
from pathlib import Path

from coneskin.core.recording.block import Block
from coneskin.core.recording.recorder import Recorder
from coneskin.robot.driver.messages import StatusReport
from coneskin.robot.guard.signals.journal import BlockKind, GuardEvent, Output
from coneskin.robot.ur.rtde_codec import STATE_RECIPE
from coneskin.runs.replay.run import read_run
from coneskin.scene.build import build_core
from coneskin.scene.reader import parse_scene
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin

_START_TIME = 1000.0


def record_long_run(path: Path, model: Path, seconds: float) -> None:
    """Record a run in the scene of another: 1000 frames and 500 noisy states a second, a touch near the end."""
    scene = parse_scene(read_run(model).header["scene"].replace('kind = "retreat"', 'kind = "stop"'), "scene.toml")
    assert scene.source is not None
    touch = ScriptedTouch(seconds - 2.0, seconds - 1.0, 0.13, 1.55, sensor=scene.sensors[0].sensor.name)
    skin = VirtualSkin([item.sensor for item in scene.sensors], [touch], rate_hz=scene.source.settings["rate"], seed=7)
    core, noise = build_core(scene), random.Random(1)
    header = {"scene": scene.text, "name": scene.name, "folder": ".", "clocks": {"monotonic": _START_TIME}}
    with Recorder(path, copied=frozenset({BlockKind.HEADER})) as recorder:

        def take(kind: BlockKind, time: float, payload: bytes) -> None:
            block, outputs = Block(kind, time, payload), list[Output]()
            core.feed(block, outputs)
            events = [output for output in outputs if isinstance(output, GuardEvent)]
            recorder.write(block, *(event.block() for event in events), flush=bool(events))

        recorder.write(Block(BlockKind.HEADER, _START_TIME, json.dumps(header).encode()))
        take(BlockKind.DRIVER, _START_TIME, StatusReport("ready").encode())
        due = heard = 0.0
        for time, data in skin.packets():
            if time > seconds:
                return
            if time >= heard:
                heard += 0.05
                take(BlockKind.PROGRAM, _START_TIME + time, b"")
                take(BlockKind.DRIVER, _START_TIME + time, StatusReport("released", "1").encode())
            while due <= time:
                swing = 0.0 if due > touch.start + 0.02 else 0.5
                q = [-0.7, -1.6, 1.6, -1.6, -1.6, 0.2 * math.sin(due)]
                qd = [swing, 0.0, 0.0, 0.0, 0.0, 0.2 * math.cos(due) if swing else 0.0]
                values = [tuple([x + noise.gauss(0.0, 1e-5) for x in row]) for row in (q, qd, [1.0] * 6, [1.0] * 6)]
                state = STATE_RECIPE.pack([due, values[0], values[1], 7, 1, 2, values[2], values[3]])
                take(BlockKind.ARM, _START_TIME + due, state)
                due += 0.002
            take(BlockKind.SKIN, _START_TIME + time, data)
