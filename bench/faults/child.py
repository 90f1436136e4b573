"""Child process of a trial of the fault campaign, which takes and sends lines of JSON."""

from __future__ import annotations

import json
import queue
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any


class Child:
    """Process that takes and sends lines of JSON."""

    def __init__(self, *arguments: str, folder: Path | None = None) -> None:
        self._process = subprocess.Popen(
            [sys.executable, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=folder,
            start_new_session=True,  # Linux divides its time among sessions; one for all would hold them all up
        )
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._threads = [threading.Thread(target=self._read), threading.Thread(target=self._read_errors)]
        self.errors = ""
        for thread in self._threads:
            thread.start()

    @property
    def pid(self) -> int:
        return self._process.pid

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if line.startswith("{"):  # the wheel prints lines of its own
                self._lines.put(line)

    def _read_errors(self) -> None:
        assert self._process.stderr is not None
        self.errors = self._process.stderr.read()

    def say(self, **request: Any) -> None:
        assert self._process.stdin is not None
        with suppress(BrokenPipeError):
            self._process.stdin.write(json.dumps(request) + "\n")
            self._process.stdin.flush()

    def hear(self, timeout: float) -> dict[str, Any]:
        """Return the next answer; empty if there is none in time."""
        with suppress(queue.Empty):
            answer: dict[str, Any] = json.loads(self._lines.get(timeout=timeout))
            return answer
        return {}

    def ask(self, **request: Any) -> dict[str, Any]:
        self.say(**request)
        return self.hear(5.0)

    def close(self, patience: float = 0.0) -> bool:
        """End the process; return whether it ended by itself within the patience [s]."""
        assert self._process.stdin is not None
        with suppress(OSError):
            self._process.stdin.close()
        try:
            self._process.wait(patience)
            ended = True
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
            ended = False
        for thread in self._threads:
            thread.join()
        for pipe in (self._process.stdout, self._process.stderr):
            if pipe is not None:
                pipe.close()
        return ended
