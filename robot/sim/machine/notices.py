"""Notices: what the simulated controller tells its clients besides its state, as values."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from .safety import SafetyMode

__all__ = [
    "ErrorNotice",
    "Notice",
    "PopupNotice",
    "ProgramFailed",
    "ProgramNotice",
    "Report",
    "SafetyNotice",
    "TextNotice",
]


class Report(IntEnum):
    """How grave an error is: the report level of the client interface."""

    DEBUG = 0
    INFO = 1
    WARNING = 2
    VIOLATION = 3
    FAULT = 4
    CRITICAL_FAULT = 5


@dataclass(frozen=True, slots=True)
class TextNotice:
    """Text of a program's ``textmsg``."""

    text: str


@dataclass(frozen=True, slots=True)
class PopupNotice:
    """Window that a program's ``popup`` opens.

    Attributes:
        title: of the window.
        text: in it.
        warning: whether it is shown as a warning.
        error: whether it is shown as an error.
    """

    title: str
    text: str
    warning: bool = False
    error: bool = False


@dataclass(frozen=True, slots=True)
class ProgramNotice:
    """Program that has started, or stopped.

    Attributes:
        name: of the program.
        event: "STARTED", "STOPPED", "PAUSED" or "RESUMED".
    """

    name: str
    event: str


@dataclass(frozen=True, slots=True)
class ProgramFailed:
    """Program that cannot be run, or that has failed.

    Attributes:
        text: what is wrong.
        line: of the program, from 1; 0 where it is not known.
        column: in that line, from 1; 0 where it is not known.
    """

    text: str
    line: int = 0
    column: int = 0


@dataclass(frozen=True, slots=True)
class SafetyNotice:
    """New state of the safety system."""

    mode: SafetyMode


@dataclass(frozen=True, slots=True)
class ErrorNotice:
    """Entry of the controller's log, such as C153A0.

    Attributes:
        code: number after the C.
        argument: number after the A.
        report: how grave it is.
        text: what happened.
    """

    code: int
    argument: int
    report: Report
    text: str = ""


Notice = TextNotice | PopupNotice | ProgramNotice | ProgramFailed | SafetyNotice | ErrorNotice
