"""Course of a run on a page: its history, taken block by block, each moment of it, and its own zero of time.

A page that follows a guard forgets what is older than it shows, so that it does not grow.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

from coneskin.core.errors import RecordingError, RobotConnectionError
from coneskin.core.recording.block import Block
from coneskin.core.recording.reader import parts_of
from coneskin.geometry.pose import Pose, Vector
from coneskin.robot.arm.model import Joints
from coneskin.robot.guard.signals.event_text import describe
from coneskin.robot.guard.signals.journal import (
    CONTACT_EVENTS,
    BlockKind,
    EventName,
    GuardEvent,
    body_places,
    contact_force,
    decode_event,
)
from coneskin.runs.replay.run import Run, read_run
from coneskin.scene.values.scene import Scene
from coneskin.skin.wire import Frame, FrameDecoder

from .stage.stage import Stage, set_stage

#: kind of a phase -> its colour, which differ in brightness by 3 and more, so that no eye mistakes the last three
PHASE_COLOURS = {"unknown": "#6b7280", "active": "#1d7dc9", "moving": "#fff3b8", "stopped": "#4a0d18"}


class PhaseWords(NamedTuple):
    """Phase of a guard for people."""

    text: str  #: in a few words
    kind: str  #: one of ``PHASE_COLOURS``


UNKNOWN = PhaseWords("nothing is known of the guard", "unknown")  #: before its first event
_PHASE_ACTIVE = PhaseWords("active", "active")
#: event -> the phase that it begins
_PHASE_OF_EVENT: Mapping[str, PhaseWords] = {
    EventName.WAITING: PhaseWords("waiting, not active", "unknown"),
    EventName.ACTIVATED: _PHASE_ACTIVE,
    EventName.SPEED_REDUCED: PhaseWords("touched: slower", "moving"),
    EventName.RESUMED: _PHASE_ACTIVE,
    EventName.STOPPING: PhaseWords("stopping", "stopped"),
    EventName.STANDSTILL: PhaseWords("stands", "stopped"),
    EventName.STOP_FAILED: PhaseWords("standstill NOT confirmed", "stopped"),
    EventName.RETREATING: PhaseWords("moving away from the touch", "moving"),
    EventName.RETREATED: PhaseWords("stopping after the motion away", "stopped"),
    EventName.LATCHED: PhaseWords("latched: stands until a manual reset", "stopped"),
    EventName.RESET: PhaseWords("reset, not active yet", "unknown"),
    EventName.ENDING: PhaseWords("ending", "unknown"),
    EventName.GUARD_EXITED: PhaseWords("no guard: it has ended", "unknown"),
    EventName.GUARD_UNRESPONSIVE: PhaseWords("the guard does not answer", "stopped"),
    EventName.GUARD_RESPONSIVE: PhaseWords("the guard answers again", "moving"),
    EventName.FALLBACK_STOP: PhaseWords("stopped without the guard", "stopped"),
}
_REPEATING_EVENTS = {EventName.WAITING, EventName.STANDSTILL}  # within the phases below they say nothing new
_FINAL_PHASES = {"latched: stands until a manual reset", "ending", "no guard: it has ended"}


def _phase_after(before: PhaseWords, name: str) -> PhaseWords:
    """Return the phase after an event."""
    if name in _REPEATING_EVENTS and before.text in _FINAL_PHASES:
        return before
    return _PHASE_OF_EVENT.get(name, before)


FADING = 4.0  #: s that the mark of a touch that is over is still seen
_MAX_TOUCHES = 400  # touches that are remembered, in a page that stays open
_MAX_DISTANCE = 100.0  # m; a place farther off is no place


class ContactMark(NamedTuple):
    """Mark of a contact at one moment."""

    number: int  #: of the touch
    sensor: str  #: its name
    point: Vector  #: in the frame of the link [m]
    normal: Vector  #: outward unit normal there
    ellipse: tuple[Vector, Vector] | None  #: the two half axes within which the place is with 95 % [m], or None
    located: bool  #: the place is certain
    strength: float  #: 1 while it lasts, then falling to 0


@dataclass(slots=True)
class _Touch:
    """Touch: the places told of it, each with its time [s], when it ended, and until when it holds the arm."""

    places: list[tuple[float, ContactMark]] = field(default_factory=list)
    ended: float = math.inf
    held: float = -math.inf


class _ContactLog:
    """Touches of a run, taken event by event. The one that has stopped the arm is seen until the reset.

    An event whose place is nonsense has no mark; it stands among the events all the same.
    """

    def __init__(self) -> None:
        self._touches: dict[int, _Touch] = {}
        self._stopping: Any = None  # number of the touch that has stopped the arm

    def feed(self, event: GuardEvent) -> None:
        """Take an event; those that tell of no touch are passed over."""
        if event.name == EventName.TOUCH_ENDED:
            for touch in self._touches.values():
                if touch.places[-1][1].sensor == event.details.get("sensor"):
                    touch.ended = min(touch.ended, event.time)
            return
        if event.name in (EventName.RESET, EventName.ACTIVATED):
            for touch in self._touches.values():
                touch.held = min(touch.held, event.time)
            self._stopping = None
            return
        if event.name == EventName.STOPPING and isinstance(contact := event.details.get("contact"), dict):
            self._stopping = contact.get("number")
            if isinstance(self._stopping, int) and self._stopping in self._touches:
                self._touches[self._stopping].held = math.inf
        number = event.details.get("number")
        if not isinstance(number, int):
            return
        if event.name in CONTACT_EVENTS and (mark := _mark(number, event.details)) is not None:
            touch = self._touches.setdefault(number, _Touch())
            touch.places.append((event.time, mark))
            if number == self._stopping:
                touch.held = math.inf
            while len(self._touches) > _MAX_TOUCHES:
                del self._touches[next(iter(self._touches))]

    def marks(self, time: float) -> list[ContactMark]:
        """Return the marks that are seen at a time [s, host clock], the strongest first."""
        found = []
        for touch in self._touches.values():
            told = [mark for then, mark in touch.places if then <= time]
            age = 0.0 if time < touch.held else time - max(touch.ended, touch.held)
            if told and age < FADING:
                found.append(told[-1]._replace(strength=min(1.0, 1.0 - age / FADING)))
        return sorted(found, key=lambda mark: (-mark.strength, -mark.number))


def _mark(number: int, details: Mapping[str, Any]) -> ContactMark | None:
    """Return the mark of an event's details; None where they have no place."""
    point, normal = _vector3(details.get("point")), _vector3(details.get("normal"))
    if point is None or normal is None:
        return None
    axes = details.get("ellipse")
    ellipse = None
    if isinstance(axes, list | tuple) and len(axes) == 2:
        first, second = _vector3(axes[0]), _vector3(axes[1])
        ellipse = None if first is None or second is None else (first, second)
    located = details.get("location_valid") is True
    return ContactMark(number, str(details.get("sensor")), point, normal, ellipse, located, 1.0)


