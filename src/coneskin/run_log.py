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
from typing import Any

from . import __version__
from .errors import ConeSkinError, RecordingError
from .robot.channel import Channel
from .robot.journal import GuardEvent, Kind, decode_event
from .skin.recording import Block, Recorder, decode_blocks

__all__ = ["RunLog", "new_recording"]

_SILENCE = 1.0  # s; an owner, or a keeper, has acted by then, if it can


class RunLog:
    """Hears the guard from a thread of its own, until the guard's channel ends.

    Args:
        recording: file to record to, or None.
        on_event: called for each event, from that thread.

    Attributes:
        events: what has happened so far, in order.
        ended: whether the guard's channel has ended.
    """

    def __init__(self, recording: Path | None, on_event: Callable[[GuardEvent], None] | None) -> None:
        self.events: list[GuardEvent] = []
        self.ended = False
        self._recorder = Recorder(recording) if recording else None
        self._on_event = on_event
        self._changed = threading.Condition()
        self._on_lost: Callable[[], None] | None = None
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

    def listen(self, channel: Channel, on_lost: Callable[[], None] | None = None) -> None:
        """Begin to hear the guard.

        Args:
            channel: the guard's.
            on_lost: called once, from that thread, where an armed guard falls silent or ends without a word.
        """
        self._on_lost = on_lost
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
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        if self._recorder is not None:
            recorder, self._recorder = self._recorder, None
            recorder.close()

    def _listen(self, channel: Channel) -> None:
        while not channel.closed:
            heard, _, _ = select.select([channel], [], [], _SILENCE)
            if data := b"".join(channel.receive()):
                self._hear([block for _, block in decode_blocks(data)])
            if not heard:
                self._lose()
        self._lose()
        with self._changed:
            self.ended = True
            self._changed.notify_all()

    def _lose(self) -> None:
        """The guard is gone, or hangs: it says something in every control cycle otherwise."""
        names = {event.name for event in self.events}
        if "armed" in names and "ending" not in names and self._on_lost is not None:
            on_lost, self._on_lost = self._on_lost, None
            on_lost()

    def _hear(self, blocks: list[Block]) -> None:
        events = [decode_event(block) for block in blocks if block.kind == Kind.EVENT]
        if self._recorder is not None:
            try:
                self._recorder.write(*blocks)
            except ConeSkinError as exc:  # a full disk ends the recording, not the guard
                recorder, self._recorder = self._recorder, None
                with contextlib.suppress(ConeSkinError):
                    recorder.close()
                events.append(GuardEvent("message", blocks[-1].time, {"what": f"recording ended: {exc}"}))
        if not events:
            return
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
