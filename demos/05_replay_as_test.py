"""A recorded collision as a regression test: the same bytes through today's guard, and whether the same happens.

    python demos/05_replay_as_test.py [RUN]      RUN: folder of a run, as `coneskin demo` writes it

Without RUN it records a skin without an arm first, in memory and a temporary folder.
"""

import json
import math
import sys
import tempfile
from pathlib import Path

from coneskin.build import build_core
from coneskin.replay import read_run, replay
from coneskin.robot.arm_reaction import Output
from coneskin.robot.journal import GuardEvent, Kind
from coneskin.scene_reader import parse_scene
from coneskin.skin.recording import Block, Recorder
from coneskin.skin.scripted_touch import ScriptedTouch
from coneskin.skin.virtual import VirtualSkin
from coneskin.timeline import describe

SCENE = """
[[link]]
name = "tube"

[[link.sensor]]
radius1_mm = 54
radius2_mm = 54
height_mm = 434
"""


def record(path: Path) -> None:
    """What a session does: every input and every event, in their order."""
    scene = parse_scene(SCENE)
    touch = ScriptedTouch(start=0.3, end=0.5, u=0.200, phi=math.radians(90))
    skin = VirtualSkin(scene.sensors[0].sensor, [touch])
    core = build_core(scene)
    header = {"scene": SCENE, "name": "tube", "folder": ".", "clocks": {"monotonic": 0.0}}
    with Recorder(path) as recorder:
        recorder.write(Block(Kind.HEADER, 0.0, json.dumps(header).encode()))
        for time, data in skin.packets():
            if time > 0.7:
                break
            block, outputs = Block(Kind.SKIN, time, data), list[Output]()
            core.take(block, outputs)
            recorder.write(block, *(output.block() for output in outputs if isinstance(output, GuardEvent)))


def check(path: Path) -> bool:
    run = read_run(path)
    result = replay(run)
    for event in result.events:
        print(describe(event, run.header["clocks"]["monotonic"]))
    print("the same events, bit by bit" if result.same else "NOT the same: " + "; ".join(result.differences))
    return result.same


if __name__ == "__main__":
    if len(sys.argv) > 1:
        sys.exit(not check(Path(sys.argv[1])))
    with tempfile.TemporaryDirectory() as folder:
        record(Path(folder) / "run.rec")
        sys.exit(not check(Path(folder)))
