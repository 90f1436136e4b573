"""Event log of a run: it records blocks as they come, and keeps the events for callers that wait for one.

A program's own function is called for each event from a thread in which it may take its time. What waits for it has a
bound, so a function that blocks delays neither the recording nor the monitoring of the guard.

Retention: the events of a run stay for ever, all that was recorded around them for a while, and the rest is dropped.
"""

from __future__ import annotations

import contextlib
import json
import logging
import queue
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import ConeSkinError, RecordingError
from coneskin.core.files import explain_os_error
from coneskin.core.progress import Progress, silent
from coneskin.core.recording.block import Block, decode_blocks
from coneskin.core.recording.defects import DefectKind
from coneskin.core.recording.reader import Recording, parts_of, read_recording
from coneskin.core.recording.recorder import Recorder, hold_against_recorder
from coneskin.core.recording.retention import prune_file
from coneskin.core.version import code_versions
from coneskin.robot.guard.signals.journal import BlockKind, EventName, GuardEvent, decode_event
from coneskin.scene.tables.source_tables import source_label
from coneskin.scene.values.scene import RecordingScene, Scene

if TYPE_CHECKING:
    from coneskin.skin.diagnosis.capture import CaptureWindow

#: kinds of block without which nothing can be replayed
_COPIED_KINDS = frozenset({BlockKind.HEADER, BlockKind.SURFACE})
#: where a program's own logging gets every event; without a handler of its own nothing is printed
_EVENT_LOGGER = logging.getLogger("coneskin.events")
_EVENT_LOGGER.addHandler(logging.NullHandler())
_GRAVE_EVENTS = frozenset({EventName.STOPPING, EventName.FAULT, EventName.GUARD_EXITED, EventName.FALLBACK_STOP})


class EventLog:
    """Log of one run, written by one thread and read by any.

    Args:
        recording: file to record to, or None.
        on_event: called for each event, from a thread of its own.
        limits: of the recording's files; None for one file without a limit.
        arm: with which each line of logging begins.

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
        arm: str = "",
    ) -> None:
        self.events: list[GuardEvent] = []
        self._line_start = f"{arm}: " if arm else ""
        self.began = time.monotonic()
        self.ended = self.activated = self.ending = False
        self.line = _HeardLine()
        self.physics: Callable[[], list[Block]] = list  # what it knows since it was last asked
        self._truths: deque[Block] = deque()  # that the thread which writes has not written yet
        size, keep = (limits.max_size, limits.keep) if limits else (None, None)
        self._recorder = Recorder(recording, size, _COPIED_KINDS, keep, _prune_part) if recording else None
        self._delivery = None if on_event is None else _EventDelivery(on_event)
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
        full = {**header, **code_versions(), "python": sys.version.split()[0], "clocks": clocks}
        self._recorder.write(Block(BlockKind.HEADER, clocks["monotonic"], json.dumps(full).encode()))

    def feed(self, data: bytes) -> None:
        """Take encoded blocks from the guard; whatever they are, the log goes on."""
        try:
            self._write(decode_blocks(data))
        except Exception as exc:
            logging.getLogger("coneskin").exception("a report of the guard is lost")
            self.report(EventName.MESSAGE, what=f"a report of the guard is lost: {type(exc).__name__}: {exc}")

    def note_truth(self, facts: dict[str, Any]) -> None:
        """Record with what a virtual skin is touched; any thread may say so."""
        self._truths.append(Block(BlockKind.TRUTH, time.monotonic(), json.dumps(facts).encode()))

    def report(self, name: EventName, at: float | None = None, **details: Any) -> None:
        """Add an event of the session's own, of now or of a host time [s]."""
        self._write([GuardEvent(name, time.monotonic() if at is None else at, details).block()])

    def wait_for(
        self,
        names: tuple[str, ...],
        timeout: float,
        after: int = 0,
        fits: Callable[[GuardEvent], bool] = lambda _: True,
    ) -> GuardEvent | None:
        """Return the first of these events that fits, from position ``after`` on; None after the timeout [s]."""

        def find() -> GuardEvent | None:
            return next((event for event in self.events[after:] if event.name in names and fits(event)), None)

        with self._changed:
            self._changed.wait_for(lambda: self.ended or find() is not None, timeout)
            return find()

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
        self.line.feed(blocks)
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
            level = logging.WARNING if event.name in _GRAVE_EVENTS else logging.INFO
            _EVENT_LOGGER.log(level, "%s%s %s", self._line_start, event.name, event.details)
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
    what = f"cannot make the folder {made} for the recording"
    with explain_os_error(RecordingError, what, "; see recording.folder"):
        for parent in (*reversed(folder.parents), folder):
            parent.mkdir(mode=0o700, exist_ok=True)
        while True:
            try:
                made.mkdir(mode=0o700)
                return made / "run.rec"
            except FileExistsError:
                number += 1
                made = folder / f"{stamp}-{number}"


_MAX_WAITING = 1000  # events that wait
_CLOSE_TIMEOUT = 2.0  # s for the function to take what still waits


