"""Start a simulated controller for a test or a demonstration, and be sure that it ends.

    with SimulatedController(host="127.0.0.2", start_q=(0, -1.2, 1.4, -1.6, -1.5, 0)) as simulated:
        receive = RTDEReceiveInterface(simulated.host)

It is a process of its own because ur_rtde's constructors keep Python's lock: in a thread it could never answer them.
"""

from __future__ import annotations

import json
import math
import os
import queue
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Container, Sequence
from pathlib import Path
from typing import Any

from coneskin.errors import RobotConnectionError, RobotTimeout

from .sim_server import PORTS

__all__ = ["SimulatedController", "free_host"]


def free_host(used: Container[str] = ()) -> str:
    """A loopback address on which no other simulated controller listens, so that tests can run side by side.

    Linux answers on all of 127.0.0.0/8; elsewhere there may be 127.0.0.1 alone.

    Args:
        used: addresses not to take again, though nobody listens there any more.
    """
    if not sys.platform.startswith("linux"):
        return "127.0.0.1"
    start = os.getpid() * 7
    for number in range(start, start + 20_000):
        host = f"127.{1 + number // 62500 % 250}.{number // 250 % 250}.{1 + number % 250}"
        if host in used:
            continue
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((host, PORTS["RTDE"]))
            except OSError:
                continue
            return host
    raise RobotConnectionError("no loopback address is free for a simulated controller: 20 000 were tried")


class SimulatedController:
    """The simulated UR controller as a process, in a ``with``.

    Args:
        model: the arm.
        host: address to listen on; 127.0.0.1, 127.0.0.2 ... can run side by side.
        start_q: joint positions at the start [rad]; a pose clear of singular positions if not given.
        log: file for a JSON line of every command and event.
        version: PolyScope version to report.
        quirks: "real" or "fixed".
        start_delay: from a program's last byte to its first cycle [s].
        unlock_after: time before a protective stop can be unlocked [s].
        protective_stop: "pause" or "stop": what one does to the running program.
        program: URScript file that the dashboard's play starts.
        ready_within: time allowed until it listens [s].
    """

    def __init__(
        self,
        model: str = "ur10e",
        host: str = "127.0.0.1",
        start_q: Sequence[float] | None = None,
        *,
        log: Path | None = None,
        version: str = "5.25",
        quirks: str = "real",
        start_delay: float = 0.010,
        unlock_after: float = 5.0,
        protective_stop: str = "pause",
        program: Path | None = None,
        ready_within: float = 15.0,
    ) -> None:
        self.host = host
        self.log = log
        self.ready_within = ready_within
        self.facts: dict[str, Any] = {}
        self._process: subprocess.Popen[str] | None = None
        self._arguments = [
            *("--host", host, "--model", model, "--version", version, "--quirks", quirks),
            *("--start-delay-ms", repr(start_delay * 1000.0), "--unlock-after-s", repr(unlock_after)),
            *("--protective-stop", protective_stop),
        ]
        if start_q is not None:
            self._arguments += ["--start-q-deg", *(repr(math.degrees(q)) for q in start_q)]
        if log is not None:
            self._arguments += ["--log", str(log)]
        if program is not None:
            self._arguments += ["--program", str(program)]

    def __enter__(self) -> SimulatedController:
        command = [sys.executable, "-m", "coneskin.robot.sim_command", "--json", "--exit-with-parent"]
        self._process = process = subprocess.Popen(
            [*command, *self._arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,  # a terminal's Ctrl-C is for the program, which ends this when the arm stands
        )
        lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        threading.Thread(target=lambda: lines.put(_first_line(process)), daemon=True).start()
        try:
            line = lines.get(timeout=self.ready_within)
        except queue.Empty:
            self.close()
            raise RobotTimeout(
                f"the simulated controller on {self.host} was not ready within {self.ready_within:g} s"
            ) from None
        if not line:
            _, problem = process.communicate()
            self.close()
            raise RobotConnectionError(f"the simulated controller did not start: {problem.strip() or 'no message'}")
        self.facts = json.loads(line)
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def pid(self) -> int:
        """The process id."""
        return self._running().pid

    def freeze(self) -> None:
        """Stop it in its tracks, as a cut cable would; `thaw` lets it go on. POSIX only."""
        os.kill(self.pid, signal.SIGSTOP)

    def thaw(self) -> None:
        """Let it go on after `freeze`."""
        os.kill(self.pid, signal.SIGCONT)

    def kill(self) -> None:
        """End it without a goodbye, as a power cut would."""
        process = self._running()
        process.kill()
        process.wait()

    def call(self, line: str, timeout: float = 5.0) -> Any:
        """Call for a fault, or ask for the state; `sim_faults` lists the lines.

        Raises:
            RobotConnectionError: it has gone, or does not know the line.
        """
        try:
            with socket.create_connection((self.host, self.facts["fault_port"]), timeout) as sock:
                sock.sendall(line.encode() + b"\n")
                reply = json.loads(sock.makefile().readline() or "{}")
        except OSError as exc:
            raise RobotConnectionError(f"the simulated controller on {self.host} does not answer: {exc}") from exc
        if "result" not in reply:
            raise RobotConnectionError(f"the simulated controller refuses {line!r}: {reply.get('error', 'no answer')}")
        return reply["result"]

    def state(self) -> dict[str, Any]:
        """Joint positions [rad], speeds [rad/s], and what the controller is doing."""
        state: dict[str, Any] = self.call("state")
        return state

    def events(self, kind: str = "") -> list[dict[str, Any]]:
        """The lines of the log so far, all or of one kind of event."""
        if self.log is None:
            raise ValueError("SimulatedController needs log=... to have events")
        lines = self.log.read_text().splitlines() if self.log.exists() else []
        events = [json.loads(line) for line in lines if line.endswith("}")]
        return [event for event in events if not kind or event["event"] == kind]

    def wait_standing(self, timeout: float = 10.0) -> dict[str, Any]:
        """Wait until no joint turns; returns the state.

        Raises:
            RobotTimeout: the arm still moves.
        """
        deadline = time.monotonic() + timeout
        while any((state := self.state())["qd"]):
            if time.monotonic() > deadline:
                raise RobotTimeout(f"the simulated arm still moves after {timeout:g} s")
            time.sleep(0.005)
        return state

    def close(self) -> None:
        """End it, whatever state it is in; may be called twice."""
        process = self._process
        if process is None:
            return
        self._process = None
        if process.poll() is None:
            if hasattr(signal, "SIGCONT"):
                process.send_signal(signal.SIGCONT)  # a frozen process does not hear SIGTERM
            process.terminate()
            try:
                process.wait(2.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        for pipe in (process.stdout, process.stderr):
            if pipe is not None:
                pipe.close()

    def _running(self) -> subprocess.Popen[str]:
        if self._process is None:
            raise RobotConnectionError("the simulated controller does not run; use it in a 'with'")
        return self._process


def _first_line(process: subprocess.Popen[str]) -> str:
    return process.stdout.readline() if process.stdout is not None else ""
