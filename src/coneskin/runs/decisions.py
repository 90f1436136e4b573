"""Decisions of a guard in one run: events and commands to the arm, recorded or made again by a replay."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from coneskin.core.progress import Progress, silent
from coneskin.core.recording.block import Block
from coneskin.robot.driver.messages import Release, SetJointVelocity, decode_command
from coneskin.robot.guard.signals.journal import (
    CONTACT_EVENTS,
    INPUTS,
    SESSION_EVENTS,
    BlockKind,
    EventName,
    GuardEvent,
    encode_command,
)
from coneskin.scene.values.scene import Scene

from .replay.event_details import Tolerances
from .replay.run import Run

_NUMBER_PATTERN = re.compile(r"[-+]?(?:\d+\.?\d*(?:[eE][-+]?\d+)?|inf|nan)")
_SLIDER_WORD = "slider"
_SPEED_COMMANDS = frozenset({"setpoint", SetJointVelocity.__name__})  # commands of joint speeds
_ABSOLUTE_TOLERANCE = 1e-12  # rad/s and the like, for numbers near zero


class _ArmCommand(NamedTuple):
    """Command of a guard."""

    time: float  #: of the input that led to it, host clock [s]
    what: str  #: such as "StopProgram", or the stop path that was used
    numbers: tuple[float, ...]  #: what it carries, in SI

    def equals(self, other: _ArmCommand, tolerances: Tolerances) -> bool:
        """Tell whether the other does the same to the arm at the same time, within tolerances."""
        absolute = _ABSOLUTE_TOLERANCE
        if self.what in _SPEED_COMMANDS:
            absolute = max(absolute, tolerances.speed)
        elif self.what == _SLIDER_WORD:
            absolute = max(absolute, tolerances.level)
        return (
            (self.what, len(self.numbers)) == (other.what, len(other.numbers))
            and math.isclose(self.time, other.time, rel_tol=0.0, abs_tol=tolerances.time)
            and all(
                math.isclose(a, b, rel_tol=tolerances.relative, abs_tol=absolute)
                for a, b in zip(self.numbers, other.numbers, strict=True)
            )
        )


def recorded_commands(blocks: Iterable[Block]) -> Iterator[_ArmCommand]:
    """Yield the commands of a recording, each with the time of the input before it."""
    time = math.nan
    for block in blocks:
        if block.kind in INPUTS:
            time = block.time
        elif block.kind == BlockKind.COMMAND:
            yield _command_in(block.payload, time)


def _command_in(payload: bytes, time: float) -> _ArmCommand:
    """Return the command in a block's payload, for an input of a host time [s]."""
    head, _, body = payload.partition(b"\n")
    name = head.decode("utf-8", "replace").removesuffix(", not sent")
    if body in (b"sent", b"not sent"):  # with which deceleration, a recording does not tell
        return _ArmCommand(time, name, ())
    if name in ("driver", "watchdog"):
        try:
            command = decode_command(body)
        except ValueError:
            return _ArmCommand(time, repr(body), ())
        return _ArmCommand(time, type(command).__name__, _numbers(repr(command)))
    return _ArmCommand(time, name, _numbers(body.decode("utf-8", "replace")))


def first_divergence(
    one: Sequence[_ArmCommand], other: Sequence[_ArmCommand], tolerances: Tolerances | None = None
) -> float:
    """Return from when on two guards command otherwise on the same inputs [s]; infinite where they do not."""
    tolerances = tolerances or Tolerances()
    for a, b in zip(one, other, strict=False):
        if not a.equals(b, tolerances):
            return min(a.time, b.time)
    shared = min(len(one), len(other))
    rest = [*one[shared:], *other[shared:]]
    return rest[0].time if rest else math.inf


def _numbers(text: str) -> tuple[float, ...]:
    return tuple(map(float, _NUMBER_PATTERN.findall(text)))


SKIN_EVENTS = CONTACT_EVENTS | {EventName.TOUCH_ENDED}  #: what the skin alone decides


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
    commands: tuple[_ArmCommand, ...] | None
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
        settings: values to set in the scene first, such as ``{"reaction.kind": "stop"}``.
        label: for people; by default the settings.
        scene: another scene than the run's own; no setting changes it.

    Raises:
        SceneError: the scene cannot be read or built with these settings.
        RecordingError: a block holds what no guard records.
    """
    events: list[GuardEvent] = []
    commands: list[_ArmCommand] = []
    for block, outputs in run.decide(run.build_core(scene, settings), progress):
        for output in outputs:
            if isinstance(output, GuardEvent):
                events.append(output)
            else:
                commands.append(_command_in(encode_command(output, "driver"), block.time))
    label = label or ", ".join(f"{name} = {value}" for name, value in (settings or {}).items()) or "replayed"
    return replace(_decisions(run, label, tuple(events), tuple(commands)), other_code=run.other_code())


def _decisions(run: Run, label: str, events: tuple[GuardEvent, ...], commands: tuple[_ArmCommand, ...]) -> Decisions:
    window = -math.inf, math.inf
    if "cut" in run.header:
        window = run.span
        commands = tuple(command for command in commands if command.what != Release.__name__)  # the cut's own
    return Decisions(label, events, commands, run.start, run.gap, run.missing, window)
