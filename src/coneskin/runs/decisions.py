"""Decisions of a guard in one run: events and commands, as they were recorded or as a replay makes them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from coneskin.robot.driver.messages import Release
from coneskin.robot.guard.signals.journal import INPUTS, SESSION_EVENTS, BlockKind, GuardEvent
from coneskin.robot.guard.signals.outputs import Output

from .arm_command import ArmCommand, command_of, recorded_commands
from .block_progress import Progress, silent, watch

if TYPE_CHECKING:
    from coneskin.scene.values.scene import Scene

    from .replay.run import Run

__all__ = ["Decisions", "decide_again", "recorded_decisions", "scene_with"]


@dataclass(frozen=True, slots=True)
class Decisions:
    """Decisions of one guard in one run.

    Attributes:
        label: whose decisions they are, for people.
        events: of the guard, without those of the session around it.
        commands: to the arm; None where they are not known.
        start: host time that counts as 0 [s].
        until: from this time on the recording has lost something [s]; infinite where it has not.
        missing: what it has lost, in a sentence.
        other_code: in what the code that decided differs from what recorded the run, in sentences.
        window: time from which on, and until which, a cut tells something [s, host clock]; all of it for a whole run.
    """

    label: str
    events: tuple[GuardEvent, ...]
    commands: tuple[ArmCommand, ...] | None
    start: float
    until: float = math.inf
    missing: str = ""
    window: tuple[float, float] = (-math.inf, math.inf)
    other_code: tuple[str, ...] = ()


def recorded_decisions(run: Run, label: str = "recorded") -> Decisions:
    """Return what the guard decided when the run was recorded."""
    events = tuple(event for event in run.events if event.name not in SESSION_EVENTS)
    return _decisions(run, label, events, tuple(recorded_commands(run.blocks)))


def decide_again(
    run: Run,
    settings: Mapping[str, Any] | None = None,
    label: str = "",
    scene: Scene | None = None,
    progress: Progress = silent,
) -> Decisions:
    """Give a run's inputs to a new guard of today's code and return what it decides.

    Args:
        run: the recorded run.
        settings: values to set in the scene first, such as ``{"reaction.kind": "stop"}``.
        label: for people; by default the settings.
        scene: another scene than the run's own; no setting changes it.
        progress: called now and then with the fraction of a run in a file that is done.

    Raises:
        SceneError: the scene cannot be read or built with these settings.
        RecordingError: a block holds what no guard records.
    """
    from coneskin.scene.build import build_core, place_on_arm
    from coneskin.scene.settings import override_detector
    from coneskin.scene.surface_record import decode_surfaces

    if scene is None:
        scene = scene_with(run, settings or {})
        surfaces = frozenset({BlockKind.SURFACE})
        carried = (block for block in (*run.copies, *run.select(kinds=surfaces)) if block.kind in surfaces)
        placed = place_on_arm(scene, decode_surfaces(carried))
    else:
        if scene.commissioning is None:
            scene = replace(scene, commissioning=run.commissioning)
        placed = place_on_arm(scene)
    core, sink, gap = build_core(scene, placed, override_detector(settings or {})), _Sink(), run.gap
    for block in watch(run, run.select(kinds=INPUTS), progress):
        if block.time < gap:
            sink.now = block.time
            core.take(block, sink)
    label = label or ", ".join(f"{name} = {value}" for name, value in (settings or {}).items()) or "replayed"
    return replace(_decisions(run, label, tuple(sink.events), tuple(sink.commands)), other_code=run.other_code())


def scene_with(run: Run, settings: Mapping[str, Any]) -> Scene:
    """Return the scene of a run with other settings. No file that it names is opened.

    Raises:
        SceneError: with them it is no scene.
    """
    from pathlib import Path

    from coneskin.scene.reader import parse_scene
    from coneskin.scene.settings import override_settings

    if not settings:
        return run.scene()
    header = run.header
    text = override_settings(header["scene"], settings)
    folder = Path(header["folder"])
    return parse_scene(text, header["name"], folder, recorded=True, commissioning=run.commissioning)


def _decisions(run: Run, label: str, events: tuple[GuardEvent, ...], commands: tuple[ArmCommand, ...]) -> Decisions:
    window = -math.inf, math.inf
    if "cut" in run.header:
        window = _ends(run)
        commands = tuple(command for command in commands if command.what != Release.__name__)  # the cut's own
    return Decisions(label, events, commands, run.start, run.gap, run.missing, window)


def _ends(run: Run) -> tuple[float, float]:
    """Return the times of the first block and of the last [s]."""
    first, last = math.inf, -math.inf
    for block in run.blocks:
        first, last = min(first, block.time), max(last, block.time)
    return first, last


class _Sink:
    """Sink of a core's outputs, which gives each command the time of its input."""

    def __init__(self) -> None:
        self.now = math.nan
        self.events: list[GuardEvent] = []
        self.commands: list[ArmCommand] = []

    def append(self, output: Output, /) -> None:
        """Take one output."""
        if isinstance(output, GuardEvent):
            self.events.append(output)
        else:
            self.commands.append(command_of(output, self.now))
