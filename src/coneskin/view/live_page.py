"""Page that follows a guard: one scene and one panel for all viewers, who can change nothing in either.

It follows the guard's recording, found and read from another process. The recorder hands a chunk to the system once it
holds 50 ms or an event, so that is how late a reader is. Nothing is locked, and the guard does not know that somebody
reads.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from coneskin.core.errors import ConeSkinError
from coneskin.core.recording.reader import RecordingTail, parts_of
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.runs.replay.run import Run, read_header

from .field_choice import FieldChoice
from .page_server import PageServer
from .panel import NOTICE, PAGE_LEGEND, event_list, state_of, status, stop_entries, timeline, trace_drawings
from .run_course import UNKNOWN, History, Moment, RunCourse
from .stage.level_scale import level_bars
from .stage.stage import Stage, set_stage
from .stage_nodes import StageNodes, look_at_stages

KEPT = 60.0  #: s of a live run that its page keeps
_GROWING_TIME = 3.0  # s since the last write, within which a recording grows: a guard records ticks all the time
_KINDS_KEPT = frozenset({BlockKind.HEADER, BlockKind.SURFACE, BlockKind.EVENT})


class LiveRun:
    """Run that is followed.

    Args:
        path: the first file of its recording.

    Attributes:
        path: the same.
        course: what is shown; its history grows.
        ended: the recording was closed.

    Raises:
        RecordingError: there is no recording, or its header has not been written yet.
        SceneError: this version of coneskin cannot read its scene.
    """

    def __init__(self, path: Path) -> None:
        self._tail = RecordingTail(path, KEPT, _KINDS_KEPT)
        try:
            blocks = self._tail.read()
            first = next((block for block in blocks if block.kind == BlockKind.HEADER), None)
            run = Run(read_header(first, path), blocks)
            scene = run.scene()
            history = History(scene, KEPT)
            history.feed_all(blocks)
            stage = set_stage(scene, run.place_sensors(), f"live: {path}")
        except BaseException:
            self._tail.close()
            raise
        self.path, self.course = path, RunCourse(stage, history, run.start)
        self._grown = time.monotonic()

    @property
    def ended(self) -> bool:
        """True once the recording was closed."""
        return self._tail.ended

    def poll(self) -> int:
        """Take what has come, and return how many blocks that were.

        Raises:
            RecordingError: the recording is gone, or damaged.
        """
        blocks = self._tail.read()
        if blocks:
            self.course.history.feed_all(blocks)
            self._grown = time.monotonic()
        return len(blocks)

    @property
    def silence(self) -> float:
        """Time since anything came [s]."""
        return time.monotonic() - self._grown

    def close(self) -> None:
        """Close the recording; may be called again."""
        self._tail.close()


def is_live(path: Path) -> bool:
    """Tell whether a recording grows: its newest file was written a moment ago."""
    try:
        newest = max(part.stat().st_mtime for part in parts_of(path))
    except OSError:
        return False
    return time.time() - newest < _GROWING_TIME


def find_live_run(folder: Path) -> Path | None:
    """Return the recording in a folder of runs that grows now, the newest of several; None without any."""
    found = [path for path in folder.glob("*/run.rec") if is_live(path)]
    return max(found, key=lambda path: path.stat().st_mtime, default=None)


_PICTURE_PERIOD = 1.0 / 30.0  # s between two pictures
_POLL_PERIOD = 0.008  # s between two looks at the recording
_UNSEEN_PERIOD = 0.25  # s between two of either while nobody looks, so that a page costs the guard next to nothing
_TEXT_PERIOD = 0.2  # s between two changes of the text: a processor that draws the arm draws it too
_PLOT_PERIOD = 0.5  # s between two changes of timeline, traces and potentials
_ROOT_NODE = "/run"
_SEARCH_PERIOD = 0.3  # s between two looks for a guard
_SEARCH_SILENCE = 1.0  # s without news after which a newer run is looked for
_TIMELINE_SPAN = 20.0  # s of the timeline
_MAX_LISTED_EVENTS = 200  # events that are put into words
_AT_REST = '<div class="coneskin-card">No guard records a run: the arm is drawn at rest until one begins.</div>'


_POSE_DELAY = 0.07  # s by which poses and bodies are late: a parcel of the recorder's, and the wait for the next
_OFFSET_DRIFT = 0.01  # s for each second; by which the offset of the two clocks may shrink


class _Playout:
    """Playout of one run. Pure: the time is an argument.

    A recorder hands over what it has every 50 ms, in which an arm moves in jerks. So the poses, and the bodies that the
    arm meets, are shown a little late, by a clock that runs as evenly as the computer's own. What touches and what the
    guard does is shown at once.

    The offset of the run's clock from this computer's is the largest that was seen: of the parcel that was on its way
    for the shortest time.
    """

    def __init__(self) -> None:
        self._offset: float | None = None
        self._looked = 0.0

    def time(self, newest: float, now: float) -> float:
        """Return the time of the run that is to be shown; it never runs back, and never ahead of what has come.

        Args:
            newest: time of the newest that has come, on the run's clock [s].
            now: the clock [s].
        """
        offset = newest - now
        if self._offset is not None:
            offset = max(offset, self._offset - _OFFSET_DRIFT * (now - self._looked))
        self._offset, self._looked = offset, now
        return min(newest, now + offset - _POSE_DELAY)


class LivePage:
    """Page that shows a stage, and the run of a guard whenever there is one.

    Args:
        stage: what is shown while there is no run.
        find: returns the run to follow, None while there is none but the one it is given.
    """

    def __init__(self, server: PageServer, stage: Stage, find: Callable[[LiveRun | None], LiveRun | None]) -> None:
        self._server, self._stage, self._find = server, stage, find
        self._run: LiveRun | None = None
        self._searched = self._texted = self._plotted = -1e9
        self._newest_event: object = None
        self._nodes: StageNodes
        gui = server.gui
        gui.add_html(NOTICE)
        self._status, self._clock = gui.add_html(""), gui.add_html("")
        self._past, self._levels, self._events = gui.add_html(""), gui.add_html(""), gui.add_html("")
        gui.add_html(PAGE_LEGEND)
        self._choices: dict[int, FieldChoice] = {}
        self._entering = threading.Lock()  # viewers come and go in threads of their own
        self._stand(stage)
        server.on_viewer(self._enter)

    def serve(self, over: threading.Event) -> None:
        """Show what happens until an event is set."""
        due = 0.0
        while not over.is_set():
            now = time.monotonic()
            news = self.poll(now)
            if now >= due or news:
                self.draw(now)
                if now >= due:  # the next one on time, unless this one was late by more than that
                    due = max(due, now - _PICTURE_PERIOD) + _PICTURE_PERIOD
            seen = self._server.gate.viewers
            over.wait(max(0.0, min(_POLL_PERIOD, due - time.monotonic())) if seen else _UNSEEN_PERIOD)

    def poll(self, now: float) -> bool:
        """Take what is new at a time of the clock [s]; return whether an event is among it."""
        if self._run is None or self._run.ended or self._run.silence > _SEARCH_SILENCE:
            found = self._search(now)
            if found or self._run is None:
                return found
        events = self._run.course.history.events
        before = events[-1] if events else None
        try:
            self._run.poll()
        except ConeSkinError:
            self.close()
            return True
        return bool(events) and events[-1] is not before

    def _search(self, now: float) -> bool:
        """Go over to another run; return whether there is one."""
        if now - self._searched < _SEARCH_PERIOD:
            return False
        self._searched = now
        try:
            found = self._find(self._run)
        except ConeSkinError:  # its header is not there yet
            return False
        if found is not None:
            self.close()
            self._run = found
            self._stand(found.course.stage)
        return found is not None

    def draw(self, now: float) -> None:
        """Show the newest moment at a time of the clock [s]."""
        texted = now - self._texted >= _TEXT_PERIOD
        if self._run is None:
            _set(self._status, status([(self._stage.title, UNKNOWN, _AT_REST)]))
            if texted:
                self._texted = now
                _set(self._clock, f'<div id="coneskin-clock" data-sent="{now:.2f}"></div>')
            return
        course = self._run.course
        at = course.history.until - course.zero
        moment = course.moment(at, self._playout.time(at, now))
        with self._server.together():
            self._nodes.show(moment)
        newest = course.history.events[-1] if course.history.events else None
        if newest is not self._newest_event:
            self._newest_event = newest
            lines = stop_entries(course.history.events[-_MAX_LISTED_EVENTS:], course.zero)
            _set(self._status, status([(course.stage.title, moment.phase, state_of(course, moment.time))]))
            _set(self._events, event_list(lines, len(lines) - 1))
        if texted:
            self._texted = now
            _set(self._levels, level_bars(self._drawn.sheets, moment.levels, moment.force))
            over = ' data-over="1"' if self._run.ended else ""
            told = f'data-sent="{now:.2f}" data-news="{now - self._run.silence:.2f}"{over}'
            _set(self._clock, f'<div id="coneskin-clock" {told}>{at:.3f} s into the run</div>')
        if now - self._plotted >= _PLOT_PERIOD:
            self._plotted = now
            since = max(at - _TIMELINE_SPAN, course.history.since - course.zero)  # axes end with what is there
            _set(self._past, timeline([course], since, at) + trace_drawings([course], since, at, live=True))
            with self._entering:
                for choice in self._choices.values():
                    choice.show([moment])

    def _enter(self, client: Any) -> Callable[[], None]:
        """Give a viewer its choice of potentials; return what takes it away."""
        with self._entering:
            self._choices[client.client_id] = FieldChoice(client, [(self._drawn, _ROOT_NODE)])

        def leave() -> None:
            with self._entering:
                self._choices.pop(client.client_id, None)

        return leave

    def _stand(self, stage: Stage) -> None:
        """Draw a stage in the place of the one before."""
        self._drawn, self._playout, self._newest_event = stage, _Playout(), self
        self._texted = self._plotted = -1e9
        scene, reach = self._server.scene, stage.reach
        with self._entering:
            for choice in self._choices.values():
                choice.stand([(stage, _ROOT_NODE)])
        scene.reset()
        scene.set_up_direction("+z")
        look_at_stages(self._server, reach)
        self._nodes = StageNodes(scene, stage, _ROOT_NODE)
        levels = {sheet.name: 0.0 for sheet in stage.sheets}
        self._nodes.show(Moment(0.0, stage.poses(None), levels, [], UNKNOWN, bodies=stage.moved(())))

    def close(self) -> None:
        """Close the recording that is followed; may be called again."""
        if self._run is not None:
            self._run.close()
            self._run = None


def _set(place: Any, content: str) -> None:
    """Set the HTML of a place on the page; what is there already is not sent."""
    if content != place.content:
        place.content = content
