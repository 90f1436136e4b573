"""Contract of every source, held by each of ours over each kind of line, and what ours promise beyond it."""

import os
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from coneskin.core.errors import SkinConnectionError, SkinTimeout
from coneskin.geometry.frustum import Frustum
from coneskin.skin.sensor import Sensor
from coneskin.skin.sources.serial_port import SerialPort
from coneskin.skin.sources.source import SourceGroup
from coneskin.skin.virtual.memory_source import MemorySource
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.testing.source_contract import SOURCE_CHECKS, OpenLine, OpenLineFactory, contract_bytes

SENSOR = Sensor(Frustum(0.054, 0.054, 0.434))
posix = pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals on Windows")


class SentSkin(VirtualSkin):
    """A device that sends given bytes, is silent, and goes when the plug is pulled."""

    def __init__(self, sent: bytes) -> None:
        super().__init__(SENSOR, model="ladder")
        self.sent = sent
        self.pulled = False

    def packets(self) -> Iterator[tuple[float, bytes]]:
        """Send the bytes, 500 of them a millisecond."""
        number = 0
        while not self.pulled:
            number += 1
            yield 1e-3 * number, self.sent[500 * (number - 1) : 500 * number]
        raise SkinConnectionError("unplugged")

    def pull(self) -> None:
        """Pull the plug."""
        self.pulled = True


@contextmanager
def over_memory(sent: bytes) -> Iterator[OpenLine]:
    skin = SentSkin(sent)
    with MemorySource(skin) as source:
        yield OpenLine(source, skin.pull)


@contextmanager
def over_twin(sent: bytes) -> Iterator[OpenLine]:
    from coneskin.skin.virtual.pseudo_terminal import PseudoTerminal

    skin = SentSkin(sent)
    with PseudoTerminal(skin, hold=True) as twin, SerialPort(twin.path) as port:
        twin.begin()
        yield OpenLine(port, skin.pull)


@contextmanager
def over_pty(sent: bytes) -> Iterator[OpenLine]:
    with pseudo_terminal() as (master, path, pull), SerialPort(path) as port:
        assert os.write(master, sent) == len(sent)
        yield OpenLine(port, pull)


@contextmanager
def over_loop(sent: bytes) -> Iterator[OpenLine]:
    with SerialPort("loop://") as port:
        inner = port._port  # loop:// has no other end that could send
        inner.write(sent)
        yield OpenLine(port, inner.close)


@contextmanager
def over_socket(sent: bytes) -> Iterator[OpenLine]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        host, number = server.getsockname()
        with SerialPort(f"socket://{host}:{number}") as port:
            other, _ = server.accept()
            with other:
                other.sendall(sent)
                yield OpenLine(port, other.close)


@contextmanager
def over_group(sent: bytes) -> Iterator[OpenLine]:
    """Beside a second port, on which nothing comes."""
    with (
        pseudo_terminal() as (_, silent, _),
        pseudo_terminal() as (master, path, pull),
        SourceGroup([SerialPort(silent), SerialPort(path)]) as group,
    ):
        assert os.write(master, sent) == len(sent)
        yield OpenLine(group, pull)


@contextmanager
def over_asked_group(sent: bytes) -> Iterator[OpenLine]:
    """Two sources that can only be asked in turn; on the other one nothing comes."""
    port = SerialPort("loop://")
    with SourceGroup([MemorySource(SentSkin(b"")), port]) as group:
        inner = port._port
        inner.write(sent)
        yield OpenLine(group, inner.close)


@contextmanager
def pseudo_terminal() -> Iterator[tuple[int, str, Callable[[], None]]]:
    """Our end, the path of the other, and what hangs it up."""
    from coneskin.skin.virtual.pseudo_terminal import open_raw_terminal

    master, slave, path = open_raw_terminal()
    ends = [slave, master]

    def pull() -> None:
        while ends:
            os.close(ends.pop())

    try:
        yield master, path, pull
    finally:
        pull()


LINES: dict[str, OpenLineFactory] = {
    "memory": over_memory,
    "pty twin": over_twin,
    "serial over pty": over_pty,
    "two ports as one, over pty": over_group,
    "two sources as one, asked in turn": over_asked_group,
    "serial over loop": over_loop,
    "serial over socket": over_socket,
}
every_line = pytest.mark.parametrize(
    "line", [pytest.param(line, id=name, marks=posix if "pty" in name else ()) for name, line in LINES.items()]
)


@pytest.fixture(autouse=True)
def nothing_leaks() -> Iterator[None]:
    """Fail the test that leaves a descriptor or a thread behind."""
    before = open_descriptors()
    threads = set(threading.enumerate())
    yield
    assert open_descriptors() <= before, "a descriptor was left open"
    assert set(threading.enumerate()) <= threads, "a thread was left running"


def open_descriptors() -> set[str]:
    folder = Path("/proc/self/fd")
    if not folder.is_dir():
        return set()
    found = set()
    for entry in folder.iterdir():
        try:
            found.add(f"{entry.name} -> {entry.readlink()}")
        except FileNotFoundError:
            continue  # the descriptor with which the folder itself was read
    return found


@every_line
@pytest.mark.parametrize("check", SOURCE_CHECKS, ids=lambda check: check.__name__)
def test_it_keeps_the_contract(check: Callable[[OpenLineFactory], None], line: OpenLineFactory) -> None:
    check(line)


@every_line
def test_its_errors_say_what_happened(line: OpenLineFactory) -> None:
    sent = contract_bytes()[:720]
    with line(sent) as opened:
        assert opened.pull is not None
        assert (opened.source.fileno() is None) == (line in (over_memory, over_loop, over_asked_group))
        opened.read(len(sent))
        with pytest.raises(SkinTimeout, match="no bytes for 10 ms"):
            opened.source.read(0.01)
        opened.pull()
        with pytest.raises(SkinConnectionError, match="gone"):
            opened.source.read(2.0)
        opened.source.close()
        with pytest.raises(SkinConnectionError, match="not open"):
            opened.source.read(0.0)


@pytest.mark.parametrize("make", [lambda: SerialPort("/dev/there-is-none"), lambda: MemorySource(SentSkin(b""))])
def test_nothing_happens_before_open(make):
    source = make()
    source.close()
    with pytest.raises(SkinConnectionError, match="not open"):
        source.read(0.0)


@posix
def test_a_twin_that_is_closed_early_leaves_nothing():
    from coneskin.skin.virtual.pseudo_terminal import PseudoTerminal

    twin = PseudoTerminal(SentSkin(b""))
    twin.open()
    twin.open()
    twin.close()
    twin.close()
    held = PseudoTerminal(SentSkin(b""), hold=True)
    held.open()
    held.close()