def _vector3(value: Any) -> Vector | None:
    if not isinstance(value, list | tuple) or len(value) != 3:
        return None
    if not all(isinstance(x, int | float) and abs(x) < _MAX_DISTANCE for x in value):
        return None
    return float(value[0]), float(value[1]), float(value[2])


#: channels of a frame that are drawn, as fractions of the supply
CHANNELS = ("touch_c", "touch_d", "radial_c", "radial_d", "angular_a", "angular_b")
_MAX_EVENTS = 2000  # that a page keeps
_KEEP_FACTOR = 1.5  # times what is kept, before the older part is dropped
_HEALTH_EVENTS = frozenset(
    {EventName.FAULT, EventName.GUARD_EXITED, EventName.GUARD_UNRESPONSIVE, EventName.STOP_FAILED}
    | {EventName.RECORDING_GAP, EventName.SKIN_LINE, EventName.FALLBACK_STOP}
)


class _PhaseChange(NamedTuple):
    """Time [s, host clock] from which on a guard is in a phase."""

    time: float
    phase: PhaseWords


@dataclass(slots=True)
class Series:
    """Values over time, in the order of their times."""

    times: list[float] = field(default_factory=list)  #: [s, host clock]
    values: list[tuple[float, ...]] = field(default_factory=list)  #: one for each time

    def append(self, time: float, value: tuple[float, ...]) -> None:
        """Take a value that is later than those before."""
        self.times.append(time)
        self.values.append(value)

    def at(self, time: float) -> tuple[float, ...] | None:
        """Return the last values up to a time; None before the first."""
        index = bisect_right(self.times, time) - 1
        return self.values[index] if index >= 0 else None

    def drop_before(self, time: float, but_last: bool = False) -> None:
        """Forget what is older than a time, or all but the last of it."""
        index = max(bisect_right(self.times, time) - but_last, 0)
        del self.times[:index]
        del self.values[:index]


