"""A virtual skin of a scene, in a process of its own, on a pseudo-terminal. Started by ``coneskin.session``.

It plays the scene's script and takes further touches while it runs, so that a program can touch a moving arm.
"""

from __future__ import annotations

import os
import select
import sys
import time
from pathlib import Path

from .errors import ConeSkinError
from .robot.channel import Channel, inherit
from .robot.owner_messages import decode_json, encode_json
from .scene import Scene
from .scene_reader import parse_scene
from .skin.scripted_touch import ScriptedTouch
from .skin.virtual import VirtualSkin

__all__ = ["main", "virtual_skin"]

_SOON = 0.002  # s from a request to its touch, so that it begins on a frame that is not measured yet


def virtual_skin(scene: Scene) -> VirtualSkin:
    """The virtual skin that a scene's source describes."""
    assert scene.source is not None
    return VirtualSkin(
        [item.sensor for item in scene.sensors],
        scene.source.touches,
        rate_hz=scene.source.rate_hz,
        seed=scene.source.seed,
        model=scene.source.model,
    )


def main(arguments: list[str]) -> int:
    """Take the channel and the scene, say which port, and play until the channel ends."""
    from .skin.pseudo_terminal import open_raw_terminal, play, wait_for_reader, write_all

    (channel,) = inherit(arguments)
    while not (hello := channel.receive()) and not channel.closed:
        select.select([channel], [], [], 1.0)
    if not hello:
        return 1
    start = decode_json(hello[0])
    skin = virtual_skin(parse_scene(start["scene"], start["name"], Path(start["folder"])))
    master, slave, path = open_raw_terminal()
    channel.send(encode_json({"port": path}))

    began = time.monotonic()

    def wait(duration: float) -> bool:
        end = time.monotonic() + duration
        while select.select([channel], [], [], max(end - time.monotonic(), 0.0))[0]:
            _serve(channel, skin, began)
            if channel.closed:
                return True
        return False

    os.close(slave)
    wait_for_reader(master, path, wait)
    began = time.monotonic()
    play(skin, lambda data: write_all(master, data), wait=wait)
    return 0


def _serve(channel: Channel, skin: VirtualSkin, began: float) -> None:
    """Make the touches that are asked for; one that cannot be is refused, and the skin goes on."""
    for message in channel.receive():
        start = time.monotonic() - began + _SOON
        try:
            request = decode_json(message)
            end, place = start + request["duration"], (request["u"], request["phi"])
            skin.touch(ScriptedTouch(start, end, *place, force=request["force"], sensor=request["sensor"]))
        except (ConeSkinError, ValueError, TypeError, KeyError) as exc:
            channel.send(encode_json({"refused": str(exc)}))
        else:
            channel.send(encode_json({"touched": began + start}))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
