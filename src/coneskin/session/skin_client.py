"""Skin client: a program's requests to the process of the scene's virtual skin."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

from coneskin.core.channel import Channel, decode_json, encode_json, pair, wait_readable
from coneskin.core.child_process import spawn
from coneskin.core.errors import SensorError, SkinConnectionError
from coneskin.core.recording.block import Block
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.skin.sensor import Sensor

_ANSWER_TIMEOUT = 10.0  # s that the process may take to start, or to answer


class SkinClient:
    """Client of the process of ``skin_process``, which it starts.

    Args:
        start: the scene's text, name and folder.
        note_truth: is told each touch: ``touches``, a list of their ``sensor``, ``start``, ``end`` [s, host clock; None
            for one without an end], ``u`` [m], ``phi`` [rad], ``force`` [N] and ``radius`` [m]; or ``released``, when
            all that touches was taken away [s].
        pressed_by: line from what presses the skin, closed here; None where only touches do.

    Attributes:
        process: the skin's; it ends when the channel does.
        channel: to the process.
    """

    def __init__(
        self,
        start: dict[str, Any],
        sensors: Sequence[Sensor],
        note_truth: Callable[[dict[str, Any]], None] = lambda _: None,
        pressed_by: socket.socket | None = None,
    ) -> None:
        ours, theirs = pair()
        ends = [theirs]
        self._physics: Channel | None = None
        self._reading = threading.Lock()
        if pressed_by is not None:
            known, told = pair()
            self._physics = Channel(known)
            ends += [pressed_by, told]
        self.process = spawn("coneskin.session.skin_process", *ends)
        self.channel = Channel(ours)
        self.channel.send(encode_json(start))
        self._sensors = sensors
        self._note_truth = note_truth

    def port(self) -> str:
        """Return the port at which the skin can be read, once its process has started."""
        return str(self._ask("port"))

    def touch(self, u: float, phi: float, force: float, duration: float, sensor: str | int) -> float:
        """Touch the skin now; arguments, result and errors as of ``Session.touch``."""
        from coneskin.skin.virtual.scripted_touch import ScriptedTouch

        touch = ScriptedTouch(0.0, duration, u, phi, force=force, sensor=self._name(sensor))
        request = {"u": u, "phi": phi, "force": force, "duration": duration, "sensor": touch.sensor}
        self.channel.send(encode_json(request))
        told = self._ask("touched")
        self._note_truth({"touches": [told]})
        return float(told["start"])

    def note_script(self) -> None:
        """Note the touches of the scene's script, once the skin plays; errors as of ``touch``."""
        self._note_truth({"touches": self._ask("script")})

    def release(self) -> None:
        """End the touches that there are now."""
        self.channel.send(encode_json({"release": True}))
        self._note_truth({"released": time.monotonic()})

    def physics(self) -> list[Block]:
        """Return what the physics knows since this was last asked, as blocks of a recording; any thread may ask."""
        if self._physics is None or self._physics.closed:
            return []
        with self._reading:
            told = [decode_json(message) for message in self._physics.receive()]
        return [Block(BlockKind.TRUTH, float(one["time"]), one["truth"].encode()) for one in told]

    def close(self) -> None:
        """Close the line on which the physics is heard; may be called again. The process ends with its channel."""
        if self._physics is not None:
            self._physics.close()

    def _name(self, wanted: str | int) -> str:
        if wanted == "":
            return self._sensors[0].name
        known_by_id = type(wanted) is int  # no bool
        found = [s.name for s in self._sensors if wanted == s.name or (known_by_id and wanted == s.sensor_id)]
        if len(found) != 1:  # sensors of two devices may have one id
            known = ", ".join(f"{sensor.name} (id {sensor.sensor_id})" for sensor in self._sensors)
            raise SensorError(f"touch.sensor must be one of {known}, got {wanted!r}")
        return found[0]

    def _ask(self, key: str) -> Any:
        end = time.monotonic() + _ANSWER_TIMEOUT
        while time.monotonic() < end and not self.channel.closed:
            wait_readable([self.channel], 0.1)
            for message in self.channel.receive():
                answer = decode_json(message)
                if "refused" in answer:
                    raise SensorError(answer["refused"])
                if key in answer:
                    return answer[key]
        if self.process.poll() is not None:
            raise SkinConnectionError(
                f"the process of the virtual skin has ended with exit code {self.process.returncode}; why is on "
                "standard error"
            )
        raise SkinConnectionError(
            f"the process of the virtual skin has not answered for {_ANSWER_TIMEOUT:g} s: end what else keeps this "
            'computer busy, or choose model = "ladder" in [source], which takes less, and start the session again'
        )
