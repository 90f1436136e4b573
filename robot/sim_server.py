"""The sockets of the simulated controller, and the loop that keeps its 500 Hz cycle.

One thread and `select`: its timeout is exact to microseconds, that of epoll is rounded up to whole milliseconds.
"""

from __future__ import annotations

import gc
import os
import selectors
import socket
import time
from collections.abc import Callable
from contextlib import ExitStack

from coneskin.errors import RobotRefused

from .sim_arm import CYCLE
from .sim_compiler import Compiler
from .sim_controller import Controller
from .sim_dashboard import WELCOME, answer
from .sim_faults import Faults
from .sim_outputs import Outputs
from .sim_rtde import RtdeSession
from .sim_urscript import Translation, complete_programs

__all__ = ["PORTS", "Server"]

PORTS = {"RTDE": 30004, "dashboard": 29999, "primary": 30001, "secondary": 30002, "realtime": 30003}
CATCH_UP = 0.05  #: a cycle that is later than this is not made up for: the process was frozen [s]
UNREAD = 10.0  #: a client that reads nothing for this long is dropped [s]


class _Client:
    """One connection."""

    def __init__(self, sock: socket.socket, receive: Callable[[bytes], bytes], closed: Callable[[], None]) -> None:
        self.socket, self.receive, self.closed = sock, receive, closed
        self.unsent = b""
        self.stuck_since = 0.0

    def send(self, data: bytes) -> None:
        self.unsent += data
        if not self.unsent:
            return
        try:
            sent = self.socket.send(self.unsent)
        except BlockingIOError:
            sent = 0
        self.unsent = self.unsent[sent:]
        if sent or not self.stuck_since:
            self.stuck_since = time.monotonic()


