"""What is still told to somebody who does not take what he is sent: the events, and how much else is missing. Pure.

A program that is frozen for long makes its guard's channel run full. What goes into the recording is then left out, but
no event is: the program that goes on has to know of a collision.
"""

from __future__ import annotations

from coneskin.skin.recording import decode_blocks, encode_block

from .journal import GuardEvent, Kind

__all__ = ["Spill"]


class Spill:
    """For ``Channel.spill``, where each message consists of whole blocks of a recording."""

    def __init__(self) -> None:
        self._left_out = 0
        self._since = self._until = 0.0

    def shorten(self, message: bytes) -> bytes:
        """The events in a message; the rest of it is counted."""
        kept = []
        for _, block in decode_blocks(message):
            if block.kind == Kind.EVENT:
                kept.append(encode_block(block))
                continue
            if not self._left_out:
                self._since = block.time
            self._left_out += 1
            self._until = block.time
        return b"".join(kept)

    def notice(self) -> bytes:
        """The event that says what has been left out since the last one; nothing where nothing was."""
        if not self._left_out:
            return b""
        length = self._until - self._since
        what = f"{self._left_out} blocks of {length:.3f} s are not recorded: the program did not take them"
        details = {"what": what, "blocks": self._left_out, "since": self._since, "until": self._until}
        self._left_out = 0
        return encode_block(GuardEvent("missing", self._until, details).block())
