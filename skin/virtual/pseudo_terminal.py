"""Virtual skin behind a real serial port: a pseudo-terminal, paced by absolute deadlines (POSIX only)."""

from __future__ import annotations

import os
import select
import sys
import threading
import time
from collections.abc import Callable

from coneskin.core.errors import SkinConnectionError
from coneskin.skin.sources.source import Openable

from .skin import VirtualSkin

_OPENING_TIME = 0.05  # s; a reader may throw away what came while it was opening, as pyserial does
_LOOK_PERIOD = 0.005  # s between two looks for a reader
_PACKET_MODE = (1).to_bytes(4, sys.byteorder)  # of tty_ioctl(2): our end is told when the reader has thrown bytes away


class Pacing:
    """The punctuality of the bytes.

    Attributes:
        packets: packets handed over.
        overruns: packets lost because the port was not read.
        worst_late: longest delay behind a deadline [s].
    """

    __slots__ = ("overruns", "packets", "worst_late")

    def __init__(self) -> None:
        self.packets = self.overruns = 0
        self.worst_late = 0.0


def play(
    skin: VirtualSkin,
    write: Callable[[bytes], bool],
    *,
    wait: Callable[[float], bool],
    pacing: Pacing | None = None,
) -> None:
    """Write a virtual skin's bytes when they are due, until its line is gone or the caller asks to stop.

    The deadlines are absolute: being late once makes nothing later.

    Args:
        write: takes the bytes; False if they were lost.
        wait: lets so many seconds pass; True if the playing shall stop.
        pacing: is filled in while playing.
    """
    pacing = pacing or Pacing()
    start = time.monotonic()
    try:
        for due, data in skin.packets():
            left = start + due - time.monotonic()
            if wait(max(left, 0.0)):
                return
            if data:
                pacing.worst_late = max(pacing.worst_late, time.monotonic() - start - due)
                pacing.packets += 1
                if not write(data):
                    pacing.overruns += 1
    except SkinConnectionError:
        return  # unplugged, on purpose


class PseudoTerminal(Openable):
    """A virtual skin that plays into a pseudo-terminal, from a thread of its own.

    A guard loop that is to be timed should not share its process with this thread: use ``coneskin sim-skin`` there.

    Args:
        hold: begin the script at ``begin``, not at ``open``, so that a reader loses none of it.

    Attributes:
        path: what to give to ``SerialPort``; empty before ``open``.
        pacing: how well the bytes kept their time.
    """

    def __init__(self, skin: VirtualSkin, hold: bool = False) -> None:
        self._skin = skin
        self._hold = hold
        self._begin = threading.Event()
        self.path = ""
        self.pacing = Pacing()
        self._master: int | None = None
        self._slave: int | None = None
        self._thread: threading.Thread | None = None
        self._stop = threading.Event()

    def open(self) -> None:
        """Make the pseudo-terminal and start to play.

        Raises:
            SkinConnectionError: this system has no pseudo-terminals (Windows), or none is left.
        """
        if self._thread is not None:
            return
        self._master, self._slave, self.path = open_raw_terminal()
        self._stop.clear()
        self._begin.clear()
        if not self._hold:
            self._begin.set()
        self._thread = threading.Thread(target=self._run, name=f"virtual skin on {self.path}", daemon=True)
        self._thread.start()

    def begin(self) -> None:
        """Begin the script that was held."""
        self._begin.set()

    def close(self) -> None:
        """Stop playing and take the port away; may be called twice."""
        self._stop.set()
        self._begin.set()
        thread, self._thread = self._thread, None
        if thread is not None:
            thread.join()
        self._unplug()

    def join(self, timeout: float | None = None) -> bool:
        """Wait until the script has ended [s]; True if it has."""
        if self._thread is not None:
            self._thread.join(timeout)
        return self._thread is None or not self._thread.is_alive()

    def _run(self) -> None:
        master = self._master
        if master is None:
            return
        self._begin.wait()
        if not self._stop.is_set():
            play(self._skin, lambda data: write_all(master, data), wait=self._stop.wait, pacing=self.pacing)
            drain(self._slave, self._stop.wait)
        self._unplug()

    def _unplug(self) -> None:
        for descriptor in (self._slave, self._master):
            if descriptor is not None:
                os.close(descriptor)
        self._slave = self._master = None


def open_raw_terminal(awaited: bool = False) -> tuple[int, int, str]:
    """Make a pseudo-terminal that passes every byte as it is.

    Args:
        awaited: ``wait_for_reader`` is called later on, and a reader may come before that.

    Returns:
        descriptors of both ends (the second is kept open so that readers may come and go) and the path of the port.

    Raises:
        SkinConnectionError: this system has no pseudo-terminals (Windows), or none is left.
    """
    if sys.platform == "win32":
        raise SkinConnectionError(
            "a virtual serial port needs pseudo-terminals, which Windows does not have; use the skin in memory, or a "
            "pair of ports made by com0com"
        )
    import fcntl
    import termios
    import tty

    try:
        master, slave = os.openpty()
    except OSError as error:
        raise SkinConnectionError(f"cannot open a pseudo-terminal: {error}") from error
    tty.setraw(slave)  # no echo, no line editing, no flow control by bytes
    os.set_blocking(master, False)
    if awaited:
        fcntl.ioctl(master, termios.TIOCPKT, _PACKET_MODE)
    return master, slave, os.ttyname(slave)


def wait_for_reader(master: int, path: str, wait: Callable[[float], bool]) -> int | None:
    """Wait until the other end is opened; no descriptor of it may be open here.

    Args:
        master: our end.
        path: the other end.
        wait: lets so many seconds pass; True if the waiting shall stop.

    Returns:
        a descriptor of the other end, so that it stays when the reader goes; None if stopped.
    """
    import fcntl
    import termios

    poll = select.poll()
    poll.register(master, select.POLLPRI)
    fcntl.ioctl(master, termios.TIOCPKT, _PACKET_MODE)
    left = _OPENING_TIME
    while left > 0.0:
        events = next((event for _, event in poll.poll(0)), 0)
        flushed = events & select.POLLPRI and os.read(master, 1)[0] & termios.TIOCPKT_FLUSHREAD
        if events & select.POLLHUP:  # a pseudo-terminal without a reader
            left = _OPENING_TIME
        elif flushed:
            break
        if wait(_LOOK_PERIOD):
            return None
        left -= _LOOK_PERIOD
    fcntl.ioctl(master, termios.TIOCPKT, bytes(4))
    return os.open(path, os.O_RDWR | os.O_NOCTTY)


def drain(slave: int | None, wait: Callable[[float], bool]) -> None:
    """Let the reader take what is on its way to its end, for a second at most: a hang-up would throw it away."""
    import fcntl
    import termios

    if slave is None:
        return
    empty = 0
    for _ in range(200):
        waiting = int.from_bytes(fcntl.ioctl(slave, termios.FIONREAD, bytes(4)), sys.byteorder)
        empty = 0 if waiting else empty + 1
        # the kernel hands bytes over when it gets to it, so "nothing there" must last a while to mean something
        if empty >= 10 or wait(0.005):
            return


def write_all(descriptor: int, data: bytes) -> bool:
    """Write without waiting; False if the reader is so far behind that bytes are lost, as on a real line."""
    try:
        return os.write(descriptor, data) == len(data)
    except BlockingIOError:
        return False
