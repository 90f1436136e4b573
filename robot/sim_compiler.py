"""Where programs are translated: short ones at once, long ones in a process of their own.

ur_rtde's program is 50 kB and takes about 40 ms to translate. In the controller's process that would hold up 20 control
cycles, and a client that watches the age of the controller's data would take it for a lost connection.
"""

from __future__ import annotations

import marshal
import pickle
import signal
import struct
import subprocess
import sys
import threading
from queue import SimpleQueue
from typing import IO

from .sim_builtins import Builtins
from .sim_mended import MENDED
from .sim_urscript import Translation, translate
from .sim_values import ScriptError

__all__ = ["Compiler"]

AT_ONCE = 4000  #: programs up to this length are translated in place: about a millisecond [characters]
_SIZE = struct.Struct(">I")

#: The number of the program, and what became of it.
Result = tuple[int, Translation | ScriptError]


class Compiler:
    """Text in, programs out; one seen before comes at once. Use it in a ``with``: it has a process and a thread."""

    def __init__(self, quirks: str) -> None:
        self._mend = quirks == "fixed"
        self._known: dict[str, Translation] = {}
        self._todo: SimpleQueue[tuple[int, str] | None] = SimpleQueue()
        self._done: SimpleQueue[Result] = SimpleQueue()
        self._thread = threading.Thread(target=self._translate_long_ones, daemon=True)

    def __enter__(self) -> Compiler:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._todo.put(None)
        self._thread.join()

    def submit(self, number: int, text: str) -> None:
        """A program to translate; its number comes back with it from `results`."""
        if text in self._known:
            self._done.put((number, self._known[text]))
        elif len(text) <= AT_ONCE:
            try:
                self._done.put((number, _translate(text, self._mend)))
            except ScriptError as exc:
                self._done.put((number, exc))
        else:
            self._todo.put((number, text))

    def results(self) -> list[Result]:
        """What has been translated since the last call."""
        ready = []
        while not self._done.empty():
            ready.append(self._done.get())
        return ready

    def _translate_long_ones(self) -> None:
        with subprocess.Popen(
            [sys.executable, "-c", "from coneskin.robot.sim_compiler import serve; serve()"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        ) as worker:
            source, target = worker.stdin, worker.stdout
            if source is None or target is None:
                raise RuntimeError("the translating process has no pipes")
            while (job := self._todo.get()) is not None:
                number, text = job
                _send(source, pickle.dumps((text, self._mend)))
                name, secondary, code, problem = pickle.loads(target.read(_SIZE.unpack(target.read(_SIZE.size))[0]))
                if problem:
                    self._done.put((number, ScriptError(problem)))
                else:
                    self._known[text] = Translation(name, secondary, marshal.loads(code))
                    self._done.put((number, self._known[text]))


def serve() -> None:
    """The other process: translate what comes on stdin until it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the controller, which ends this process
    source, target = sys.stdin.buffer, sys.stdout.buffer
    while len(head := source.read(_SIZE.size)) == _SIZE.size:
        text, mend = pickle.loads(source.read(_SIZE.unpack(head)[0]))
        try:
            made = _translate(text, mend)
            answer = (made.name, made.secondary, marshal.dumps(made.code), "")
        except ScriptError as exc:
            answer = ("", False, b"", str(exc))
        _send(target, pickle.dumps(answer))


def _translate(text: str, mend: bool) -> Translation:
    return translate(text, Builtins.names(), Builtins.blocking(), MENDED if mend else None)


def _send(pipe: IO[bytes], data: bytes) -> None:
    pipe.write(_SIZE.pack(len(data)) + data)
    pipe.flush()
