"""Recorded run: its blocks, events and scene, what it lacks, and its replay.

The same bytes through the same guard must give the same events, bit by bit. Differences are told in units for people.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from coneskin.core.errors import RecordingError, RobotConnectionError, SceneError
from coneskin.core.progress import Progress, silent
from coneskin.core.recording.block import ALL_KINDS, Block, is_time
from coneskin.core.recording.defects import Defect, DefectKind
from coneskin.core.recording.reader import Recording, read_recording
from coneskin.core.text import html_card, read_json
from coneskin.core.version import code_versions, recorded_version
from coneskin.robot.driver.protocol import ArmDriver, SliderDriver
from coneskin.robot.driver.values import ControllerState
from coneskin.robot.guard.signals.event_text import describe
from coneskin.robot.guard.signals.journal import (
    INPUTS,
    SESSION_EVENTS,
    BlockKind,
    EventName,
    GuardEvent,
    Output,
    decode_event,
)
from coneskin.scene.build import SensorOnArm, build_core, build_stream, decode_surfaces, place_on_arm
from coneskin.scene.reader import parse_scene
from coneskin.scene.settings import changed_settings, override_detector, override_settings
from coneskin.scene.values.scene import Commissioning, Scene
from coneskin.skin.detection.events import TouchBegan, TouchEnded
from coneskin.skin.wire import Frame, FrameDecoder

from .event_details import event_differences

if TYPE_CHECKING:
    from coneskin.robot.guard.core import GuardCore

MOST_DIFFERENCES = 5  #: that a replay describes


class Verdict(StrEnum):
    """What a replay shows."""

    SAME = "same"  #: the recording is whole and was closed, and each event, of which there are some, is the same
    DIFFERENT = "different"  #: an event differs
    INCOMPLETE = "incomplete"  #: nothing differs as far as it can be compared; the rest, or all, is missing


@dataclass(frozen=True, slots=True)
class Replay:
    """Result of a replay.

    Attributes:
        events: of the replay, up to the first gap, where inputs are missing.
        recorded: events of the recording, all of them.
        compared: number of recorded events that could be compared.
        differences: the first events that differ, with units for people; at most ``MOST_DIFFERENCES``.
        frames: bytes of the skin's stream that were replayed.
        duration: of the recording [s].
        missing: what the recording lacks, in a sentence.
        other_code: in what today's code differs from what recorded the run, as of ``Run.other_code``.
    """

    events: list[GuardEvent]
    recorded: list[GuardEvent]
    compared: int
    differences: list[str]
    frames: int
    duration: float
    missing: str
    other_code: tuple[str, ...] = ()

    @property
    def verdict(self) -> Verdict:
        """What all that shows."""
        whole = not self.missing and self.compared
        return Verdict.DIFFERENT if self.differences else Verdict.SAME if whole else Verdict.INCOMPLETE

    @property
    def same(self) -> bool:
        """True where the whole run is there, has events, and each of them is the same, bit by bit."""
        return self.verdict is Verdict.SAME


_PROGRESS_PERIOD = 1.0  # s of a run between two calls
_HEADER_TYPES = {"scene": str, "name": str, "folder": str, "clocks": dict}


class _FoundTouch(NamedTuple):
    """Touch that was found in what is left of a run."""

    sensor: str  #: its name
    began: float  #: host time of the frame with which it began [s]
    ended: float  #: of the frame with which it ended [s]; inf where the run ended first
    peak: float  #: the largest level


@dataclass(frozen=True, slots=True)
class Run:
    """Recorded run.

    Attributes:
        header: scene, versions and times; see ``coneskin.session.session``.
        blocks: all that was recorded after the header, in the order in which it was written; to be iterated over as
            often as one likes. Those of a file are read from it anew each time, so that a long run is never in memory.
        defects: what the recording lacks, or what stands in it at the wrong place; empty where it is whole and closed.
        copies: blocks that stand at another place as well: the header, and the surfaces below the sensors.
    """

    header: dict[str, Any]
    blocks: Iterable[Block]
    defects: tuple[Defect, ...] = ()
    copies: tuple[Block, ...] = ()

    def __repr__(self) -> str:
        since, until = self.span
        whole = "whole" if self.complete else f"{len(self.defects)} defects"
        return f"<Run {self.header.get('name')!r}: {until - since:.1f} s, {len(self.events)} events, {whole}>"

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the speed of the fastest joint and the touches, the events, the next call."""
        since, until = self.span
        scale, events = 480.0 / max(until - since, 1e-9), self.events
        speeds = [(scale * (state.time - since), max(map(abs, state.qd))) for state in self.states()]
        most = max((speed for _, speed in speeds), default=0.0) or 1.0
        path = " ".join(f"{x:.1f},{100.0 - 90.0 * speed / most:.1f}" for x, speed in speeds)
        ticks = (scale * (event.time - since) for event in events if event.name == EventName.CONTACT)
        touches = "".join(f"<path d='M{x:.1f} 0V100' stroke='#d646e0' stroke-width='3'/>" for x in ticks)
        line = f"<polyline points='{path}' fill='none' stroke='#1d7dc9'/>"
        told = f"fastest joint, 0 to {most:.2f} rad/s, in {until - since:.2f} s; magenta: touches"
        words = f"<text x='2' y='12' font-size='11'>{told}</text>"
        lines = [describe(event, self.start).strip().partition("  ") for event in events]
        rows = [("lacks", self.missing or "nothing"), *((time, text) for time, _, text in lines)]
        drawn = f"<svg viewBox='0 0 480 102'>{touches}{line}{words}</svg>"
        return html_card(f"run of {self.header.get('name')}", rows, "run.replay()", drawn)

    @property
    def start(self) -> float:
        """Host time at which the run was started [s]."""
        start: float = self.header["clocks"]["monotonic"]
        return start

    @property
    def unix_offset(self) -> float:
        """What turns a host time of the run into seconds since 1970 [s]; 0 where the recording does not tell."""
        unix = self.header["clocks"].get("unix")
        return unix - self.start if is_time(unix) else 0.0

    @property
    def complete(self) -> bool:
        """True where nothing is missing and nothing is out of place."""
        return not self.defects

    @property
    def missing(self) -> str:
        """The defects in a sentence; empty where there are none."""
        return "; ".join(defect.describe(self.start, _kind_name) for defect in self.defects)

    @property
    def gap(self) -> float:
        """Time from which on inputs are missing [s]: what follows cannot be compared. Infinite where none are."""
        lost = (min(defect.since, defect.until) for defect in self.defects if defect.inputs_missing)
        return min(lost, default=math.inf)

    @property
    def _whole_until(self) -> float:
        return math.nextafter(self.gap, -math.inf)

    @property
    def events(self) -> list[GuardEvent]:
        """Events of the run, as they were recorded."""
        return [decode_event(block) for block in self.select(kinds=frozenset({BlockKind.EVENT}))]

    @property
    def span(self) -> tuple[float, float]:
        """Times of the first block and of the newest [s, host clock]; the start of the run where there is none."""
        first = next(iter(self.blocks), None)
        if first is None:
            return self.start, self.start
        blocks = self.blocks
        until = blocks.until if isinstance(blocks, Recording) else max(block.time for block in blocks)
        return first.time, until

    def select(
        self,
        since: float = -math.inf,
        until: float = math.inf,
        kinds: frozenset[int] = ALL_KINDS,
        progress: Progress = silent,
    ) -> Iterator[Block]:
        """Yield blocks of kinds, from and until a time [s, host clock]; the rest is not read, as far as it can be."""
        for blocks in self._batches(since, until, kinds, progress):
            yield from blocks

    def _batches(self, since: float, until: float, kinds: frozenset[int], progress: Progress) -> Iterator[list[Block]]:
        """Yield the blocks of ``select``, many at a time: quicker than one by one."""
        if not isinstance(self.blocks, Recording):
            yield [block for block in self.blocks if since <= block.time <= until and block.kind in kinds]
            return
        begin = self.blocks.since
        duration = max(self.blocks.until - begin, _PROGRESS_PERIOD)
        due = math.inf if progress is silent else begin + _PROGRESS_PERIOD
        for blocks in self.blocks.batches(since, until, kinds):
            time = blocks[0].time
            if time >= due:
                due = time + _PROGRESS_PERIOD
                progress(min((time - begin) / duration, 1.0))
            yield blocks
        progress(1.0)

    def frames(self, progress: Progress = silent) -> Iterator[tuple[float, Frame]]:
        """Yield the frames of the skin, each with the host time at which its last byte was read [s]."""
        decoder = FrameDecoder()
        for block in self.select(kinds=frozenset({BlockKind.SKIN}), progress=progress):
            for frame in decoder.feed(block.payload):
                yield block.time, frame

    def states(self, since: float = -math.inf, until: float = math.inf) -> Iterator[ControllerState]:
        """Yield the states of the arm in a time [s, host clock]; what the guard could not read either is left out."""
        if (driver := self._driver()) is not None:
            for block in self.select(since, until, frozenset({BlockKind.ARM})):
                with suppress(RobotConnectionError):
                    yield driver.decode_state(block.time, block.payload)

    def slider(self) -> Iterator[tuple[float, float]]:
        """Yield host times [s] and positions of the speed slider, from 0 to 1; what cannot be read is left out."""
        if isinstance(driver := self._driver(), SliderDriver):
            for block in self.select(kinds=frozenset({BlockKind.SLIDER})):
                with suppress(RobotConnectionError):
                    yield block.time, driver.decode_speed_fraction(block.payload)

    def _driver(self) -> ArmDriver | None:
        arm = self.scene().arm
        return None if arm is None else arm.driver

    def scene(self, settings: Mapping[str, Any] | None = None) -> Scene:
        """Return the scene of the run. No file that it names is looked for or opened.

        Args:
            settings: values to set in it first, such as ``{"reaction.kind": "stop"}``.

        Raises:
            SceneError: this version of coneskin cannot read it, or with these settings it is no scene.
        """
        header = self.header
        text = override_settings(header["scene"], settings) if settings else header["scene"]
        folder = Path(header["folder"])
        try:
            return parse_scene(text, header["name"], folder, recorded=True, commissioning=self.commissioning)
        except SceneError as exc:
            if not settings:
                raise
            given = ", ".join(f"{name}={value}" for name, value in settings.items())
            raise SceneError(exc.problems, f"{header['name']} with {given}") from exc

    @property
    def commissioning(self) -> Commissioning | None:
        """What was known of the scene's commissioning; a replay does not look again."""
        return Commissioning.from_message(self.header.get("commissioning"))

    @property
    def recorded_by(self) -> str:
        """Version of coneskin that recorded the run, such as ``0.1.0 (984714c)``; empty where it does not tell."""
        return recorded_version(self.header)

    def other_code(self) -> tuple[str, ...]:
        """Return in what today's code differs from what recorded the run, before any input: version, filled-in values.

        Raises:
            SceneError: this version of coneskin cannot read the scene.
        """
        then, now = self.recorded_by or "an unknown version", recorded_version(code_versions())
        words = () if then == now else (f"recorded by coneskin {then}, replayed by {now}",)
        changed = changed_settings(self.header.get("resolved"), self.scene())
        return *words, *(f"the scene is filled in otherwise than when it was recorded: {what}" for what in changed)

    def place_sensors(self, scene: Scene | None = None) -> list[SensorOnArm]:
        """Return the places of the sensors on the arm, with the surfaces of links that the recording carries.

        Raises:
            SceneError: this version of coneskin cannot read the scene, or a sensor lies on a mesh that is not carried.
            RecordingError: a surface is damaged.
        """
        surfaces = frozenset({BlockKind.SURFACE})
        carried = [*self.copies, *self.select(kinds=surfaces)]
        return place_on_arm(scene or self.scene(), decode_surfaces(b for b in carried if b.kind in surfaces))

    def build_core(self, scene: Scene | None = None, settings: Mapping[str, Any] | None = None) -> GuardCore:
        """Return a new guard's core, of today's code, for the inputs of the run.

        Args:
            scene: another scene than the run's own; no setting changes it.
            settings: values to set in the run's scene first, such as ``{"reaction.kind": "stop"}``.

        Raises:
            SceneError: the scene cannot be read or built.
        """
        placed = None
        if scene is None:
            scene = self.scene(settings)
            placed = self.place_sensors(scene)
        elif scene.commissioning is None:
            scene = replace(scene, commissioning=self.commissioning)
        return build_core(scene, placed, override_detector(settings or {}))

    def decide(self, core: GuardCore, progress: Progress = silent) -> Iterator[tuple[Block, list[Output]]]:
        """Feed the inputs of the run to a guard's core, one at a time, up to the first gap.

        Yields:
            each input and what the guard puts out for it; the list is used again.
        """
        outputs = list[Output]()
        for block in self.select(until=self._whole_until, kinds=INPUTS, progress=progress):
            core.feed(block, outputs)
            yield block, outputs
            outputs.clear()

    def touches(self) -> list[_FoundTouch]:
        """Return the touches in what is left of the run, in the order of their beginnings.

        Only the detectors run, on the skin's bytes. So it serves a long run of which retention has dropped parts, too,
        which cannot be replayed as a whole.

        Raises:
            SceneError: this version of coneskin cannot read the scene.
            RecordingError: a file of the run has changed since it was opened.
        """
        stream = build_stream(self.scene())
        lasting: dict[str, _FoundTouch] = {}
        over: list[_FoundTouch] = []
        for _, time, payload in self.select(kinds=frozenset({BlockKind.SKIN})):
            for event in stream.feed(payload, time):
                if isinstance(event, TouchBegan):
                    lasting[event.sensor] = _FoundTouch(event.sensor, event.time, math.inf, event.level)
                elif isinstance(event, TouchEnded):
                    over.append(lasting.pop(event.sensor)._replace(ended=event.time))
            for detector in stream.detectors if lasting else ():
                name, reading = detector.sensor.name, detector.reading_now
                if reading is not None and reading.level > lasting[name].peak:
                    lasting[name] = lasting[name]._replace(peak=reading.level)
        return sorted([*over, *lasting.values()], key=lambda touch: touch.began)

    def replay(self, scene: Scene | None = None, progress: Progress = silent) -> Replay:
        """Feed the inputs of the run to a new guard, and compare its events with the recorded ones.

        Args:
            scene: another scene than the run's own, to see what it would have done.

        Raises:
            SceneError: the scene cannot be read or built.
            RecordingError: a block holds what no guard records.
        """
        events: list[GuardEvent] = []
        outputs = list[Output]()
        core, frames, skin = self.build_core(scene), 0, int(BlockKind.SKIN)
        for blocks in self._batches(-math.inf, self._whole_until, INPUTS, progress):
            for block in blocks:
                core.feed(block, outputs)
            events += [output for output in outputs if isinstance(output, GuardEvent)]
            outputs.clear()
            frames += sum(len(payload) for kind, _, payload in blocks if kind == skin)
        gap, recorded = self.gap, self.events
        then = [event for event in recorded if event.name not in SESSION_EVENTS and event.time < gap]
        # an input is recorded before its events, so a run that was cut off may lack the last of these
        again = events if gap == math.inf else events[: len(then)]
        differences = list(islice(event_differences(then, again, self.start), MOST_DIFFERENCES))
        since, until = self.span
        return Replay(events, recorded, len(then), differences, frames, until - since, self.missing, self.other_code())

    def timeline(self, events: Sequence[GuardEvent] | None = None) -> list[str]:
        """Return a line of text for each event, by default the recorded ones, with its time since the run's start."""
        return [describe(event, self.start) for event in (self.events if events is None else events)]


