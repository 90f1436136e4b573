"""The serial port's own matters: what cannot be opened is one clear line. The rest is in tests/contracts."""

import errno
import os
import sys

import pytest

from coneskin.core.errors import SkinConnectionError
from coneskin.skin.sources.serial_port import SerialPort, find_ports

posix = pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals on Windows")


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("/dev/there-is-none", r"^/dev/there-is-none: no such port; present: "),
        ("hwgrep://there-is-none", r"^hwgrep://there-is-none: no such port; present: "),
        ("hwgrep://(", r"^hwgrep://\(: not a port or URL that pyserial knows"),
        ("loop://?logging=loud", r"^loop://\?logging=loud: not a port or URL that pyserial knows"),
        ("warp://9", r"^warp://9: not a port or URL that pyserial knows"),
        (
            "socket://127.0.0.1:1",
            r"^socket://127.0.0.1:1: refused, no program listens there; start it, or correct the port$",
        ),
    ],
)
def test_a_port_that_is_not_there(url, words):
    port = SerialPort(url)
    with pytest.raises(SkinConnectionError, match=words) as caught:
        port.open()
    assert "\n" not in str(caught.value)


@posix
def test_a_busy_port_says_so():
    from coneskin.skin.virtual.pseudo_terminal import open_raw_terminal

    master, slave, path = open_raw_terminal()
    try:
        second = SerialPort(path)
        with SerialPort(path), pytest.raises(SkinConnectionError, match="busy, another program has it open"):
            second.open()
        with second:
            assert second.fileno() is not None
    finally:
        os.close(slave)
        os.close(master)


@posix
def test_bytes_that_a_line_does_not_take_are_told():
    from coneskin.skin.virtual.pseudo_terminal import write_all

    read, write = os.pipe()
    os.set_blocking(write, False)
    assert write_all(write, bytes(1000))
    while write_all(write, bytes(65536)):
        pass
    assert len(os.read(read, 1000)) == 1000
    os.close(read)
    os.close(write)


@posix
def test_a_file_is_no_port():
    with pytest.raises(SkinConnectionError, match=r"^/dev/null: cannot be opened"):
        SerialPort("/dev/null").open()


def test_a_port_that_is_not_permitted_tells_what_to_do(monkeypatch):
    import serial

    def refuse(*_: object, **__: object) -> None:
        raise serial.SerialException(errno.EACCES, "could not open port /dev/ttyACM0: Permission denied")

    monkeypatch.setattr(serial, "serial_for_url", refuse)
    with pytest.raises(SkinConnectionError, match=r"not permitted; .* group \(mostly dialout\)"):
        SerialPort("/dev/ttyACM0").open()


def test_ports_are_listed_one_line_each():
    assert all("\n" not in line and line for line in map(str, find_ports()))


@posix
def test_a_pseudo_terminal_has_no_low_latency_switch():
    from coneskin.skin.virtual.pseudo_terminal import open_raw_terminal

    master, slave, path = open_raw_terminal()
    try:
        with SerialPort(path) as port:
            assert port.low_latency is False
    finally:
        os.close(slave)
        os.close(master)


@posix
@pytest.mark.parametrize("awaited", [False, True])
@pytest.mark.parametrize("flushes", [False, True])
def test_a_virtual_skin_waits_until_its_reader_has_thrown_away_what_had_piled_up(awaited, flushes):
    """Where the reader throws nothing away, for 50 ms; the waits are counted, and take no time."""
    import termios

    from coneskin.skin.virtual.pseudo_terminal import open_raw_terminal, wait_for_reader

    master, slave, path = open_raw_terminal(awaited)
    os.close(slave)
    waits, readers = [], []

    def wait(seconds):
        waits.append(seconds)
        if len(waits) == 3:
            readers.append(os.open(path, os.O_RDWR | os.O_NOCTTY))
        if len(waits) == 5 and flushes:
            termios.tcflush(readers[0], termios.TCIFLUSH)
        return False

    kept = wait_for_reader(master, path, wait)
    try:
        assert len(waits) == (5 if flushes else 13)
        os.write(master, b"frame")
        assert os.read(readers[0], 10) == b"frame"
    finally:
        for descriptor in (kept, *readers, master):
            os.close(descriptor)


@posix
def test_a_reader_that_came_before_it_was_waited_for_is_played_to_at_once():
    from coneskin.skin.virtual.pseudo_terminal import open_raw_terminal, wait_for_reader

    master, slave, path = open_raw_terminal(awaited=True)
    os.close(slave)
    with SerialPort(path):
        kept = wait_for_reader(master, path, lambda _: pytest.fail("it waited"))
    os.close(kept)
    os.close(master)
