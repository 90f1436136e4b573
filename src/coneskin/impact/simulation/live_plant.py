"""Live plant: the physics of a scene in real time, between a simulated controller and a virtual skin.

    with LivePlant(scene, q) as plant, SimulatedController("UR5e", host, q, plant=plant.controller):
        with guard(scene, pressed_by=plant.skin) as session:
            session.arm.move_j(goal, speed=1.0, acceleration=2.0)     # into a body of the scene

Its process is one of its own: on a busy computer of two cores a cycle of 2 ms takes it 0.07 ms while nothing touches
and 0.5 ms (at times 9 ms) while something does, which in the controller's process would hold up the control cycle.
"""

from __future__ import annotations

import math
import socket
import time
from collections.abc import Sequence
from typing import Any

from coneskin.core.channel import Channel, decode_json, encode_json, pair, wait_readable
from coneskin.core.child_process import OwnedProcess, spawn
from coneskin.core.errors import MissingExtra, RobotConnectionError, RobotRefused, RobotTimeout
from coneskin.scene.values.scene import Scene

from .impact_outcome import ImpactOutcome

_TIMEOUT = 30.0  # s; a busy computer holds a process up


class LivePlant(OwnedProcess):
    """Process of a plant; use it in a ``with``, around the controller and the guarded session.

    Args:
        scene: with an arm, a virtual skin and bodies.
        q: joint positions at the start [rad].

    Raises:
        MissingExtra: on entry, MuJoCo is not installed.
        RobotRefused: on entry, there can be no plant of this scene; the message says why.
        RobotTimeout: on entry, it is not ready in time.
        RobotConnectionError: on entry, its process did not start, or ended.
    """

    _process_name = "the physics"
    controller: socket.socket  #: line for ``SimulatedController(plant=...)``
    skin: socket.socket  #: line for ``guard(pressed_by=...)``

    def __init__(self, scene: Scene, q: Sequence[float]) -> None:
        self._start = {"scene": scene.text, "name": scene.name, "folder": str(scene.folder.resolve()), "q": list(q)}
        self._channel: Channel | None = None

    def __enter__(self) -> LivePlant:
        ours, theirs = pair()
        self.controller, of_controller = pair()
        self.skin, of_skin = pair()
        try:
            self._process = spawn("coneskin.impact.simulation.plant_process", theirs, of_controller, of_skin)
            self._channel = Channel(ours)
            self._channel.send(encode_json(self._start))
            answer = self._receive(_TIMEOUT)
            if "refused" in answer:
                if answer["missing"]:
                    raise MissingExtra("mujoco", "physics in the loop", "physics")
                raise RobotRefused(f"no physics for {self._start['name']}: {answer['refused']}")
        except BaseException:
            self.close()
            raise
        return self

    def outcome(self) -> tuple[ImpactOutcome, float]:
        """Return what the bodies had to bear so far, and when the first contact began on the host's clock [s].

        NaN where there was none. What the guard noticed is not in it: its events say that.

        Raises:
            RobotTimeout, RobotConnectionError: the process does not answer, or has ended.
        """
        self._running()
        assert self._channel is not None
        self._channel.send(b"outcome")
        answer = {name: math.nan if value is None else value for name, value in self._receive(_TIMEOUT).items()}
        began = answer.pop("began")
        return ImpactOutcome(**answer), began

    def close(self) -> None:
        """End the process, and close the lines that were not given away; may be called again."""
        for line in (self.controller, self.skin):
            line.close()
        if self._channel is not None:
            self._channel.close()
        super().close()

    def _receive(self, timeout: float) -> dict[str, Any]:
        process, channel = self._running(), self._channel
        assert channel is not None
        end = time.monotonic() + timeout
        while time.monotonic() < end and not channel.closed:
            wait_readable([channel], 0.1)
            for message in channel.receive():
                return decode_json(message)
        if channel.closed:
            process.wait()
            raise RobotConnectionError(f"the process of the physics has ended with exit code {process.returncode}")
        raise RobotTimeout(f"the process of the physics has not answered for {timeout:g} s")