class Server:
    """Listens on the ports of a UR controller, and runs one.

    Attributes:
        fault_port: where `Faults` listens for lines; chosen by the system.
    """

    def __init__(self, controller: Controller, host: str) -> None:
        self.controller = controller
        self.host = host
        self.faults = Faults(controller, self)
        self.fault_port = 0
        self._outputs = Outputs(controller)
        self._selector = selectors.SelectSelector()
        self._clients: dict[str, list[_Client]] = {name: [] for name in (*PORTS, "faults")}
        self._sessions: dict[_Client, RtdeSession] = {}
        self._compiler = Compiler(controller.options.quirks)
        self._programs = 0
        self._stopping = False

    # life

    def __enter__(self) -> Server:
        with ExitStack() as undo:
            undo.callback(self.close)
            for name, port in (*PORTS.items(), ("faults", 0)):
                self._listen(name, port)
            undo.enter_context(self._compiler)
            undo.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._compiler.__exit__()
        self.close()

    def close(self) -> None:
        """Close every socket."""
        for key in list(self._selector.get_map().values()):
            self._selector.unregister(key.fileobj)
            key.fileobj.close()  # type: ignore[union-attr]

    def stop(self) -> None:
        """End `run` after the present cycle."""
        self._stopping = True

    def _listen(self, name: str, port: int) -> None:
        sock = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        if os.name == "posix":  # elsewhere this option would let two servers share a port
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            sock.bind((self.host, port))
            sock.listen(16)
        except OSError as exc:
            sock.close()
            raise RobotRefused(
                f"the simulated controller cannot listen on {self.host} port {port} ({name}): {exc.strerror}; ur_rtde "
                "knows no other ports, so use another --host such as 127.0.0.2"
            ) from exc
        sock.setblocking(False)
        if name == "faults":
            self.fault_port = sock.getsockname()[1]
        self._selector.register(sock, selectors.EVENT_READ, name)

    # the loop

    def run(self, alive: Callable[[], bool] = lambda: True) -> None:
        """Keep the cycle until `stop`, or until alive(), asked five times a second, says no."""
        gc.collect()
        gc.freeze()  # what is there now stays: no collection in the cycle need look at it again
        asked = 0
        due = time.monotonic() + CYCLE
        while not self._stopping:
            wait = due - time.monotonic()
            if wait > 0.0:
                self._poll(wait)
                continue
            self._poll(0.0)
            if wait < -CATCH_UP:
                due = time.monotonic()
            while due <= time.monotonic():
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
                self.controller.log("abort", program="", reason=str(result))
            elif result.secondary or number == self._programs:  # one that another has overtaken is not started
                self.controller.load(result)
        self.controller.step()

    def _publish(self) -> None:
        if self.faults.rtde_silent:
            return
        now = time.monotonic()
        for client, session in list(self._sessions.items()):
            if client.unsent:  # skip what a slow client could not read; it gets the newest when it can
                if now - client.stuck_since > UNREAD:
                    self._drop("RTDE", client)
                    continue
                self._send("RTDE", client, b"")
            else:
                self._send("RTDE", client, session.outputs())

    # clients

    def _accept(self, listener: socket.socket, name: str) -> None:
        try:
            sock, _ = listener.accept()
        except OSError:
            return
        sock.setblocking(False)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if name == "RTDE":
            session = RtdeSession(self.controller, self._outputs)
            client = _Client(sock, session.receive, session.close)
            self._sessions[client] = session
        elif name == "dashboard":
            client = _Client(sock, _Lines(self._dashboard), _nothing)
        elif name == "faults":
            client = _Client(sock, _Lines(self.faults.answer), _nothing)
        else:
            client = _Client(sock, self._script_port(), _nothing)
        self._clients[name].append(client)
        self._selector.register(sock, selectors.EVENT_READ, (name, client))
        if name == "dashboard" and not self.faults.dashboard_silent:
            self._send(name, client, WELCOME.encode() + b"\n")

    def _read(self, name: str, client: _Client) -> None:
        if client not in self._clients[name]:
            return  # dropped while this batch of events was handled
        try:
            data = client.socket.recv(65536)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._drop(name, client)
            return
        self._send(name, client, client.receive(data))

    def _send(self, name: str, client: _Client, data: bytes) -> None:
        try:
            client.send(data)
        except OSError:
            self._drop(name, client)

    def _drop(self, name: str, client: _Client) -> None:
        if client in self._clients[name]:
            self._clients[name].remove(client)
            self._sessions.pop(client, None)
            self._selector.unregister(client.socket)
            client.socket.close()
            client.closed()

    def drop_all(self, name: str) -> int:
        """Close all connections of a port. Returns how many there were."""
        clients = list(self._clients[name])
        for client in clients:
            self._drop(name, client)
        return len(clients)

    # what the ports do

    def _dashboard(self, line: str) -> str:
        reply = answer(self.controller, line, self._play)
        return "" if self.faults.dashboard_silent else reply

    def _play(self) -> bool:
        text = self.controller.options.program
        if text and self.controller.program is None:
            self._program(text)
        return bool(text)

    def _script_port(self) -> Callable[[bytes], bytes]:
        rest = ""

        def receive(data: bytes) -> bytes:
            nonlocal rest
            programs, rest = complete_programs(rest + data.decode("utf-8", "replace"))
            for text in programs:
                self._program(text)
            return b""

        return receive

    def _program(self, text: str) -> None:
        first = text.lstrip().partition("\n")[0].strip()
        self.controller.log("script", first_line=first, size=len(text))
        if not first.startswith("sec "):
            self._programs += 1
            self.controller.arriving()
        self._compiler.submit(self._programs, text)


class _Lines:
    """Bytes in, answers to whole lines out."""

    def __init__(self, answer_line: Callable[[str], str]) -> None:
        self._answer = answer_line
        self._rest = b""

    def __call__(self, data: bytes) -> bytes:
        *lines, self._rest = (self._rest + data).split(b"\n")
        replies = (self._answer(line.decode("utf-8", "replace").rstrip("\r")) for line in lines)
        return b"".join([reply.encode() + b"\n" for reply in replies if reply])


def _nothing() -> None:
    """Nothing to give back."""
