"""Serial port through pyserial: any of its URLs, and the quickest way to the bytes that the system has.

Where there is a descriptor, a read is ``poll`` and ``os.read``, which wakes as soon as the first byte is there and
takes all that have come. Where there is none (Windows, loop://) pyserial's own read is used.
"""

from __future__ import annotations

import errno
import os
import re
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple, Self

from coneskin.core.channel import wait_readable
from coneskin.core.errors import SkinConnectionError, SkinTimeout, needed_package


class PortFacts(NamedTuple):
    """A serial port that is there."""

    device: str  #: such as /dev/ttyUSB0 or COM3
    description: str  #: for people; empty where the system has none
    hardware: str  #: what ``hwgrep://`` can look for: vendor, product and serial number; empty likewise

    def __str__(self) -> str:
        """Return it as one line."""
        facts = [fact for fact in (self.description, self.hardware) if fact]
        return self.device + (f" ({', '.join(facts)})" if facts else "")


def find_ports() -> list[PortFacts]:
    """Return the serial ports that are there, in the order of their names.

    Raises:
        MissingExtra: pyserial is not installed.
    """
    with needed_package("pyserial", "listing serial ports"):
        from serial.tools import list_ports as tools
    found = []
    for port in sorted(tools.comports()):
        description = port.description if port.description not in (None, "n/a", port.name) else ""
        found.append(PortFacts(port.device, description, port.hwid if port.hwid not in (None, "n/a") else ""))
    return found


def port_group(device: Path) -> str:
    """Return the group whose members may use a port."""
    try:
        return device.group()
    except (KeyError, OSError, NotImplementedError):  # a number without a name; Windows has none
        return "dialout"


_MAX_READ = 4096  # bytes in one read


class SerialPort:
    """Source of bytes from a serial port.

    Args:
        port: a device (``/dev/ttyACM0``, ``COM3``) or any pyserial URL: ``hwgrep://1234:5678``, ``socket://host:port``,
            ``rfc2217://``, ``loop://``, ``spy://``.
        baud: bits per second; a device with USB of its own ignores it.

    Attributes:
        name: the device or URL.
        low_latency: the driver was told not to hold bytes back (an FTDI adapter otherwise waits 16 ms); False where
            that is not possible or not needed.
    """

    def __init__(self, port: str, baud: int = 921600) -> None:
        self.name = port
        self.baud = baud
        self.low_latency = False
        self._port: Any = None
        self._descriptor: int | None = None

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def open(self) -> None:
        """Open the port for this process alone, and throw away what had piled up in it.

        Raises:
            SkinConnectionError: no such port, busy, not permitted, or an URL that pyserial does not know.
            MissingExtra: pyserial is not installed.
        """
        if self._port is not None:
            return
        with needed_package("pyserial", "reading a serial port"):
            import serial
        try:
            port = serial.serial_for_url(self.name, self.baud, timeout=0, exclusive=True)
        except (serial.SerialException, OSError, ValueError, KeyError, re.error) as error:  # of odd URLs the last two
            raise SkinConnectionError(_explain(self.name, error)) from error
        self._port = port
        try:
            port.set_low_latency_mode(True)
            self.low_latency = True
        except (AttributeError, NotImplementedError, ValueError, OSError):
            self.low_latency = False  # no such switch here: a pseudo-terminal, a socket, not Linux
        self._descriptor = _descriptor(port)
        if self._descriptor is not None:
            os.set_blocking(self._descriptor, False)

    def close(self) -> None:
        """Close the port; it does not matter whether it is open or still there."""
        port, self._port, self._descriptor = self._port, None, None
        if port is not None:
            with suppress(OSError):  # a port that was pulled out cannot be closed any better than this
                port.close()

    def fileno(self) -> int | None:
        """Return the port's descriptor, or None where the system or the kind of URL has none."""
        return self._descriptor

    def read(self, timeout: float) -> bytes:
        """Wait for bytes, as every Source does."""
        if self._port is None:
            raise SkinConnectionError(f"{self.name} is not open: call open, or read it inside a with")
        descriptor = self._descriptor
        if descriptor is None:
            return self._read_by_pyserial(timeout)
        deadline, waited = 0.0, False
        while True:
            try:
                if data := os.read(descriptor, _MAX_READ):  # without waiting: a loop that was woken for it has it here
                    return data
                if waited:
                    raise SkinConnectionError(f"{self.name} is gone: the other end closed it")
            except (BlockingIOError, InterruptedError):
                pass  # nothing has come, or another reader, or a signal, was quicker
            except OSError as error:
                raise SkinConnectionError(f"{self.name} is gone: {error.strerror or error}") from error
            now = time.monotonic()
            deadline = deadline or now + timeout
            waited = bool(wait_readable([self._port], deadline - now))
            if not waited and time.monotonic() >= deadline:
                raise SkinTimeout(f"{self.name}: no bytes for {timeout * 1e3:.0f} ms")

    def _read_by_pyserial(self, timeout: float) -> bytes:
        port = self._port
        try:
            port.timeout = timeout
            data: bytes = port.read(1)
            if data:
                more = min(port.in_waiting, _MAX_READ - 1)
                return data + port.read(more) if more else data
        except OSError as error:  # SerialException is one
            raise SkinConnectionError(f"{self.name} is gone: {error}") from error
        raise SkinTimeout(f"{self.name}: no bytes for {timeout * 1e3:.0f} ms")


def _descriptor(port: Any) -> int | None:
    """Return the port's descriptor if this system can wait on it."""
    if sys.platform == "win32":
        return None
    try:
        return int(port.fileno())
    except (AttributeError, OSError, ValueError):  # io.UnsupportedOperation is both
        return None


def _explain(url: str, error: Exception) -> str:
    """Say in one line which port, why, and what to do."""
    code = getattr(error, "errno", None)
    text = str(error)
    low = text.lower()
    if code == errno.EACCES or "access is denied" in low or "permission" in low:
        return f"{url}: not permitted; on Linux, add yourself to the port's group (mostly dialout) and log in again"
    if code in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in low or "busy" in low:
        return f"{url}: busy, another program has it open"
    if isinstance(error, ValueError | KeyError | re.error):
        return f"{url}: not a port or URL that pyserial knows ({text}); write a device, COM3 or socket://host:port"
    if code == errno.ENOENT or "no ports found" in low or "filenotfound" in low:
        present = ", ".join(map(str, find_ports())) or "none at all"
        return f"{url}: no such port; present: {present}"
    if code == errno.ECONNREFUSED or "refused" in low:
        return f"{url}: refused, no program listens there; start it, or correct the port"
    return f"{url}: cannot be opened ({text})"
