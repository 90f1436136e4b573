"""A virtual skin in a process of its own, with which anything can go wrong at any time: for bench/faults.py.

Started with the name that its port shall have. A line of JSON in, a line of JSON with the time out::

    {"faults": {"corrupt_every": 2}}     faults of coneskin.skin.faults; ``..._after`` counts from now on
    {"replay": 300}                      the last 300 frames over and over
    {"slow": 1.0}                        from now on frames take so much longer to arrive, more with each
    {"touch": {"u": 0.13, "phi": 1.5, "duration": 0.2}}
    {"unplug": true}  {"plug": true}     the port goes away, and comes back under the same name

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
from coneskin.skin.faults import Faults, FaultyLine
from coneskin.skin.pseudo_terminal import open_raw_terminal, wait_for_reader, write_all
from coneskin.skin.scripted_touch import ScriptedTouch
from coneskin.skin.sensor import Sensor
from coneskin.skin.sim_command import parse_fault
from coneskin.skin.virtual import VirtualSkin

RADIUS1, RADIUS2, HEIGHT = 0.0376, 0.0372, 0.26
CLOCK = time.monotonic


class FaultySkin:
    """Plays, and does what it is told."""

    def __init__(self, link: Path, seed: int) -> None:
        sensor = Sensor(Frustum(RADIUS1, RADIUS2, HEIGHT))
        self._skin = VirtualSkin(sensor, seed=seed, model="ladder")  # starts sooner; the place is not what is tested
        self._line = FaultyLine(Faults(), seed)
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
                case "touch":
                    at = CLOCK() + 0.002
                    start = at - self._began
                    self._skin.touch(ScriptedTouch(start, start + value["duration"], value["u"], value["phi"]))
                case "unplug":
                    for descriptor in (self._keep, self._master):
                        if descriptor is not None:
                            os.close(descriptor)
                    self._keep = self._master = None
                case "plug":
                    self._plug()
        say(at=at, late=self._worst_late)

    def _break(self, values: dict[str, Any]) -> None:
        known = {}
        for name, value in values.items():
            if isinstance(value, str):
                name, value = parse_fault(f"{name}={value}")
            known[name] = value + self._index if name.endswith("_after") else value
        self._skin.faults = self._line.faults = Faults(**known)


def say(**facts: Any) -> None:
    print(json.dumps(facts), flush=True)


if __name__ == "__main__":
    FaultySkin(Path(sys.argv[1]), int(sys.argv[2])).run()