def read_header(block: Block | None, path: Path) -> dict[str, Any]:
    """Return the header that the first block of a recording holds.

    Raises:
        RecordingError: there is none, or this version of coneskin cannot read it.
    """
    if block is None:
        raise RecordingError(f"{path} has no header: the run ended before it began")
    try:
        header: dict[str, Any] = read_json(block.payload)
        if wrong := [key for key, kind in _HEADER_TYPES.items() if not isinstance(header[key], kind)]:
            raise ValueError(f"{', '.join(wrong)} of another kind")
        if not is_time(header["clocks"]["monotonic"]):
            raise ValueError("clocks.monotonic is no time in seconds")
        Commissioning.from_message(header.get("commissioning"))
    except (ValueError, TypeError, KeyError) as exc:
        raise RecordingError(f"{path} has a header that this coneskin cannot read: {exc}") from exc
    return header


def run_path(path: Path | str) -> Path:
    """Return the path of a run; ``gallery:palm`` is a recording that the package contains.

    Raises:
        RecordingError: the gallery has no such run.
    """
    word, _, name = str(path).partition(":")
    if word != "gallery":
        return Path(path)
    known = {each.stem: each for each in sorted((Path(__file__).parents[1] / "gallery").glob("*.rec"))}
    if name not in known:
        raise RecordingError(f"there is no run {path}: name one of {', '.join(f'gallery:{each}' for each in known)}")
    return known[name]


