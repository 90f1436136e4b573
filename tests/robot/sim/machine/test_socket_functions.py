"""Programs of the simulated controller as clients of a server on this computer."""

from __future__ import annotations

import contextlib
import socket
import struct
from collections.abc import Iterator

import pytest

from coneskin.robot.sim.machine.builtins import Builtins
from coneskin.robot.sim.machine.controller import Controller
from coneskin.robot.sim.machine.script_host import _MAX_READS, _MAX_UNREAD
from coneskin.robot.sim.machine.states import Options
from coneskin.robot.sim.urscript.translator import translate

PATIENCE = 60.0  # s that a read of the test waits


class Peer:
    """A server to which one program connects, and that program's controller."""

    def __init__(self) -> None:
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.listener.settimeout(PATIENCE)
        self.controller = Controller(Options(start_delay=0.0))
        self.socket: socket.socket | None = None

    def run(self, body: str) -> socket.socket:
        port = self.listener.getsockname()[1]
        text = f'def p():\nif socket_open("127.0.0.1", {port}, "peer"):\n{body}\nend\nend\n'
        self.controller.load(translate(text, Builtins.functions()))
        self.step(3)
        self.socket, _ = self.listener.accept()
        self.socket.settimeout(PATIENCE)
        return self.socket

    def step(self, cycles: int) -> None:
        for _ in range(cycles):
            self.controller.update()

    def finish(self) -> None:
        while self.controller.program is not None:
            self.controller.update()

    def close(self) -> None:
        self.controller.stop_program("end of the test")
        self.listener.close()
        if self.socket is not None:
            self.socket.close()


@pytest.fixture
def peer() -> Iterator[Peer]:
    made = Peer()
    yield made
    made.close()


def test_what_a_program_sends_arrives(peer: Peer) -> None:
    server = peer.run(
        'socket_send_string("a", "peer")\nsocket_send_line([1, 2.5], "peer")\nsocket_send_byte(66, "peer")\n'
        'socket_send_int(-2, "peer")\nsocket_send_byte_list([1, 255], "peer")\nsocket_set_var("x", 3, "peer")'
    )
    peer.finish()
    received = b"".join(iter(lambda: server.recv(999), b""))  # to the end: the program's end has closed it
    assert received == b"a[1, 2.5]\nB\xff\xff\xff\xfe\x01\xffSET x 3\n"


def test_whole_numbers_arrive_in_parts(peer: Peer) -> None:
    server = peer.run(
        'a = socket_read_binary_integer(3, "peer", 0)\nwrite_output_integer_register(0, a[0])\n'
        "write_output_integer_register(1, a[3])\nwrite_output_integer_register(2, 1)"
    )
    data = struct.pack(">3i", 1, 2, -3)
    server.sendall(data[:5])
    peer.step(20)
    assert peer.controller.output_ints[2] == 0
    server.sendall(data[5:])
    peer.finish()
    assert peer.controller.output_ints[:3] == [3, -3, 1]


def test_numbers_lines_and_marked_texts_are_cut_from_what_comes(peer: Peer) -> None:
    server = peer.run(
        'a = socket_read_ascii_float(2, "peer")\nwrite_output_float_register(0, a[1] + a[2])\n'
        'write_output_integer_register(0, str_len(socket_read_line("peer")))\n'
        'write_output_integer_register(1, to_num(socket_read_string("peer", "<", ">")))\n'
        'write_output_integer_register(2, socket_read_byte_list(2, "peer")[2])\n'
        'write_output_integer_register(3, socket_get_var("speed", "peer"))'
    )
    server.sendall(b"noise (1.5, -0.25)line\r\n..<42>\x01\x07")
    peer.step(10)
    assert server.recv(99) == b"GET speed\n"
    server.sendall(b"speed 8\n")
    peer.finish()
    assert peer.controller.output_doubles[0] == 1.25
    assert peer.controller.output_ints[:4] == [4, 42, 7, 8]


def test_a_read_ends_at_its_timeout_and_when_the_server_has_gone(peer: Peer) -> None:
    server = peer.run(
        'a = socket_read_binary_integer(1, "peer", 0.1)\nwrite_output_integer_register(0, a[0] + 10)\n'
        'a = socket_read_binary_integer(1, "peer", 0)\nwrite_output_integer_register(1, a[0] + 10)'
    )
    peer.step(40)
    assert peer.controller.output_ints[0] == 0
    peer.step(20)
    assert peer.controller.output_ints[:2] == [10, 0]
    server.close()
    peer.finish()
    assert peer.controller.output_ints[:2] == [10, 10]


def test_cycles_that_are_made_up_for_leave_the_server_its_time(peer: Peer) -> None:
    peer.run(
        'a = socket_read_binary_integer(1, "peer", 0.02)\nwrite_output_integer_register(0, a[0] + 10)\n'
        'a = socket_read_binary_integer(1, "peer", 0.02)\nwrite_output_integer_register(1, a[0] + 10)'
    )
    now = 5.0
    peer.controller.outside_time = lambda: now
    peer.step(40)
    assert peer.controller.output_ints[0] == 10  # its time began before
    peer.step(40)
    assert peer.controller.output_ints[1] == 0
    now = 5.018
    peer.step(1)
    assert peer.controller.output_ints[1] == 0
    now = 5.020
    peer.step(1)
    assert peer.controller.output_ints[1] == 10


def test_a_program_that_reads_for_ever_from_nobody_gives_way(peer: Peer) -> None:
    server = peer.run('while True:\nsocket_read_string("peer", "", "", False, 0)\nend')
    server.close()
    peer.step(50)
    assert peer.controller.program is not None
    assert not [notice for notice in peer.controller.notices if "endless" in str(notice)]


def test_a_server_that_sends_without_end_fills_no_memory(peer: Peer) -> None:
    server = peer.run('socket_read_line("peer", 0)')
    server.setblocking(False)
    program = peer.controller.program
    assert program is not None
    for _ in range(200):
        with contextlib.suppress(BlockingIOError):
            server.send(b"x" * 60_000)
        peer.step(1)
        assert len(program.sockets["peer"].unread) <= _MAX_UNREAD
    peer.controller.stop_program("test")
    assert not program.sockets


def test_a_program_that_is_sent_more_than_it_reads_gives_way_and_misses_nothing(peer: Peer) -> None:
    server = peer.run(
        'while True:\na = socket_read_binary_integer(1, "peer", 0.002)\nif a[0] > 0:\n'
        "write_output_integer_register(0, read_output_integer_register(0) + 1)\n"
        "write_output_integer_register(1, a[1])\nend\nend"
    )
    server.sendall(struct.pack(">1000i", *range(1000)))
    peer.step(5)
    assert peer.controller.output_ints[0] <= 5 * _MAX_READS
    peer.step(200)
    assert peer.controller.output_ints[:2] == [1000, 999]
    assert peer.controller.program is not None


def test_a_program_has_a_bounded_number_of_sockets(peer: Peer) -> None:
    port = peer.listener.getsockname()[1]
    peer.run(f'i = 0\nwhile True:\nsocket_open("127.0.0.1", {port}, to_str(i))\ni = i + 1\nsync()\nend')
    program = peer.controller.program
    assert program is not None
    peer.step(200)
    assert peer.controller.program is None
    assert not program.sockets
