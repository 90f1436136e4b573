"""Controller, program and connections as the URScript functions see them, which are below all of these."""

from __future__ import annotations

import contextlib
import errno
import json
import socket
import time
from collections import deque
from collections.abc import Callable
from typing import IO, Any

from coneskin.robot.arm.models import arm_model
from coneskin.robot.sim.motion.arm import CYCLE, TRIGGERED, SimulatedArm, StopCause
from coneskin.robot.sim.urscript.translator import Interpreter
from coneskin.robot.sim.urscript.values import ScriptError
from coneskin.robot.ur.rtde_codec import SafetyMode

from .inputs_outputs import ClientInputs, Terminals, with_bits
from .states import Notice, Options, ProgramFailed

_PENDING_ERRORS = (errno.EINPROGRESS, errno.EALREADY, errno.EWOULDBLOCK)
_MAX_UNREAD = 65_536  # bytes that have come and that the program has not read; more wait in the network
_MAX_READS = 10  # of one connection in a control cycle; an assumption, so that a program that is sent more gives way


class ScriptSocket:
    """Connection to a server.

    Args:
        address: numeric address.

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


class CallingProgram:
    """Program as the URScript functions see it that it calls."""

    interpreter: Interpreter

    def __init__(self, name: str) -> None:
        self.name = name  #: in the program's text
        self.sockets: dict[str, ScriptSocket] = {}  #: connections that it has opened, by their names
        self.told: set[str] = set()  #: what its clients have been told is not simulated
        self.signals: dict[str, Any] = {}  #: of Modbus units, name -> value
        self.damping, self.gain_scaling = 0.025, 1.0  #: of force mode, until the program sets them

    def drive(self) -> None:
        """Claim the arm for the thread that runs now; see `Program.drive`."""
        raise NotImplementedError


_MAX_NOTICES = 1000  # that wait to be sent; a program that writes more in a cycle loses the oldest
_HISTORY_LENGTH = 500  # cycles; the range of get_actual_joint_positions_history
_REDUCED_SHARE = 0.5  # of the speed slider, in reduced mode; a real controller has limits of its own instead


def _no_rtde(name: str) -> Any:
    raise ScriptError(f"{name}: this controller has no RTDE")


def _plain(value: object) -> object:
    return list(value) if isinstance(value, list | tuple) else str(value)


class ScriptHost:
    """Controller of one arm below its programs: arm, inputs and outputs, clock and log. `Controller` is the whole.

    Args:
        log: file for a JSON line for each event.

    Attributes:
        cycle: number of control cycles since power-on.
        safety: state of the safety system.
        slider: share at which the speed slider stands, 0..1.
        inputs: what clients write.
        notices: what clients are still to be told.
        history: measured joint positions of the last cycles, oldest first [rad].
        outside_time: returns the time of those outside [s]; late cycles are made up for in less of it.
        rtde_value: returns the value of an output of RTDE, which those set who know these.
        frozen: time in which no cycle ran though its clock went on [s].
        beyond: whether programs may connect to other computers.
    """

    def __init__(self, options: Options, log: IO[str] | None = None) -> None:
        self.options = options
        self.cycle = 0
        self.arm = SimulatedArm(arm_model(options.model), options.start_q)
        self.arm.deceleration = options.deceleration
        self.safety = SafetyMode.NORMAL
        self.slider = 1.0
        self.inputs = ClientInputs(self.log, options.fieldbus)
        self.inputs.watchdog_delay = options.watchdog_delay
        self.output_ints = [0] * 48
        self.output_doubles = [0.0] * 48
        self.digital_outputs = 0
        self.terminals = Terminals()
        self.gravity: tuple[float, ...] = (0.0, 0.0, 9.82)
        self.payload = 0.0
        self.payload_cog: tuple[float, ...] = (0.0, 0.0, 0.0)
        self.payload_inertia: tuple[float, ...] = (0.0,) * 6
        self.notices: deque[Notice] = deque(maxlen=_MAX_NOTICES)
        self.history: deque[list[float]] = deque([list(self.arm.q)], maxlen=_HISTORY_LENGTH)
        self.outside_time: Callable[[], float] = lambda: self.timestamp
        self.rtde_value: Callable[[str], Any] = _no_rtde
        self.frozen = 0.0
        self.beyond = False
        self._log = log

    @property
    def timestamp(self) -> float:
        """Time since power-on [s]."""
        return self.cycle * CYCLE + self.frozen

    @property
    def steptime(self) -> float:
        """Control cycle, in which each thread of a program takes one turn [s]."""
        return self.options.steps * CYCLE

    @property
    def speed_scaling(self) -> float:
        """Share of the commanded speeds at which paths run; the safety system's own stops are not in it."""
        return self.slider * _REDUCED_SHARE if self.safety is SafetyMode.REDUCED else self.slider

    def set_digital(self, bit: int, on: bool) -> None:
        """Switch digital outputs: bits 0-7 standard, 8-15 configurable, 16-17 tool."""
        self.digital_outputs = with_bits(self.digital_outputs, bit, on)
        self.log("digital", outputs=self.digital_outputs)

    def tell(self, notice: Notice) -> None:
        """Keep a notice until the server sends it to every client of the primary interface."""
        self.notices.append(notice)

    def fail(self, program: str, problem: ScriptError) -> None:
        """Report a program that cannot be run, or that has failed."""
        self.log("abort", program=program, reason=str(problem))
        self.tell(ProgramFailed(problem.title, problem.line, problem.column))

    def log(self, event: str, **facts: Any) -> None:
        """Write one JSON line: cycle, controller time, this machine's monotonic clock, event and its facts."""
        if self._log is not None:
            now, here = round(self.timestamp, 3), time.monotonic()
            line = {"cycle": self.cycle, "time": now, "monotonic": here, "event": event}
            self._log.write(json.dumps(line | facts, default=_plain) + "\n")

    def pause_program(self) -> bool:
        """Hold the program and the arm; return False where no program plays."""
        raise NotImplementedError

    def protective_stop(self, reason: str, cause: StopCause = TRIGGERED) -> None:
        """Stop the arm as its safety system does."""
        raise NotImplementedError
