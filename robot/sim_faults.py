"""Faults that a test can call for while the simulated controller runs: a line in, a line of JSON out.

A frozen controller or a cut cable needs nothing here: stop the process with SIGSTOP (`SimulatedController.freeze`).
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from .sim_controller import Controller

if TYPE_CHECKING:
    from .sim_server import Server

__all__ = ["Faults"]


class Faults:
    """What is wrong with the controller's network, and the lines that change it.

    Attributes:
        dashboard_silent: the dashboard takes connections and commands, and answers nothing.
        rtde_silent: RTDE connections stay open, and no outputs are sent.
    """

    def __init__(self, controller: Controller, server: Server) -> None:
        self._c = controller
        self.dashboard_silent = False
        self.rtde_silent = False
        self._lines: dict[str, Callable[[], Any]] = {
            "state": controller.describe,
            "close rtde": lambda: server.drop_all("RTDE"),
            "close dashboard": lambda: server.drop_all("dashboard"),
            "close scripts": lambda: sum(server.drop_all(name) for name in ("primary", "secondary", "realtime")),
            "dashboard silent": lambda: self._set("dashboard_silent", True),
            "dashboard normal": lambda: self._set("dashboard_silent", False),
            "rtde silent": lambda: self._set("rtde_silent", True),
            "rtde normal": lambda: self._set("rtde_silent", False),
            "protective stop": lambda: controller.protective_stop("called for"),
            "emergency stop": controller.emergency_stop,
        }

    def answer(self, line: str) -> str:
        """Act on one line. Returns JSON: the result, or the lines that there are."""
        command = line.strip()
        self._c.log("fault", line=command)
        action = self._lines.get(command)
        if action is None:
            return json.dumps({"error": f"unknown fault {command!r}", "known": sorted(self._lines)})
        return json.dumps({"result": action()})

    def _set(self, name: str, value: bool) -> bool:
        setattr(self, name, value)
        return value
