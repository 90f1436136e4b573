"""Overflow filter of the recording: a full channel still carries every event, and the extent of what is left out. Pure.

A program that is frozen for long makes its guard's channel run full. Inputs and commands are then left out of the
recording, but no event is: a program that goes on has to know of a collision.
"""

from __future__ import annotations

from coneskin.core.recording.block import decode_blocks, encode_block

from .signals.journal import BlockKind, EventName, GuardEvent

__all__ = ["RecordingOverflowFilter"]


class RecordingOverflowFilter:
    """Filter for ``Channel.overflow``, where each message consists of whole blocks of a recording."""

    def __init__(self) -> None:
        self._left_out = 0
        self._since = self._until = 0.0

    def shorten(self, message: bytes) -> bytes:
        """Return the events in a message; the rest of it is counted."""
        kept = []
        for _, block in decode_blocks(message):
            if block.kind == BlockKind.EVENT:
                kept.append(encode_block(block))
                continue
            if not self._left_out:
                self._since = block.time
            self._left_out += 1
            self._until = block.time
        return b"".join(kept)

    def notice(self) -> bytes:
        """Return the event that says what was left out since the last one; empty where nothing was."""
        if not self._left_out:
            return b""
        length = self._until - self._since
        what = f"{self._left_out} blocks of {length:.3f} s are not recorded: the program did not read them"
        details = {"what": what, "blocks": self._left_out, "since": self._since, "until": self._until}
        self._left_out = 0
        return encode_block(GuardEvent(EventName.RECORDING_GAP, self._until, details).block())
