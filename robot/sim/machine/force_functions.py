"""URScript functions of forces, in a world where nothing touches the arm.

A contact is never found, freedrive holds the arm (nobody pushes it), and measured forces are 0, or what a client gives
by RTDE instead of a sensor. What would move an arm even so, a force mode with a wanted force and torques of the joints,
is not simulated: the arm holds, and the log and every client of the primary interface are told.

Source: Universal Robots, "The URScript Programming Language", modules motion, internals and interfaces.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

from coneskin.robot.sim.urscript.values import ScriptError, number, numbers, show

from .script_host import CallingProgram, ScriptHost
from .states import WARNING_REPORT, ErrorNotice

_NOT_SIMULATED = 0  # number of a log entry that only this simulator writes


class ForceFunctions:
    """URScript functions of forces."""

    _host: ScriptHost
    _program: CallingProgram

    def _tell_not_simulated(self, what: str) -> None:
        """Tell log and clients, once for each program."""
        if what not in self._program.told:
            self._program.told.add(what)
            self._host.log("not_simulated", what=what)
            self._host.tell(ErrorNotice(_NOT_SIMULATED, 0, WARNING_REPORT, f"not simulated: {what}"))

    # contact

    def tool_contact(self, direction: Any = None) -> int:
        """Return 0: no contact."""
        if direction is not None:
            numbers(direction, 6, "a direction")
        return 0

    # measured forces

    def enable_external_ft_sensor(self, enable: Any, *_: Any, **__: Any) -> None:
        """Take forces and torques from RTDE's external_force_torque."""
        self._host.inputs.external_forces = bool(enable)

    ft_rtde_input_enable = enable_external_ft_sensor

    # modes that follow a force

    def force_mode(self, task_frame: Any, selection_vector: Any, wrench: Any, type: Any, limits: Any) -> None:
        """Follow forces along the selected axes: nothing touches the arm, and it holds."""
        numbers(task_frame, 6, "a task frame")
        numbers(limits, 6, "limits")
        if int(type) not in (1, 2, 3):
            raise ScriptError(f"the type of a force mode is 1, 2 or 3, got {show(type)}")
        selected = numbers(selection_vector, 6, "a selection vector")
        if any(on and wanted for on, wanted in zip(selected, numbers(wrench, 6, "a wrench"), strict=True)):
            self._tell_not_simulated("the motion of force_mode with a wanted force; the arm holds")

    def force_mode_set_damping(self, damping: float) -> None:
        """Set the damping of force mode, 0..1: no effect."""
        self._program.damping = min(1.0, max(0.0, number(damping, "a damping")))

    def force_mode_get_damping(self) -> float:
        """Return the damping of force mode."""
        return self._program.damping

    def force_mode_set_gain_scaling(self, scaling: float) -> None:
        """Set the gain of force mode, 0..2: no effect."""
        self._program.gain_scaling = min(2.0, max(0.0, number(scaling, "a scaling")))

    def force_mode_get_gain_scaling(self) -> float:
        """Return the gain of force mode."""
        return self._program.gain_scaling

    def direct_torque(
        self,
        torque: Any,
        friction_comp: Any = True,  # noqa: ARG002
        viscous_scale: Any = None,  # noqa: ARG002
        coulomb_scale: Any = None,  # noqa: ARG002
    ) -> Generator[None, None, None]:
        """Let torques act on the joints for a cycle, beside gravity [N m]: the arm holds."""
        wanted = numbers(torque, 6, "joint torques")
        self._program.drive()
        if any(wanted):
            self._tell_not_simulated("the motion by direct_torque; the arm holds")
        yield

    def set_gravity(self, d: Any) -> None:
        """Set the direction of gravity [m/s^2]: no effect on an arm that follows its path exactly."""
        self._host.gravity = tuple(numbers(d, 3, "gravity"))