class History:
    """What has happened in a run so far.

    Args:
        keep: time that is kept [s]; infinite for a recording that is over.

    Attributes:
        joints: measured joint positions [rad].
        speeds: measured joint speeds [rad/s].
        levels: by the names of the sensors: touch level.
        channels: by the names of the sensors: fractions of the supply, in the order of ``CHANNELS``.
        forces: between the arm and what it met, where the run was in physics [N].
        bodies: places of the bodies' parts then, in the base frame: x, y and z of each [m].
        events: the newest.
        phases: when each began.
        since: time of the first block [s, host clock].
        until: time of the last one.
    """

    def __init__(self, scene: Scene, keep: float = math.inf) -> None:
        self.joints, self.speeds, self.forces, self.bodies = Series(), Series(), Series(), Series()
        self.sensors = [item.sensor for item in scene.sensors]
        self.levels = {sensor.name: Series() for sensor in self.sensors}
        self.channels = {sensor.name: Series() for sensor in self.sensors}
        self.events: list[GuardEvent] = []
        self.phases = [_PhaseChange(-math.inf, UNKNOWN)]
        self.since, self.until = math.inf, -math.inf
        self.contacts = _ContactLog()
        self._keep = keep
        self._names = {(sensor.device_id, sensor.sensor_id): sensor.name for sensor in self.sensors}
        self._decoder = FrameDecoder()
        self._decode = None if scene.arm is None else scene.arm.driver.decode_state

    def feed(self, block: Block) -> None:
        """Take a block; one that cannot be read, which the guard has reported, is passed over."""
        self.since, self.until = min(self.since, block.time), max(self.until, block.time)
        if block.kind == BlockKind.SKIN:
            for frame in self._decoder.feed(block.payload):
                if (name := self._names.get((frame.device, frame.sensor))) is not None:
                    self._take_frame(name, block.time, frame)
        elif block.kind == BlockKind.ARM and self._decode is not None:
            with suppress(RobotConnectionError):
                state = self._decode(block.time, block.payload)
                self.joints.append(block.time, state.q)
                self.speeds.append(block.time, state.qd)
        elif block.kind == BlockKind.EVENT:
            with suppress(RecordingError):
                self._take_event(decode_event(block))
        elif block.kind == BlockKind.TRUTH and (force := contact_force(block.payload)) is not None:
            self.forces.append(block.time, (force,))
            if places := body_places(block.payload):
                self.bodies.append(block.time, tuple(chain.from_iterable(places)))
        if self.until - self.since > _KEEP_FACTOR * self._keep:
            self._forget()

    def feed_all(self, blocks: Iterable[Block]) -> History:
        """Take blocks and return itself."""
        for block in blocks:
            self.feed(block)
        return self

    def _forget(self) -> None:
        """Drop what is older than is kept."""
        self.since = self.until - self._keep
        for series in (self.joints, self.speeds, self.forces, *self.levels.values(), *self.channels.values()):
            series.drop_before(self.since)
        self.bodies.drop_before(self.since, but_last=True)  # a body that rests is told of no more

    def q(self, time: float) -> Joints | None:
        """Return the joint positions at a time [rad]; the first ones before they were measured, None without any."""
        return self.joints.at(time) or (self.joints.values[0] if self.joints.values else None)

    def level(self, sensor: str, time: float) -> float:
        """Return the touch level of a sensor at a time; 0 before it was read."""
        found = self.levels[sensor].at(time)
        return 0.0 if found is None else found[0]

    def force(self, time: float) -> float | None:
        """Return the force between the arm and what it meets at a time [N]; None where nothing tells."""
        if not self.forces.times:
            return None
        found = self.forces.at(time)
        return 0.0 if found is None else found[0]

    def places(self, time: float) -> tuple[Vector, ...]:
        """Return where the parts of the bodies are at a time, in the base frame [m]; none where nothing tells."""
        found = self.bodies.at(time) or ()
        return tuple(zip(found[::3], found[1::3], found[2::3], strict=True))

    def phase(self, time: float) -> PhaseWords:
        """Return the guard's phase at a time."""
        at = bisect_right(self.phases, time, key=lambda change: change.time) - 1
        return self.phases[max(at, 0)].phase

    def health(self, time: float) -> str:
        """Return the last thing that was wrong up to a time, since the guard last became active; empty for none."""
        for event in reversed([event for event in self.events if event.time <= time]):
            if event.name == EventName.ACTIVATED:
                return ""
            if event.name in _HEALTH_EVENTS:
                return str(event.details.get("what", event.name))
        return ""

    def _take_event(self, event: GuardEvent) -> None:
        self.events.append(event)
        if len(self.events) > _KEEP_FACTOR * _MAX_EVENTS and math.isfinite(self._keep):
            del self.events[:-_MAX_EVENTS]
            del self.phases[:-_MAX_EVENTS]
        self.contacts.feed(event)
        before = self.phases[-1].phase
        if (phase := _phase_after(before, event.name)) != before:
            self.phases.append(_PhaseChange(event.time, phase))

    def _take_frame(self, sensor: str, time: float, frame: Frame) -> None:
        supplies = (getattr(frame, f"{name[:-2]}_supply") or 1 for name in CHANNELS)
        shares = [getattr(frame, name) / supply for name, supply in zip(CHANNELS, supplies, strict=True)]
        self.levels[sensor].append(time, (min(0.5 * (shares[0] + shares[1]), 1.0),))
        self.channels[sensor].append(time, tuple(min(share, 1.1) for share in shares))


