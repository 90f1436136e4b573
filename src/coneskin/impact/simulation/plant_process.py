"""Physics process: the plant of a scene in real time. Started by ``coneskin.impact.simulation.live_plant``.

It is driven by the control cycles of a simulated controller: each targets that come let 2 ms pass, what is measured
goes back, and what presses on the skins goes to the virtual skin's process. It makes up for nothing and leaves nothing
out, so a computer that is too slow shows as answers that come late, which the controller judges.
"""

from __future__ import annotations

import contextlib
import gc
import os
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from coneskin.core.channel import Channel, encode_json, wait_readable
from coneskin.core.child_process import first_message, inherit, shorten_time_slice
from coneskin.core.errors import ConeSkinError, MissingExtra
from coneskin.core.text import finite

if TYPE_CHECKING:
    from .impact_outcome import ImpactMeter

_POLL_TIMEOUT = 1.0  # s between two looks at whether anybody is left
_TRUTH_PERIOD = 0.01  # s from one recorded force to the next
_PROCESS_NICENESS = -10  # niceness; behind the guard
_RELAXED_CYCLES = 500  # without a press, after which the foam of a skin has come back: it need not be told more


def main(arguments: list[str]) -> int:
    """Take the channels and the scene, follow the controller until it ends, and answer the program until it does."""
    _, (program, controller, skin) = inherit(arguments)  # it ends with the program at once
    from coneskin.robot.sim.motion.arm import CYCLE
    from coneskin.robot.sim.motion.plant import PlantLost, decode_targets, encode_state
    from coneskin.scene.reader import parse_scene

    from .impact_outcome import ImpactMeter, TouchRecorder, TruthRecorder
    from .mujoco_plant import ScenePlant

    if (start := first_message(program)) is None:
        return 1
    try:
        scene = parse_scene(start["scene"], start["name"], Path(start["folder"]))
        plant = ScenePlant(scene, start["q"])
        plant.update(start["q"], (0.0,) * len(start["q"]))  # what is loaded on first use is loaded now
    except (ConeSkinError, PlantLost) as exc:
        program.send(encode_json({"refused": str(exc), "missing": isinstance(exc, MissingExtra)}))
        return 1
    shorten_time_slice()
    with contextlib.suppress(OSError):
        os.nice(_PROCESS_NICENESS)  # allowed for root, and where the user's limits say so: nature waits for no process
    program.send(encode_json({"ready": True}))
    gc.collect()
    gc.freeze()
    meter, recorder, touches = ImpactMeter(), TruthRecorder(_TRUTH_PERIOD), TouchRecorder()
    quiet = _RELAXED_CYCLES  # cycles since something pressed
    while not program.closed:
        if controller.closed:
            skin.close()
        ready = wait_readable([program] if controller.closed else [program, controller], _POLL_TIMEOUT)
        for message in controller.receive():
            try:
                state = plant.update(*decode_targets(message))
            except (PlantLost, ValueError) as exc:
                print(f"coneskin physics: {exc}", file=sys.stderr, flush=True)
                return 1
            controller.send(encode_state(state))
            now = time.monotonic()  # before the skin can feel it: no touch begins after what is seen of it
            physics = plant.physics
            presses = physics.presses
            quiet = 0 if presses else quiet + 1
            if quiet < _RELAXED_CYCLES:
                pressing = [[*key, *press] for key, press in presses.items()]
                skin.send(encode_json({"step": CYCLE, "presses": pressing}))
            for truth in (recorder.feed(now, physics.force, physics.places), touches.feed(now, presses.values())):
                if truth is not None:
                    skin.send(encode_json({"truth": truth.payload.decode(), "time": truth.time}))
            meter.feed(now, physics)
        if program in ready:
            _report(program, meter)
    return 0


def _report(program: Channel, meter: ImpactMeter) -> None:
    for _ in program.receive():
        program.send(encode_json(finite({**asdict(meter.outcome), "began": meter.began})))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
