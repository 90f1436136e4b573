"""The kinds of block that a guard records: everything that goes into it, and everything that comes out.

What goes in is enough to run the guard again: ``GuardCore.take`` is fed the same blocks, live and in a replay.
"""

from __future__ import annotations

import json
from enum import IntEnum
from typing import Any, NamedTuple

from coneskin.errors import RecordingError
from coneskin.skin.recording import Block

__all__ = ["ABOUT", "INPUTS", "GuardEvent", "Kind", "decode_event"]


class Kind(IntEnum):
    """What a block holds. 1 to 9 go into the guard, 10 to 19 come out of it."""

    SKIN = 1  #: bytes of the skin's stream, as they were read
    ARM = 2  #: payload of an RTDE data packet, for ``state_reader.decode_state``
    TICK = 3  #: nothing: time has passed
    OWNER = 4  #: a note of the owner of ur_rtde
    RESET = 5  #: a person resets the guard
    LOST = 6  #: a source, or a way to stop, is gone; the payload says which and why
    SLIDER = 7  #: payload of an RTDE data packet, for ``speed_slider.decode_fraction``
    EVENT = 10  #: a GuardEvent, JSON
    COMMAND = 11  #: a command as it was sent: to whom, a line feed, its bytes
    HEADER = 20  #: JSON: the scene and the versions
    OVERRUN = 21  #: JSON: how late the loop was


INPUTS = frozenset({Kind.SKIN, Kind.ARM, Kind.TICK, Kind.OWNER, Kind.RESET, Kind.LOST, Kind.SLIDER})


#: events about the guard, not by it, so that a replay does not make them: it died, hangs, is heard again; the arm was
#: kept standing without it; blocks are missing
ABOUT = frozenset({"died", "hung", "heard", "kept", "missing"})


class GuardEvent(NamedTuple):
    """Something that a person, or a test, wants to know about.

    Attributes:
        name: "waiting", "armed", "contact", "contact_placed", "touch_ended", "fault", "stopping", "slower",
            "not_standing", "standstill", "escalated", "retreating", "clipped", "retreated", "slowing", "resumed",
            "latched", "refused", "reset", "message", "ending"; and those of ``ABOUT``.
        time: host clock [s].
        details: numbers and words that belong to it; SI and radians.
    """

    name: str
    time: float
    details: dict[str, Any]

    def block(self) -> Block:
        """The block that records it. Floats keep every bit."""
        return Block(Kind.EVENT, self.time, json.dumps([self.name, self.details]).encode())


def decode_event(block: Block) -> GuardEvent:
    """The event in a block.

    Raises:
        RecordingError: the block holds none.
    """
    try:
        name, details = json.loads(block.payload)
        if block.kind != Kind.EVENT or not isinstance(details, dict):
            raise ValueError(f"kind {block.kind}")
    except ValueError as exc:
        raise RecordingError(f"a block of {block.time:.6f} s holds no event: {exc}") from exc
    return GuardEvent(str(name), block.time, details)
