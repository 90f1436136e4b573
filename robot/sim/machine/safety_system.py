"""Safety system of the simulated controller: its state, what changes it, and what its clients and the log are told.

It holds neither program nor arm: the controller does, by the state that it finds here.
"""

from __future__ import annotations

from collections.abc import Callable

from coneskin.robot.sim.motion.arm import CYCLE, StopCause

from .states import MOVING, ErrorNotice, Notice, Report, SafetyMode, SafetyNotice

__all__ = ["SafetySystem"]

_PLANT_LOST = 50  # number in the log; that of a real controller which loses its arm depends on the joint


class SafetySystem:
    """Safety system of one controller.

    Args:
        unlock_after: time that must pass before a protective stop can be unlocked [s].
        log: takes an event and its facts.
        tell: takes what every client of the primary interface is told.

    Attributes:
        mode: its state.
        stopped_at: cycle of the last protective stop.
    """

    def __init__(self, unlock_after: float, log: Callable[..., None], tell: Callable[[Notice], None]) -> None:
        self.mode = SafetyMode.NORMAL
        self.stopped_at = 0
        self._reduced = False
        self._unlock_after, self._log, self._tell = unlock_after, log, tell

    def protective_stop(self, reason: str, cause: StopCause, cycle: int) -> bool:
        """Begin a protective stop; return False where the arm may not move anyway."""
        if self.mode not in MOVING:
            return False
        self._enter(SafetyMode.PROTECTIVE_STOP)
        self.stopped_at = cycle
        self._log("protective_stop", reason=reason, cause=str(cause))
        self._tell(ErrorNotice(cause.code, cause.argument, Report.WARNING, reason))
        return True

    def unlock(self, cycle: int, early: bool) -> bool:
        """End a protective stop; return False where it is too early, and that is not allowed."""
        if self.mode is SafetyMode.PROTECTIVE_STOP:
            if not early and (cycle - self.stopped_at) * CYCLE < self._unlock_after:
                return False
            self._log("unlocked")
            self._release()
        return True

    def open_safeguard(self) -> bool:
        """Begin a safeguard stop; return False where the arm may not move anyway."""
        if self.mode not in MOVING:
            return False
        self._enter(SafetyMode.SAFEGUARD_STOP)
        self._log("safeguard_stop")
        return True

    def close_safeguard(self) -> None:
        """End a safeguard stop."""
        if self.mode is SafetyMode.SAFEGUARD_STOP:
            self._release()

    def reduce(self, on: bool) -> None:
        """Begin or end reduced mode, now or once the arm may move."""
        self._reduced = on
        if self.mode in MOVING:
            self._release()

    def emergency_stop(self) -> None:
        """Act on the emergency stop button."""
        self._log("emergency_stop")
        self._enter(SafetyMode.ROBOT_EMERGENCY_STOP)

    def lose_plant(self, reason: str) -> None:
        """Begin a fault, because the arm is not there any more; nothing ends it."""
        self._log("plant_lost", reason=reason)
        self._enter(SafetyMode.FAULT)
        self._tell(ErrorNotice(_PLANT_LOST, 0, Report.FAULT, reason))

    def restart(self) -> bool:
        """End an emergency stop; return whether there was one."""
        if self.mode in (*MOVING, SafetyMode.PROTECTIVE_STOP, SafetyMode.FAULT):
            return False
        self.mode = SafetyMode.NORMAL
        return True

    def _release(self) -> None:
        self._enter(SafetyMode.REDUCED if self._reduced else SafetyMode.NORMAL)

    def _enter(self, mode: SafetyMode) -> None:
        self.mode = mode
        self._tell(SafetyNotice(mode))
