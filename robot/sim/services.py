"""Services of the simulated controller: what stands behind each of its ports, for each client that connects."""

from __future__ import annotations

import socket
from collections.abc import Callable

from .fault_injection import FaultInjector
from .polyscope.dashboard import WELCOME, Dashboard
from .polyscope.http_message import RequestReader
from .polyscope.robot_api import RobotApi
from .polyscope.user_interface import UserInterface
from .ports.client import UNREAD_TIMEOUT, Client, LineReader
from .ports.publisher import Publisher
from .ports.rtde_outputs import RtdeOutputs
from .ports.rtde_session import RtdeSession
from .ports.script_port import ScriptPort

__all__ = ["SCRIPT_PORTS", "PortServices"]

SCRIPT_PORTS = ("primary", "secondary", "realtime")  #: that take URScript, and send the state


class PortServices:
    """Services of one controller.

    Args:
        interface: its PolyScope, behind dashboard and robot API.
        faults: takes the lines of its port, and silences the dashboard.
        publisher: makes what a new client gets first.
    """

    def __init__(self, interface: UserInterface, faults: FaultInjector, publisher: Publisher) -> None:
        self._interface, self._faults, self._publisher = interface, faults, publisher
        self._controller = interface.controller
        self._outputs = RtdeOutputs(self._controller)
        self._api = RobotApi(interface)

    def client(self, name: str, sock: socket.socket) -> Client:
        """Return a new client of a service."""
        if name == "RTDE":
            session = RtdeSession(self._controller, self._outputs)
            return Client(sock, session.receive, session.close, outputs=session.outputs, patience=UNREAD_TIMEOUT)
        if name == "dashboard":
            dashboard = Dashboard(self._interface)
            return Client(sock, LineReader(self._unless_silent(dashboard.answer)), left=lambda: dashboard.left)
        if name == "robot API":
            return Client(sock, RequestReader(self._api.answer))
        if name == "faults":
            return Client(sock, LineReader(self._faults.answer))
        port = ScriptPort(self._controller, self._interface.run, messages=name == "primary")
        return Client(sock, port, left=lambda: port.left)

    def greeting(self, name: str) -> bytes:
        """Return what a new client of a service gets first."""
        if name == "dashboard" and not self._faults.dashboard_silent:
            return WELCOME.encode() + b"\n"
        return self._publisher.greeting(name) if name in SCRIPT_PORTS else b""

    def _unless_silent(self, answer: Callable[[str], str]) -> Callable[[str], str]:
        def reply(line: str) -> str:
            text = answer(line)
            return "" if self._faults.dashboard_silent else text

        return reply
