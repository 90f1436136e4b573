"""Ports of a guard that are gone, missing from the start, or open again: what follows from each. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from coneskin.core.recording.block import Block

from .companion_monitor import CompanionMonitor
from .event_folding import EventFolding
from .fault_register import FaultRegister
from .phase import Phase
from .signals.journal import EventName, decode_loss
from .signals.outputs import Outputs, emit
from .skin_connection import SkinConnection

if TYPE_CHECKING:
    from .arm_supervisor import ArmSupervisor

__all__ = ["PortLosses"]


class PortLosses:
    """Ports that one guard has lost; only a skin's may be opened again.

    Args:
        arm: the arm under guard, or None.
        connection: to the skin.
        companions: processes beside the guard.
        faults: of the guard.
        folding: of the guard's events.
    """

    def __init__(
        self,
        arm: ArmSupervisor | None,
        connection: SkinConnection,
        companions: CompanionMonitor,
        faults: FaultRegister,
        folding: EventFolding,
    ) -> None:
        self._arm = arm
        self._connection = connection
        self._companions = companions
        self._faults = faults
        self._folding = folding
        self._lost: dict[str, str] = {}

    @property
    def blockers(self) -> Iterable[str]:
        """What is gone, one line each."""
        return self._lost.values()

    def take_lost(self, block: Block, out: Outputs) -> None:
        """Take that a port is gone: the arm stops."""
        what, why = decode_loss(block.payload)
        self._lost[what] = why
        self._companions.lose(what, block.time)
        if self._arm is not None and what == "slider":
            self._arm.speed_reduction.note(block.time, None)
        self._faults.react(block.time, why, out)
        if what == "session":
            self._folding.flush(block.time, out)
            if self._arm is not None:
                self._arm.end(block.time, out)
        emit(out, EventName.ENDING if what == "session" else EventName.FAULT, block.time, what=why)

    def take_absent(self, block: Block, out: Outputs) -> None:
        """Take that there is no such stop path in this run."""
        what, why = decode_loss(block.payload)
        self._companions.lose(what, block.time)
        emit(out, EventName.MESSAGE, block.time, what=f"a stop path is missing, {what}: {why}")

    def take_reopened(self, block: Block, out: Outputs) -> None:
        """Take a skin that is open again; only the reset of a latched arm makes the guard active with it."""
        latched = self._arm is not None and self._arm.phase is Phase.LATCHED
        if block.payload != b"skin" or "skin" not in self._lost or not latched:
            return
        del self._lost["skin"]
        self._connection.reopen(block.time)
        emit(out, EventName.MESSAGE, block.time, what="the skin's port is open again; a reset is needed")
