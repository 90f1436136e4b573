"""Page of recordings: each viewer has a player of its own, so that nobody moves what another looks at."""

from __future__ import annotations

import math
import threading
import time
from bisect import bisect_right
from collections.abc import Callable, Sequence
from html import escape
from typing import Any

from coneskin.robot.guard.signals.journal import EventName

from .field_choice import FieldChoice
from .page_server import PageServer
from .panel import NOTICE, PAGE_LEGEND, event_list, state_of, status, timeline, trace_drawings
from .run_course import RunCourse, event_lines
from .stage.level_scale import level_bars
from .stage_nodes import look_at_stages, nodes_of_runs

_PICTURE_PERIOD = 1.0 / 30.0  # s between two pictures
_TEXT_PERIOD = 0.1  # s between two changes of the text
_PLAYBACK_SPEEDS = (0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)  # times the recorded speed
_SPEED_CHOICES = {f"{speed:g}x": speed for speed in _PLAYBACK_SPEEDS}
_JUMP_EVENTS = frozenset(
    {EventName.CONTACT, EventName.STOPPING, EventName.STANDSTILL, EventName.RETREATING, EventName.RETREATED}
    | {EventName.LATCHED, EventName.FAULT, EventName.ACTIVATED, EventName.SPEED_REDUCED, EventName.STOP_FAILED}
    | {EventName.CONTACT_LOCATED, EventName.TOUCH_ENDED, EventName.GUARD_EXITED, EventName.RESET}
)


def show_runs(server: PageServer, courses: Sequence[RunCourse]) -> None:
    """Show recordings on a page, to every viewer that connects from now on."""
    look_at_stages(server, max(course.stage.reach for course in courses), len(courses))
    server.on_viewer(lambda client: _Player(client, courses).end)


class _Playback:
    """Playback of a stretch of time. Pure: the time is an argument.

    Args:
        since: where it begins [s].
        until: where it ends.

    Attributes:
        time: that is shown [s].
        playing: it goes on by itself.
        speed: times the recorded one.
    """

    def __init__(self, since: float, until: float) -> None:
        self.since, self.until = since, until
        self.time = since
        self.playing = False
        self.speed = 1.0
        self._then: float | None = None

    def play(self, now: float) -> None:
        """Go on from here at a time of the clock [s]; from the beginning where the end is shown."""
        if self.time >= self.until:
            self.time = self.since
        self.playing, self._then = True, now

    def pause(self) -> None:
        """Stay where it is."""
        self.playing, self._then = False, None

    def show(self, time: float) -> None:
        """Stand at a time [s], or the nearest that there is; nonsense is not followed."""
        self.pause()
        if math.isfinite(time):
            self.time = min(max(time, self.since), self.until)

    def poll(self, now: float) -> float:
        """Go on by what has passed since the last call, by the clock [s], and return the time that is shown [s]."""
        if self.playing:
            if self._then is not None and now > self._then:
                self.time += self.speed * (now - self._then)
            self._then = now
            if self.time >= self.until:
                self.time = self.until
                self.pause()
        return self.time


