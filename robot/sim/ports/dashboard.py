"""Dashboard server of the simulated controller: a line in, a line out. No sockets.

The clients compare replies word for word; they end with a newline alone. In local control what acts is refused. A
command that a version of the software does not have is not understood. Source: Universal Robots, "Dashboard Server,
port 29999" (CB3) and "Dashboard Server e-Series".
"""

from __future__ import annotations

from collections.abc import Callable

from coneskin.robot.sim.machine.controller import POWER_COMMANDS
from coneskin.robot.sim.machine.states import Runtime, Version, has_since
from coneskin.robot.sim.urscript.values import ScriptError

from .rtde import BUGFIX_VERSION, BUILD_NUMBER
from .user_interface import NO_MODE, SERIAL_NUMBER, UserInterface

#: line that the server sends when a client connects
WELCOME = "Connected: Universal Robots Dashboard Server"
#: reply to an unlock that comes too early
_UNLOCK_REFUSED = (
    "Cannot unlock protective stop until 5s after occurrence. Always inspect cause of protective stop before unlocking"
)
#: reply to a command that acts, in local control; and on a connection that was opened in it
_LOCAL_REFUSAL = (
    "Command is not allowed due to safety reasons, "
    "please switch robot to Remote Control mode and reconnect to port 29999"
)
_REMOTE_COMMANDS = {
    *POWER_COMMANDS,
    *("load", "load installation", "play", "pause", "stop", "shutdown"),
    *("close safety popup", "unlock protective stop"),
}
_USER_ROLES = ("PROGRAMMER", "OPERATOR", "NONE", "LOCKED", "RESTRICTED")
_OPERATIONAL_MODES = ("MANUAL", "AUTOMATIC")
_NO_VERSION = None
#: command -> first minor version of PolyScope 5 that has it, and of CB3; all others have it since 5.0 and 3.0
_FIRST_VERSIONS: dict[str, tuple[int | None, int | None]] = {
    "clear operational mode": (0, _NO_VERSION),
    "generate flight report": (8, 13),
    "generate support file": (8, 13),
    "get operational mode": (6, _NO_VERSION),
    "get robot model": (6, 12),
    "get serial number": (6, 12),
    "getUserRole": (_NO_VERSION, 1),
    "is in remote control": (6, _NO_VERSION),
    "load installation": (0, 2),
    "restart safety": (1, 7),
    "safetystatus": (4, _NO_VERSION),
    "saveLog": (8, 13),
    "set operational mode": (0, _NO_VERSION),
    "setUserRole": (_NO_VERSION, 1),
    "version": (0, _NO_VERSION),
}


