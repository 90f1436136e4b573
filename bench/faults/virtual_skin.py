"""Virtual skin of bench `faults`, in a process of its own, in which any fault can be injected at any time.

It is started with the name of its port, a seed, the model of its sheets and the number of its sensors.
A line of JSON in, a line of JSON with the time out::

    {"faults": {"corrupt_every": 2}}     of coneskin.skin.virtual.fault_injection; ``..._after`` counts from now
    {"replay": 300}                      the last 300 frames over and over
    {"slow": 1.0}                        from now on frames take so much longer to arrive, more with each
    {"touches": [{"u": 0.13, "phi": 1.5, "after": 0.0, "duration": 0.2, "force": 5.0, "rise": 0.01, "sensor": ""}]}
    {"unplug": true}  {"plug": true}     the port goes away, and comes back under the same name
    {"anew": true}                       what is said of late frames begins anew

Each answer also says how late the machine has made a frame at worst.
"""

from __future__ import annotations

import json
import os
import select
import sys
import time
from collections import deque
from pathlib import Path
from typing import Any

from coneskin.geometry.frustum import Frustum
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.command import _parse_fault
from coneskin.skin.virtual.fault_injection import FaultInjection, FaultyLine
from coneskin.skin.virtual.pseudo_terminal import open_raw_terminal, wait_for_reader, write_all
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin

from .setup import give_precedence

RADIUS1, RADIUS2, HEIGHT = 0.0376, 0.0372, 0.26
UPPER_ARM = 0.048
CLOCK = time.monotonic


class FaultySkin:
    """Plays, and does what it is told."""

    def __init__(self, link: Path, seed: int, sheets: str, sensors: int) -> None:
        shapes = (Frustum(RADIUS1, RADIUS2, HEIGHT), Frustum(UPPER_ARM, UPPER_ARM, HEIGHT))[:sensors]
        skins = [Sensor(shape, number, name=str(number)) for number, shape in enumerate(shapes)]
        self._skin = VirtualSkin(skins, seed=seed, model=sheets)
        self._line = FaultyLine(FaultInjection(), seed)
        self._link = link
        self._sent: deque[bytes] = deque(maxlen=1000)
        self._replayed: list[bytes] = []
        self._index = 0  # of the next frame, as the line counts
        self._slow = self._lag_since = self._due = 0.0
        self._began = CLOCK()
        self._worst_late = 0.0
        self._master: int | None = None
        self._keep: int | None = None

    def run(self) -> None:
        """Plug in, wait for a reader, and play until the input ends."""
        path = self._plug()
        say(port=str(self._link))
        self._keep = wait_for_reader(self._master or 0, path, self._wait)
        self._began = CLOCK()
        for due, frame in self._skin.frames():
            self._due = due
            if self._wait(self._began + due + self._slow * max(0.0, due - self._lag_since) - CLOCK()):
                return
            if not self._slow:
                self._worst_late = max(self._worst_late, CLOCK() - self._began - due)
            data = self._line.send(frame)
            if self._replayed:
                data = self._replayed[self._index % len(self._replayed)]
            self._index += 1
            self._sent.append(data)
            if data and self._master is not None:
                write_all(self._master, data)

    def _plug(self) -> str:
        self._master, slave, path = open_raw_terminal()
        os.close(slave)
        self._link.unlink(missing_ok=True)
        self._link.symlink_to(path)
        return path

    def _wait(self, seconds: float) -> bool:
        """Let time pass, and serve; True once the input has ended."""
        end = CLOCK() + seconds
        while select.select([sys.stdin], [], [], max(0.0, end - CLOCK()))[0]:
            line = sys.stdin.readline()
            if not line:
                return True
            self._serve(json.loads(line))
        return False

    def _serve(self, request: dict[str, Any]) -> None:
        at = CLOCK()
        for what, value in request.items():
            match what:
                case "faults":
                    self._break(value)
                case "replay":
                    self._replayed = [data for data in self._sent if data][-value:]
                case "slow":
                    self._slow, self._lag_since = value, self._due
                case "touches":
                    at = CLOCK() + 0.002
                    for touch in value:
                        self._touch(at - self._began + touch.pop("after"), **touch)
                case "unplug":
                    for descriptor in (self._keep, self._master):
                        if descriptor is not None:
                            os.close(descriptor)
                    self._keep = self._master = None
                case "plug":
                    self._plug()
        say(at=at, late=self._worst_late)
        if "anew" in request:
            self._worst_late = 0.0

    def _touch(self, start: float, duration: float, **values: Any) -> None:
        self._skin.touch(ScriptedTouch(start, start + duration, **values))

    def _break(self, values: dict[str, Any]) -> None:
        known = {}
        for name, value in values.items():
            if isinstance(value, str):
                name, value = _parse_fault(f"{name}={value}")
            known[name] = value + self._index if name.endswith("_after") else value
        self._skin.faults = self._line.faults = FaultInjection(**known)


def say(**facts: Any) -> None:
    print(json.dumps(facts), flush=True)


if __name__ == "__main__":
    give_precedence(os.getpid())
    FaultySkin(Path(sys.argv[1]), int(sys.argv[2]), sys.argv[3], int(sys.argv[4])).run()
