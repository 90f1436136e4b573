"""Remote plant: one in a process of its own, in real time, over a channel.

Each cycle its targets are sent, and what has come back is taken: what is measured is a cycle old where the plant keeps
up, and older where it does not. A plant that is gone, `LONGEST_BEHIND` behind or ahead of its targets is lost, and so
is one that measures what no arm does.

A message of targets is 12 doubles, q [rad] and qd [rad/s]; the answer 18: measured q, qd and current [A].
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence

from coneskin.channel import Channel

from .arm import CYCLE
from .plant import PlantLost, PlantState

__all__ = ["LONGEST_BEHIND", "RemotePlant", "decode_targets", "encode_state"]

#: s that a plant may be behind; as long as a pseudo-terminal on a busy computer can stall
LONGEST_BEHIND = 0.25
#: what no arm that is whole measures: joints turn twice at most, and wrists at 2 pi rad/s. A blow of 7 kN takes 800 A
_MOST = (("position", 8.0 * math.pi, "rad"), ("speed", 100.0, "rad/s"), ("current", 1e4, "A"))
_TARGETS = struct.Struct("<12d")
_STATE = struct.Struct("<18d")


def encode_state(state: PlantState) -> bytes:
    """Return the answer to targets."""
    return _STATE.pack(*state.q, *state.qd, *state.current)


def decode_targets(message: bytes) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return joint positions [rad] and speeds [rad/s] of a message of targets.

    Raises:
        ValueError: it is none.
    """
    if len(message) != _TARGETS.size:
        raise ValueError(f"targets of a plant must be {_TARGETS.size} bytes, got {len(message)}")
    values = _TARGETS.unpack(message)
    return values[:6], values[6:]


def _decode(message: bytes) -> PlantState:
    """Return what a plant has measured; raise PlantLost for what it cannot have."""
    if len(message) != _STATE.size:
        raise PlantLost(f"the plant has answered {len(message)} bytes, not {_STATE.size}")
    values = _STATE.unpack(message)
    state = PlantState(values[:6], values[6:12], values[12:])
    for (name, most, unit), own in zip(_MOST, state, strict=True):
        for joint, value in enumerate(own, 1):
            if not math.isfinite(value):
                raise PlantLost(f"the plant has measured a {name} of joint {joint} that is not a number")
            if abs(value) > most:
                what = f"a {name} of joint {joint} of {value:.3g} {unit}"
                raise PlantLost(f"the plant has measured {what}; at most {most:.3g} is possible")
    return state


class RemotePlant:
    """Plant at the other end of a channel; methods as of `Plant`.

    Args:
        channel: to its process.
        q: joint positions at the start [rad].
    """

    def __init__(self, channel: Channel, q: Sequence[float]) -> None:
        self._channel = channel
        self._state = PlantState(tuple(q), (0.0,) * 6, (0.0,) * 6)
        self._behind = 0  # cycles that are not answered yet

    def advance(self, q: Sequence[float], qd: Sequence[float]) -> PlantState:
        """Send the targets, and return what was measured last; see `Plant`."""
        self._channel.send(_TARGETS.pack(*q, *qd))
        self._behind += 1
        for message in self._channel.receive():
            self._state = _decode(message)
            self._behind -= 1
            if self._behind < 0:
                raise PlantLost("the plant has answered targets that it was not sent")
        if self._channel.closed:
            raise PlantLost("the process of the plant has ended")
        if self._behind * CYCLE > LONGEST_BEHIND:
            raise PlantLost(
                f"the plant is more than {1e3 * LONGEST_BEHIND:g} ms behind real time: end what else keeps this "
                "computer busy, or put fewer bodies and skins into the scene"
            )
        return self._state

    def close(self) -> None:
        """End the conversation; the process then ends."""
        self._channel.close()
