"""The process in which the guard's loop runs alone. Started by ``coneskin.session``, not by people."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import sys
import time
from pathlib import Path
from typing import Any

from .build import build_core
from .errors import ConeSkinError
from .robot.channel import Channel, inherit
from .robot.guard_loop import GuardLoop, GuardPorts
from .robot.journal import GuardEvent
from .robot.owner_messages import decode_json
from .robot.spill import Spill
from .scene import Scene
from .scene_reader import parse_scene
from .skin.recording import encode_block

__all__ = ["main"]


def main(arguments: list[str]) -> int:
    """Take the channels and the scene, open what it names, and run until told to end."""
    supervisor, *rest = inherit(arguments)
    supervisor.spill = Spill()
    other = rest[0] if rest else None
    while not (hello := supervisor.receive()) and not supervisor.closed:
        select.select([supervisor], [], [], 1.0)
    if not hello:
        return 1
    start = decode_json(hello[0])
    with contextlib.suppress(OSError):
        os.nice(-15)  # allowed for root, and where the user's limits say so
    try:
        scene = parse_scene(start["scene"], start["name"], Path(start["folder"]))
        with contextlib.ExitStack() as stack:
            _run(scene, start, supervisor, other, stack)
    except ConeSkinError as exc:
        event = GuardEvent("died", time.monotonic(), {"what": str(exc), "error": type(exc).__name__})
        supervisor.send(encode_block(event.block()))
        select.select([], [supervisor], [], 1.0)
        supervisor.flush()
        return 1
    return 0


def _run(
    scene: Scene, start: dict[str, Any], supervisor: Channel, other: Channel | None, stack: contextlib.ExitStack
) -> None:
    """Guard; the other channel is the owner's, or the keeper's."""
    from .skin.serial_port import SerialPort

    core = build_core(scene)
    assert scene.source is not None
    source = stack.enter_context(SerialPort(start["port"], scene.source.baud))
    ports = GuardPorts(supervisor, source)
    if scene.arm is not None:
        if scene.arm.control == "owner":
            ports.owner = other
        else:
            ports.keeper = other
        from .robot.arm_identity import check_identity, read_pose
        from .robot.foreign import ForeignStops
        from .robot.state_reader import StateReader
        from .robot.ur_models import model

        if (pose := read_pose(scene.arm.host)) is not None:
            check_identity(model(scene.arm.model), pose, scene.arm.host)
        if core.steers:
            from .robot.steering import Steering

            ports.reader = ports.steering = stack.enter_context(Steering(scene.arm.host))
        else:
            ports.reader = stack.enter_context(StateReader(scene.arm.host))
        ports.foreign = stack.enter_context(ForeignStops(scene.arm.host))
        if core.needs_slider:
            from .robot.speed_slider import SpeedSlider

            ports.slider = stack.enter_context(SpeedSlider(scene.arm.host))
    loop = GuardLoop(core, ports)
    signal.signal(signal.SIGTERM, lambda *_: loop.stop())
    loop.run()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
