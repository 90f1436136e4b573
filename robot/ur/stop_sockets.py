"""Stop sockets: the stop paths that work on any program, opened before they are needed and independent of ur_rtde.

| stop path | how |
|---|---|
| program | a program of one ``stopj`` on the script port; it replaces the one that runs, whatever started it |
| command | the dashboard's ``stop`` |
| slider | the speed slider at 0, over an RTDE connection that is opened for it; the guard has one of its own |
| protective | ``protective_stop()`` twice: in a program that replaces the one that runs, and in a secondary program |

A secondary program runs beside the main one and no upload replaces it, so that a sender which starts its program again
at once cannot keep the protective stop away. Whether a controller takes the call there is measured by
scripts/measure_controller.py; where it does not, the program before it does the same as long as nobody replaces it.

A controller in local control refuses the programs and the dashboard's stop, and closes nothing; a connection that was
opened meanwhile stays read-only after the switch (C210 on the primary interface). So both are proven at the start, by
what moves nothing: a secondary program writes an output register, and the dashboard answers "is in remote control". It
is asked again and again, and its refusal of a stop counts as an answer. Software that does not know the question has no
local control. PolyScope X has no dashboard.

Source: UR script manual, dashboard server manual; which of these stops which motion was measured in a simulation
(docs/safety.md, "Stop paths").
"""

from __future__ import annotations

import socket
import time
from contextlib import suppress

from coneskin.core.errors import RobotConnectionError, RobotRefused
from coneskin.robot.driver.values import SetpointProgram, StopPath

from .rtde_connection import RtdeConnection

_REOPEN_TIMEOUT = 0.2  # s for each port; a stop over the other one waits meanwhile
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
_ARM_RUNNING = 7  # value of robot_mode
_MODE_QUESTION = b"is in remote control\n"
_LOCAL_REFUSAL = b"command is not allowed"  # begins the dashboard's answer to a command in local control
_LOCAL_CONTROL = (
    "is in local control: it refuses every stop by program or command. Choose Remote Control at the top right of the "
    "pendant, then start again"
)
_FIRST_X = 10  # major version of PolyScope X
_STOP_PORTS = {"program": 30003, "command": 29999}  # stop path -> TCP port: script interface, dashboard


class StopSockets:
    """Two sockets and the three stops that go through them; open it in a ``with``.

    Args:
        host: the controller.
        timeout: how long connecting may take [s].

    Raises:
        RobotConnectionError: on entering, where a port does not answer.
        RobotRefused: on entering, where the controller takes no stop: in local control, over read-only connections, or
            with PolyScope X.
    """

    def __init__(self, host: str, timeout: float = 2.0) -> None:
        self.host = host
        self._timeout = timeout
        self._open_ones: dict[str, socket.socket] = {}
        self._said = b""  # by the dashboard, since its last whole line

    def __enter__(self) -> StopSockets:
        try:
            self._refuse_polyscope_x()
            for name, port in _STOP_PORTS.items():
                self._open_ones[name] = self._open(port)
            self._prove_remote(self._open_ones["command"])
            self._prove_program()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close both; may be called again."""
        for sock in self._open_ones.values():
            sock.close()
        self._open_ones = {}

    def sockets(self) -> dict[str, socket.socket]:
        """Return the open sockets, by stop path. The controller sends on both: ``drain`` them."""
        return dict(self._open_ones)

    def ask(self) -> None:
        """Ask the dashboard whether the controller still takes stops, without waiting; ``drain`` takes its answer."""
        self._send("command", _MODE_QUESTION)

    def drain(self) -> list[tuple[str, socket.socket, str]]:
        """Take what the controller has sent, at most 64 kB a call and socket, without waiting.

        Returns:
            the sockets that are no longer of use, for the caller to close, and why: the controller has closed them, or
            is in local control, or the system could not take a whole program, so that the next one would not be
            understood.
        """
        gone: dict[str, str] = {}
        for name, sock in self._open_ones.items():
            try:
                data = sock.recv(1 << 16)
            except BlockingIOError:
                continue
            except OSError:
                data = b""
            if not data:
                gone[name] = f"the controller has closed the {name} connection, which a stop may need"
            elif name == "command" and self._is_local(data):
                gone = dict.fromkeys(self._open_ones, f"the controller {self.host} {_LOCAL_CONTROL}")
                break
        return [(name, self._open_ones.pop(name), why) for name, why in gone.items()]

    def _is_local(self, data: bytes) -> bool:
        """Take what the dashboard has said; tell whether that is the answer of local control."""
        *lines, self._said = (self._said + data).split(b"\n")
        self._said = self._said[-_MAX_ANSWER:]
        return any(line.strip().lower() == b"false" or line.lower().startswith(_LOCAL_REFUSAL) for line in lines)

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
            "its script port is read-only (C210): the controller was in local control when it was opened, or another "
            "program has closed it. Choose Remote Control at the top right of the pendant, then start again"
            if mode == _ARM_RUNNING
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
            return self._send("command", b"stop\n")
        if path is StopPath.SLIDER:
            from .input_writers import set_slider

            return set_slider(self.host, 0.0, _SLIDER_TIMEOUT)
        if path is StopPath.PROTECTIVE:
            return self.run(_PROTECTIVE_PROGRAM)
        return self.run(f"def coneskin_stop():\n  stopj({deceleration:.3f})\nend\n")

    def follow(self, program: SetpointProgram) -> bool:
        """Start the program that follows setpoints, without waiting; return whether the system took the bytes."""
        from .input_writers import program_text

        return self.run(program_text(program))

    def run(self, program: str) -> bool:
        """Send a program without waiting; it replaces the one that runs. Return whether the system took the bytes."""
        return self._send("program", program.encode())

    def reopen(self) -> bool:
        """Open again what has been closed, at most 0.2 s for each; return whether any was opened."""
        opened = False
        for name, port in _STOP_PORTS.items():
            if name not in self._open_ones:
                with suppress(RobotConnectionError):
                    self._open_ones[name] = self._open(port, min(self._timeout, _REOPEN_TIMEOUT))
                    opened = True
        return opened

    def _send(self, name: str, data: bytes) -> bool:
        sock = self._open_ones.get(name)
        try:
            if sock is None or sock.send(data) == len(data):
                return sock is not None
            sock.shutdown(socket.SHUT_RDWR)  # half a program: the next one would not be understood
        except OSError:
            pass
        return False

    def _open(self, port: int, timeout: float | None = None) -> socket.socket:
        try:
            sock = socket.create_connection((self.host, port), self._timeout if timeout is None else timeout)
        except OSError as exc:
            raise RobotConnectionError(
                f"cannot reach port {port} of the controller {self.host}, which a stop may need: {exc.strerror or exc}"
                "; enable it: Settings, Security, Services"
            ) from exc
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setblocking(False)
        return sock
