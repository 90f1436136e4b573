"""Activation of a guard: at its start, or after a manual reset, once there has been no blocker for a while. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from .signals.journal import EventName, Outputs, emit


@dataclass(frozen=True, slots=True)
class ControllerNeeds:
    """What a guard needs of the arm's controller, beside its states and a way to stop it. Nothing without an arm.

    Attributes:
        slider: the speed slider: a reaction, or the limit of the speed, may use it.
        stops_by_slider: the speed slider as a stop path, without which the guard does where another client has it.
        setpoints: a setpoint program: a reaction may move an arm that another program moves.
        heartbeat: a program that counts the guard's heartbeats: True where it must, False where it may, None where no
            other program moves the arm.
    """

    slider: bool = False
    stops_by_slider: bool = False
    setpoints: bool = False
    heartbeat: bool | None = None


_REPORT_PERIOD = 0.5  # s between two lists of what the guard waits for
_RELEASE_TIMEOUT = 4.0  # s; a driver process may first have to start its program on the controller again


class ActivationStep(Enum):
    """What a guard on its way to being active has to do next."""

    WAIT = "wait"
    RELEASE = "release"  #: ask the process that moves or holds the arm to let the program move it
    WITHDRAW = "withdraw"  #: take that back: something stands against it after all


class _Way(NamedTuple):
    """How far a guard is on its way to being active."""

    request: int | None = None  # number of the reset that is under way
    free_since: float | None = None
    released_at: float | None = None  # None while no release waits for its acknowledgement
    disturbed: bool = False  # by a touch, however short


class Activation:
    """State of a guard on its way to being active.

    Nothing may stand against it for a while. Then a release goes out, and with its acknowledgement the guard is active.
    Each release has a number, so that the acknowledgement of an older one does not count.

    Args:
        settle: time without a blocker after which the release goes out [s].

    Attributes:
        number: of the newest release, counted from 1.
    """

    def __init__(self, settle: float) -> None:
        self.number = 0
        self._settle = settle
        self._way = _Way()
        self._reported: tuple[float, list[str]] | None = None  # when, and what it waited for

    def disturb(self) -> None:
        """Note that a touch has begun, however short it is."""
        self._way = self._way._replace(disturbed=True)

    @property
    def resetting(self) -> bool:
        """True from a manual reset until it is accepted or refused."""
        return self._way.request is not None

    def reset(self, now: float, request: int) -> None:
        """Note a manual reset at a time [s], with the number of the request."""
        self._way = _Way(request, now)

    def poll(self, now: float, blockers: list[str], out: Outputs) -> ActivationStep:
        """Return what is due at a host time [s].

        A first activation waits as long as there is a blocker, one line each. Any blocker refuses a reset.
        """
        request, free_since, released_at, disturbed = self._way
        if disturbed:
            blockers = [*blockers, "it was touched meanwhile"]
        if released_at is not None and now - released_at > _RELEASE_TIMEOUT:
            blockers = [*blockers, f"the release was not acknowledged within {_RELEASE_TIMEOUT:g} s"]
        if blockers:
            self._way = _Way()  # a blocker refuses a reset
            self._report(now, request, blockers, out)
            return ActivationStep.WAIT if released_at is None else ActivationStep.WITHDRAW
        free_since = now if free_since is None else free_since
        due = released_at is None and now - free_since >= self._settle
        self._way = _Way(request, free_since, now if due else released_at)
        self.number += due
        return ActivationStep.RELEASE if due else ActivationStep.WAIT

    def acknowledged(self, number: int) -> bool:
        """Tell whether this is the number of the release that waits for its acknowledgement."""
        return self._way.released_at is not None and number == self.number

    def end(self) -> int:
        """End the way to being active: the guard is. Return the number of the reset, 0 for the first one."""
        request, disturbed = self._way.request or 0, self._way.disturbed
        self._way = _Way(disturbed=disturbed)
        return request

    def _report(self, now: float, request: int | None, blockers: list[str], out: Outputs) -> None:
        if request is not None:
            emit(out, EventName.REFUSED, now, what="reset", request=request, reasons=blockers)
        elif self._reported is None:
            self._reported = now, []
        elif blockers != self._reported[1] and now - self._reported[0] >= _REPORT_PERIOD:
            self._reported = now, blockers
            emit(out, EventName.WAITING, now, reasons=blockers)
