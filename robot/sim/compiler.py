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
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

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
        self._done: list[Result] = []
        self._waiting: deque[tuple[int, str, bool]] = deque()
        self._newest = 0  # number of the last program that is not a secondary one
        self._pool = ThreadPoolExecutor(1)
        self._long: list[tuple[int, bool, Future[Translation | ScriptError]]] = []  # handed to that thread

    def __enter__(self) -> Compiler:
        self._worker = _start_worker()
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(cancel_futures=True)
        _end(self._worker)

    def submit(self, number: int, text: str, *, secondary: bool = False) -> None:
        """Translate a program; `results` returns it with its number, soon if it is short or was translated before.

        Args:
            number: of the program; one with a higher number overtakes it.
            text: of the program.
            secondary: it runs beside another, and neither overtakes nor is overtaken.
        """
        if len(self._waiting) >= _MAX_WAITING:
            self._done.append((number, ScriptError(f"{_MAX_WAITING} programs wait already")))
            return
        if not secondary:
            self._newest = number
        self._waiting.append((number, text, secondary))

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
            number, text, secondary = self._waiting.popleft()
            if secondary or number >= self._newest:
                self._begin(number, text, secondary)
        for job in list(self._long):
            number, secondary, made = job
            if made.done():
                self._long.remove(job)
                self._done.append((number, made.result()))
            elif not secondary and number < self._newest and made.cancel():
                self._long.remove(job)
        ready, self._done = self._done, []
        return ready

    def _begin(self, number: int, text: str, secondary: bool) -> None:
        """Translate a program that waits, or hand it to the translating process."""
        if text in self._known:
            self._done.append((number, self._known[text]))
        elif len(text) <= _IN_PLACE_LENGTH:
            self._done.append((number, _translation(text)))
        else:
            self._long.append((number, secondary, self._pool.submit(self._translate_long_one, text)))

    def _translate_long_one(self, text: str) -> Translation | ScriptError:
        try:
            made = _ask(self._worker, text)
        except (OSError, EOFError, pickle.UnpicklingError) as exc:  # it has died of this program
            _end(self._worker)
            self._worker = _start_worker()
            why = f"the translation has failed, or took more than {_TRANSLATION_TIME:g} s: {type(exc).__name__}"
            return ScriptError(why)
        if isinstance(made, Translation):
            if len(self._known) >= _MAX_KNOWN:
                self._known.clear()
            self._known[text] = made
        return made


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
        return translate(text, Builtins.functions())
    except ScriptError as exc:
        return exc
