"""The dashboard server of the simulated controller: a line in, a line out. No sockets in here.

Replies are compared word for word by ur_rtde's DashboardClient; they end with a newline alone.
"""

from __future__ import annotations

from collections.abc import Callable

from .sim_controller import Controller
from .sim_safety import RobotMode, Runtime, SafetyMode

__all__ = ["WELCOME", "answer"]

WELCOME = "Connected: Universal Robots Dashboard Server"
UNLOCK_LATER = (
    "Cannot unlock protective stop until 5s after occurrence. Always inspect cause of protective stop before unlocking"
)


def answer(controller: Controller, line: str, play: Callable[[], bool]) -> str:
    """Act on one line of a client.

    Args:
        controller: what is asked about, or told.
        line: the command, without its newline.
        play: starts the loaded program; returns False where there is none.

    Returns:
        the reply, without its newline.
    """
    command = line.strip()
    controller.log("dashboard", line=command)
    word, _, rest = command.partition(" ")
    state = _STATES.get(command)
    if state is not None:
        return state(controller)
    if word == "load":
        return f"Loading program: {rest}"
    if command == "play":
        if controller.resume_program() or (controller.runtime is not Runtime.PAUSED and play()):
            return "Starting program"
        return "Failed to execute: play"
    if command == "pause":
        return "Pausing program" if controller.pause_program() else "Failed to execute: pause"
    if command == "stop":
        controller.stop_program("dashboard")
        return "Stopped"
    if command == "unlock protective stop":
        return "Protective stop releasing" if controller.unlock() else UNLOCK_LATER
    if command in _POWER:
        return _power(controller, command)
    if word in _ACCEPTED or command in _ACCEPTED:
        return _ACCEPTED[word if word in _ACCEPTED else command]
    return f"could not understand: '{command}'"


def _version(controller: Controller) -> str:
    major, minor = controller.options.version
    return f"URSoftware {major}.{minor}.0.1 (Jan 01 2026)"


def _program_state(controller: Controller) -> str:
    name = controller.program.name if controller.program is not None else "<unnamed>"
    state = {Runtime.PLAYING: "PLAYING", Runtime.PAUSED: "PAUSED"}.get(controller.runtime, "STOPPED")
    return f"{state} {name}"


def _model(controller: Controller) -> str:
    return controller.arm.model.name.removesuffix("e")


_STATES: dict[str, Callable[[Controller], str]] = {
    "PolyscopeVersion": _version,
    "version": _version,
    "get serial number": lambda _: "20250000001",
    "get robot model": _model,
    "is in remote control": lambda _: "true",
    "running": lambda c: f"Program running: {str(c.runtime is Runtime.PLAYING).lower()}",
    "programState": _program_state,
    "get loaded program": lambda c: "Loaded program: play.script" if c.options.program else "No program loaded",
    "isProgramSaved": lambda _: "True <unnamed>",
    "robotmode": lambda c: f"Robotmode: {c.robot_mode.name}",
    "safetymode": lambda c: f"Safetymode: {c.safety.name}",
    "safetystatus": lambda c: f"Safetystatus: {c.safety.name}",
}

_ACCEPTED = {
    "popup": "showing popup",
    "close popup": "closing popup",
    "close safety popup": "closing safety popup",
    "addToLog": "Added log message",
    "setUserRole": "Setting user role",
    "quit": "Disconnected",
    "shutdown": "Shutting down",
}

_POWER = ("power on", "power off", "brake release", "restart safety")


def _power(controller: Controller, command: str) -> str:
    if command == "power off":
        controller.stop_program("power off")
        controller.robot_mode = RobotMode.POWER_OFF
        return "Powering off"
    if command == "restart safety":
        if controller.safety not in (SafetyMode.NORMAL, SafetyMode.PROTECTIVE_STOP):
            controller.safety = SafetyMode.NORMAL
            controller.robot_mode = RobotMode.POWER_OFF
        return "Restarting safety"
    if controller.safety is SafetyMode.NORMAL:
        if command == "brake release":
            controller.robot_mode = RobotMode.RUNNING
        elif controller.robot_mode is RobotMode.POWER_OFF:
            controller.robot_mode = RobotMode.IDLE
    return "Brake releasing" if command == "brake release" else "Powering on"
