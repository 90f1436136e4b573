"""Commands of a guard to its arm, so that recorded ones can be compared with those of a replay."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from coneskin.core.recording.block import Block
from coneskin.robot.driver.messages import SetJointVelocity, decode_command
from coneskin.robot.driver.setpoint import JointVelocitySetpoint, SetpointProgram, SetSpeedSlider
from coneskin.robot.driver.stop_path import UseStopPath
from coneskin.robot.guard.signals.journal import INPUTS, BlockKind
from coneskin.robot.guard.signals.outputs import Command

from .replay.quantities import Tolerances

__all__ = ["ArmCommand", "command_block", "command_of", "first_divergence", "recorded_commands"]

_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*(?:[eE][-+]?\d+)?|inf|nan)")
_SLIDER = "slider"
_OWN_NAMES = {JointVelocitySetpoint: "setpoint", SetpointProgram: "follow", SetSpeedSlider: _SLIDER}
_SPEEDS = frozenset({"setpoint", SetJointVelocity.__name__})  # commands of joint speeds
_ABSOLUTE = 1e-12  # rad/s and the like, for numbers near zero


class ArmCommand(NamedTuple):
    """Command of a guard.

    Attributes:
        time: of the input that led to it, host clock [s].
        what: such as "StopProgram", or the stop path that was used.
        numbers: what it carries, in SI.
    """

    time: float
    what: str
    numbers: tuple[float, ...]

    def equals(self, other: ArmCommand, tolerances: Tolerances) -> bool:
        """Tell whether the other does the same to the arm at the same time, within tolerances."""
        absolute = _ABSOLUTE
        if self.what in _SPEEDS:
            absolute = max(absolute, tolerances.speed)
        elif self.what == _SLIDER:
            absolute = max(absolute, tolerances.level)
        return (
            (self.what, len(self.numbers)) == (other.what, len(other.numbers))
            and math.isclose(self.time, other.time, rel_tol=0.0, abs_tol=tolerances.time)
            and all(
                math.isclose(a, b, rel_tol=tolerances.relative, abs_tol=absolute)
                for a, b in zip(self.numbers, other.numbers, strict=True)
            )
        )


def command_of(output: Command, time: float) -> ArmCommand:
    """Return the command that a guard's core puts out at a time [s]."""
    if isinstance(output, UseStopPath):
        return ArmCommand(time, output.path.value, ())  # a recording does not tell with which deceleration
    if isinstance(output, JointVelocitySetpoint | SetpointProgram | SetSpeedSlider):
        return ArmCommand(time, _OWN_NAMES[type(output)], _numbers(str(tuple(output))))
    return _of_message(time, output.encode())


def command_block(output: Command, time: float, process: str) -> Block:
    """Return the block that records a command as the guard's loop does.

    Args:
        output: of a guard's core.
        time: host clock [s].
        process: that takes what goes over no connection of the guard's own: "driver" or "watchdog".
    """
    if isinstance(output, UseStopPath):
        payload = f"{output.path.value}\nsent".encode()
    elif isinstance(output, JointVelocitySetpoint | SetpointProgram | SetSpeedSlider):
        payload = f"{_OWN_NAMES[type(output)]}\n{tuple(output)}".encode()
    else:
        payload = process.encode() + b"\n" + output.encode()
    return Block(BlockKind.COMMAND, time, payload)


def recorded_commands(blocks: Iterable[Block]) -> Iterator[ArmCommand]:
    """Yield the commands of a recording, each with the time of the input before it."""
    time = math.nan
    for block in blocks:
        if block.kind in INPUTS:
            time = block.time
        elif block.kind == BlockKind.COMMAND:
            head, _, body = block.payload.partition(b"\n")
            name = head.decode("utf-8", "replace").removesuffix(", not sent")
            if body in (b"sent", b"not sent"):
                yield ArmCommand(time, name, ())
            elif name in ("driver", "watchdog"):
                yield _of_message(time, body)
            else:
                yield ArmCommand(time, name, _numbers(body.decode("utf-8", "replace")))


def first_divergence(
    one: Sequence[ArmCommand], other: Sequence[ArmCommand], tolerances: Tolerances | None = None
) -> float:
    """Return from when on two guards command otherwise [s]; infinite where they do not.

    Args:
        one: commands of a guard.
        other: of another that was given the same inputs, or the same guard in a replay.
        tolerances: what does not count.
    """
    tolerances = tolerances or Tolerances()
    for a, b in zip(one, other, strict=False):
        if not a.equals(b, tolerances):
            return min(a.time, b.time)
    shared = min(len(one), len(other))
    rest = [*one[shared:], *other[shared:]]
    return rest[0].time if rest else math.inf


def _of_message(time: float, message: bytes) -> ArmCommand:
    try:
        command = decode_command(message)
    except ValueError:
        return ArmCommand(time, repr(message), ())
    return ArmCommand(time, type(command).__name__, _numbers(str(tuple(command))))


def _numbers(text: str) -> tuple[float, ...]:
    return tuple(map(float, _NUMBER.findall(text)))
