"""Sockets of the simulated controller, what stands behind each port, and the loop that keeps its 500 Hz cycle.

One thread and `select`: its timeout is exact to microseconds, that of epoll is rounded up to whole milliseconds.
"""

from __future__ import annotations

import errno
import gc
import json
import os
import re
import selectors
import socket
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from functools import partial
from typing import Any

from coneskin.core.errors import RobotRefused

from .compiler import Compiler
from .machine.controller import Controller
from .machine.states import PORTS, READ_ONLY, SCRIPT_PORTS
from .motion.arm import CYCLE
from .ports.client import MAX_MESSAGES, UNREAD_TIMEOUT, Client, LineReader
from .ports.client_interface import ScriptPort, due_packets, greeting, interpreter_reply
from .ports.dashboard import WELCOME, Dashboard
from .ports.rtde import RtdeOutputs, RtdeSession
from .ports.user_interface import UserInterface
from .urscript.translator import Translation

_STATE_PORTS = (*SCRIPT_PORTS, *(name + READ_ONLY for name in SCRIPT_PORTS))
_WITH_NUMBERS = ("resist A A A A A A", "digital input NUMBER 0 or 1", "analog input NUMBER VALUE")
#: word of a line -> the services that it means
_SERVICE_PORTS = {
    "rtde": ("RTDE",),
    "dashboard": ("dashboard",),
    "scripts": SCRIPT_PORTS,
    "network": tuple(PORTS),
}


