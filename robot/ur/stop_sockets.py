"""Stop sockets: the stop paths that work on any program, opened before they are needed and independent of ur_rtde.

| stop path | how |
|---|---|
| program | a program of one ``stopj`` on the primary interface; it replaces the one that runs, whatever started it |
| command | the dashboard's ``stop`` |
| slider | the speed slider at 0, over an RTDE connection that is opened for it; the guard has one of its own |
| protective | ``protective_stop()`` twice: in a program that replaces the one that runs, and in a secondary program |

A secondary program runs beside the main one and no upload replaces it, so that a sender which starts its program again
at once cannot keep the protective stop away. Whether a controller takes the call there is measured by
scripts/measure_controller.py; where it does not, the program before it does the same as long as nobody replaces it.

A controller in local control refuses the programs and the dashboard's stop. A switch to it closes the connection for
programs, and one that is opened meanwhile stays read-only, also after the switch back: each program over it is answered
by C210, which the primary interface alone says. So both are proven at the start, by what moves nothing: a secondary
program writes an output register, and the dashboard answers "is in remote control". It is asked again and again, and
its refusal of a stop counts as an answer. Software that does not know the question has no local control. PolyScope X
has no dashboard.

Source: UR script manual, dashboard server manual, client interface (messages of errors), issue 459 of Universal Robots'
ROS driver (what a switch closes); which of these stops which motion was measured in a simulation
(docs/safety.md, "Stop paths").
"""

from __future__ import annotations

import socket
import struct
import time
from types import MappingProxyType
from typing import Self

from coneskin.core.errors import RobotConnectionError, RobotRefused
from coneskin.robot.driver.tcp import TcpStops
from coneskin.robot.driver.values import SetpointProgram, StopPath

from .rtde_codec import RobotMode
from .rtde_connection import RtdeConnection

_SLIDER_TIMEOUT = 0.2  # s for connecting, and for each reply, where the slider is used
_MAX_ANSWER = 1024  # bytes of a line of the dashboard
_PROTECTIVE_PROGRAM = """def coneskin_stop():
  protective_stop()
end
sec coneskin_protective():
  protective_stop()
end
"""
_PROOF_REGISTER = 47  # integer output register
_PROOF_REPEAT = 0.25  # s after which the program is sent again: another guard may have written the register meanwhile
_PROOF_FREQUENCY = 125.0  # Hz
_MODE_QUESTION = b"is in remote control\n"
_LOCAL_REFUSAL = b"command is not allowed"  # begins the dashboard's answer to a command in local control
_LOCAL_CONTROL = (
    "is in local control: it refuses every stop by program or command. Choose Remote Control at the top right of the "
    "pendant, then start again"
)
_READ_ONLY = (
    "is read-only (C210): the controller was in local control when it was opened, or is again. Choose Remote Control "
    "at the top right of the pendant, then start again"
)
#: of an error on the primary interface: length, kind of packet, time, source, kind of message, number of the error
_ERROR_HEAD = struct.Struct(">IBQBBi")
_MESSAGE, _ERROR, _READ_ONLY_CODE = 20, 6, 210
_MAX_PACKET = 1 << 16  # bytes of one that can be; a state has some 1500
_FIRST_X = 10  # major version of PolyScope X


