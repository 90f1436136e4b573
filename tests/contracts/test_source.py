"""One contract for all sources: the serial port over three kinds of line, the skin in memory, the pty twin."""

import os
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from coneskin.errors import SkinConnectionError, SkinTimeout
from coneskin.geometry.frustum import Frustum
from coneskin.skin.faults import Faults
from coneskin.skin.memory_source import MemorySource
from coneskin.skin.scripted_touch import ScriptedTouch
from coneskin.skin.sensor import Sensor
from coneskin.skin.serial_port import SerialPort
from coneskin.skin.source import Source
from coneskin.skin.virtual import VirtualSkin
from coneskin.skin.wire import FRAME_LENGTH, Decoder

SENSOR = Sensor(Frustum(0.054, 0.054, 0.434))
PATIENCE = 2.0  # far beyond what a line in this machine needs; reached only where the contract is broken
posix = pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals on Windows")


def a_skin(faults: Faults | None = None, duration: float = 1.0) -> VirtualSkin:
    touch = ScriptedTouch(0.01, 0.03, 0.2, 1.0)
    return VirtualSkin(SENSOR, [touch], faults=faults or Faults(), duration=duration, seed=3)


def what_arrives(skin: VirtualSkin) -> bytes:
    data = b""
    with suppress(SkinConnectionError):  # unplugged, where the faults say so
        for _, packet in skin.packets():
            data += packet
    return data


class Line:
    """An open source, and the hand that pulls the plug."""

    def __init__(self, source: Source, pull: Callable[[], None] | None) -> None:
        self.source = source
        self.pull = pull

    def read(self, count: int) -> bytes:
        """So many bytes."""
        data = b""
        while len(data) < count:
            data += self.source.read(PATIENCE)
        return data

    def read_to_the_end(self, count: int) -> bytes:
        """Everything until the line is gone; where it does not go by itself, the plug is pulled after so many bytes."""
        data = b""
        with suppress(SkinConnectionError):
            while True:
                if self.pull and len(data) == count:
                    self.pull()
                data += self.source.read(PATIENCE)
        return data


@contextmanager
def over_memory(skin: VirtualSkin) -> Iterator[Line]:
    with MemorySource(skin) as source:
        yield Line(source, None)


@contextmanager
def over_twin(skin: VirtualSkin) -> Iterator[Line]:
    from coneskin.skin.pseudo_terminal import PseudoTerminal

    with PseudoTerminal(skin, hold=True) as twin, SerialPort(twin.path) as port:
        twin.begin()
        yield Line(port, None)


@contextmanager
def over_pty(skin: VirtualSkin) -> Iterator[Line]:
    from coneskin.skin.pseudo_terminal import open_raw_terminal

    master, slave, path = open_raw_terminal()
    open_ends = [slave, master]

    def pull() -> None:
        while open_ends:
            os.close(open_ends.pop())

    try:
        with SerialPort(path) as port:
            assert os.write(master, what_arrives(skin))
            yield Line(port, pull)
    finally:
        pull()


@contextmanager
def over_loop(skin: VirtualSkin) -> Iterator[Line]:
    with SerialPort("loop://") as port:
        inner = port._port  # loop:// has no other end that could send
        inner.write(what_arrives(skin))
        yield Line(port, inner.close)


@contextmanager
def over_socket(skin: VirtualSkin) -> Iterator[Line]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        host, number = server.getsockname()
        with SerialPort(f"socket://{host}:{number}") as port:
            other, _ = server.accept()
            with other:
                other.sendall(what_arrives(skin))
                yield Line(port, other.close)


LINES = {
    "memory": over_memory,
    "pty twin": over_twin,
    "serial over pty": over_pty,
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
def test_it_is_a_source_and_the_bytes_are_the_same(line):
    skin = a_skin(Faults(stall_after=50))
    expected = what_arrives(skin)
    assert len(expected) == 50 * FRAME_LENGTH
    with line(skin) as opened:
        assert isinstance(opened.source, Source)
        assert opened.read(len(expected)) == expected


@every_line
def test_silence_is_a_timeout_that_leaves_it_open(line):
    with line(a_skin(Faults(stall_after=10))) as opened:
        opened.read(10 * FRAME_LENGTH)
        for _ in range(2):
            with pytest.raises(SkinTimeout, match=r"no bytes for 10 ms"):
                opened.source.read(0.01)


@every_line
def test_a_cut_frame_costs_that_frame_only(line):
    skin = a_skin(Faults(cut_after=5, stall_after=50))
    with line(skin) as opened:
        decoder = Decoder()
        numbers = [frame.sequence for frame in decoder.feed(opened.read(len(what_arrives(skin))))]
    assert numbers == [n for n in range(50) if n != 5]
    assert 0 < decoder.bytes_skipped < FRAME_LENGTH


@every_line
def test_unplugged_is_a_connection_error_not_an_end_of_bytes(line):
    skin = a_skin(Faults(unplug_after=20))
    with line(skin) as opened:
        expected = what_arrives(skin)
        received = opened.read_to_the_end(len(expected))
        # a pseudo-terminal that is hung up, like a plug that is pulled, may take the last bytes with it
        assert expected.startswith(received) if line is over_twin else received == expected
        for _ in range(2):
            with pytest.raises(SkinConnectionError, match="gone"):
                opened.source.read(0.05)


@every_line
def test_closing_twice_is_fine_and_reading_then_is_not(line):
    with line(a_skin(Faults(stall_after=20))) as opened:
        opened.source.close()
        opened.source.close()
        assert opened.source.fileno() is None
        with pytest.raises(SkinConnectionError, match="not open"):
            opened.source.read(0.0)


@every_line
def test_the_descriptor_becomes_readable_where_there_is_one(line):
    import select

    with line(a_skin(Faults(stall_after=20))) as opened:
        descriptor = opened.source.fileno()
        if descriptor is None:
            assert line in (over_memory, over_loop)
            return
        assert select.select([descriptor], [], [], PATIENCE)[0] == [descriptor]


@pytest.mark.parametrize("make", [lambda: SerialPort("/dev/there-is-none"), lambda: MemorySource(a_skin())])
def test_nothing_happens_before_open(make):
    source = make()
    source.close()
    with pytest.raises(SkinConnectionError, match="not open"):
        source.read(0.0)


@posix
def test_a_twin_that_is_closed_early_leaves_nothing():
    from coneskin.skin.pseudo_terminal import PseudoTerminal

    twin = PseudoTerminal(a_skin(duration=60.0))
    twin.open()
    twin.open()
    twin.close()
    twin.close()
    held = PseudoTerminal(a_skin(), hold=True)
    held.open()
    held.close()
