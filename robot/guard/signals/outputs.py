"""Outputs of a guard: commands and events, and the protocol of what takes them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from .journal import EventName, GuardEvent

if TYPE_CHECKING:  # a guard without an arm loads none of them
    from coneskin.robot.driver.messages import EndReaction, Release, SetJointVelocity, StopProgram
    from coneskin.robot.driver.setpoint import JointVelocitySetpoint, SetpointProgram, SetSpeedSlider
    from coneskin.robot.driver.stop_path import UseStopPath

__all__ = ["Command", "Output", "Outputs", "emit"]

#: to the driver process, and over connections of the guard's own
Command: TypeAlias = (
    "StopProgram | SetJointVelocity | EndReaction | Release"
    " | UseStopPath | SetpointProgram | JointVelocitySetpoint | SetSpeedSlider"
)
Output: TypeAlias = "Command | GuardEvent"


class Outputs(Protocol):
    """Sink of outputs, in order: a list, or something that sends a command as soon as it is there."""

    def append(self, output: Output, /) -> None:
        """Take one output."""


def emit(out: Outputs, name: EventName, time: float, **details: Any) -> None:
    """Put an event out, of a host time [s]."""
    out.append(GuardEvent(name, time, details))