class StopSockets(TcpStops):
    """Two sockets and the three stops that go through them; open it in a ``with``.

    Raises:
        RobotConnectionError: on entering, where a port does not answer.
        RobotRefused: on entering, where the controller takes no stop: in local control, over read-only connections, or
            with PolyScope X.
    """

    ports = MappingProxyType({"program": 30001, "command": 29999})  # primary interface, dashboard
    advice = "enable it: Settings, Security, Services"

    def __init__(self, host: str, timeout: float = 2.0) -> None:
        super().__init__(host, timeout)
        self._said = b""  # by the dashboard, since its last whole line
        self._rest = b""  # of the primary interface, since its last whole packet
        self._read_only = False  # which it has said

    def __enter__(self) -> Self:
        self._refuse_polyscope_x()
        return super().__enter__()

    def prove(self) -> None:
        """Prove that the controller takes commands and programs."""
        self._prove_remote(self.sockets()["command"])
        self._prove_program()

    def ask(self) -> None:
        """Ask the dashboard whether the controller still takes stops, without waiting; ``drain`` takes its answer."""
        self.send("command", _MODE_QUESTION)

    def drain(self) -> list[tuple[str, socket.socket, str]]:
        """Take what the controller has said; see `TcpStops.drain`. A read-only connection is of no use either."""
        gone = [
            (name, sock, f"{why}; it does so where it is switched to local control" if name == "program" else why)
            for name, sock, why in super().drain()
        ]
        if self._read_only and (sock := self._open_ones.pop("program", None)) is not None:
            gone.append(("program", sock, f"the connection for programs of the controller {self.host} {_READ_ONLY}"))
        if any(name == "program" for name, _, _ in gone):
            self._rest, self._read_only = b"", False
        return gone

    def refusal(self, name: str, data: bytes) -> str:
        """Return that the controller is in local control, where the dashboard has said so."""
        if name == "program":
            self._look_for_read_only(data)
            return ""
        *lines, self._said = (self._said + data).split(b"\n")
        self._said = self._said[-_MAX_ANSWER:]
        local = any(line.strip().lower() == b"false" or line.lower().startswith(_LOCAL_REFUSAL) for line in lines)
        return f"the controller {self.host} {_LOCAL_CONTROL}" if local else ""

    def _look_for_read_only(self, data: bytes) -> None:
        self._rest += data
        while len(self._rest) >= _ERROR_HEAD.size:
            size, kind, _, _, message, code = _ERROR_HEAD.unpack_from(self._rest)
            if size > len(self._rest) and size <= _MAX_PACKET:
                return
            self._read_only |= (kind, message, code) == (_MESSAGE, _ERROR, _READ_ONLY_CODE)
            self._rest = self._rest[size:] if 5 <= size <= _MAX_PACKET else b""  # else it is no primary interface

    def _prove_remote(self, sock: socket.socket) -> None:
        """Wait for the dashboard's answer: a connection alone proves no stop."""
        sock.settimeout(self._timeout)
        answers: list[bytes] = []
        try:
            sock.sendall(_MODE_QUESTION)
            with sock.makefile("rb") as lines:
                while len(answers) < 2 and (line := lines.readline(_MAX_ANSWER)):  # its welcome is the first
                    answers.append(line.strip())
        except OSError:
            pass
        sock.setblocking(False)
        if len(answers) < 2:
            raise RobotConnectionError(
                f"the dashboard of the controller {self.host} (port 29999), which a stop may need, does not answer "
                f"within {self._timeout:g} s"
            )
        if answers[1].lower() == b"false":
            raise RobotRefused(f"the controller {self.host} {_LOCAL_CONTROL}")

    def _refuse_polyscope_x(self) -> None:
        with RtdeConnection(self.host, self._timeout) as connection:
            major, minor = connection.ask_version()
        if major >= _FIRST_X:
            raise RobotRefused(
                f"the controller {self.host} has PolyScope X ({major}.{minor}), which has no dashboard server to stop "
                "an arm with: coneskin does not support it. It guards arms with PolyScope 3 and 5"
            )

    def _prove_program(self) -> None:
        """Send a secondary program that writes a register, and see it written: it runs beside any other."""
        text = f"sec coneskin_proof():\n  write_output_integer_register({_PROOF_REGISTER}, %d)\nend\n"
        token, mode = time.monotonic_ns() & 0x7FFFFFFF, 0
        end, due = time.monotonic() + self._timeout, 0.0
        with RtdeConnection(self.host, self._timeout) as seen:
            recipe = seen.ask_outputs((f"output_int_register_{_PROOF_REGISTER}", "robot_mode"), _PROOF_FREQUENCY)
            seen.start()
            while (now := time.monotonic()) < end:
                if now >= due:
                    due = now + _PROOF_REPEAT
                    self.run(text % token)
                found, mode = recipe.unpack(seen.wait_data(self._timeout))  # type: ignore[assignment]
                if found == token:
                    return
        remedy = (
            f"perhaps its connection {_READ_ONLY}"
            if mode == RobotMode.RUNNING
            else "the arm is not powered, or its brakes are not released: power it on, then start again"
        )
        raise RobotRefused(
            f"the controller {self.host} has not run a test program of one line within {self._timeout:g} s, so it "
            f"would not run a stop either: {remedy}"
        )

    def use(self, path: StopPath, deceleration: float) -> bool:
        """Send one stop without waiting.

        Args:
            path: PROGRAM, COMMAND, PROTECTIVE, or SLIDER, which alone may wait, for 0.6 s at most.
            deceleration: of the leading joint [rad/s2], for PROGRAM.

        Returns:
            whether the system took the bytes; what the arm does is measured, not assumed.
        """
        if path is StopPath.COMMAND:
            return self.send("command", b"stop\n")
        if path is StopPath.SLIDER:
            from .input_writers import set_slider

            return set_slider(self.host, 0.0, _SLIDER_TIMEOUT)
        if path is StopPath.PROTECTIVE:
            return self.run(_PROTECTIVE_PROGRAM)
        return self.run(f"def coneskin_stop():\n  stopj({deceleration:.3f})\nend\n")

    def follow(self, program: SetpointProgram) -> bool:
        """Start the program that follows setpoints, without waiting; return whether the system took the bytes."""
        from .input_writers import program_text  # no part of a scene that only stops

        return self.run(program_text(program))

    def run(self, program: str) -> bool:
        """Send a program without waiting; it replaces the one that runs. Return whether the system took the bytes."""
        return self.send("program", program.encode())
