"""Messages between guard, driver process and guard watchdog. Pure: bytes in, values out.

The guard's commands are a letter and doubles, because they are sent from the live loop.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from coneskin.robot.arm.joints import Joints

LEAVE = b"leave"  #: of the guarded program to a guard watchdog: it ends, and still listens

_ONE_DOUBLE = struct.Struct("<d")
_ONE_NUMBER = struct.Struct("<Q")


class StopProgram(NamedTuple):
    """Command to stop the arm, at [rad/s2] of the leading joint, and to refuse the program until ``Release``."""

    deceleration: float

    def encode(self) -> bytes:
        """Return the message."""
        return b"S" + _ONE_DOUBLE.pack(self.deceleration)


class SetJointVelocity(NamedTuple):
    """Command to move at joint speeds [rad/s] until the next one; acceleration of the leading joint [rad/s2]."""

    qd: Joints
    acceleration: float

    def encode(self) -> bytes:
        """Return the message."""
        return b"V" + struct.pack(f"<{len(self.qd) + 1}d", *self.qd, self.acceleration)


class DatedVelocity(NamedTuple):
    """Speeds with the host time of their decision [s]: the driver process follows none that were held up anywhere."""

    decided: float
    velocity: SetJointVelocity

    def encode(self) -> bytes:
        """Return the message."""
        return b"D" + _ONE_DOUBLE.pack(self.decided) + self.velocity.encode()[1:]


class EndReaction(NamedTuple):
    """Command to end what ``SetJointVelocity`` began, with a deceleration of the leading joint [rad/s2]."""

    deceleration: float

    def encode(self) -> bytes:
        """Return the message."""
        return b"H" + _ONE_DOUBLE.pack(self.deceleration)


class Release(NamedTuple):
    """Command to let the program move the arm; acknowledged by a report "released" with the same number."""

    number: int  #: of the release; a guard watchdog, which lets nothing move, acknowledges it as well

    def encode(self) -> bytes:
        """Return the message."""
        return b"C" + _ONE_NUMBER.pack(self.number)


class Heartbeat(NamedTuple):
    """Heartbeat of the guard, every ``BEAT_PERIOD``; without it for ``GUARD_SILENCE`` the arm is stopped."""

    def encode(self) -> bytes:
        """Return the message."""
        return b"A"


class Shutdown(NamedTuple):
    """Announcement that the guard ends on purpose, after it has seen the arm stand."""

    def encode(self) -> bytes:
        """Return the message."""
        return b"F"


#: written out: compiled, a loop over both takes them for plain tuples without items
_WORD_COMMANDS: dict[bytes, Heartbeat | Shutdown] = {b"A": Heartbeat(), b"F": Shutdown()}
GuardCommand = StopProgram | DatedVelocity | SetJointVelocity | EndReaction | Release | Heartbeat | Shutdown


class StatusReport(NamedTuple):
    """Report of the driver process, or of the guard watchdog, to the guard.

    Attributes:
        kind: "alive", every ``BEAT_PERIOD``; "ready"; "done" (a stop or the end of a reaction returned);
            "released", with the number of the release; "restarts" and "restarted" around an end of the driver's program
            on the controller that is meant; "remark"; "error".
        text: more, for a person.
    """

    kind: str
    text: str = ""

    def encode(self) -> bytes:
        """Return the message."""
        return f"{self.kind}\n{self.text}".encode("utf-8", "backslashreplace")  # an error may name a file

    @classmethod
    def decode(cls, message: bytes) -> StatusReport:
        """Return the report in a message."""
        kind, _, text = message.decode("utf-8", "replace").partition("\n")
        return cls(kind, text)


def _doubles(body: bytes) -> tuple[float, ...]:
    return struct.unpack(f"<{len(body) // _ONE_DOUBLE.size}d", body)


def decode_command(message: bytes) -> GuardCommand:
    """Return the command in a message of the guard.

    Raises:
        ValueError: it is none.
    """
    letter, body = message[:1], message[1:]
    try:
        if letter == b"D":
            (decided,), (*qd, acceleration) = _ONE_DOUBLE.unpack(body[:8]), _doubles(body[8:])
            return DatedVelocity(decided, SetJointVelocity(tuple(qd), acceleration))
        if letter == b"V":
            *qd, acceleration = _doubles(body)
            return SetJointVelocity(tuple(qd), acceleration)
        if letter == b"C":
            return Release(*_ONE_NUMBER.unpack(body))
        if letter in (b"S", b"H"):
            return (StopProgram if letter == b"S" else EndReaction)(*_ONE_DOUBLE.unpack(body))
    except (struct.error, ValueError) as exc:
        raise ValueError(f"a command of the guard is damaged: {message!r}") from exc
    if message in _WORD_COMMANDS:
        return _WORD_COMMANDS[message]
    raise ValueError(f"not a command of the guard: {message!r}")
