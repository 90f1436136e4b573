"""Start of a child process that speaks over channels, and the child's own ends of them.

A child must not outlive its parent. The end of the channel between them says that the parent is gone, unless somebody
else has a copy of it: a fork below Python, where nothing of ours runs, makes one. So the child has a descriptor of the
parent's process as well, whose end nobody can hide. A thread waits for it from the child's first moment, because a
child that imports or connects may not look for seconds.

A process that wakes is let in before one that computes only where its time is due sooner, and it is due after a slice.
With slices of 0.1 ms a frame waits for less beside, say, a browser that draws on the processor; the share of the
processor is as before, which is what nice values divide. Any process may ask for it, from Linux 6.12 on (sched(7) and
sched_setattr(2); EEVDF, whose slice is ``sched_runtime``); an older kernel ignores it, other systems have no such call.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import socket
import struct
import sys
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from .channel import Channel, decode_json, wait_readable
from .errors import RobotConnectionError
from .files import explain_os_error

if TYPE_CHECKING:  # a child needs it for nothing else, and it takes a while to import
    import subprocess

_END_TIMEOUT = 2.0  # s for a process to end by itself
_MIN_MEMORY = 400 * 2**20  # bytes that a process must be let take: one that loads numpy asks for 350 MB of addresses


def _check_memory() -> None:
    """Raise RobotConnectionError where a child would end for want of memory, by the limit that it inherits."""
    import resource

    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY and limit < _MIN_MEMORY:
        raise RobotConnectionError(
            f"a process may take {limit / 2**20:.0f} MB of memory here, and one of coneskin needs up to "
            f"{_MIN_MEMORY / 2**20:.0f} MB: raise the limit (ulimit -v)"
        )


def spawn(module: str, *ends: socket.socket) -> subprocess.Popen[bytes]:
    """Start ``python -m module`` with these ends of pairs, then closed here; the child takes them with ``inherit``.

    The child does not look for modules in the current folder, where a file named like one of them may lie; PYTHONPATH
    holds for it as for this process.

    Raises:
        RobotConnectionError: the process cannot be started, or may take too little memory.
    """
    import subprocess

    _check_memory()
    command = [sys.executable, "-I" if sys.flags.isolated else "-P", "-m", module]
    failure = explain_os_error(RobotConnectionError, f"cannot start the process {module}")
    with failure, contextlib.ExitStack() as stack:
        numbers = [end.fileno() for end in ends]
        if hasattr(os, "pidfd_open"):  # Linux, from 5.3 on
            with contextlib.suppress(OSError):
                numbers.append(os.pidfd_open(os.getpid()))
                stack.callback(os.close, numbers[-1])
        child = subprocess.Popen(
            [*command, str(len(ends)), *map(str, numbers)],
            pass_fds=numbers,
            stdin=subprocess.DEVNULL,
            start_new_session=True,
        )
    for end in ends:
        end.close()
    return child


class OwnedProcess:
    """Process of a ``with``: started on entry, ended on exit whatever its state."""

    _process_name = "the process"  # for messages
    _process: subprocess.Popen[Any] | None = None

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def pid(self) -> int:
        """Process id."""
        return self._running().pid

    def freeze(self) -> None:
        """Suspend the process; `thaw` resumes it."""
        os.kill(self.pid, signal.SIGSTOP)

    def thaw(self) -> None:
        """Resume the process after `freeze`."""
        os.kill(self.pid, signal.SIGCONT)

    def kill(self) -> None:
        """Kill the process, as a power cut would."""
        process = self._running()
        process.kill()
        process.wait()

    def close(self) -> None:
        """End the process, whatever its state; may be called twice."""
        import subprocess

        process, self._process = self._process, None
        if process is None:
            return
        if process.poll() is None:
            process.send_signal(signal.SIGCONT)  # a frozen process acts on nothing else
            process.terminate()
            try:
                process.wait(_END_TIMEOUT)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        for pipe in (process.stdout, process.stderr):
            if pipe is not None:
                pipe.close()

    def _running(self) -> subprocess.Popen[Any]:
        if self._process is None:
            raise RobotConnectionError(f"{self._process_name} is not running; use it in a 'with'")
        return self._process


class Lifeline:
    """Line of a child to its parent, which a thread watches.

    Until ``hold`` the process ends at once where the parent is gone, or has closed the channel: nothing is under way.

    Args:
        channel: to the parent.
        parent: descriptor of the parent's process; None where the system has none, and the channel alone counts.
    """

    def __init__(self, channel: Channel, parent: int | None, end: Callable[[], None] = lambda: os._exit(1)) -> None:
        self._channel = channel
        self._parent = parent
        self._end = end
        self._starting = True
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._watch, name="coneskin lifeline", daemon=True)
        self._thread.start()

    def hold(self) -> None:
        """Let the parent's end be the end of the channel from now on: this process looks for it, and acts first."""
        with self._lock:
            self._starting = False

    def _watch(self) -> None:
        poll = select.poll()
        poll.register(self._channel.fileno(), 0)  # its end is reported without being asked for
        if self._parent is not None:
            poll.register(self._parent, select.POLLIN)
        poll.poll()
        with self._lock:
            if self._starting:
                self._end()
        if self._parent is None:
            return
        poll = select.poll()
        poll.register(self._parent, select.POLLIN)
        poll.poll()
        self._channel.hang_up()


def inherit(arguments: list[str], parent: int = 0) -> tuple[Lifeline, list[Channel]]:
    """Return the line to the parent, and the channels that ``spawn`` gave to this process; one of them goes there."""
    count, *numbers = map(int, arguments)
    channels = [Channel(socket.socket(fileno=number)) for number in numbers[:count]]
    return Lifeline(channels[parent], numbers[count] if len(numbers) > count else None), channels


def first_message(channel: Channel) -> dict[str, Any] | None:
    """Wait for the settings that a parent sends first; None where it has ended, or ends the child, before."""
    while not (hello := channel.receive()) and not channel.closed:
        wait_readable([channel], 1.0)
    return decode_json(hello[0]) if hello and hello[0] != b"quit" else None


_MIN_SLICE = 100_000  # ns that Linux takes
_ORDINARY_POLICY = 0  # policy of ordinary processes
#: sched_attr: size, policy, flags, nice, priority, runtime, deadline, period; times in ns
_SCHED_ATTRIBUTES = struct.Struct("<IIQiIQQQ")
#: machine -> numbers of the calls sched_getattr and sched_setattr, which Python does not have
_CALL_NUMBERS = {"x86_64": (315, 314), "aarch64": (275, 274), "riscv64": (275, 274)}


def shorten_time_slice() -> None:
    """Ask for the shortest time slices for this thread, and all that it starts from now on.

    Call it before anything starts a thread. Where it is not to be had, all is as it was.
    """
    calls = _CALL_NUMBERS.get(os.uname().machine) if sys.platform == "linux" else None
    if calls is None or sys.maxsize < 2**32:  # a process of 32 bits on such a kernel has other numbers
        return
    import ctypes

    call = ctypes.CDLL(None).syscall
    data = ctypes.create_string_buffer(_SCHED_ATTRIBUTES.size)
    if call(calls[0], 0, data, _SCHED_ATTRIBUTES.size, 0) != 0:
        return
    size, policy, _, nice, *_ = _SCHED_ATTRIBUTES.unpack(data.raw)
    if policy == _ORDINARY_POLICY:
        data.raw = _SCHED_ATTRIBUTES.pack(size, policy, 0, nice, 0, _MIN_SLICE, 0, 0)
        call(calls[1], 0, data, 0)
