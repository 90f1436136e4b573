"""Page that follows a guard: one scene and one panel for all viewers, who can change nothing in either."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

from coneskin.core.errors import ConeSkinError
from coneskin.robot.guard.signals.event_text import describe

from .field_choice import FieldChoice
from .history import UNKNOWN, PhaseWords
from .live_run import LiveRun
from .page_server import PageServer
from .panel import event_list, notice, status, timeline
from .playback import Playout
from .run_course import Moment, RunCourse
from .stage.level_scale import level_bars
from .stage.stage import Stage
from .stage_nodes import StageNodes, look_at_stages
from .traces import TracePlot

__all__ = ["LivePage"]

_PICTURE_PERIOD = 1.0 / 30.0  # s between two pictures
_POLL_PERIOD = 0.008  # s between two looks at the recording
_TEXT_PERIOD = 0.2  # s between two changes of the text: a processor that draws the arm draws it too
_PLOT_PERIOD = 0.5  # s between two changes of timeline, traces and potentials
_ROOT_NODE = "/run"
_SEARCH_PERIOD = 0.3  # s between two looks for a guard
_STALE_TIME = 0.7  # s without news after which the page says so
_TIMELINE_SPAN = 20.0  # s of the timeline
_MAX_LISTED_EVENTS = 60  # events that are put into words


class LivePage:
    """Page that shows a stage, and the run of a guard whenever there is one.

    Args:
        server: of the page.
        stage: what is shown while there is no run.
        find: returns the run to follow, or None while there is none.
    """

    def __init__(self, server: PageServer, stage: Stage, find: Callable[[], LiveRun | None]) -> None:
        self._server, self._stage, self._find = server, stage, find
        self._run: LiveRun | None = None
        self._plot: TracePlot | None = None
        self._drawn = stage
        self._nodes: StageNodes | None = None
        self._texted = self._plotted = self._searched = -1e9
        self._lines_of = -1
        self._clock = ""
        gui = server.gui
        gui.add_html(notice())
        self._timeline = gui.add_html("")
        self._status = gui.add_html("")
        self._levels = gui.add_html("")
        self._events = gui.add_html("")
        self._playout = Playout()
        self._choices: dict[int, FieldChoice] = {}
        self._entering = threading.Lock()  # viewers come and go in threads of their own
        self._stand(stage)
        server.on_viewer(self._enter)

    def serve(self, over: threading.Event, ended: Callable[[], bool] = lambda: False) -> None:
        """Show what happens until an event is set, or ``ended`` says so.

        Args:
            over: ends the page.
            ended: asked with each picture.
        """
        due = 0.0
        while not over.is_set() and not ended():
            now = time.monotonic()
            news = self.poll(now)
            if now >= due or news:
                self.draw(now)
                if now >= due:  # the next one on time, unless this one was late by more than that
                    due = due + _PICTURE_PERIOD if now < due + _PICTURE_PERIOD else now + _PICTURE_PERIOD
            over.wait(max(0.0, min(_POLL_PERIOD, due - time.monotonic())))

    def poll(self, now: float) -> bool:
        """Take what is new; return whether an event is among it.

        Args:
            now: the clock [s].
        """
        if self._run is None:
            if now - self._searched < _SEARCH_PERIOD:
                return False
            self._searched = now
            try:
                self._run = self._find()
            except ConeSkinError:  # its header is not there yet
                return False
            if self._run is not None:
                self._stand(self._run.course.stage)
            return False
        events = len(self._run.course.history.events)
        try:
            self._run.poll()
        except ConeSkinError:
            self._leave()
            return True
        news = len(self._run.course.history.events) != events
        if self._run.ended or self._run.silence > 30.0:
            self._searched = now
            if (following := self._find()) is not None:
                self._leave()
                self._run = following
                self._stand(following.course.stage)
                return True
        return news

    def draw(self, now: float) -> None:
        """Show the newest moment.

        Args:
            now: the clock [s].
        """
        course = None if self._run is None else self._run.course
        if course is None:
            self._text(now, [(self._stage.title, UNKNOWN, "")], "", "no guard records a run: what is drawn is at rest")
            return
        at = course.history.until - course.zero
        moment = course.moment(at, self._playout.time(at, now))
        assert self._nodes is not None
        with self._server.together():
            self._nodes.show(moment)
        self._show_levels(now, moment)
        self._text(now, [(course.stage.title, moment.phase, moment.health)], f"{at:9.3f} s", self._stale())
        self._draw_past(now, course, at)

    def _enter(self, client: Any) -> Callable[[], None]:
        """Give a viewer its choice of potentials; return what takes it away."""
        with self._entering:
            self._choices[client.client_id] = FieldChoice(client, [(self._drawn, _ROOT_NODE)])

        def leave() -> None:
            with self._entering:
                self._choices.pop(client.client_id, None)

        return leave

    def _show_levels(self, now: float, moment: Moment) -> None:
        if now - self._texted >= _TEXT_PERIOD:
            levels = level_bars(self._drawn.sheets, moment.levels, moment.force)
            if levels != self._levels.content:
                self._levels.content = levels
        if now - self._plotted >= _PLOT_PERIOD:
            with self._entering:
                for choice in self._choices.values():
                    choice.show([moment])

    def _stale(self) -> str:
        assert self._run is not None
        if self._run.ended:
            return "the run is over: this is its last moment"
        silence = self._run.silence
        return f"NOTHING NEW for {silence:.1f} s: what is drawn is old" if silence > _STALE_TIME else ""

    def _text(self, now: float, runs: list[tuple[str, PhaseWords, str]], clock: str, stale: str) -> None:
        content = status(runs, clock if now - self._texted >= _TEXT_PERIOD else self._clock, stale)
        if content != self._status.content:
            self._clock = clock
            self._texted = now
            self._status.content = content

    def _draw_past(self, now: float, course: RunCourse, at: float) -> None:
        events = course.history.events
        newest = len(events) and id(events[-1])
        if newest != self._lines_of:
            self._lines_of = newest
            lines = [(event, describe(event, course.zero)) for event in events[-_MAX_LISTED_EVENTS:]]
            self._events.content = event_list(lines, len(lines) - 1)
        if now - self._plotted >= _PLOT_PERIOD and not (self._run is not None and self._run.ended):
            self._plotted = now
            self._timeline.content = timeline([course], at - _TIMELINE_SPAN, at)
            if self._plot is None:
                self._plot = TracePlot(self._server.gui, [course], at - _TIMELINE_SPAN, at, fixed=True)
            else:
                self._plot.move(at - _TIMELINE_SPAN, at)

    def _stand(self, stage: Stage) -> None:
        """Draw a stage in the place of the one before, unless it looks the same."""
        if self._plot is not None:
            self._plot.remove()
            self._plot = None
        self._clock = ""
        self._playout = Playout()
        if self._nodes is not None and self._drawn.same_shape(stage):
            self._drawn = stage
            return
        self._drawn = stage
        scene, reach = self._server.scene, stage.reach
        with self._entering:
            for choice in self._choices.values():
                choice.stand([(stage, _ROOT_NODE)])
        scene.reset()
        scene.set_up_direction("+z")
        look_at_stages(self._server, reach)
        self._nodes = StageNodes(scene, stage, _ROOT_NODE)
        levels = {sheet.name: 0.0 for sheet in stage.sheets}
        self._nodes.show(Moment(0.0, stage.poses(None), levels, [], UNKNOWN, "", bodies=stage.moved(())))

    def _leave(self) -> None:
        if self._run is not None:
            self._run.close()
            self._run = None

    def close(self) -> None:
        """Close the recording that is followed; may be called again."""
        self._leave()
