"""Event log of a run: it records blocks as they come, and keeps the events for callers that wait for one."""

from __future__ import annotations

import contextlib
import json
import logging
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

from coneskin.core.errors import ConeSkinError, RecordingError
from coneskin.core.recording.block import Block, decode_blocks
from coneskin.core.recording.reader import parts_of
from coneskin.core.recording.recorder import Recorder
from coneskin.core.version import __version__, code_commit
from coneskin.robot.guard.signals.journal import BlockKind, EventName, GuardEvent, decode_event
from coneskin.scene.values.scene import RecordingScene

from .event_delivery import EventDelivery
from .heard_line import HeardLine
from .retention import prune_part

__all__ = ["EventLog", "discard_recording", "new_recording"]


#: kinds of block without which nothing can be replayed
_COPIED = frozenset({BlockKind.HEADER, BlockKind.SURFACE})


#: where a program's own logging gets every event; without a handler of its own nothing is printed
_LOGGER = logging.getLogger("coneskin.events")
_LOGGER.addHandler(logging.NullHandler())
_GRAVE = frozenset({EventName.STOPPING, EventName.FAULT, EventName.GUARD_EXITED, EventName.FALLBACK_STOP})


class EventLog:
    """Log of one run, written by one thread and read by any.

    Args:
        recording: file to record to, or None.
        on_event: called for each event, from a thread of its own.
        limits: of the recording's files; None for one file without a limit.

    Attributes:
        began: when the log was opened, which is the zero of the run's times [s, host clock].
        events: what has happened so far, in order.
        ended: True once no more will come.
        activated: True once the guard has become active; it stays so, whatever becomes of ``events``.
        ending: True once the guard was told to end.
        line: what has come from the skin.
    """

    def __init__(
        self,
        recording: Path | None = None,
        on_event: Callable[[GuardEvent], None] | None = None,
        limits: RecordingScene | None = None,
    ) -> None:
        self.events: list[GuardEvent] = []
        self.began = time.monotonic()
        self.ended = self.activated = self.ending = False
        self.line = HeardLine()
        self.physics: Callable[[], list[Block]] = list  # what it knows since it was last asked
        self._truths: deque[Block] = deque()  # that the thread which writes has not written yet
        self._recorder = _recorder(recording, limits) if recording else None
        self._delivery = None if on_event is None else EventDelivery(on_event)
        self._changed = threading.Condition()

    def open(self, header: dict[str, Any]) -> None:
        """Begin the recording with a header.

        Raises:
            RecordingError: the file exists, or cannot be made.
        """
        self.began = time.monotonic()
        if self._recorder is None:
            return
        self._recorder.__enter__()
        clocks = {"monotonic": self.began, "unix": time.time()}
        versions = {"coneskin": __version__, "commit": code_commit(), "python": sys.version.split()[0]}
        full = {**header, **versions, "clocks": clocks}
        self._recorder.write(Block(BlockKind.HEADER, clocks["monotonic"], json.dumps(full).encode()))

    def take(self, data: bytes) -> None:
        """Take encoded blocks from the guard; whatever they are, the log goes on."""
        try:
            self._write([block for _, block in decode_blocks(data)])
        except Exception as exc:
            logging.getLogger("coneskin").exception("a report of the guard is lost")
            self.report(EventName.MESSAGE, what=f"a report of the guard is lost: {type(exc).__name__}: {exc}")

    def note_truth(self, facts: dict[str, Any]) -> None:
        """Record with what a virtual skin is touched; any thread may say so."""
        self._truths.append(Block(BlockKind.TRUTH, time.monotonic(), json.dumps(facts).encode()))

    def report(self, name: EventName, **details: Any) -> None:
        """Add an event of the session's own."""
        self._write([GuardEvent(name, time.monotonic(), details).block()])

    def wait_for(
        self,
        names: tuple[str, ...],
        timeout: float,
        after: int = 0,
        fits: Callable[[GuardEvent], bool] = lambda _: True,
    ) -> GuardEvent | None:
        """Return the first of these events that fits, from position ``after`` on; None after the timeout [s]."""
        end = time.monotonic() + timeout
        with self._changed:
            while True:
                for event in self.events[after:]:
                    if event.name in names and fits(event):
                        return event
                left = end - time.monotonic()
                if left <= 0.0 or self.ended or not self._changed.wait(left):
                    return None

    def end(self) -> None:
        """Note that no more will come, so that nothing waits any longer."""
        with self._changed:
            self.ended = True
            self._changed.notify_all()

    def close(self) -> None:
        """Close the recording, and deliver what waits for the program's function; may be called again."""
        self._write([])
        if self._recorder is not None:
            recorder, self._recorder = self._recorder, None
            try:
                recorder.close()
            except ConeSkinError as exc:  # it has no end then, which its reader says too
                self._tell([_recording_ended(time.monotonic(), exc)])
        if self._delivery is not None:
            self._delivery.close()

    def _write(self, blocks: list[Block]) -> None:
        events = []
        self.line.take(blocks)
        blocks += self.physics()
        while self._truths:
            blocks.append(self._truths.popleft())
        if self._recorder is not None and blocks:
            try:
                # an event is what people look for: it, and all that led to it, must outlive this process
                self._recorder.write(*blocks, flush=any(block.kind == BlockKind.EVENT for block in blocks))
            except ConeSkinError as exc:  # a full disk ends the recording, not the guard
                recorder, self._recorder = self._recorder, None
                with contextlib.suppress(ConeSkinError):
                    recorder.close()
                events.append(_recording_ended(blocks[-1].time, exc))
        for block in blocks:
            if block.kind == BlockKind.EVENT:
                try:
                    events.append(decode_event(block))
                except ConeSkinError as exc:
                    events.append(GuardEvent(EventName.MESSAGE, block.time, {"what": str(exc)}))
        if events:
            self._tell(events)

    def _tell(self, events: list[GuardEvent]) -> None:
        """Keep events, and give them to whoever waits for them."""
        for event in events:
            _LOGGER.log(logging.WARNING if event.name in _GRAVE else logging.INFO, "%s %s", event.name, event.details)
        names = {event.name for event in events}
        self.activated |= EventName.ACTIVATED in names
        self.ending |= EventName.ENDING in names
        with self._changed:
            self.events += events
            self._changed.notify_all()
        if self._delivery is not None:
            self._delivery.put(events)


