"""Controller, program and connections as the URScript functions see them, which are below all of these."""

from __future__ import annotations

import contextlib
import errno
import socket
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from coneskin.robot.sim.motion.arm import TRIGGERED, SimulatedArm, StopCause
from coneskin.robot.sim.urscript.translator import Interpreter
from coneskin.robot.sim.urscript.values import ScriptError

from .inputs_outputs import ClientInputs, Terminals
from .states import Notice

_PENDING_ERRORS = (errno.EINPROGRESS, errno.EALREADY, errno.EWOULDBLOCK)
_MAX_UNREAD = 65_536  # bytes that have come and that the program has not read; more wait in the network
_MAX_READS = 10  # of one connection in a control cycle; an assumption, so that a program that is sent more gives way


class ScriptSocket:
    """Connection to a server.

    Args:
        address: numeric address.
        port: of the server.

    Attributes:
        unread: bytes that have come.
        ended: the other side has closed it, or it is broken.
    """

    def __init__(self, address: str, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._peer = (address, port)
        self.unread = bytearray()
        self.ended = False
        self._cycle = self._reads = 0

    def connect(self) -> bool | None:
        """Return whether it is connected; None while that is not known yet."""
        error = self._socket.connect_ex(self._peer)
        if error in _PENDING_ERRORS:
            return None
        return error in (0, errno.EISCONN)

    def fill(self) -> None:
        """Take what has come, as far as there is room."""
        while not self.ended and (room := _MAX_UNREAD - len(self.unread)) > 0:
            try:
                data = self._socket.recv(room)
            except BlockingIOError:
                return
            except OSError:
                data = b""
            if not data:
                self.ended = True
            self.unread += data

    def gives_way(self, cycle: int) -> bool:
        """Count a read of what has come; return whether it has to wait for the next control cycle."""
        if cycle != self._cycle:
            self._cycle, self._reads = cycle, 0
        self._reads += 1
        return bool(self.unread) and self._reads > _MAX_READS

    def pop(self, count: int) -> bytes:
        """Return the first bytes of what has come, and forget them."""
        data = bytes(self.unread[:count])
        del self.unread[:count]
        return data

    def forget_if_full(self) -> None:
        """Forget what has come where it leaves no room for what a program looks for."""
        if len(self.unread) >= _MAX_UNREAD:
            self.unread.clear()

    def send(self, data: bytes) -> bool:
        """Send bytes; return False where the connection is broken, or the other side does not read."""
        if self.ended:
            return False
        try:
            sent = self._socket.send(data)
        except OSError:
            return False
        if sent < len(data):  # what follows would not be understood
            self.ended = True
        return not self.ended

    def close(self) -> None:
        """Close it."""
        self.ended = True
        with contextlib.suppress(OSError):
            self._socket.close()


class CallingProgram(Protocol):
    """Program that calls a URScript function."""

    name: str
    sockets: dict[str, ScriptSocket]
    told: set[str]
    signals: dict[str, Any]
    damping: float
    gain_scaling: float
    interpreter: Interpreter

    def drive(self) -> None:
        """Claim the arm for the thread that runs now; see `Program.drive`."""


class ScriptHost(Protocol):
    """Controller as a URScript function reads and commands it; see `Controller`."""

    cycle: int
    arm: SimulatedArm
    inputs: ClientInputs
    output_ints: list[int]
    output_doubles: list[float]
    digital_outputs: int
    terminals: Terminals
    outside_time: Callable[[], float]
    rtde_value: Callable[[str], Any]
    beyond: bool
    gravity: tuple[float, ...]
    payload: float
    payload_cog: tuple[float, ...]
    payload_inertia: tuple[float, ...]

    @property
    def steptime(self) -> float:
        """Control cycle [s]."""

    @property
    def speed_scaling(self) -> float:
        """Share of the commanded speeds at which the arm moves, 0..1."""

    @property
    def history(self) -> Sequence[list[float]]:
        """Joint positions of the last cycles, oldest first [rad]."""

    def pause_program(self) -> bool:
        """Hold the program and the arm."""

    def set_digital(self, bit: int, on: bool) -> None:
        """Switch digital outputs."""

    def protective_stop(self, reason: str, cause: StopCause = TRIGGERED) -> None:
        """Stop the arm as its safety system does."""

    def tell(self, notice: Notice) -> None:
        """Tell every client of the primary interface."""

    def fail(self, program: str, problem: ScriptError) -> None:
        """Report a program that has failed."""

    def log(self, event: str, **facts: Any) -> None:
        """Write one event to the log."""
