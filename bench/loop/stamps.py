"""Stamps of bench `loop`: when each stage of the guard's loop was done with a frame, and what the guard was then."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field

from coneskin.core.channel import Channel
from coneskin.core.recording.block import decode_blocks
from coneskin.robot.guard.core import GuardCore
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.journal import BlockKind, decode_event
from coneskin.skin.sources.serial_port import SerialPort
from coneskin.skin.wire import FrameDecoder

from .far_end import CLOCK


@dataclass(slots=True)
class Stamp:
    """One read of the port.

    Attributes:
        read: when [s].
        data: what was read.
        phase: of the guard then.
        sequences: of the frames that were read whole; usually one, and none where a frame was cut.
        reason: why the guard was last stopped or kept from becoming active, where it is not active.
        decided: when a stop was decided [s]; 0 without one.
        sent: when it was sent [s].
        why: of that stop.
        done: when the loop's round was over [s].
    """

    read: float
    data: bytes
    phase: Phase
    sequences: tuple[int, ...] = ()
    reason: str = ""
    decided: float = 0.0
    sent: float = 0.0
    why: str = ""
    done: float = 0.0


@dataclass
class Stamps:
    """Clock around the stages of the loop.

    Attributes:
        all: in order.
        core: whose phase is noted.
    """

    all: list[Stamp] = field(default_factory=list)
    core: GuardCore | None = None

    def read(self, data: bytes) -> None:
        """Stamp what has just been read. It is looked at later: the guard waits."""
        now = CLOCK()
        assert self.core is not None
        self.all.append(Stamp(now, data, self.core.phase))

    def done(self) -> None:
        """Stamp that a round of the loop is over."""
        if self.all and not self.all[-1].done:
            self.all[-1].done = CLOCK()

    def explain(self, recorded: bytes) -> None:
        """Say which frames each read has, why the guard was not active, and why it stopped, from its recording."""
        decoder = FrameDecoder()
        events = [decode_event(block) for _, block in decode_blocks(recorded) if block.kind == BlockKind.EVENT]
        reason, at = "it has not been active yet", 0
        ends = [stamp.read for stamp in self.all[1:]] + [math.inf]
        for stamp, end in zip(self.all, ends, strict=True):
            stamp.sequences = tuple(frame.sequence for frame in decoder.feed(stamp.data))
            stamp.reason = reason
            while at < len(events) and events[at].time < end:
                event, at = events[at], at + 1
                what = event.details.get("why") or event.details.get("what") or event.details.get("reasons")
                if event.name in ("stopping", "fault", "refused", "waiting"):
                    reason = without_numbers(str(what))
                if event.name == "stopping" and stamp.sent and not stamp.why:
                    stamp.why = reason


class StampedPort:
    """Port that stamps when it has read."""

    def __init__(self, port: SerialPort, stamps: Stamps) -> None:
        self._port, self._stamps = port, stamps
        self.name, self.fileno = port.name, port.fileno

    def read(self, timeout: float) -> bytes:
        """Read as the port does."""
        data = self._port.read(timeout)
        self._stamps.read(data)
        return data


class StampedChannel(Channel):
    """Channel to the driver process that stamps before and after a stop is sent."""

    stamps: Stamps

    def send(self, message: bytes) -> bool:
        """Send as a channel does."""
        stamps = self.stamps.all
        if message[:1] != b"S" or not stamps or stamps[-1].sent:
            return super().send(message)
        stamps[-1].decided = CLOCK()
        taken = super().send(message)
        stamps[-1].sent = CLOCK()
        return taken


def without_numbers(text: str) -> str:
    """Return a reason without its numbers in brackets, so that the same ones can be counted."""
    return re.sub(r" \([^)]*\d[^)]*\)", "", text)