class _FaultInjector:
    """Faults of the controller and of its network that a test switches by lines of text; each answers a line of JSON.

    A frozen controller is not among them: `SimulatedController.freeze` stops the process, and with it the arm. A cut
    network leaves the arm alive: no packet goes through in either direction, nothing is closed, nothing can be opened.

    Args:
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
            "local control": lambda: controller.switch_control(False),
            "remote control": lambda: controller.switch_control(True),
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
        """Return what a line does that gives numbers to the joints, or one to an input."""
        lines = r"resist((?: NUMBER){6})|(digital|analog) input (\d{1,3}) (NUMBER)"
        match = re.fullmatch(lines.replace("NUMBER", r"-?\d+(?:\.\d*)?(?:e-\d+)?"), command)
        if match is None:
            return None
        if match[1]:
            return partial(self._resist, [float(current) for current in match[1].split()])
        index, value, terminals = int(match[3]), float(match[4]), self._c.terminals
        if match[2] == "analog":
            return partial(terminals.apply_analog, index, value)
        return partial(terminals.apply_digital, index, value != 0.0) if value in (0.0, 1.0) else None

    def _resist(self, currents: list[float]) -> list[float]:
        """Let the motors take so much current beyond the model of the arm [A]."""
        self._c.resistance[:] = currents
        return currents

    def _set(self, name: str, value: bool) -> bool:
        setattr(self, name, value)
        return value


def _each(action: Callable[[str], int | None], names: tuple[str, ...]) -> int | bool:
    """Do something to services; return how many connections that has closed, or True where it closes none."""
    closed = [count for name in names if (count := action(name)) is not None]
    return sum(closed) if closed else True


def _service(name: str) -> str:
    return name.removesuffix(READ_ONLY)


_MAX_LATENESS = 0.05  # s; later cycles are skipped, not made up for: the process was frozen
_MAX_MADE_UP = 10  # late cycles between two looks at the sockets
_LOOPBACK_PREFIX = "127."  # of every address that no other computer can reach
_ACCEPT_BACKLOG = 16  # connections that wait to be accepted
_MAX_CLIENTS = 50  # of each service
#: bytes of one client that are read at a time. What a client has sent whose connection it resets, as ur_rtde does
#: after each upload, is lost unless it is read at once; lines of the dashboard are dear, and their clients wait
_READ_SIZE, _DASHBOARD_READ_SIZE = 65536, 4096


def is_loopback(host: str) -> bool:
    """Return whether no other computer can have an address."""
    return host.startswith(_LOOPBACK_PREFIX) or host == "localhost"


class Server:
    """Server on the ports of a UR controller, which also runs its control cycle.

    Args:
        host: address to listen on.
        faults: whether to open a port on which `FaultInjector` takes lines. It is open to this computer alone.

    Attributes:
        fault_address: address and port of that; None without one.
        local: True where only this computer can reach the controller.
    """

    def __init__(self, controller: Controller, host: str, *, faults: bool = False) -> None:
        self.controller = controller
        self.host = host
        self.faults = _FaultInjector(controller, {"close": self.drop_all, "cut": self.cut, "restore": self.restore})
        self.fault_address: tuple[str, int] | None = None
        self.local = True
        self._with_faults = faults
        self._selector = selectors.SelectSelector()
        self._listeners: dict[str, socket.socket] = {}
        self._clients: dict[str, list[Client]] = {name: [] for name in (*PORTS, "faults")}
        self._compiler = Compiler()
        self._interface = UserInterface(controller, self._program, self._compiler.check)
        self._outputs = RtdeOutputs(controller)
        self._cut: set[str] = set()  # services that the network does not reach
        self._fillers: dict[str, socket.socket] = {}
        self._programs = 0
        self._remote = controller.remote_control
        self._stopping = False

    # open and close

    def __enter__(self) -> Server:
        with ExitStack() as undo:
            undo.callback(self.close)
            address = (self.host, 0)
            for name, port in self.controller.options.services.items():
                address = self._listen(name, self.host, port)
            self.local = is_loopback(address[0])
            self.controller.beyond = not self.local
            if self._with_faults:
                self.fault_address = self._listen("faults", self.host if self.local else "127.0.0.1", 0)
            undo.enter_context(self._compiler)
            undo.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._compiler.__exit__()
        self.close()

    def close(self) -> None:
        """Close every socket."""
        for name in PORTS:
            self.restore(name)  # what is cut is not in the selector
        for key in list(self._selector.get_map().values()):
            self._selector.unregister(key.fileobj)
            key.fileobj.close()  # type: ignore[union-attr]

    def stop(self) -> None:
        """End `run` after the present cycle."""
        self._stopping = True

    def _listen(self, name: str, host: str, port: int) -> tuple[str, int]:
        sock = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        if os.name == "posix":  # elsewhere this option would let two servers share a port
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            sock.bind((host, port))
            sock.listen(_ACCEPT_BACKLOG)
        except OSError as exc:
            sock.close()
            taken = exc.errno == errno.EADDRINUSE
            advice = (
                "UR's ports are fixed: end the controller that has this one, or"
                if taken
                else "it is not this computer's:"
            )
            raise RobotRefused(
                f"the simulated controller cannot listen on {host} port {port} ({name}): {exc.strerror}; {advice} "
                "choose another address, such as 127.0.0.2 (arm.host of a scene, --host of sim-ur and demo)"
            ) from exc
        sock.setblocking(False)
        self._listeners[name] = sock
        self._selector.register(sock, selectors.EVENT_READ, name)
        address: tuple[str, int] = sock.getsockname()
        return address

    # network

    def cut(self, name: str) -> None:
        """Let the network drop every packet of a service: nothing is read, sent or accepted, nothing is closed."""
        if name in self._cut or name not in self._listeners:
            return
        self._cut.add(name)
        listener = self._listeners[name]
        for sock in (listener, *(client.socket for client in self._clients[name])):
            self._selector.unregister(sock)
        listener.listen(0)  # Linux drops the packets of whoever connects once the queue of one is full
        self._fillers[name] = filler = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        filler.setblocking(False)
        filler.connect_ex(listener.getsockname())

    def restore(self, name: str) -> None:
        """End `cut`: what clients have sent meanwhile arrives now, as TCP sends it again."""
        if name not in self._cut:
            return
        self._cut.remove(name)
        self._fillers.pop(name).close()
        self._listeners[name].listen(_ACCEPT_BACKLOG)
        self._selector.register(self._listeners[name], selectors.EVENT_READ, name)
        for client in self._clients[name]:
            self._selector.register(client.socket, selectors.EVENT_READ, (name, client))

    # loop

    def run(self, alive: Callable[[], bool] = lambda: True) -> None:
        """Run the control cycle until `stop`, or until alive(), called five times a second, returns False."""
        self.controller.outside_time = time.monotonic
        gc.collect()
        gc.freeze()  # what exists now stays: the garbage collector need not look at it again within a cycle
        asked = 0
        due = time.monotonic() + CYCLE
        while not self._stopping:
            wait = due - time.monotonic()
            if wait > 0.0:
                self._poll(wait)
                continue
            self._poll(0.0)
            if wait < -_MAX_LATENESS:
                before, due = due, time.monotonic()
                self.controller.hold_up(due - before)  # without it its states would look ever later than they are
            for _ in range(_MAX_MADE_UP):  # clients are read even where a program takes more time than there is
                if due > time.monotonic():
                    break
                self._cycle()
                due += CYCLE
            self._publish()
            if self.controller.cycle >= asked + 100:
                asked = self.controller.cycle
                if not alive():
                    return

    def _poll(self, timeout: float) -> None:
        for key, _ in self._selector.select(timeout):
            if isinstance(key.data, str):
                self._accept(key.fileobj, key.data)  # type: ignore[arg-type]
            else:
                self._read(key.data[0], key.data[1])

    def _cycle(self) -> None:
        for number, result in self._compiler.results():
            if not isinstance(result, Translation):
                self.controller.fail("", result)
            elif result.secondary or number == self._programs:  # a program is not started once a newer one has come
                self.controller.load(result)
        self._interface.turn()
        self.controller.update()
        if self._remote and not self.controller.remote_control:  # what is opened from now on is read-only
            for name in SCRIPT_PORTS:
                self.drop_all(name)
        self._remote = self.controller.remote_control

    def _publish(self) -> None:
        names = [name for name in _STATE_PORTS if self._clients[name] and name not in self._cut]
        due = due_packets(self.controller, frozenset(map(_service, names)))
        for name in names:
            state, messages = due.get(_service(name), (b"", b""))
            for client in list(self._clients[name]) if state or messages else ():
                late = len(client.unsent)  # one that does not read misses states, and in the end messages too
                self._send(name, client, (b"" if late else state) + (messages if late < MAX_MESSAGES else b""))
        if self.faults.rtde_silent or "RTDE" in self._cut:
            return
        now = time.monotonic()
        for client in list(self._clients["RTDE"]):
            if client.unsent:  # a slow client misses packets, and gets the newest when it reads again
                if now - client.stuck_since > UNREAD_TIMEOUT:
                    self._drop("RTDE", client)
                    continue
                self._send("RTDE", client, b"")
            elif client.outputs is not None:
                self._send("RTDE", client, client.outputs())

    # clients

    def _accept(self, listener: socket.socket, name: str) -> None:
        if name in self._cut:
            return
        try:
            sock, _ = listener.accept()
        except OSError:
            return
        if len(self._clients[name]) >= _MAX_CLIENTS:
            sock.close()
            return
        client = self._client(name, sock)
        self._clients[name].append(client)
        self._selector.register(sock, selectors.EVENT_READ, (name, client))
        self._send(name, client, self._greeting(name))

    def _client(self, name: str, sock: socket.socket) -> Client:
        """Return a new client of a service."""
        if name == "RTDE":
            session = RtdeSession(self.controller, self._outputs)
            return Client(sock, session.receive, session.close, outputs=session.outputs, patience=UNREAD_TIMEOUT)
        if name == "dashboard":
            dashboard = Dashboard(self._interface)

            def reply(line: str) -> str:
                text = dashboard.answer(line)
                return "" if self.faults.dashboard_silent else text

            return Client(sock, LineReader(reply), left=lambda: dashboard.left)
        if name == "faults":
            return Client(sock, LineReader(self.faults.answer))
        if name == "interpreter":
            return Client(sock, LineReader(partial(interpreter_reply, self.controller)))
        kind = _service(name)
        port = ScriptPort(self.controller, self._program, messages=kind == "primary", read_only=name != kind)
        return Client(sock, port, left=lambda: port.left)

    def _greeting(self, name: str) -> bytes:
        """Return what a new client of a service gets first."""
        if name == "dashboard" and not self.faults.dashboard_silent:
            return WELCOME.encode() + b"\n"
        return greeting(self.controller, _service(name)) if name in _STATE_PORTS else b""

    def _read(self, name: str, client: Client) -> None:
        if client not in self._clients[name] or name in self._cut:
            return  # dropped, or cut, while this batch of events was handled
        try:
            data = client.socket.recv(_DASHBOARD_READ_SIZE if name == "dashboard" else _READ_SIZE)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._drop(name, client)
            return
        try:
            reply = client.receive(data)
        except Exception as exc:  # whatever a client sends ends its connection, never the controller
            self.controller.log("dropped", service=name, reason=f"{type(exc).__name__}: {exc}"[:1000])
            self._drop(name, client)
            return
        self._send(name, client, reply)
        if client.left():
            self._drop(name, client)

    def _send(self, name: str, client: Client, data: bytes) -> None:
        try:
            client.send(data)
        except OSError:
            self._drop(name, client)

    def _drop(self, name: str, client: Client) -> None:
        if client in self._clients[name]:
            self._clients[name].remove(client)
            if name not in self._cut:
                self._selector.unregister(client.socket)
            client.socket.close()
            client.closed()

    def drop_all(self, name: str) -> int:
        """Close all connections of a port, and return how many there were."""
        clients = list(self._clients[name])
        for client in clients:
            self._drop(name, client)
        return len(clients)

    # programs

    def _program(self, text: str) -> None:
        first = text.lstrip().partition("\n")[0].strip()
        self.controller.log("script", first_line=first, size=len(text))
        secondary = first.startswith("sec ")
        if not secondary:
            self._programs += 1
            self.controller.program_arrived()
        self._compiler.submit(self._programs, text, secondary=secondary)