@dataclass(frozen=True, slots=True)
class Moment:
    """What is seen at one time."""

    time: float  #: [s, host clock]
    poses: dict[int, Pose]  #: of the links' frames in the base frame, by their indices
    levels: dict[str, float]  #: of the sensors, by their names
    marks: list[ContactMark]  #: of contacts
    phase: PhaseWords  #: of the guard
    force: float | None = None  #: between the arm and what it meets [N]; None where nothing tells
    bodies: tuple[Vector, ...] = ()  #: how far each part of a body is from where the scene puts it [m]


_BASE_DISTANCE = 0.75  # of the arms' reach, between two bases
_MAX_RUN_SIZE = 200_000_000  # bytes of a recording: about an hour, which takes 3 GB of memory on a page
_ZERO_EVENTS = (EventName.CONTACT, EventName.STOPPING)  # by which two runs are laid side by side


@dataclass(frozen=True, slots=True)
class RunCourse:
    """One run on a page."""

    stage: Stage  #: what is drawn
    history: History  #: what happened
    zero: float  #: host time that is 0 on the page's clock [s]
    offset: Vector = (0.0, 0.0, 0.0)  #: where the base stands [m]

    @property
    def span(self) -> tuple[float, float]:
        """From when to when it is, on the page's clock [s]."""
        return self.history.since - self.zero, self.history.until - self.zero

    def moment(self, time: float, moving: float | None = None) -> Moment:
        """Return what is seen at a time on the page's clock [s].

        Args:
            time: of levels, contacts and phase.
            moving: of the poses and the bodies; None for the same time.
        """
        at, history, stage = self.zero + time, self.history, self.stage
        then = at if moving is None else self.zero + moving
        levels = {sheet.name: history.level(sheet.name, at) for sheet in stage.sheets}
        seen = history.contacts.marks(at), history.phase(at), history.force(at)
        return Moment(at, stage.poses(history.q(then)), levels, *seen, stage.moved(history.places(then)))


def event_lines(courses: Sequence[RunCourse]) -> list[tuple[float, GuardEvent, str]]:
    """Return the events of runs in the order of the page's clock: each one's time there [s], itself, and its words.

    Of several runs the words say in which it happened.
    """
    found = []
    for number, course in enumerate(courses, 1):
        whose = f"run {number}: " if len(courses) > 1 else ""
        for event in course.history.events:
            time, _, words = describe(event, course.zero).strip().partition("  ")
            found.append((event.time - course.zero, event, f"{time}  {whose}{words}"))
    return sorted(found, key=lambda line: line[0])


def read_courses(paths: Sequence[Path]) -> list[RunCourse]:
    """Read runs: one as it is, several side by side, each with its first touch at the time 0.

    Raises:
        RecordingError: a run cannot be read, nothing was recorded in it, or it is too long for a page.
        SceneError: this version of coneskin cannot read its scene.
    """
    for path in paths:
        size = sum(
            part.stat().st_size for part in parts_of(path / "run.rec" if path.is_dir() else path) if part.exists()
        )
        if size > _MAX_RUN_SIZE:
            raise RecordingError(
                f"{path} has {size / 1e6:.3g} MB, and a page shows at most {_MAX_RUN_SIZE / 1e6:g} MB of a run; "
                f"take the part that matters: coneskin runs cut {path} --around SECONDS --keep SECONDS"
            )
    runs = [read_run(path) for path in paths]
    found = [_read_course(run, str(path), len(runs) > 1) for run, path in zip(runs, paths, strict=True)]
    apart = _BASE_DISTANCE * max(course.stage.reach for course in found)
    middle = 0.5 * (len(found) - 1)
    return [
        RunCourse(item.stage, item.history, item.zero, (0.0, apart * (middle - number), 0.0))
        for number, item in enumerate(found)
    ]


def _read_course(run: Run, title: str, aligned: bool) -> RunCourse:
    scene = run.scene()
    history = History(scene).feed_all(run.blocks)
    if not history.since <= history.until:
        raise RecordingError(f"nothing was recorded in {title}: there is nothing to be shown")
    stage = set_stage(scene, run.place_sensors(), title)
    zeros = (event.time for event in history.events if aligned and event.name in _ZERO_EVENTS)
    return RunCourse(stage, history, next(zeros, run.start))
