"""Inputs of a guard that its controller sends: states, the speed slider, answers to the heartbeat. Pure."""

from __future__ import annotations

from typing import TYPE_CHECKING

from coneskin.core.recording.block import Block

from .companion_monitor import CompanionMonitor
from .fault_register import FaultRegister
from .phase import Phase
from .signals.journal import EventName
from .signals.outputs import Outputs, emit

if TYPE_CHECKING:
    from coneskin.robot.driver.state import ControllerState

    from .arm_supervisor import ArmSupervisor

__all__ = ["ControllerInputs"]


class ControllerInputs:
    """Inputs that the controller of an arm under guard sends.

    Args:
        arm: the arm under guard.
        companions: monitor of the processes beside the guard.
        faults: takes what the controller shows to be wrong.
    """

    def __init__(self, arm: ArmSupervisor, companions: CompanionMonitor, faults: FaultRegister) -> None:
        self._arm = arm
        self._companions = companions
        self._faults = faults

    def take_arm(self, block: Block, out: Outputs) -> None:
        """Take a state of the arm, as it was sent."""
        driver = self._arm.driver
        what = "the controller's state cannot be read"
        state = self._faults.decode(block, what, lambda payload: driver.decode_state(block.time, payload), out)
        if state is not None:
            self.take_state(state, out)

    def take_state(self, state: ControllerState, out: Outputs) -> None:
        """Take a state of the arm."""
        now = state.time
        self._arm.sample(state, out)
        if state.stopped_by_safety and self._arm.phase.watched:
            self._faults.add(now, "the controller's own safety system has stopped the arm", out)
        elif not state.powered and self._arm.phase.watched:
            self._faults.add(now, "the arm is not powered any more, or its brakes are closed", out)
        if ended := self._companions.program_ended(now, state.program_running):
            self._faults.add(now, ended, out)
        self._check_heartbeat(now, state.program_running, out)

    def take_slider(self, block: Block, out: Outputs) -> None:
        """Take the position of the speed slider."""
        decode = self._arm.driver.decode_speed_fraction
        fraction = self._faults.decode(block, "the speed slider cannot be read", decode, out)
        if fraction is not None:
            self._arm.speed_reduction.note(block.time, fraction)

    def take_echo(self, block: Block, out: Outputs) -> None:
        """Take the program's answer to the heartbeat."""
        if self._arm.heartbeat is None:
            return
        what = "the program's answer to the heartbeat cannot be read"
        count = self._faults.decode(block, what, self._arm.driver.decode_heartbeat, out)
        if count is not None:
            self._arm.heartbeat.note(count)

    def _check_heartbeat(self, now: float, running: bool, out: Outputs) -> None:
        """Look whether the program ends by itself where no packet reaches the controller."""
        heartbeat = self._arm.heartbeat
        if heartbeat is None:
            return
        heartbeat.sample(now, running)
        if self._arm.phase not in (Phase.ACTIVE, Phase.SLOWED) or not (trouble := heartbeat.trouble(now)):
            return
        if heartbeat.required:
            self._faults.add(now, trouble, out)
        else:
            emit(out, EventName.MESSAGE, now, what=trouble)