class _Player:
    """Player of one viewer: a thread of its own that moves the scene; its panel only sets what the thread reads.

    Args:
        client: viser's ``ClientHandle``.
    """

    def __init__(self, client: Any, courses: Sequence[RunCourse]) -> None:
        self._client, self._strands = client, courses
        spans = [course.span for course in courses]
        self._playback = _Playback(_down(min(since for since, _ in spans)), -_down(-max(until for _, until in spans)))
        self._changed = threading.Condition()
        self._over = False
        self._nodes = nodes_of_runs(client.scene, courses)
        lines = event_lines(courses)
        self._times = [time for time, _, _ in lines]
        self._lines = [(event, text) for _, event, text in lines]
        self._jumps = [index for index, (event, _) in enumerate(self._lines) if event.name in _JUMP_EVENTS]
        self._make_panel(client.gui)
        self._shown = -2
        self._texted = -1.0
        threading.Thread(target=self._run, daemon=True, name="coneskin player").start()

    def end(self) -> None:
        """End the thread."""
        with self._changed:
            self._over = True
            self._changed.notify()

    def _make_panel(self, gui: Any) -> None:
        playback = self._playback
        gui.add_html(NOTICE)
        for course in self._strands:
            gui.add_html(f'<div class="coneskin-title">{escape(course.stage.title)}</div>')
        gui.add_html(timeline(self._strands, playback.since, playback.until))
        self._status = gui.add_html("")
        step = max(1e-3, round((playback.until - playback.since) / 2e5, 3))
        self._slider = gui.add_slider(
            "time [s]", min=playback.since, max=playback.until, step=step, initial_value=playback.since
        )
        self._buttons = gui.add_button_group("", ("play", "pause", "|<", "<", ">"))
        self._speed = gui.add_dropdown("speed", list(_SPEED_CHOICES), initial_value="1x")
        told = (f"{index}: {' '.join(self._lines[index][1].split())[:70]}" for index in self._jumps[:500])
        choices = ["jump to an event", *told]
        self._levels = gui.add_html("")
        self._field = FieldChoice(
            self._client, [(course.stage, f"/run {number}") for number, course in enumerate(self._strands, 1)]
        )
        self._jump = gui.add_dropdown("event", choices, initial_value=choices[0])
        self._events = gui.add_html("")
        gui.add_html(trace_drawings(self._strands, playback.since, playback.until))
        gui.add_html(PAGE_LEGEND)
        self._slider.on_update(self._sought)
        self._buttons.on_click(self._pressed)
        self._speed.on_update(self._speeded)
        self._jump.on_update(self._jumped)
        self._field.on_update(lambda _event: self._do(lambda _playback: None))

    def _sought(self, event: Any) -> None:
        if event.client is not None:  # not our own change
            self._do(lambda playback: playback.show(float(self._slider.value)))

    def _pressed(self, _event: Any) -> None:
        what, now = self._buttons.value, time.monotonic()
        actions: dict[str, Callable[[_Playback], object]] = {
            "play": lambda playback: playback.play(now),
            "pause": lambda playback: playback.pause(),
            "|<": lambda playback: playback.show(playback.since),
            "<": lambda playback: self._step(playback, -1),
            ">": lambda playback: self._step(playback, 1),
        }
        if what in actions:
            self._do(actions[what])

    def _speeded(self, _event: Any) -> None:
        speed = _SPEED_CHOICES.get(str(self._speed.value))
        if speed is not None:  # a browser may send any words
            self._do(lambda playback: setattr(playback, "speed", speed))

    def _jumped(self, event: Any) -> None:
        head = str(self._jump.value).partition(":")[0]
        if event.client is not None and head.isdecimal() and int(head) < len(self._times):
            self._do(lambda playback: playback.show(self._times[int(head)]))

    def _step(self, playback: _Playback, way: int) -> None:
        """Go to the next event that matters, or to the one before."""
        times = [self._times[index] for index in self._jumps]
        ahead = [at for at in times if (at - playback.time) * way > 1e-4]
        if ahead:
            playback.show(min(ahead) if way > 0 else max(ahead))

    def _do(self, action: Callable[[_Playback], object]) -> None:
        with self._changed:
            action(self._playback)
            self._changed.notify()

    def _run(self) -> None:
        with self._changed:
            while not self._over:
                began = time.monotonic()
                at, playing = self._playback.poll(began), self._playback.playing
                self._show(at, began, playing)
                wait = max(0.0, _PICTURE_PERIOD - (time.monotonic() - began)) if self._playback.playing else None
                self._changed.wait(wait)

    def _show(self, at: float, now: float, playing: bool) -> None:
        moments = [course.moment(at) for course in self._strands]
        with self._client.atomic():
            for nodes, moment in zip(self._nodes, moments, strict=True):
                nodes.show(moment)
        if playing and now - self._texted < _TEXT_PERIOD:
            return
        self._texted = now
        self._field.show(moments)
        self._levels.content = "".join(
            level_bars(course.stage.sheets, moment.levels, moment.force, f"run {number}" if len(moments) > 1 else "")
            for number, (course, moment) in enumerate(zip(self._strands, moments, strict=True), 1)
        )
        playback = self._playback
        share = (at - playback.since) / max(playback.until - playback.since, 1e-9)
        runs = [
            (course.stage.title, moment.phase, state_of(course, moment.time))
            for course, moment in zip(self._strands, moments, strict=True)
        ]
        clock = f'data-share="{100.0 * min(max(share, 0.0), 1.0):.2f}%">{at:9.3f} s of {playback.until:.3f} s'
        self._status.content = f'{status(runs)}<div id="coneskin-clock" {clock}</div>'
        if abs(float(self._slider.value) - at) > 1e-9:
            self._slider.value = at
        newest = bisect_right(self._times, at + 1e-6) - 1
        if newest != self._shown:
            self._shown = newest
            self._events.content = event_list(self._lines, newest)


def _down(time: float) -> float:
    """Return a time rounded down to a millisecond, which a slider has room for [s]."""
    return math.floor(1e3 * time) / 1e3