def read_run(path: Path | str, progress: Progress = silent) -> Run:
    """Read a recorded run.

    Args:
        path: the recording, the folder of a run with one in it, or one of the gallery, such as ``gallery:palm``.

    Raises:
        RecordingError: there is none, or it has no header.
    """
    path = run_path(path)
    if path.is_dir():
        if not (path / "run.rec").exists() and (runs := sorted(path.glob("*/run.rec"))):
            raise RecordingError(f"{path} is a folder of {len(runs)} runs: name one of them, such as {runs[-1].parent}")
        path = path / "run.rec"
    recording = read_recording(path, progress)
    first = next(iter(recording), None)
    if first is None or first.kind != BlockKind.HEADER:
        first = next((block for block in recording.copies if block.kind == BlockKind.HEADER), None)
    header = read_header(first, path)
    blocks = replace(recording, hidden=recording.hidden | {BlockKind.HEADER})
    run = Run(header, blocks, recording.defects, recording.copies)
    return replace(run, defects=tuple(sorted((*_left_out(run.events), *run.defects), key=lambda found: found.since)))


def _kind_name(kind: int) -> str:
    return BlockKind(kind).name if kind in BlockKind.__members__.values() else str(kind)


def _left_out(events: Sequence[GuardEvent]) -> Iterator[Defect]:
    """Yield what the guard says that it left out."""
    for event in events:
        if event.name == EventName.RECORDING_GAP:
            since, until = event.details.get("since"), event.details.get("until")
            if not (is_time(since) and is_time(until)):
                raise RecordingError(f"the event {event.name} of {event.time:.6f} s does not say from and until when")
            count = event.details.get("blocks")
            blocks = count if type(count) is int else 0
            yield Defect(DefectKind.LEFT_OUT, since, until, blocks=blocks, note=str(event.details.get("what")))
