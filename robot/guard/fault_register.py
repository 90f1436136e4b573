"""Faults of one guard since its last reset: each makes the arm react once, and is reported. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, TypeVar

from coneskin.core.errors import RobotConnectionError
from coneskin.core.recording.block import Block

from .event_folding import EventFolding
from .signals.journal import EventName
from .signals.outputs import Outputs

if TYPE_CHECKING:
    from .arm_supervisor import ArmSupervisor

__all__ = ["FaultRegister"]

_Decoded = TypeVar("_Decoded")


class FaultRegister:
    """Faults of one guard since its last reset.

    Args:
        arm: the arm under guard, or None.
        folding: of the guard's events.
    """

    def __init__(self, arm: ArmSupervisor | None, folding: EventFolding) -> None:
        self._arm = arm
        self._folding = folding
        self._faults: dict[str, str] = {}

    @property
    def messages(self) -> Iterable[str]:
        """What is wrong, one line each."""
        return self._faults.values()

    def clear(self) -> None:
        """Forget the faults, on a reset; what still is wrong comes again."""
        self._faults.clear()

    def add(self, now: float, what: str, out: Outputs, kind: str = "") -> None:
        """React to a fault at a host time [s], once until the next reset.

        Args:
            now: host time [s].
            what: is wrong.
            out: takes commands and events.
            kind: of a fault that repeats itself in other words or numbers; those are counted. Without it, it lasts.
        """
        known = (kind or what) in self._faults
        if known and not kind:
            return
        self._faults[kind or what] = what
        if not known:
            self.react(now, what, out)
        self._folding.emit(out, EventName.FAULT, kind or what, now, what=what)

    def react(self, now: float, why: str, out: Outputs) -> None:
        """Let the arm react at a host time [s], where there is one."""
        if self._arm is not None:
            self._arm.fault(now, why, out)

    def decode(self, block: Block, what: str, decode: Callable[[bytes], _Decoded], out: Outputs) -> _Decoded | None:
        """Return what the controller has sent; None, after a fault that says ``what``, where it is unreadable."""
        try:
            return decode(block.payload)
        except RobotConnectionError as exc:
            self.add(block.time, f"{what}: {exc}", out, what)
            return None
