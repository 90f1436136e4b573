"""Stop paths: the independent ways in which an arm can be stopped."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

__all__ = ["EXTERNAL_PATHS", "INTERNAL_PATHS", "StopPath", "UseStopPath"]


class StopPath(Enum):
    """One way to stop the arm. The driver of a controller implements it."""

    DRIVER = "driver"  #: the stop of the motion that is under way, through the driver process
    PROGRAM = "program"  #: a program that brakes, sent to the controller; it replaces the one that runs
    COMMAND = "command"  #: the stop command of the controller's operating interface
    SLIDER = "slider"  #: the controller's speed slider at 0, over a connection that lives; it stays there until a reset
    PROTECTIVE = "protective"  #: a protective stop; only a person can unlock it
    WATCHDOG = "watchdog"  #: the guard watchdog's stop, over connections of its own or new ones


class UseStopPath(NamedTuple):
    """Command to use a stop path.

    Attributes:
        path: which; DRIVER is used by ``StopProgram`` and ``EndReaction``.
        deceleration: of the leading joint, where the path can have one [rad/s2].
    """

    path: StopPath
    deceleration: float


#: in the order in which they are used where coneskin moves the arm, and where another program does
INTERNAL_PATHS = (StopPath.DRIVER, StopPath.PROGRAM, StopPath.COMMAND, StopPath.SLIDER, StopPath.PROTECTIVE)
EXTERNAL_PATHS = (StopPath.PROGRAM, StopPath.COMMAND, StopPath.SLIDER, StopPath.PROTECTIVE, StopPath.WATCHDOG)
