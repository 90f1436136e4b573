"""Stop of one arm under guard: why, by which stop paths, and whether the arm stands and may be called latched. Pure."""

from __future__ import annotations

import math

from coneskin.robot.driver.messages import EndReaction, StopProgram
from coneskin.robot.driver.state import ControllerState
from coneskin.robot.driver.stop_path import StopPath
from coneskin.robot.stop.limits import MonitoringLimits
from coneskin.robot.stop.standstill import WATCH, StandstillWatch

from .signals.contact import Contact
from .signals.journal import EventName
from .signals.outputs import Outputs, emit
from .stop_escalation import StopEscalation

__all__ = ["ArmStop"]


class ArmStop:
    """Newest stop of one arm, from its cause to the latched arm.

    Args:
        limits: of the monitoring.
        paths: the stop paths that there are, in the order of their use.

    Attributes:
        number: counted from 1; a motion away and its end belong to the stop before.
        why: its cause, and what came of it.
        escalation: one stop path after the other, until the arm stands.
        watch: of the arm that stands.
    """

    def __init__(self, limits: MonitoringLimits, paths: tuple[StopPath, ...]) -> None:
        self.number = 0
        self.why = ""
        self.escalation = StopEscalation(limits, paths)
        self.watch = StandstillWatch(limits.standstill)
        self._others_move = StopPath.DRIVER not in paths

    def again(self, what: str) -> str:
        """Return why an arm is stopped, once there is another reason: the first, which is the cause, and the newest."""
        return f"{self.why.partition('; then ')[0]}; then {what}"

    def send(self, command: StopProgram | EndReaction, out: Outputs) -> None:
        """Send a stop; nothing is looked at before."""
        self.escalation.send(command, self.watch.insists, out)

    def begin(self, now: float, speed: float | None, deceleration: float) -> None:
        """Begin to monitor the stop that was sent; arguments as of ``StopEscalation.begin``."""
        self.escalation.begin(now, speed, deceleration)
        self.watch.end()

    def report(self, now: float, why: str, contact: Contact | None, out: Outputs) -> None:
        """Report a stop that was sent.

        Args:
            now: host time [s].
            why: its cause.
            contact: for which it was sent, or None.
            out: takes the event.
        """
        self.why = why
        named = {} if contact is None else {"contact": contact.summary()}
        emit(out, EventName.STOPPING, now, why=why, stop=self.number, **named)

    def stands(self, state: ControllerState, measured_at: float, out: Outputs) -> bool:
        """Take a measured state of a stop under way; return whether the arm stands, which begins the watch.

        Args:
            state: as measured.
            measured_at: host time of the measurement [s].
            out: takes events.
        """
        if not self.escalation.sample(state, measured_at, out):
            return False
        self.watch.begin(state.time, math.inf)
        return True

    def stay(self, why: str, state: ControllerState) -> None:
        """Let the arm stand: at once where no other program can start, else to the end of a watch."""
        self.why = why
        watched = self._others_move or self.escalation.unconfirmed(state)
        self.watch.begin(state.time, WATCH if watched else 0.0)

    def latched(self, state: ControllerState, out: Outputs) -> bool:
        """Tell whether the arm has kept standing for long enough to be called latched, and report that it is."""
        if not (self.watch.confirmed or state.stopped_by_safety):
            return False
        if self.escalation.unconfirmed(state):
            self.why += "; the controller does not show the protective stop"
        emit(out, EventName.LATCHED, state.time, why=self.why, stop=self.number)
        return True
