"""Baseline of bench `loop`: a loop of poll, os.read and one send, the least that any Python program needs."""

from __future__ import annotations

import gc
import os
import select
import socket
from dataclasses import dataclass, field

from coneskin.skin.wire import FRAME_LENGTH

from .far_end import CLOCK, FarEnd


@dataclass
class Baseline:
    """Loop of poll, os.read and send.

    Attributes:
        wake: from a frame written to the same frame read [s].
        sent: from there to the end of the send [s].
        whole: both [s].
    """

    wake: list[float] = field(default_factory=list)
    sent: list[float] = field(default_factory=list)
    whole: list[float] = field(default_factory=list)

    def turn(self, rate_hz: float, seconds: float) -> None:
        """Read for some time."""
        ours, theirs = socket.socketpair()
        with FarEnd(rate_hz) as far:
            poll = select.poll()
            poll.register(far.slave, select.POLLIN)
            seen: list[tuple[int, float, float]] = []
            end = CLOCK() + seconds + 0.5
            gc.disable()
            while CLOCK() < end:
                if not poll.poll(100):
                    continue
                data = os.read(far.slave, 4096)
                read = CLOCK()
                ours.send(data[:9])
                if len(data) == FRAME_LENGTH:
                    seen.append((int.from_bytes(data[8:10], "little"), read, CLOCK()))
                theirs.recv(64)
            gc.enable()
            written = far.written()
        for sequence, read, sent in seen:
            if sequence in written:
                self.wake.append(read - written[sequence])
                self.sent.append(sent - read)
                self.whole.append(sent - written[sequence])
        ours.close()
        theirs.close()
