"""The controller's speed slider, over an RTDE connection of our own. Opened only where a scene has a slow reaction.

RTDE gives each input to one client. Whoever opens ur_rtde's RTDEIOInterface beside it gets "in use", and the other way
round; so a scene that does not slow leaves the slider alone.
"""

from __future__ import annotations

from coneskin.errors import RobotConnectionError, RobotRefused

from . import rtde_codec as rtde
from .rtde_connection import RtdeConnection

__all__ = ["SpeedSlider", "decode_fraction"]

_OUTPUT = ("target_speed_fraction",)
_INPUT = ("speed_slider_mask", "speed_slider_fraction")
_HZ = 50.0  # enough to know where a person has put it
_OUT = rtde.Recipe(_OUTPUT)


def decode_fraction(payload: bytes) -> float:
    """Where the slider is, 0..1, from the payload of a data packet of ``SpeedSlider.read``.

    Raises:
        RobotConnectionError: the payload has another length, or the slider cannot be there.
    """
    (fraction,) = _OUT.unpack(payload)
    assert isinstance(fraction, float)
    if not 0.0 <= fraction <= 1.0:
        raise RobotConnectionError(f"target_speed_fraction must be from 0 to 1, got {fraction!r}")
    return fraction


class SpeedSlider(RtdeConnection):
    """Reads and sets the slider without waiting; open it in a ``with``.

    Args:
        host: the controller.
        timeout: how long connecting and each reply may take [s].

    Raises:
        RobotConnectionError: on entering, where the controller cannot be reached.
        RobotRefused: on entering, where another client owns the slider.
        RobotTimeout: on entering, where the controller does not answer.
    """

    _in = rtde.Recipe(_INPUT)

    def __enter__(self) -> SpeedSlider:
        super().__enter__()
        try:
            self.ask_outputs(_OUTPUT, _HZ)
            self._in = self.ask_inputs(_INPUT)
        except RobotRefused as exc:
            raise RobotRefused(f"a slow reaction needs the speed slider of {self.host}: {exc}") from exc
        self.start()
        return self

    def set(self, fraction: float) -> bool:
        """Send the slider to a fraction, without waiting; whether the system took the bytes."""
        return self.send(self._in, (1, fraction))
