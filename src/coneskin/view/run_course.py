"""Course of a run on a page: each moment of it, its place on the floor, and its own zero of time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from coneskin.core.errors import RecordingError
from coneskin.core.recording.reader import parts_of
from coneskin.geometry.pose import Pose, Vector
from coneskin.robot.guard.signals.event_text import describe
from coneskin.robot.guard.signals.journal import EventName, GuardEvent
from coneskin.runs.replay.run import Run, read_run

from .history import History
from .stage.stage import Stage, set_stage

if TYPE_CHECKING:
    from .history import ContactMark, PhaseWords


@dataclass(frozen=True, slots=True)
class Moment:
    """What is seen at one time.

    Attributes:
        time: [s, host clock].
        poses: of the links' frames in the base frame, by their indices.
        levels: of the sensors, by their names.
        marks: of contacts.
        phase: of the guard.
        force: between the arm and what it meets [N]; None where nothing tells.
        bodies: how far each part of a body is from where the scene puts it [m].
    """

    time: float
    poses: dict[int, Pose]
    levels: dict[str, float]
    marks: list[ContactMark]
    phase: PhaseWords
    force: float | None = None
    bodies: tuple[Vector, ...] = ()


_BASE_DISTANCE = 0.75  # of the arms' reach, between two bases
_MAX_RUN_SIZE = 200_000_000  # bytes of a recording: about an hour, which takes 3 GB of memory on a page
_ZERO_EVENTS = (EventName.CONTACT, EventName.STOPPING)  # by which two runs are laid side by side


@dataclass(frozen=True, slots=True)
class RunCourse:
    """One run on a page.

    Attributes:
        stage: what is drawn.
        history: what happened.
        zero: host time that is 0 on the page's clock [s].
        offset: where the base stands [m].
    """

    stage: Stage
    history: History
    zero: float
    offset: Vector = (0.0, 0.0, 0.0)

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
