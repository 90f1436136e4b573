"""Speed slider of the controller, over an RTDE connection of its own.

RTDE gives each input to one client: a program that opens ur_rtde's RTDEIOInterface beside this connection gets "in
use", and vice versa. A scene can leave the slider to the program (``arm.slider_stop``).
"""

from __future__ import annotations

from coneskin.core.errors import ConeSkinError, RobotConnectionError

from . import rtde_codec as rtde
from .rtde_connection import RtdeConnection

__all__ = ["SLIDER_INPUTS", "RtdeSpeedSlider", "decode_fraction", "set_slider"]

_SLIDER_OUTPUTS = ("target_speed_fraction",)
#: the controller's names of what is written
SLIDER_INPUTS = ("speed_slider_mask", "speed_slider_fraction")
_SLIDER_FREQUENCY = 50.0  # Hz; enough to know where a person has put the slider
_SLIDER_RECIPE = rtde.Recipe(_SLIDER_OUTPUTS)


def decode_fraction(payload: bytes) -> float:
    """Return the position of the slider, 0..1, in the payload of a data packet of ``RtdeSpeedSlider.read``.

    Raises:
        RobotConnectionError: the payload has another length, or the position is not from 0 to 1.
    """
    (fraction,) = _SLIDER_RECIPE.unpack(payload)
    assert isinstance(fraction, float)
    if not 0.0 <= fraction <= 1.0:
        raise RobotConnectionError(f"target_speed_fraction must be from 0 to 1, got {fraction!r}")
    return fraction


class RtdeSpeedSlider(RtdeConnection):
    """Connection that reads and sets the slider without waiting; open it in a ``with``.

    Args:
        host: the controller.
        timeout: how long connecting and each reply may take [s].

    Raises:
        RobotConnectionError: on entering, where the controller cannot be reached.
        RobotRefused: on entering, where another client has taken the slider.
        RobotTimeout: on entering, where the controller does not answer.
    """

    _in = rtde.Recipe(SLIDER_INPUTS)

    def __enter__(self) -> RtdeSpeedSlider:
        super().__enter__()
        self._in = self.claim("the speed slider", _SLIDER_OUTPUTS, SLIDER_INPUTS, _SLIDER_FREQUENCY)
        return self

    def set(self, fraction: float) -> bool:
        """Set the slider to a fraction without waiting; return whether the system took the bytes."""
        return self.send(self._in, (1, fraction))


def set_slider(host: str, fraction: float, timeout: float) -> bool:
    """Set the slider to a fraction over a new connection that is closed again; the controller keeps the value.

    Args:
        host: the controller.
        fraction: from 0 to 1.
        timeout: how long connecting and each reply may take [s].

    Returns:
        whether the system took the bytes; False where another client has taken the slider.
    """
    try:
        with RtdeConnection(host, timeout) as connection:
            return connection.send(connection.ask_inputs(SLIDER_INPUTS), (1, fraction))
    except ConeSkinError:
        return False
