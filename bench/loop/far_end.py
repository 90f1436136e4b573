"""Far end of bench `loop`, a process of its own: it writes frames and states at a steady pace, and notes when."""

from __future__ import annotations

import array
import mmap
import os
import socket
import subprocess
import sys
import tempfile
import time

from coneskin.geometry.frustum import Frustum
from coneskin.robot.ur.rtde_codec import STATE_RECIPE
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.pseudo_terminal import open_raw_terminal
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import encode

SENSOR = Sensor(Frustum(0.0376, 0.0372, 0.26))
CYCLE_FRAMES = 160  # frames from one touch to the next; while the last of them last, it is touched
TOUCHED_FRAMES = 30  # frames; in the others the detector settles and the guard becomes active
_CYCLE_COUNT = 60  # touches that are made beforehand
_READY_MESSAGE = b"!"  # sent by the far end once its frames are made
STANDING_JOINTS = (0.0, -1.5, 1.5, -1.5, -1.5, 0.0)
ZERO_JOINTS = (0.0,) * 6
CLOCK = time.monotonic


class FarEnd:
    """Process of the far end, used in a ``with``.

    Args:
        rate_hz: frames per second.

    Attributes:
        path: of the port.
        slave: descriptor of the port.
        states: socket on which the states arrive.
    """

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz

    def __enter__(self) -> FarEnd:
        master, self.slave, self.path = open_raw_terminal()
        os.set_blocking(master, True)
        self.states, states = socket.socketpair()
        self._stamps = tempfile.TemporaryFile()
        self._stamps.write(bytes(8 * 65536))
        self._stamps.flush()
        descriptors = (master, states.fileno(), self._stamps.fileno())
        command = [sys.executable, "-m", "bench.loop.far_end", str(self._rate_hz), *map(str, descriptors)]
        self._process = subprocess.Popen(command, pass_fds=descriptors)
        os.close(master)
        states.close()
        self.states.recv(len(_READY_MESSAGE))  # making the frames takes seconds, which are no part of a turn
        return self

    def written(self) -> dict[int, float]:
        """Return when each frame was written, by its sequence number."""
        self._stamps.seek(0)
        return {sequence: at for sequence, at in enumerate(array.array("d", self._stamps.read())) if at}

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()
        for end in (self.states, self._stamps):
            end.close()
        os.close(self.slave)


def write_frames(rate_hz: float, master: int, states: int, stamps: int) -> None:
    """Write frames and states, and note the times, until the reader goes away."""
    touches = [
        ScriptedTouch(
            (k * CYCLE_FRAMES + CYCLE_FRAMES - TOUCHED_FRAMES) / rate_hz,
            ((k + 1) * CYCLE_FRAMES) / rate_hz,
            0.13,
            1.0,
            rise=1e-4,
        )
        for k in range(_CYCLE_COUNT)
    ]
    skin = VirtualSkin(SENSOR, touches, rate_hz=rate_hz, model="ladder", duration=_CYCLE_COUNT * CYCLE_FRAMES / rate_hz)
    frames = [(due, encode(frame), frame.sequence) for due, frame in skin.frames()]
    os.write(states, _READY_MESSAGE)
    with mmap.mmap(stamps, 0) as memory, memoryview(memory) as raw, raw.cast("d") as times:
        start = CLOCK() + 0.1
        try:
            for number, (due, data, sequence) in enumerate(frames):
                time.sleep(max(0.0, start + due - CLOCK()))
                times[sequence] = CLOCK()
                os.write(master, data)
                if number % 2 == 0:
                    os.write(
                        states,
                        STATE_RECIPE.pack((due, STANDING_JOINTS, ZERO_JOINTS, 7, 1, 2, ZERO_JOINTS, ZERO_JOINTS)),
                    )
        except OSError:
            return


if __name__ == "__main__":
    write_frames(float(sys.argv[1]), *map(int, sys.argv[2:]))
