"""Faults that a test injects while the simulated controller runs: a line in, a line of JSON out.

A frozen controller is not among them: `SimulatedController.freeze` stops the process, and with it the arm. A cut
network leaves the arm alive: no packet goes through in either direction, nothing is closed, nothing can be opened.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from coneskin.core.errors import RobotRefused

from .machine.controller import Controller

__all__ = ["FaultInjector"]

_WITH_NUMBERS = ("resist JOINT AMPERES", "digital input NUMBER 0 or 1", "analog input NUMBER VALUE")
#: word of a line -> the services that it means
_SERVICE_PORTS = {
    "rtde": ("RTDE",),
    "dashboard": ("dashboard",),
    "scripts": ("primary", "secondary", "realtime"),
    "network": ("RTDE", "dashboard", "primary", "secondary", "realtime"),
}


class FaultInjector:
    """Faults of the controller and of its network, switched by lines of text.

    Args:
        controller: whose faults they are.
        network: first word of a line ("close", "cut", "restore") -> what does that to a service.

    Attributes:
        dashboard_silent: True while the dashboard takes connections and commands, but answers nothing.
        rtde_silent: True while RTDE connections stay open, but no outputs are sent.
    """

    def __init__(self, controller: Controller, network: Mapping[str, Callable[[str], int | None]]) -> None:
        self._c = controller
        self.dashboard_silent = False
        self.rtde_silent = False
        self._lines: dict[str, Callable[[], Any]] = {
            "state": controller.describe,
            "dashboard silent": lambda: self._set("dashboard_silent", True),
            "dashboard normal": lambda: self._set("dashboard_silent", False),
            "rtde silent": lambda: self._set("rtde_silent", True),
            "rtde normal": lambda: self._set("rtde_silent", False),
            "protective stop": lambda: controller.protective_stop("fault injection"),
            "emergency stop": controller.emergency_stop,
            "safeguard open": lambda: controller.safeguard(True),
            "safeguard closed": lambda: controller.safeguard(False),
            "reduced mode on": lambda: controller.reduce(True),
            "reduced mode off": lambda: controller.reduce(False),
        }
        for word, names in _SERVICE_PORTS.items():
            for verb, action in network.items():
                if (verb, word) != ("close", "network"):
                    self._lines[f"{verb} {word}"] = partial(_each, action, names)

    def answer(self, line: str) -> str:
        """Act on one line; return JSON: the result, or an error and the known lines."""
        command = line.strip()
        self._c.log("fault", line=command)
        action = self._lines.get(command) or self._with_number(command)
        if action is None:
            return json.dumps({"error": f"unknown fault {command!r}", "known": [*sorted(self._lines), *_WITH_NUMBERS]})
        try:
            return json.dumps({"result": action()})
        except RobotRefused as exc:
            return json.dumps({"error": str(exc)})

    def _with_number(self, command: str) -> Callable[[], Any] | None:
        """Return what a line does that gives a number to a joint or to an input."""
        match = re.fullmatch(r"(resist|digital input|analog input) (\d{1,3}) (-?\d+(?:\.\d*)?(?:e-\d+)?)", command)
        if match is None:
            return None
        index, value, terminals = int(match[2]), float(match[3]), self._c.terminals
        if match[1] == "resist":
            return partial(self._resist, index - 1, value) if 1 <= index <= 6 else None
        if match[1] == "analog input":
            return partial(terminals.apply_analog, index, value)
        return partial(terminals.apply_digital, index, value != 0.0) if value in (0.0, 1.0) else None

    def _resist(self, joint: int, current: float) -> list[float]:
        """Let a motor, counted from 0, take so much current beyond the model of the arm [A]; return all of them."""
        self._c.resistance[joint] = current
        return self._c.resistance

    def _set(self, name: str, value: bool) -> bool:
        setattr(self, name, value)
        return value


def _each(action: Callable[[str], int | None], names: tuple[str, ...]) -> int | bool:
    """Do something to services; return how many connections that has closed, or True where it closes none."""
    closed = [count for name in names if (count := action(name)) is not None]
    return sum(closed) if closed else True
