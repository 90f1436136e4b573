"""Run a recording again: the same bytes through the same guard, and whether the same happens."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from .errors import RecordingError
from .robot.arm_reaction import Output
from .robot.journal import ABOUT, INPUTS, GuardEvent, Kind, decode_event
from .scene import Scene
from .skin.recording import Block, read_recording

__all__ = ["Replay", "Run", "read_run", "replay"]


_HEADER = {"scene": str, "name": str, "folder": str, "clocks": dict}


@dataclass(frozen=True, slots=True)
class Run:
    """A recorded run.

    Attributes:
        header: scene, versions and times; see ``coneskin.session``.
        blocks: all that was recorded after it.
        missing: what the recording lacks, in a sentence; empty where it was closed and whole.
    """

    header: dict[str, Any]
    blocks: tuple[Block, ...]
    missing: str

    @property
    def gap(self) -> float:
        """From when on blocks are missing [s]: what follows cannot be the same again. Infinite where none are."""
        return min((event.details["since"] for event in self.events if event.name == "missing"), default=math.inf)

    @property
    def events(self) -> list[GuardEvent]:
        """What happened, as it was recorded."""
        return [decode_event(block) for block in self.blocks if block.kind == Kind.EVENT]

    def scene(self) -> Scene:
        """The scene of the run.

        Raises:
            SceneError: this coneskin cannot read it any more.
        """
        from .scene_reader import parse_scene

        return parse_scene(self.header["scene"], self.header["name"], Path(self.header["folder"]), recorded=True)


@dataclass(frozen=True, slots=True)
class Replay:
    """What a replay found.

    Attributes:
        events: what happened this time.
        recorded: what happened then.
        same: whether the two are equal, bit by bit; up to the first gap, where blocks are missing.
        differences: the first pairs that are not, for people.
        frames: bytes of skin that were replayed.
        duration: of the recording [s].
        missing: what the recording lacks.
    """

    events: list[GuardEvent]
    recorded: list[GuardEvent]
    same: bool
    differences: list[str]
    frames: int
    duration: float
    missing: str


def read_run(path: Path) -> Run:
    """Read a recorded run.

    Args:
        path: the recording, or the folder of a run with one in it.

    Raises:
        RecordingError: there is none, or it has no header.
    """
    if path.is_dir():
        path = path / "run.rec"
    recording = read_recording(path)
    if not recording.blocks or recording.blocks[0].kind != Kind.HEADER:
        raise RecordingError(f"{path} has no header: the run ended before it began")
    try:
        header = json.loads(recording.blocks[0].payload)
        if wrong := [key for key, kind in _HEADER.items() if not isinstance(header[key], kind)]:
            raise ValueError(f"{', '.join(wrong)} of another kind")
    except (ValueError, TypeError, KeyError) as exc:
        raise RecordingError(f"{path} has a header that this coneskin cannot read: {exc}") from exc
    run = Run(header, recording.blocks[1:], recording.missing)
    start = recording.blocks[0].time
    gaps = [event.details for event in run.events if event.name == "missing"]
    said = [f"{gap['what']}, from {gap['since'] - start:.3f} s to {gap['until'] - start:.3f} s" for gap in gaps]
    return replace(run, missing="; ".join([*said, *([run.missing] if run.missing else [])]))


def replay(run: Run, scene: Scene | None = None) -> Replay:
    """Feed the run's inputs to a new guard.

    Args:
        run: the recorded run.
        scene: another scene than the run's own, to see what it would have done.

    Raises:
        SceneError: the scene cannot be read or built.
    """
    from .build import build_core

    core = build_core(scene or run.scene())
    outputs: list[Output] = []
    for block in run.blocks:
        if block.kind in INPUTS:
            core.take(block, outputs)
    events = [output for output in outputs if isinstance(output, GuardEvent)]
    recorded = run.events
    again = [_plain(event) for event in events if event.time < run.gap]
    then = [_plain(event) for event in recorded if event.name not in ABOUT and event.time < run.gap]
    if run.missing:  # an input is recorded before its events, so a run that was cut off may lack the last of these
        again = again[: len(then)]
    differences = list(_differences(again, then))
    frames = sum(len(block.payload) for block in run.blocks if block.kind == Kind.SKIN)
    duration = run.blocks[-1].time - run.blocks[0].time if run.blocks else 0.0
    return Replay(events, recorded, not differences, differences[:5], frames, duration, run.missing)


def _plain(event: GuardEvent) -> str:
    """An event as text with every bit of its floats."""
    return f"{event.time.hex()} {event.name} {json.dumps(event.details)}"


def _differences(again: list[str], then: list[str]) -> Iterator[str]:
    for number in range(max(len(again), len(then))):
        new = again[number] if number < len(again) else "nothing"
        old = then[number] if number < len(then) else "nothing"
        if new != old:
            yield f"event {number}: recorded {old}, replayed {new}"
