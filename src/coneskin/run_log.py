"""What the guard tells while it runs: recorded block by block, and its events kept for whoever waits for one."""

from __future__ import annotations

import contextlib
import json
import logging
import select
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import __version__
from .errors import ConeSkinError, RecordingError
from .robot.channel import Channel
from .robot.journal import GuardEvent, Kind, decode_event
from .skin.recording import Block, Recorder, decode_blocks
from .verdict import NOT_SEEN, STANDS

if TYPE_CHECKING:
    from .last_resort import LastResort

__all__ = ["RunLog", "new_recording"]

_SILENCE = 1.0  # s; an owner, or a keeper, has acted by then, if it can
_LOOK = 0.01  # s between two looks at an arm that nobody guards
_LAST = 3.0  # s that a stop may still take when the program leaves


class RunLog:
    """Hears the guard from a thread of its own, until the guard's channel ends.

    Args:
        recording: file to record to, or None.
        on_event: called for each event, from that thread.

    Attributes:
        events: what has happened so far, in order.
        ended: whether the guard's channel has ended, or nobody listens any more.
        lost: what is wrong with a guard that hangs, or is gone without a word; empty while it is heard.
    """

    def __init__(self, recording: Path | None, on_event: Callable[[GuardEvent], None] | None) -> None:
        self.events: list[GuardEvent] = []
        self.ended = False
        self.lost = ""
        self._armed = self._ending = False  # what the guard has said of itself
        self._leaving: float | None = None  # since when the program leaves
        self._recorder = Recorder(recording) if recording else None
        self._on_event = on_event
        self._changed = threading.Condition()
        self._resort: LastResort | None = None
        self._thread: threading.Thread | None = None

    def open(self, header: dict[str, Any]) -> None:
        """Begin the recording with a header.

        Raises:
            RecordingError: the file exists, or cannot be made.
        """
        if self._recorder is None:
            return
        self._recorder.__enter__()
        clocks = {"monotonic": time.monotonic(), "unix": time.time()}
        full = {**header, "coneskin": __version__, "python": sys.version.split()[0], "clocks": clocks}
        self._recorder.write(Block(Kind.HEADER, clocks["monotonic"], json.dumps(full).encode()))

    def listen(self, channel: Channel, resort: LastResort | None = None) -> None:
        """Begin to hear the guard.

        Args:
            channel: the guard's.
            resort: keeps the arm standing, in that thread, while an armed guard is silent or gone without a word; None
                where that is somebody else's task.
        """
        self._resort = resort
        self._thread = threading.Thread(target=self._listen, args=(channel,), name="coneskin recorder", daemon=True)
        self._thread.start()

    def wait_for(self, names: tuple[str, ...], timeout: float, after: int = 0) -> GuardEvent | None:
        """The first event of one of these names from position ``after`` on; None after the timeout [s] or the end."""
        end = time.monotonic() + timeout
        with self._changed:
            while True:
                for event in self.events[after:]:
                    if event.name in names:
                        return event
                left = end - time.monotonic()
                if left <= 0.0 or self.ended or not self._changed.wait(left):
                    return None

    def close(self) -> None:
        """Wait for the end of the guard's channel and close the recording; may be called again."""
        self._leaving = time.monotonic()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        if self._recorder is not None:
            recorder, self._recorder = self._recorder, None
            recorder.close()

    # ---- the thread

    def _listen(self, channel: Channel) -> None:
        try:
            self._follow(channel)
            self._end()
            if self.lost:
                self._stand_in()
        except Exception:
            logging.getLogger("coneskin").exception("what the guard tells is not heard any more")
        finally:
            self._end()
            if self._resort is not None:
                self._resort.end()

    def _end(self) -> None:
        with self._changed:
            self.ended = True
            self._changed.notify_all()

    def _follow(self, channel: Channel) -> None:
        """Hear the guard until its channel ends."""
        heard_at = time.monotonic()

        def over() -> bool:
            return bool(select.select([channel], [], [], 0.0)[0])

        while not channel.closed:
            select.select([channel], [], [], _LOOK if self.lost and self._resort else _SILENCE)
            if data := b"".join(channel.receive()):
                heard_at = time.monotonic()
                self._find()
                self._take(data)
            elif channel.closed:
                break
            elif self.lost:
                self._keep_standing(over)
            elif time.monotonic() - heard_at >= _SILENCE and self._armed and not self._ending:
                self.lost = f"the guard hangs: it has said nothing for {_SILENCE:g} s"
                self._say("hung", what=self.lost)
                self._keep_standing(over)
        if self._armed and not self._ending:
            self.lost = "the guard's process has ended without a word: nobody guards any more"
            if not any(event.name == "died" for event in self.events):  # it may have said itself what it died of
                self._say("died", what=self.lost)

    def _find(self) -> None:
        """The guard is heard: whatever was wrong is its own to say again."""
        if self.lost:
            self.lost = ""
            self._say("heard", what="the guard is heard again")
            if self._resort is not None:
                self._resort.end()

    def _stand_in(self) -> None:
        """The guard is gone for good: keep the arm standing until the program leaves."""

        def over() -> bool:
            return self._leaving is not None and time.monotonic() - self._leaving > _LAST

        while self._resort is not None:
            self._keep_standing(over)
            if self._leaving is not None and (self._resort.stands or over()):
                return
            time.sleep(_LOOK)

    def _keep_standing(self, over: Callable[[], bool]) -> None:
        if self._resort is None or not self._resort.look(over):
            return
        stands = self._resort.stands
        self._say("kept", what=f"stopped from here, without the guard: {STANDS if stands else NOT_SEEN}", stands=stands)

    def _say(self, name: str, **details: Any) -> None:
        """Put out an event of our own."""
        self._hear([GuardEvent(name, time.monotonic(), details).block()])

    def _take(self, data: bytes) -> None:
        """Whatever comes, the guard is listened to further."""
        try:
            self._hear([block for _, block in decode_blocks(data)])
        except Exception as exc:
            logging.getLogger("coneskin").exception("something that the guard has told is lost")
            self._say("message", what=f"something that the guard has told is lost: {type(exc).__name__}: {exc}")

    def _hear(self, blocks: list[Block]) -> None:
        events = []
        if self._recorder is not None:
            try:
                self._recorder.write(*blocks)
            except ConeSkinError as exc:  # a full disk ends the recording, not the guard
                recorder, self._recorder = self._recorder, None
                with contextlib.suppress(ConeSkinError):
                    recorder.close()
                events.append(GuardEvent("message", blocks[-1].time, {"what": f"recording ended: {exc}"}))
        for block in blocks:
            if block.kind == Kind.EVENT:
                try:
                    events.append(decode_event(block))
                except ConeSkinError as exc:
                    events.append(GuardEvent("message", block.time, {"what": str(exc)}))
        if not events:
            return
        names = {event.name for event in events}
        self._armed |= "armed" in names
        self._ending |= "ending" in names
        with self._changed:
            self.events += events
            self._changed.notify_all()
        if self._on_event is not None:
            try:
                for event in events:
                    self._on_event(event)
            except Exception:  # the program's own function; recording goes on without it
                self._on_event = None
                logging.getLogger("coneskin").exception("on_event has failed and is not called any more")


def new_recording(folder: Path) -> Path:
    """Make a folder for a new run in this folder, named by the time; its recording's path.

    Raises:
        RecordingError: it cannot be made.
    """
    stamp = time.strftime("%Y-%m-%dT%H-%M-%S")
    made, number = folder / stamp, 1
    while made.exists():
        number += 1
        made = folder / f"{stamp}-{number}"
    try:
        made.mkdir(parents=True)
    except OSError as exc:
        raise RecordingError(
            f"cannot make the folder {made} for the recording: {exc.strerror or exc}; see recording.folder"
        ) from exc
    return made / "run.rec"
