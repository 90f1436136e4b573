"""The virtual skin of a scene as a program touches it: requests to the process that plays it."""

from __future__ import annotations

import select
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from .errors import SensorError, SkinConnectionError
from .robot.channel import Channel, pair, spawn
from .robot.owner_messages import decode_json, encode_json
from .skin.scripted_touch import ScriptedTouch

if TYPE_CHECKING:
    from .skin.sensor import Sensor

__all__ = ["SkinProxy"]

_ANSWER = 10.0  # s that the process may take to start, or to answer


class SkinProxy:
    """Starts the process of ``skin_process`` and talks with it.

    Args:
        start: the scene's text, name and folder.
        sensors: of the scene, in its order.

    Attributes:
        process: ends when the channel does.
        channel: to it.
    """

    def __init__(self, start: dict[str, Any], sensors: Sequence[Sensor]) -> None:
        ours, theirs = pair()
        self.process = spawn("coneskin.skin_process", theirs)
        self.channel = Channel(ours)
        self.channel.send(encode_json(start))
        self._sensors = sensors

    def port(self) -> str:
        """The port at which it can be read, once its process has started."""
        return str(self._ask("port"))

    def touch(self, u: float, phi: float, force: float, duration: float, sensor: str | int) -> float:
        """Touch it now; arguments, result and errors as of ``Session.touch``."""
        touch = ScriptedTouch(0.0, duration, u, phi, force=force, sensor=self._name(sensor))
        request = {"u": u, "phi": phi, "force": force, "duration": duration, "sensor": touch.sensor}
        self.channel.send(encode_json(request))
        return float(self._ask("touched"))

    def _name(self, wanted: str | int) -> str:
        if wanted == "":
            return self._sensors[0].name
        ids = () if isinstance(wanted, bool) else tuple(sensor.sensor_id for sensor in self._sensors)
        found = [sensor.name for sensor in self._sensors if wanted == sensor.name]
        found += [sensor.name for sensor, number in zip(self._sensors, ids, strict=False) if wanted == number]
        if len(found) != 1:  # sensors of two devices may have one id
            known = ", ".join(f"{sensor.name} (id {sensor.sensor_id})" for sensor in self._sensors)
            raise SensorError(f"touch.sensor must be one of {known}, got {wanted!r}")
        return found[0]

    def _ask(self, key: str) -> Any:
        end = time.monotonic() + _ANSWER
        while time.monotonic() < end and not self.channel.closed:
            select.select([self.channel], [], [], 0.1)
            for message in self.channel.receive():
                answer = decode_json(message)
                if "refused" in answer:
                    raise SensorError(answer["refused"])
                if key in answer:
                    return answer[key]
        raise SkinConnectionError("the process of the virtual skin does not answer")
