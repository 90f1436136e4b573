"""What the guard, the program and the owner of ur_rtde say to each other. Pure: bytes in, values out.

The guard's commands are a letter and doubles, because they are sent from the live loop. The program's are JSON: they
are rare, and a person may read them.
"""

from __future__ import annotations

import json
import struct
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from .ur_models import Joints

__all__ = [
    "BEAT",
    "SILENCE",
    "STEERING_SILENCE",
    "Alive",
    "Clear",
    "Farewell",
    "GuardCommand",
    "Halt",
    "Note",
    "Speed",
    "Stop",
    "decode_command",
    "decode_json",
    "encode_json",
]

BEAT = 0.05  #: s between two signs of life of the guard
SILENCE = 0.5  #: s without one after which the guard counts as dead; a busy machine may hold it up for 0.1 s
STEERING_SILENCE = 0.1  #: s, while the guard itself moves the arm, with a new ``Speed`` every 4 ms

_ONE = struct.Struct("<d")
_SEVEN = struct.Struct("<7d")


class Stop(NamedTuple):
    """Stop whatever the owner moves, and refuse the program until ``Clear``.

    Attributes:
        deceleration: of the leading joint [rad/s2].
    """

    deceleration: float

    def encode(self) -> bytes:
        """The message."""
        return b"S" + _ONE.pack(self.deceleration)


class Speed(NamedTuple):
    """Move the joints at these speeds until the next command.

    Attributes:
        qd: joint speeds [rad/s].
        acceleration: of the leading joint [rad/s2].
    """

    qd: Joints
    acceleration: float

    def encode(self) -> bytes:
        """The message."""
        return b"V" + _SEVEN.pack(*self.qd, self.acceleration)


class Halt(NamedTuple):
    """End the movement that ``Speed`` began.

    Attributes:
        deceleration: of the leading joint [rad/s2].
    """

    deceleration: float

    def encode(self) -> bytes:
        """The message."""
        return b"H" + _ONE.pack(self.deceleration)


class Clear(NamedTuple):
    """Let the program move the arm."""

    def encode(self) -> bytes:
        """The message."""
        return b"C"


class Alive(NamedTuple):
    """The guard is there: sent every ``BEAT``. Whoever misses it for ``SILENCE`` stops the arm."""

    def encode(self) -> bytes:
        """The message."""
        return b"A"


class Farewell(NamedTuple):
    """The guard ends on purpose, after it has seen the arm stand."""

    def encode(self) -> bytes:
        """The message."""
        return b"F"


_WORDS: dict[bytes, Clear | Alive | Farewell] = {word.encode(): word for word in (Clear(), Alive(), Farewell())}
GuardCommand = Stop | Speed | Halt | Clear | Alive | Farewell


class Note(NamedTuple):
    """What the owner tells the guard.

    Attributes:
        kind: "ready", "done" (a stop or halt returned), "error", "moving", "idle".
        text: more, for a person.
    """

    kind: str
    text: str = ""

    def encode(self) -> bytes:
        """The message."""
        return f"{self.kind}\n{self.text}".encode()

    @classmethod
    def decode(cls, message: bytes) -> Note:
        """The note in a message."""
        kind, _, text = message.decode("utf-8", "replace").partition("\n")
        return cls(kind, text)


def decode_command(message: bytes) -> GuardCommand:
    """The command in a message of the guard.

    Raises:
        ValueError: it is none.
    """
    letter, body = message[:1], message[1:]
    try:
        if letter == b"V":
            *qd, acceleration = _SEVEN.unpack(body)
            return Speed((qd[0], qd[1], qd[2], qd[3], qd[4], qd[5]), acceleration)
        if letter in (b"S", b"H"):
            return (Stop if letter == b"S" else Halt)(*_ONE.unpack(body))
    except struct.error as exc:
        raise ValueError(f"a command of the guard is damaged: {message!r}") from exc
    if message in _WORDS:
        return _WORDS[message]
    raise ValueError(f"not a command of the guard: {message!r}")


def encode_json(value: dict[str, Any]) -> bytes:
    """A message that is a JSON object."""
    return json.dumps(value).encode()


def decode_json(message: bytes) -> dict[str, Any]:
    """The JSON object in a message.

    Raises:
        ValueError: it is none.
    """
    value = json.loads(message)
    if not isinstance(value, dict):
        raise ValueError(f"a message must be a JSON object, got {type(value).__name__}")
    return value
