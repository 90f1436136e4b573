"""Stamps of bench `loop`: when the guard's loop read each frame and sent each stop, by the recording of its own."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass

from coneskin.core.recording.block import decode_blocks
from coneskin.robot.guard.signals.journal import BlockKind, decode_event
from coneskin.skin.wire import FrameDecoder

_STOP_HEAD = b"driver\nS"  # of the command


@dataclass(slots=True)
class Stamp:
    """One read of the port.

    Attributes:
        read: when [s].
        sequences: of the frames that were read whole; usually one, and none where a frame was cut.
        active: the guard was active then.
        reason: why the guard was last stopped or kept from becoming active, where it is not active.
        done: when the loop's round was over [s].
        sent: when a stop was sent [s]; 0 without one.
        why: of that stop.
    """

    read: float
    sequences: tuple[int, ...]
    active: bool
    reason: str
    done: float
    sent: float = 0.0
    why: str = ""


def stamps_of(recorded: bytes, rounds: Sequence[float]) -> list[Stamp]:
    """Return the reads in what a guard has recorded.

    Args:
        recorded: its blocks.
        rounds: when each round of its loop was over [s].
    """
    decoder, found = FrameDecoder(), list[Stamp]()
    active, reason = False, "it has not been active yet"
    for block in decode_blocks(recorded):
        if block.kind == BlockKind.SKIN:
            done = rounds[min(bisect_left(rounds, block.time), len(rounds) - 1)]
            sequences = tuple(frame.sequence for frame in decoder.feed(block.payload))
            found.append(Stamp(block.time, sequences, active, reason, done))
        elif block.kind == BlockKind.COMMAND and block.payload.startswith(_STOP_HEAD) and found and not found[-1].sent:
            found[-1].sent = block.time
        elif block.kind == BlockKind.EVENT:
            event = decode_event(block)
            what = event.details.get("why") or event.details.get("what") or event.details.get("reasons")
            active = event.name == "activated" or (active and event.name != "stopping")
            if event.name in ("stopping", "fault", "refused", "waiting"):
                reason = without_numbers(str(what))
            if event.name == "stopping" and found and found[-1].sent and not found[-1].why:
                found[-1].why = reason
    return found


def without_numbers(text: str) -> str:
    """Return a reason without its numbers in brackets, so that the same ones can be counted."""
    return re.sub(r" \([^)]*\d[^)]*\)", "", text)
