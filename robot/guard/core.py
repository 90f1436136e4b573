"""Core of the guard: bytes, states and time go in, commands and events come out.

One machine without input or output of its own, so that a replay of a recording is the same run again, bit by bit. It
becomes active once nothing has stood against it for a while; a touch or a fault then makes the arm react and latch
(``arm_supervisor``). Without an arm it reports touches and faults.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from coneskin.core.recording.block import Block
from coneskin.robot.driver.messages import StatusReport
from coneskin.robot.stop.limits import MonitoringLimits
from coneskin.skin.detection.events import SkinEvent, SkinFault, TouchBegan, TouchEvent
from coneskin.skin.detection.stream import TouchStream

from .activation import Activation, ActivationStep
from .companion_monitor import CompanionMonitor
from .controller_inputs import ControllerInputs
from .controller_needs import ControllerNeeds
from .event_folding import EventFolding
from .fault_register import FaultRegister
from .phase import Phase
from .port_losses import PortLosses
from .preconditions import arm_blockers, skin_blockers
from .signals.contact import GuardedSensor
from .signals.journal import BlockKind, EventName
from .signals.outputs import Outputs, emit
from .skin_connection import SkinConnection
from .skin_contacts import SkinContacts

if TYPE_CHECKING:
    from coneskin.robot.driver.state import ControllerState

    from .arm_supervisor import ArmSupervisor

__all__ = ["GuardCore"]


class GuardCore:
    """Decisions of one guard.

    Args:
        stream: decodes and detects; it knows the sensors.
        sensors: where they are.
        limits: of the monitoring.
        arm: the arm under guard, or None.
        not_commissioned: why the arm only stops where its scene lets it move away; empty where it does not.
    """

    def __init__(
        self,
        stream: TouchStream,
        sensors: Sequence[GuardedSensor],
        limits: MonitoringLimits,
        arm: ArmSupervisor | None = None,
        not_commissioned: str = "",
    ) -> None:
        self._stream = stream
        self._limits = limits
        self._arm = arm
        self._not_commissioned = not_commissioned
        self._phase = Phase.STARTING
        self._folding = EventFolding()
        self._contacts = SkinContacts(sensors, arm, self._folding)
        self._companions = CompanionMonitor(limits, arm)
        self._faults = FaultRegister(arm, self._folding)
        self._controller = None if arm is None else ControllerInputs(arm, self._companions, self._faults)
        self._connection = SkinConnection(stream)
        self._losses = PortLosses(arm, self._connection, self._companions, self._faults, self._folding)
        self._activation = Activation(limits.settle)
        self._takers: dict[int, Callable[[Block, Outputs], None]] = {
            BlockKind.SKIN: self._take_skin,
            BlockKind.DRIVER: self._take_driver,
            BlockKind.RESET: self._take_reset,
            BlockKind.LOST: self._losses.take_lost,
            BlockKind.PROGRAM: self._take_program,
            BlockKind.ABSENT: self._losses.take_absent,
            BlockKind.SUSPENDED: self._take_suspended,
            BlockKind.REOPENED: self._losses.take_reopened,
        }
        if self._controller is not None:
            self._takers[BlockKind.ARM] = self._controller.take_arm
            self._takers[BlockKind.SLIDER] = self._controller.take_slider
            self._takers[BlockKind.ECHO] = self._controller.take_echo

    @property
    def phase(self) -> Phase:
        """Phase in which the guard is."""
        return self._phase if self._arm is None else self._arm.phase

    @property
    def stream(self) -> TouchStream:
        """Skin's stream, with its detectors."""
        return self._stream

    @property
    def arm(self) -> ArmSupervisor | None:
        """Supervisor of the arm, or None."""
        return self._arm

    @property
    def needs(self) -> ControllerNeeds:
        """What it needs of the arm's controller."""
        return ControllerNeeds() if self._arm is None else self._arm.needs

    def take(self, block: Block, out: Outputs) -> None:
        """Take one input.

        Args:
            block: of a kind in ``journal.INPUTS``; its time is the host's clock.
            out: takes commands and events as soon as they are decided; a command comes before the event that explains
                it, and before anything is computed that it does not need.
        """
        taker = self._takers.get(block.kind)
        if taker is not None:
            taker(block, out)
        self._look(block.time, out)

    def blockers(self, now: float) -> list[str]:
        """Return why the guard cannot become active, one line each; empty where it can."""
        blockers = list(dict.fromkeys([*self._losses.blockers, *self._faults.messages, *self._companions.blockers]))
        blockers += self._connection.blockers
        blockers += skin_blockers(self._stream.detectors, now, self._limits.skin_silence)
        return blockers if self._arm is None else blockers + arm_blockers(self._arm, now)

    def quiet_until(self) -> float:
        """Return the host time before which nothing is decided [s], whatever quiet input comes (``quiet_inputs``)."""
        activating = self.phase is not Phase.ACTIVE or self._activation.resetting
        if activating or self._contacts.any or not self._stream.settled:
            return -math.inf
        valid = [detector.timing.valid_at + self._limits.skin_silence for detector in self._stream.detectors]
        arm = () if self._arm is None else (self._arm.quiet_until(), self._companions.quiet_until())
        return min(self._folding.due, *valid, *arm)

    def take_quiet(self, block: Block, state: ControllerState | None, out: Outputs) -> None:
        """Take a quiet input other than the skin's, without a look at what the passing of time shows.

        Args:
            block: the input.
            state: in it, where it is one.
            out: takes nothing.
        """
        if state is not None:
            assert self._controller is not None
            self._controller.take_state(state, out)
        else:
            taker = self._takers.get(block.kind)
            if taker is not None:
                taker(block, out)

    def skip_to(self, now: float) -> None:
        """Go on at a host time [s], that of the last of many quiet inputs."""
        if self._arm is not None:
            self._companions.skip_to(now)

    # ---- what comes in

    def _take_skin(self, block: Block, out: Outputs) -> None:
        for event in self._stream.feed(block.payload, block.time):
            self._skin_event(event, out)
        self._contacts.follow(block.time, self._stream.detectors, out)

    def _skin_event(self, event: SkinEvent, out: Outputs) -> None:
        if isinstance(event, SkinFault):
            if self.phase is not Phase.STARTING or not event.sensor:  # until then ``blockers`` lists it
                self._faults.add(event.time, event.message, out, f"{event.sensor}: {event.fault.value}")
            return
        assert isinstance(event, TouchEvent)
        self._contacts.note(event, out)
        if isinstance(event, TouchBegan):
            self._activation.disturb()

    def _take_driver(self, block: Block, out: Outputs) -> None:
        if self._arm is None:
            return
        note = StatusReport.decode(block.payload)
        self._companions.note_helper(block.time)
        match note.kind:
            case "ready":
                self._arm.backup_ready = True
            case "released":
                if note.text.isdecimal() and self._activation.acknowledged(int(note.text)):
                    self._activate(block.time, out)
            case "restarts" | "restarted" as restart:
                self._companions.note_restart(block.time, restart == "restarted")
            case "remark":
                emit(out, EventName.MESSAGE, block.time, what=note.text)
            case "error":
                self._companions.doubt_driver(block.time)
                self._faults.add(block.time, note.text, out)

    def _take_program(self, block: Block, _: Outputs) -> None:
        self._companions.note_program(block.time)

    def _take_suspended(self, block: Block, out: Outputs) -> None:
        """Stop an arm that nobody has guarded for a while: what came meanwhile is lost, or is too old."""
        if self.phase is not Phase.STARTING:
            seconds = block.payload.decode("ascii", "replace")
            what = "the guard did nothing for a while: the computer slept, or froze or overloaded it"
            self._faults.add(block.time, f"{what} ({seconds} s)", out, what)

    def _take_reset(self, block: Block, out: Outputs) -> None:
        """Take a manual reset, which forgives one stop: the one that a person has looked at."""
        numbers = block.payload.split()
        stop, request = map(int, numbers) if len(numbers) == 2 and all(map(bytes.isdigit, numbers)) else (0, 0)
        newest = 0 if self._arm is None else self._arm.stop_number
        blockers = []
        if self._arm is None or self.phase is not Phase.LATCHED:
            blockers.append(f"nothing to reset: the guard is {self.phase.value}")
        elif stop != newest:
            blockers.append(f"it is for stop {stop}, and stop {newest} has latched the arm: look at that first")
        elif self._activation.resetting:
            blockers.append("a reset is under way already")
        else:
            self._faults.clear()
            blockers = self.blockers(block.time)
        if blockers:
            emit(out, EventName.REFUSED, block.time, what="reset", request=request, reasons=blockers)
            return
        self._stream.forget_faults()
        self._activation.reset(block.time, request)
        emit(out, EventName.RESET, block.time, stop=stop, request=request)

    # ---- what is decided

    def _look(self, now: float, out: Outputs) -> None:
        """Decide what only the passing of time shows."""
        self._folding.look(now, out)
        for event in self._stream.silence(now, self._limits.skin_silence):
            self._skin_event(event, out)
        arm = self._arm
        if arm is not None:
            if arm.phase is not Phase.STARTING and (trouble := arm.state_age.trouble(now)):
                self._faults.add(now, trouble, out)
            self._check_companions(now, arm, out)
            if arm.phase is Phase.RETREATING:
                self._look_at_ages(now, arm, out)
            arm.look(now, out)
        if self.phase is not Phase.STARTING and not self._activation.resetting:
            return
        blockers = self.blockers(now)
        if self.phase not in (Phase.STARTING, Phase.LATCHED):
            blockers.append("something has moved the arm, or its standstill is not confirmed")
        step = self._activation.look(now, blockers, out)
        if step is ActivationStep.RELEASE and arm is None:
            self._activate(now, out)
        elif step is ActivationStep.RELEASE and arm is not None:
            arm.release(self._activation.number, out)
        elif step is ActivationStep.WITHDRAW and arm is not None:
            arm.withdraw(out)

    def _look_at_ages(self, now: float, arm: ArmSupervisor, out: Outputs) -> None:
        """End a motion away where what supervises it is too old."""
        if stale := self._contacts.stale(now, self._stream.detectors) or arm.state_age.stale(now):
            arm.abandon_motion(now, stale, out)

    def _check_companions(self, now: float, arm: ArmSupervisor, out: Outputs) -> None:
        """Stop the arm where a process beside the guard has fallen silent, by a path that does not need it."""
        for why, paths in self._companions.look(now):
            if self.phase is not Phase.STARTING:
                self._faults.add(now, why, out)
                if paths:
                    arm.lose(paths, now, for_good=False)

    def _activate(self, now: float, out: Outputs) -> None:
        self._connection.trust()
        if self._arm is None:
            self._phase = Phase.ACTIVE
        else:
            self._arm.activate(out)
        self._folding.flush(now, out)
        emit(out, EventName.ACTIVATED, now, request=self._activation.end())
        if self._not_commissioned:
            emit(out, EventName.NOT_COMMISSIONED, now, what=self._not_commissioned)
