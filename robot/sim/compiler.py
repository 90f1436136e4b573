"""Translation of programs while the controller runs: short ones at once, long ones in a process of their own.

The program of ur_rtde is 50 kB and takes about 40 ms to translate. In the controller's process that would delay 20
control cycles, and a client that monitors the age of the controller's data would take it for a lost connection.
"""

from __future__ import annotations

import contextlib
import pickle
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from queue import SimpleQueue

from .machine.builtins import Builtins
from .urscript.translator import Translation, translate
from .urscript.values import ScriptError

SIMULATOR_MEMORY = 512 * 2**20  #: bytes that the simulated controller may take beyond what it has at its start
_TRANSLATOR_MEMORY = 1024 * 2**20  # bytes for the translation of a program, likewise
_STATUS_FILE = Path("/proc/self/statm")


@contextmanager
def bounded_memory(beyond: int) -> Iterator[bool]:
    """Let this process take so many bytes more than it has now; a request for more raises MemoryError.

    Yields:
        whether that is possible: on Linux alone.
    """
    try:
        import resource

        soft, hard = resource.getrlimit(resource.RLIMIT_AS)
        now = int(_STATUS_FILE.read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (now + beyond, hard))
    except (ImportError, OSError, ValueError):
        yield False
        return
    try:
        yield True
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


_TRANSLATION_TIME = 10.0  # s; a translation that takes longer is ended, and the program refused
_MAX_KNOWN = 100  # programs whose translation is kept
_IN_PLACE_LENGTH = 4000  # characters; a shorter program is translated in place, in about a millisecond
_IN_PLACE_TIME = 0.0005  # s of the processor in one cycle, beyond which no further one is begun in place
_MAX_WAITING = 5000  # programs that have come and are not translated yet; a packet holds fewer

#: number of a program, and its translation or what is wrong with it
Result = tuple[int, Translation | ScriptError]


class Compiler:
    """Translator that never delays a control cycle. Use it in a ``with``: it has a process and a thread.

    A program that another has overtaken before its turn came is not translated: it would never run.
    """

    def __init__(self) -> None:
        self._known: dict[str, Translation] = {}
        self._todo: SimpleQueue[tuple[int, str, bool] | None] = SimpleQueue()
        self._done: SimpleQueue[Result] = SimpleQueue()
        self._waiting: deque[tuple[int, str, bool]] = deque()
        self._newest = 0  # number of the last program that is not a secondary one
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Compiler:
        self._thread = threading.Thread(target=self._translate_long_ones, args=(_start_worker(),), daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._todo.put(None)
        if self._thread is not None:
            self._thread.join()

    def submit(self, number: int, text: str, *, secondary: bool = False) -> None:
        """Translate a program; `results` returns it with its number, soon if it is short or was translated before.

        Args:
            number: of the program; one with a higher number overtakes it.
            text: of the program.
            secondary: it runs beside another, and neither overtakes nor is overtaken.
        """
        if len(self._waiting) >= _MAX_WAITING:
            self._done.put((number, ScriptError(f"{_MAX_WAITING} programs wait already")))
            return
        if not secondary:
            self._newest = number
        self._waiting.append((number, text, secondary))

    def _begin(self, number: int, text: str, secondary: bool) -> None:
        """Translate a program that waits, or hand it to the translating process."""
        if not secondary and number < self._newest:
            return
        if text in self._known:
            self._done.put((number, self._known[text]))
        elif len(text) <= _IN_PLACE_LENGTH:
            self._done.put((number, _translation(text)))
        else:
            self._todo.put((number, text, secondary))

    def check(self, text: str) -> None:
        """Translate a program that is short enough to be translated in place, and forget the result.

        Raises:
            ScriptError: it cannot be translated.
        """
        if text in self._known or len(text) > _IN_PLACE_LENGTH:
            return
        if isinstance(made := _translation(text), ScriptError):
            raise made

    def results(self) -> list[Result]:
        """Return what has been translated since the last call; once in each control cycle."""
        end = time.thread_time() + _IN_PLACE_TIME
        while self._waiting and time.thread_time() < end:
            self._begin(*self._waiting.popleft())
        ready = []
        while not self._done.empty():
            ready.append(self._done.get())
        return ready

    def _translate_long_ones(self, worker: subprocess.Popen[bytes]) -> None:
        try:
            while (job := self._todo.get()) is not None:
                number, text, secondary = job
                if not secondary and number < self._newest:
                    continue
                try:
                    made = _ask(worker, text)
                except (OSError, EOFError, pickle.UnpicklingError) as exc:  # it has died of this program
                    why = f"the translation has failed, or took more than {_TRANSLATION_TIME:g} s: {type(exc).__name__}"
                    self._done.put((number, ScriptError(why)))
                    _end(worker)
                    worker = _start_worker()
                    continue
                if isinstance(made, Translation):
                    if len(self._known) >= _MAX_KNOWN:
                        self._known.clear()
                    self._known[text] = made
                self._done.put((number, made))
        finally:
            _end(worker)


def _start_worker() -> subprocess.Popen[bytes]:
    command = [sys.executable, "-c", "from coneskin.robot.sim.compiler import serve; serve()"]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)


def _end(worker: subprocess.Popen[bytes]) -> None:
    """End the translating process, which holds nothing and may just be starting."""
    worker.kill()
    with contextlib.suppress(OSError):
        worker.communicate()


def _ask(worker: subprocess.Popen[bytes], text: str) -> Translation | ScriptError:
    assert worker.stdin is not None
    assert worker.stdout is not None
    deadline = threading.Timer(_TRANSLATION_TIME, worker.kill)  # the read below then ends
    deadline.start()
    try:
        pickle.dump(text, worker.stdin)
        worker.stdin.flush()
        made: Translation | ScriptError = pickle.load(worker.stdout)
    finally:
        deadline.cancel()
    return made


def serve() -> None:
    """Translate what comes on stdin until it ends: the main function of the translating process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the controller, which ends this process
    with bounded_memory(_TRANSLATOR_MEMORY), contextlib.suppress(EOFError):
        while True:
            pickle.dump(_translation(pickle.load(sys.stdin.buffer)), sys.stdout.buffer)
            sys.stdout.buffer.flush()


def _translation(text: str) -> Translation | ScriptError:
    try:
        return translate(text, Builtins.names(), Builtins.blocking())
    except ScriptError as exc:
        return exc
