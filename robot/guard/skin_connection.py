"""Connection to a skin that was opened again: whether what sends on it is the device that was guarded before. Pure."""

from __future__ import annotations

from coneskin.skin.detection.stream import TouchStream

__all__ = ["SkinConnection"]


class SkinConnection:
    """Identity of the device on a skin's port: the device and sensor numbers of its frames.

    Args:
        stream: of the skin.
    """

    def __init__(self, stream: TouchStream) -> None:
        self._stream = stream
        self._reopened = False

    def reopen(self, now: float) -> None:
        """Take that the port is open again at a host time [s]: nothing that came before counts any more."""
        self._stream.reconnect(now)
        self._reopened = True

    def trust(self) -> None:
        """Take that the guard has become active with it, after a person's reset."""
        self._reopened = False

    @property
    def blockers(self) -> list[str]:
        """What stands against an activation, one line each."""
        others = self._stream.unknown
        if not self._reopened or not others:
            return []
        expected = ", ".join(f"{d.sensor.device_id}/{d.sensor.sensor_id}" for d in self._stream.detectors)
        sent = ", ".join(f"{device}/{sensor}" for device, sensor in others)
        return [
            f"another device is on the skin's port: it sends as device/sensor {sent}, guarded was {expected}; plug in "
            "the one that was there"
        ]
