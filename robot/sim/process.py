"""Process of a simulated controller, for a test or a demonstration.

    with SimulatedController(host="127.0.0.2", start_q=(0, -1.2, 1.4, -1.6, -1.5, 0)) as simulated:
        receive = RTDEReceiveInterface(simulated.host)

It is a process of its own because the constructors of ur_rtde hold Python's lock: a thread could never answer them.
"""

from __future__ import annotations

import json
import math
import os
import queue
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Container, Sequence
from pathlib import Path
from typing import Any

from coneskin.core.child_process import OwnedProcess
from coneskin.core.errors import RobotConnectionError, RobotTimeout

from .machine.states import DEFAULT_MODEL, PORTS


def free_host(used: Container[str] = ()) -> str:
    """Return a loopback address on which no other simulated controller listens, so that several can run at once.

    Linux answers on all of 127.0.0.0/8; elsewhere there may be 127.0.0.1 alone.

    Args:
        used: addresses not to return again, even if nothing listens there any more.
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
    raise RobotConnectionError("no loopback address is free for a simulated controller; 20 000 were tried")


class SimulatedController(OwnedProcess):
    """Simulated UR controller as a process of its own; use it in a ``with``.

    Args:
        model: name of the arm.
        host: address to listen on; controllers at 127.0.0.1, 127.0.0.2 ... can run at once.
        start_q: joint positions at the start [rad]; clear of every singular position if not given.
        log: file for a JSON line for each command and event.
        plant: line to what its targets move, closed here on entry (``motion/plant.py``); without one the arm
            follows them exactly. POSIX only.
        ready_within: time allowed until it listens [s].
        options: those of ``coneskin sim-ur`` by their names, such as ``unlock_after_s=1, closed=["dashboard"]``; one
            that has no value is True, as in ``fieldbus=True``.

    Raises:
        RobotTimeout: on entry, it is not ready in time.
        RobotConnectionError: on entry, it did not start; the message says why.
    """

    _process_name = "the simulated controller"

    def __init__(
        self,
        model: str = DEFAULT_MODEL,
        host: str = "127.0.0.1",
        start_q: Sequence[float] | None = None,
        *,
        log: Path | None = None,
        plant: socket.socket | None = None,
        ready_within: float = 15.0,
        **options: object,
    ) -> None:
        self.host = host
        self.log = log
        self.ready_within = ready_within
        self.facts: dict[str, Any] = {}
        self._plant = plant
        options |= {"host": host, "model": model, "log": log}
        options["start_q_deg"] = None if start_q is None else [math.degrees(q) for q in start_q]
        self._arguments: list[str] = []
        for name, value in options.items():
            if value is not None and value is not False:
                values = value if isinstance(value, list | tuple) else () if value is True else (value,)
                self._arguments += [f"--{name.replace('_', '-')}", *map(str, values)]

    def __enter__(self) -> SimulatedController:
        command = [sys.executable, "-m", "coneskin.robot.sim.command", "--json", "--faults", "--exit-with-parent"]
        lines_to_plant = () if self._plant is None else (self._plant.fileno(),)
        self._process = process = subprocess.Popen(
            [*command, *self._arguments, *(f"--plant-descriptor={number}" for number in lines_to_plant)],
            pass_fds=lines_to_plant,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,  # Ctrl-C is for the program, which ends this process once the arm stands
        )
        if self._plant is not None:
            self._plant.close()
        assert process.stdout is not None
        lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        threading.Thread(target=lambda line: lines.put(line()), args=[process.stdout.readline], daemon=True).start()
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

    def call(self, line: str, timeout: float = 5.0) -> Any:
        """Inject a fault, or ask for the state; docs/look-up/sim-ur.md lists the lines.

        Raises:
            RobotConnectionError: the process has ended, or does not know the line.
        """
        try:
            with socket.create_connection(tuple(self.facts["fault_address"]), timeout) as sock:
                sock.sendall(line.encode() + b"\n")
                reply = json.loads(sock.makefile().readline() or "{}")
        except OSError as exc:
            raise RobotConnectionError(f"the simulated controller on {self.host} does not answer: {exc}") from exc
        if "result" not in reply:
            raise RobotConnectionError(f"the simulated controller refuses {line!r}: {reply.get('error', 'no answer')}")
        return reply["result"]

    def state(self) -> dict[str, Any]:
        """Return joint positions [rad], speeds [rad/s], and the state of program and safety system."""
        state: dict[str, Any] = self.call("state")
        return state

    def events(self, kind: str = "") -> list[dict[str, Any]]:
        """Return the events in the log so far, all or those of one kind.

        Raises:
            ValueError: the controller was made without ``log``.
        """
        if self.log is None:
            raise ValueError("events need a SimulatedController with log=, a file to write them to")
        lines = self.log.read_text().splitlines() if self.log.exists() else []
        events = [json.loads(line) for line in lines if line.endswith("}")]
        return [event for event in events if not kind or event["event"] == kind]

    def wait_for_standstill(self, timeout: float = 10.0) -> dict[str, Any]:
        """Wait until no joint turns, and return the state.

        Raises:
            RobotTimeout: the arm still moves after the timeout [s].
        """
        deadline = time.monotonic() + timeout
        while (state := self.state())["turning"]:
            if time.monotonic() > deadline:
                raise RobotTimeout(f"the simulated arm still moves after {timeout:g} s")
            time.sleep(0.005)
        return state
