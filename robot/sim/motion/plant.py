"""Plant: what the controller's joint targets move, and what its sensors then measure.

The controller makes targets, the plant follows them as well as it can. The one here follows them exactly; another one
may have masses, servos that give way, and things to run into (``coneskin.impact.simulation``). That one is a process of
its own, in real time, at the other end of a channel: each cycle its targets are sent, and what has come back is taken.
So what is measured is a cycle old where the plant keeps up, and older where it does not. A plant that is gone,
`_MAX_LAG` behind or ahead of its targets is lost, and so is one that measures what no arm does: also a joint that jumps
from one answer to the next.

A message of targets is 12 doubles, q [rad] and qd [rad/s]; the answer 18: measured q, qd and current [A].
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from typing import NamedTuple, Protocol

from coneskin.core.channel import Channel
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.arm.models import JOINT_COUNT

CYCLE = 0.002  #: control cycle of an e-Series controller [s]


class PlantLost(Exception):
    """The plant is gone, or too far behind: nothing that it measures counts any more. The message says which."""


class PlantState(NamedTuple):
    """What the controller measures in one cycle."""

    q: Sequence[float]  #: joint positions [rad]
    qd: Sequence[float]  #: joint speeds [rad/s]
    current: Sequence[float]  #: of each motor beyond what the controller's model of the arm expects [A]


class Plant(Protocol):
    """Plant of one arm. It stands at the controller's start position until the first cycle."""

    def update(self, q: Sequence[float], qd: Sequence[float]) -> PlantState:
        """Let one control cycle pass, and return what is measured.

        Args:
            q: targets of the joints at its end [rad].
            qd: their speeds then [rad/s].

        Raises:
            PlantLost: the plant is gone, or too far behind; it is not asked again.
        """

    def close(self) -> None:
        """Let the plant go; may be called again."""


class KinematicPlant:
    """Plant without dynamics: it does what is commanded, so measured and commanded motion are the same."""

    def update(self, q: Sequence[float], qd: Sequence[float]) -> PlantState:
        """Return the targets; see `Plant`."""
        return PlantState(q, qd, (0.0,) * JOINT_COUNT)

    def close(self) -> None:
        """Do nothing: there is nothing to let go."""


#: s that a plant may be behind; as long as a pseudo-terminal on a busy computer can stall
_MAX_LAG = 0.25
#: what no arm that is whole measures: joints turn twice at most. A blow of 7 kN takes 800 A
_MAX_POSITION, _MAX_CURRENT = 8.0 * math.pi, 1e4  # rad, A
#: of the highest speed of a joint, which no blow exceeds: in 72 collisions of bench `collision` without any
#: protection the fastest joint was flung to 3.2 of it
_MAX_SPEED_RATIO = 10.0
_TARGETS_MESSAGE = struct.Struct("<12d")
_STATE_MESSAGE = struct.Struct("<18d")


def encode_state(state: PlantState) -> bytes:
    """Return the answer to targets."""
    return _STATE_MESSAGE.pack(*state.q, *state.qd, *state.current)


def decode_targets(message: bytes) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return joint positions [rad] and speeds [rad/s] of a message of targets.

    Raises:
        ValueError: it is none.
    """
    if len(message) != _TARGETS_MESSAGE.size:
        raise ValueError(f"targets of a plant must be {_TARGETS_MESSAGE.size} bytes, got {len(message)}")
    values = _TARGETS_MESSAGE.unpack(message)
    return values[:6], values[6:]


class RemotePlant:
    """Plant at the other end of a channel; methods as of `Plant`.

    Args:
        channel: to its process.
        q: joint positions at the start [rad].
        model: the arm, whose joints bound what can be measured.
    """

    def __init__(self, channel: Channel, q: Sequence[float], model: ArmModel) -> None:
        self._channel = channel
        self._fastest = [_MAX_SPEED_RATIO * speed for speed in model.joint_speed]
        self._state = PlantState(tuple(q), (0.0,) * JOINT_COUNT, (0.0,) * JOINT_COUNT)
        self._behind = 0  # cycles that are not answered yet

    def update(self, q: Sequence[float], qd: Sequence[float]) -> PlantState:
        """Send the targets, and return what was measured last; see `Plant`."""
        self._channel.send(_TARGETS_MESSAGE.pack(*q, *qd))
        self._behind += 1
        for message in self._channel.receive():
            self._state = self._measured(message)
            self._behind -= 1
            if self._behind < 0:
                raise PlantLost("the plant has answered targets that it was not sent")
        if self._channel.closed:
            raise PlantLost("the process of the plant has ended")
        if self._behind * CYCLE > _MAX_LAG:
            raise PlantLost(
                f"the plant is more than {1e3 * _MAX_LAG:g} ms behind real time: end what else keeps this "
                "computer busy, or put fewer bodies and skins into the scene"
            )
        return self._state

    def close(self) -> None:
        """End the conversation; the process then ends."""
        self._channel.close()

    def _measured(self, message: bytes) -> PlantState:
        """Return what an answer says; raise PlantLost for what no arm can have measured after the last."""
        if len(message) != _STATE_MESSAGE.size:
            raise PlantLost(f"the plant has answered {len(message)} bytes, not {_STATE_MESSAGE.size}")
        values = _STATE_MESSAGE.unpack(message)
        state = PlantState(values[:6], values[6:12], values[12:])
        ways = [after - before for before, after in zip(self._state.q, state.q, strict=True)]
        for what, own, most, unit in (
            ("a position", state.q, [_MAX_POSITION] * JOINT_COUNT, "rad"),
            ("a speed", state.qd, self._fastest, "rad/s"),
            ("a current", state.current, [_MAX_CURRENT] * JOINT_COUNT, "A"),
            (f"a way in {1e3 * CYCLE:g} ms", ways, [CYCLE * speed for speed in self._fastest], "rad"),
        ):
            for joint, (value, bound) in enumerate(zip(own, most, strict=True), 1):
                if not math.isfinite(value):
                    raise PlantLost(f"the plant has measured {what} of joint {joint} that is not a number")
                if abs(value) > bound:
                    said = f"{what} of joint {joint} of {value:.3g} {unit}"
                    raise PlantLost(f"the plant has measured {said}; at most {bound:.3g} is possible")
        return state
