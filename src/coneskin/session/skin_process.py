"""Skin process: the virtual skin of a scene on a pseudo-terminal. Started by ``coneskin.session.skin_client``.

It plays the scene's script and takes further touches while it runs, so that a program can touch a moving arm. With a
second channel, bodies in the physics engine press on it as well; the skin goes away when that channel ends, because a
skin that nothing can press must not look like one that nothing touches.
"""

from __future__ import annotations

import math
import os
import sys
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.core.channel import Channel, decode_json, encode_json, wait_readable
from coneskin.core.child_process import first_message, inherit, shorten_time_slice
from coneskin.core.errors import ConeSkinError

if TYPE_CHECKING:  # imported once the line to the program is there, which may have ended already
    from coneskin.scene.values.scene import Scene
    from coneskin.skin.virtual.scripted_touch import ScriptedTouch
    from coneskin.skin.virtual.skin import VirtualSkin

_TOUCH_DELAY = 0.002  # s from a request to its touch, so that it begins on a frame that is not measured yet


def virtual_skin(scene: Scene, script: bool = True, pressed: bool = False) -> VirtualSkin:
    """Return the virtual skin that a scene's source describes, with its script or without, perhaps one to press."""
    from coneskin.skin.virtual.skin import PressedSkin, VirtualSkin

    assert scene.source is not None
    make = partial(PressedSkin, coarse=True) if pressed else VirtualSkin
    sensors, touches = [item.sensor for item in scene.sensors], scene.source.touches if script else ()
    settings = {name: scene.source.settings[name] for name in ("seed", "model", "frame_length", "wires")}
    return make(sensors, touches, rate_hz=scene.source.settings["rate"], **settings)


def main(arguments: list[str]) -> int:
    """Take the channel and the scene, report the port, and play until the channel ends."""
    shorten_time_slice()  # it plays a device, which waits for no processor
    _, (channel, *lines) = inherit(arguments)  # it ends with the program at once: nothing depends on it then
    from coneskin.scene.reader import parse_scene
    from coneskin.skin.virtual.pseudo_terminal import open_raw_terminal, play, wait_for_reader, write_all

    presses, truths = lines[:1], lines[1:]  # from the physics, and what it knows on to the program
    if (start := first_message(channel)) is None:
        return 1
    scene = parse_scene(start["scene"], start["name"], Path(start["folder"]))
    master, slave, path = open_raw_terminal(awaited=True)
    os.close(slave)
    channel.send(encode_json({"port": path}))  # the guard opens it, and the arm, while the field is loaded here
    skin = virtual_skin(scene, start.get("script", True), bool(presses))

    began = time.monotonic()

    def wait(duration: float) -> bool:
        end = time.monotonic() + duration
        while ready := wait_readable([channel, *presses], max(end - time.monotonic(), 0.0)):
            if channel in ready:
                _serve(channel, skin, began)
            for line in presses:
                _press(line, skin, truths)
            if channel.closed or any(line.closed for line in presses):
                return True
        return False

    wait_for_reader(master, path, wait)
    began = time.monotonic()
    assert scene.source is not None
    script = scene.source.touches if start.get("script", True) else ()
    channel.send(encode_json({"script": [_told(touch, began, skin.sensors[0].name) for touch in script]}))
    play(skin, lambda data: write_all(master, data), wait=wait)
    return 0


def _serve(channel: Channel, skin: VirtualSkin, began: float) -> None:
    """Make the requested touches; an impossible one is refused, and the skin goes on."""
    from coneskin.skin.virtual.scripted_touch import ScriptedTouch

    for message in channel.receive():
        start = time.monotonic() - began + _TOUCH_DELAY
        try:
            request = decode_json(message)
            if "release" in request:
                skin.release(start)
                continue
            end, place = start + request["duration"], (request["u"], request["phi"])
            touch = ScriptedTouch(start, end, *place, force=request["force"], sensor=request["sensor"])
            skin.touch(touch)
        except (ConeSkinError, ValueError, TypeError, KeyError) as exc:
            channel.send(encode_json({"refused": str(exc)}))
        else:
            channel.send(encode_json({"touched": _told(touch, began)}))


def _press(line: Channel, skin: VirtualSkin, truths: Sequence[Channel]) -> None:
    """Let the bodies press as the physics engine says, and pass on what only that knows."""
    from coneskin.skin.virtual.skin import Press, PressedSkin

    assert isinstance(skin, PressedSkin)
    for message in line.receive():
        told = decode_json(message)
        if "truth" in told:
            for program in truths:
                program.send(message)  # never waits: what a program that stands does not take is left out
            continue
        skin.press({(sheet, part): Press(*press) for sheet, part, *press in told["presses"]}, told["step"])
    if line.closed:
        print("coneskin: the physics that presses the virtual skin has ended; so does the skin", file=sys.stderr)


def _told(touch: ScriptedTouch, began: float, first: str = "") -> dict[str, Any]:
    """Return a touch as it is recorded; times on the host's clock."""
    end = began + touch.end if math.isfinite(touch.end) else None
    place = {name: getattr(touch, name) for name in ("u", "phi", "force", "radius")}
    return {"sensor": touch.sensor or first, "start": began + touch.start, "end": end, **place}


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
