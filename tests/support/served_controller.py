"""Simulated controller in a thread of the test: for clients in Python, which let it run beside them.

The ur_rtde wheel does not: it needs `SimulatedController`, a process.
"""

from __future__ import annotations

import gc
import io
import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from coneskin.robot.sim.machine.controller import Controller
from coneskin.robot.sim.machine.states import Options
from coneskin.robot.sim.process import free_host
from coneskin.robot.sim.server import Server


class ServedController:
    """Address of a controller that is served, its log, and the faults that it takes."""

    def __init__(self, server: Server, log: io.StringIO) -> None:
        self.host = server.host
        self._server, self._log = server, log

    def call(self, line: str) -> dict[str, Any]:
        """Inject a fault; return its result, or what is wrong."""
        answer: dict[str, Any] = json.loads(self._server.faults.answer(line))
        return answer

    def events(self, kind: str) -> list[dict[str, Any]]:
        """Return the events of one kind in the log so far."""
        events = [json.loads(line) for line in self._log.getvalue().splitlines(keepends=True) if line.endswith("\n")]
        return [event for event in events if event["event"] == kind]


@contextmanager
def served(**options: Any) -> Iterator[ServedController]:
    """Run a controller with these `Options` until the end of the ``with``."""
    log = io.StringIO()
    with Server(Controller(Options(**options), log), free_host()) as server:
        thread = threading.Thread(target=server.run)
        thread.start()
        try:
            yield ServedController(server, log)
        finally:
            server.stop()
            thread.join()
            gc.unfreeze()  # as a process of its own the server keeps what exists at its start
