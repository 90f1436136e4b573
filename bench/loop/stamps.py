"""Stamps of bench `loop`: when each stage of the guard's loop was done with a frame, and what the guard was then."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from coneskin.core.channel import Channel
from coneskin.robot.guard.core import GuardCore
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.journal import GuardEvent
from coneskin.skin.sources.serial_port import SerialPort
from coneskin.skin.wire import FrameDecoder

from .far_end import CLOCK


@dataclass(slots=True)
class Stamp:
    """One read of the port.

    Attributes:
        sequences: of the frames that were read whole; usually one, and none where a frame was cut.
        read: when [s].
        phase: of the guard then.
        reason: why the guard was last stopped or kept from becoming active, where it is not active.
        decided: when a stop was decided [s]; 0 without one.
        sent: when it was sent [s].
        why: of that stop.
        done: when the core was done [s].
    """

    sequences: tuple[int, ...]
    read: float
    phase: Phase
    reason: str
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
        reason: why the guard was last stopped or kept from becoming active.
    """

    all: list[Stamp] = field(default_factory=list)
    core: GuardCore | None = None
    reason: str = "it has not been active yet"
    _decoder: FrameDecoder = field(default_factory=FrameDecoder)

    def wrap_core(self, core: GuardCore) -> Any:
        """Return the core; it stamps when it is done, and notes why the guard stops."""
        self.core = core
        return Wrapped(core, "feed", lambda _, __, out: self._stamp_done(out))

    def wrap_source(self, port: SerialPort) -> Any:
        """Return the port; it stamps when it has read."""
        return Wrapped(port, "read", lambda data, *_: self._stamp_read(data))

    def wrap_driver(self, channel: Channel) -> Any:
        """Return the channel; it stamps before and after a stop is sent."""
        wrapped = Wrapped(channel, "receive", lambda *_: None)
        wrapped.send = self._sender(channel)  # type: ignore[attr-defined]
        return wrapped

    def _stamp_read(self, data: bytes) -> None:
        now = CLOCK()
        assert self.core is not None
        frames = self._decoder.feed(data)
        self.all.append(Stamp(tuple(frame.sequence for frame in frames), now, self.core.phase, self.reason))

    def _stamp_done(self, out: Any) -> None:
        if self.all and not self.all[-1].done:
            self.all[-1].done = CLOCK()
        events: list[GuardEvent] = getattr(out, "events", [])
        for event in events:
            what = event.details.get("why") or event.details.get("what") or event.details.get("reasons")
            if event.name in ("stopping", "fault", "refused", "waiting"):
                self.reason = without_numbers(str(what))
            if event.name == "stopping" and self.all and self.all[-1].sent and not self.all[-1].why:
                self.all[-1].why = without_numbers(str(what))

    def _sender(self, channel: Channel) -> Callable[[bytes], bool]:
        def send(message: bytes) -> bool:
            if message[:1] != b"S" or not self.all or self.all[-1].sent:
                return channel.send(message)
            self.all[-1].decided = CLOCK()
            taken = channel.send(message)
            self.all[-1].sent = CLOCK()
            return taken

        return send


def without_numbers(text: str) -> str:
    """Return a reason without its numbers in brackets, so that the same ones can be counted."""
    return re.sub(r" \([^)]*\d[^)]*\)", "", text)


class Wrapped:
    """Object with one method whose results and arguments are passed on as well."""

    def __init__(self, inner: Any, name: str, emit: Callable[..., None]) -> None:
        method = getattr(inner, name)

        def wrapped(*arguments: Any) -> Any:
            result = method(*arguments)
            emit(result, *arguments)
            return result

        self._inner = inner
        setattr(self, name, wrapped)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)