class _EventDelivery:
    """Delivery of events to a program's function, in order, until ``close``; one that has raised is not called again.

    What comes beyond a bound of events that wait is dropped, and the function is told how many.
    """

    def __init__(self, on_event: Callable[[GuardEvent], None], bound: int = _MAX_WAITING) -> None:
        self._on_event = on_event
        self._bound = bound
        self._waiting: queue.SimpleQueue[GuardEvent | None] = queue.SimpleQueue()  # None: the end
        self._dropped = 0
        self._thread = threading.Thread(target=self._run, name="coneskin events", daemon=True)
        self._thread.start()

    def put(self, events: Iterable[GuardEvent]) -> None:
        """Take events without waiting."""
        for event in events:
            if self._waiting.qsize() >= self._bound:
                self._dropped += 1
                continue
            self._tell_gap(event.time)
            self._waiting.put(event)

    def close(self) -> None:
        """Deliver what waits, for 2 s at most, and end; may be called again, and by the function itself."""
        self._tell_gap(time.monotonic())
        self._waiting.put(None)
        if threading.current_thread() is not self._thread:
            self._thread.join(_CLOSE_TIMEOUT)

    def _tell_gap(self, now: float) -> None:
        if self._dropped:
            what = f"on_event was busy: {self._dropped} events were not delivered to it; the recording has them"
            self._dropped = 0
            logging.getLogger("coneskin").warning(what)
            self._waiting.put(GuardEvent(EventName.MESSAGE, now, {"what": what}))

    def _run(self) -> None:
        while (event := self._waiting.get()) is not None:
            try:
                self._on_event(event)
            except Exception:
                logging.getLogger("coneskin").exception("on_event has failed and is not called any more")
                return


class _HeardLine:
    """The newest bytes of the skin; whoever writes them and whoever asks may be different threads."""

    def __init__(self) -> None:
        self._window: CaptureWindow | None = None

    def feed(self, blocks: Sequence[Block]) -> None:
        """Keep the skin's bytes among these blocks, for some seconds."""
        for block in blocks:
            if block.kind == BlockKind.SKIN:
                if self._window is None:
                    from coneskin.skin.diagnosis.capture import CaptureWindow

                    self._window = CaptureWindow(block.time)
                self._window.feed(block.payload, block.time)

    def describe(self, scene: Scene, reasons: Sequence[str], now: float) -> str:
        """Return what is wrong with the line, where a guard waits for its skin.

        Args:
            reasons: why the guard waits or refuses; those of sensors begin with their names.

        Returns:
            a sentence; empty where the reasons are others, and where frames come as they should.
        """
        names = tuple(item.sensor.name + mark for item in scene.sensors for mark in ":,")
        if scene.source is None or not any(reason.startswith(names) for reason in reasons):
            return ""
        from coneskin.skin.diagnosis.capture import Capture
        from coneskin.skin.diagnosis.diagnose import diagnose

        capture = Capture((), now, since=now) if self._window is None else self._window.capture(now)
        found = diagnose(capture, [item.sensor for item in scene.sensors], scene.source.settings.get("baud"))
        if found.verdict == "ok":
            return ""
        name = source_label(scene.source)
        return f"on {name}, {found.line}" if capture.pieces else f"no byte has come from {name}: {found.remedy}"


AROUND = 5.0  #: s before and after an event in which all stays
_KEPT_KINDS = frozenset({BlockKind.HEADER, BlockKind.SURFACE, BlockKind.TRUTH, BlockKind.EVENT, BlockKind.OVERRUN})
_EVENT_KINDS = frozenset({BlockKind.EVENT})
#: events that are no reason to keep what led to them
_ORDINARY_EVENTS = frozenset(
    {
        EventName.WAITING,
        EventName.ACTIVATED,
        EventName.NOT_COMMISSIONED,
        EventName.MESSAGE,
        EventName.REFUSED,
        EventName.RESET,
        EventName.ENDING,
        EventName.RECORDING_GAP,
    }
)


def prune_run(path: Path, around: float = AROUND, progress: Progress = silent) -> tuple[int, int]:
    """Drop what is far from any touch, stop or fault; a run that was pruned says so, and cannot be replayed as a whole.

    Args:
        path: a recording, or the folder of a run with one in it.
        around: time before and after such an event in which all stays [s].

    Returns:
        bytes before and after.

    Raises:
        RecordingError: it cannot be read, or is being recorded now.
    """
    path = path / "run.rec" if path.is_dir() else path
    recording = read_recording(path, progress)
    parts = parts_of(path)
    with hold_against_recorder(parts[-1]):
        windows = _windows(recording, around)
        # a touch may be in what is lost
        lost = [defect for defect in recording.defects if defect.kind is not DefectKind.DROPPED]
        windows += [(defect.since - around, defect.until + around) for defect in lost]
        for part in parts:
            for _ in prune_file(part, windows, _KEPT_KINDS):
                pass
    return recording.size, sum(part.stat().st_size for part in parts)


def _prune_part(path: Path) -> Iterator[None]:
    """Drop the same from one file of a recording that goes on, step by step; errors as of ``prune_run``."""
    yield from prune_file(path, _windows(read_recording(path), AROUND), _KEPT_KINDS)


def _windows(recording: Recording, around: float) -> list[tuple[float, float]]:
    """Return the times around what is no ordinary event; those that overlap are one."""
    windows: list[tuple[float, float]] = []
    for block in recording.select(kinds=_EVENT_KINDS):
        if decode_event(block).name not in _ORDINARY_EVENTS:
            since = block.time - around
            if windows and since <= windows[-1][1]:
                since = windows.pop()[0]
            windows.append((since, block.time + around))
    return windows