def _recording_ended(now: float, why: ConeSkinError) -> GuardEvent:
    return GuardEvent(EventName.MESSAGE, now, {"what": f"recording ended: {why}"})


def _recorder(path: Path, limits: RecordingScene | None) -> Recorder:
    if limits is None:
        return Recorder(path, copied=_COPIED)
    return Recorder(path, limits.max_size, _COPIED, limits.keep, prune_part)


def discard_recording(path: Path) -> None:
    """Remove the folder of a run that did not start, which ``new_recording`` has made; what else lies in it stays."""
    with contextlib.suppress(OSError):
        for part in parts_of(path):
            part.unlink(missing_ok=True)
        path.parent.rmdir()


def new_recording(folder: Path) -> Path:
    """Make a folder for a new run, named by the time, and return the path of its recording.

    Folders that are made here are for their owner alone; one that is there keeps its permissions.

    Raises:
        RecordingError: it cannot be made.
    """
    stamp = time.strftime("%Y-%m-%dT%H-%M-%S")
    made, number = folder / stamp, 1
    try:
        for parent in (*reversed(folder.parents), folder):
            parent.mkdir(mode=0o700, exist_ok=True)
        while True:
            try:
                made.mkdir(mode=0o700)
                return made / "run.rec"
            except FileExistsError:
                number += 1
                made = folder / f"{stamp}-{number}"
    except OSError as exc:
        raise RecordingError(
            f"cannot make the folder {made} for the recording: {exc.strerror or exc}; see recording.folder"
        ) from exc
