"""Power of the simulated arm: on, off, brakes released. It changes at once; a real arm takes seconds."""

from __future__ import annotations

from coneskin.robot.sim.machine.safety import MOVING, RobotMode

from .controller import Controller

__all__ = ["POWER_COMMANDS", "power"]

#: commands that change the power of the arm
POWER_COMMANDS = ("power on", "power off", "brake release", "restart safety")


def power(controller: Controller, command: str) -> str:
    """Carry out one of `POWER_COMMANDS`; return what the dashboard answers."""
    if command == "power off":
        controller.stop_program("power off")
        controller.robot_mode = RobotMode.POWER_OFF
        return "Powering off"
    if command == "restart safety":
        if controller.safety_system.restart():
            controller.robot_mode = RobotMode.POWER_OFF
        return "Restarting safety"
    if controller.safety in MOVING:
        if command == "brake release":
            controller.robot_mode = RobotMode.RUNNING
        elif controller.robot_mode is RobotMode.POWER_OFF:
            controller.robot_mode = RobotMode.IDLE
    return "Brake releasing" if command == "brake release" else "Powering on"