class Dashboard:
    """Dashboard of one controller, for one client.

    Attributes:
        left: True once the client has said ``quit``.
    """

    def __init__(self, interface: UserInterface) -> None:
        self._i = interface
        self._c = interface.controller
        self.left = False
        self._opened_local = not interface.controller.remote_control
        major, minor = interface.controller.options.version
        version = f"{major}.{minor}.{BUGFIX_VERSION}.{BUILD_NUMBER}"
        self._commands: dict[str, Callable[[str], str]] = {
            "PolyscopeVersion": lambda _: f"URSoftware {version} (Jan 01 2026)",
            "addToLog": self._add_to_log,
            "clear operational mode": self._clear_operational_mode,
            "close popup": lambda _: "closing popup",
            "close safety popup": lambda _: "closing safety popup",
            "generate flight report": lambda kind: f"Flight Report generated with id: {self._i.report(kind)}",
            "generate support file": self._support_file,
            "get loaded program": lambda _: (
                f"Loaded program: {self._i.loaded.path}" if self._i.loaded is not None else "No program loaded"
            ),
            "get operational mode": lambda _: self._i.operational_mode,
            "get robot model": lambda _: self._c.arm.model.name.removesuffix("e"),
            "get serial number": lambda _: SERIAL_NUMBER,
            "getUserRole": lambda _: self._i.user_role,
            "is in remote control": lambda _: str(self._c.remote_control and self._c.options.remote_enabled).lower(),
            "isProgramSaved": lambda _: f"true {self._i.program_name}",
            "load": self._load,
            "load installation": self._load_installation,
            "pause": lambda _: "Pausing program" if self._c.pause_program() else "Failed to execute: pause",
            "play": lambda _: "Starting program" if self._i.play() else "Failed to execute: play",
            "popup": self._popup,
            "programState": lambda _: f"{self._c.runtime.word} {self._i.program_name}",
            "quit": self._quit,
            "robotmode": lambda _: f"Robotmode: {self._c.robot_mode.name}",
            "running": lambda _: f"Program running: {str(self._c.runtime is Runtime.PLAYING).lower()}",
            "safetymode": lambda _: f"Safetymode: {self._c.safety.name}",
            "safetystatus": lambda _: f"Safetystatus: {self._c.safety.name}",
            "saveLog": self._save_log,
            "set operational mode": self._set_operational_mode,
            "setUserRole": self._set_user_role,
            "shutdown": self._shut_down,
            "stop": self._stop,
            "unlock protective stop": lambda _: "Protective stop releasing" if self._c.unlock() else _UNLOCK_REFUSED,
            "version": lambda _: version,
        }
        for name in POWER_COMMANDS:
            self._commands[name] = lambda _, command=name: self._c.switch_power(command)  # type: ignore[misc]

    def answer(self, line: str) -> str:
        """Act on one line of the client, without its newline; return the reply, likewise."""
        command = line.strip()
        self._c.log("dashboard", line=command)
        words = command.split(" ")
        for count in range(min(4, len(words)), 0, -1):  # the longest command that the line begins with
            name = " ".join(words[:count])
            if name in self._commands and available(name, self._c.options.version):
                if name in _REMOTE_COMMANDS and (self._opened_local or not self._c.remote_control):
                    self._c.log("refused", line=command, reason="local control")
                    return _LOCAL_REFUSAL
                return self._commands[name](" ".join(words[count:]).strip())
        return f"could not understand: '{command}'"

    # programs

    def _load(self, name: str) -> str:
        try:
            self._i.load(name)
        except FileNotFoundError:
            return f"File not found: {name}"
        except (OSError, ScriptError) as exc:
            self._c.log("refused", program=name, reason=str(exc))
            return f"Error while loading program: {name}"
        return f"Loading program: {name}"

    def _load_installation(self, name: str) -> str:
        if not name.endswith(".installation") or not self._i.folder.has(name):
            return f"File not found: {name}"
        self._i.stop("another installation was loaded")
        return f"Loading installation: {name}"

    def _stop(self, _: str) -> str:
        self._i.stop("dashboard")
        return "Stopped"

    # windows, log, modes

    def _popup(self, text: str) -> str:
        self._c.log("popup", text=text, title="")
        return "showing popup"

    def _add_to_log(self, text: str) -> str:
        if not text:
            return "No log message to add"
        self._i.messages.append(text)
        return "Added log message"

    def _save_log(self, _: str) -> str:
        try:
            self._i.save_log()
        except OSError:
            return "Failed to save log"
        return "Log saved to disk"

    def _support_file(self, folder: str) -> str:
        try:
            return f"Completed successfully: {self._i.support_file(folder)}"
        except OSError as exc:
            return f"Error: {folder} is not a folder that can be written ({type(exc).__name__})"

    def _set_operational_mode(self, mode: str) -> str:
        if mode.upper() not in _OPERATIONAL_MODES:
            return f"Failed setting operational mode: {mode}"
        self._i.operational_mode = mode.upper()
        return f"Operational mode {mode.upper()} is set"

    def _clear_operational_mode(self, _: str) -> str:
        self._i.operational_mode = NO_MODE
        return f"No longer controlling the operational mode. Current operational mode: {NO_MODE}."

    def _set_user_role(self, role: str) -> str:
        if role.upper() not in _USER_ROLES:
            return f"Failed setting user role: {role}"
        self._i.user_role = role.upper()
        return f"Setting user role: {role}"

    def _quit(self, _: str) -> str:
        self.left = True
        return "Disconnected"

    def _shut_down(self, _: str) -> str:
        self._c.switch_power("power off")
        return "Shutting down"


def available(command: str, version: Version) -> bool:
    """Return whether a version of the software has a command."""
    return has_since(version, *_FIRST_VERSIONS.get(command, (0, 0)))
