"""Clients that hold up, flood or leave the simulated controller, while others go on being served at their rate."""

from __future__ import annotations

import contextlib
import math
import random
import socket
import struct
import time
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest

from coneskin.robot.sim import compiler
from coneskin.robot.sim import server as server_module
from coneskin.robot.sim.machine.controller import Controller
from coneskin.robot.sim.machine.states import PORTS, Options
from coneskin.robot.sim.ports import client as client_module
from coneskin.robot.sim.ports.client_interface import MESSAGE, ROBOT_STATE
from coneskin.robot.sim.ports.rtde import RtdeOutputs, RtdeSession
from coneskin.robot.sim.process import free_host
from coneskin.robot.sim.server import Server
from coneskin.robot.sim.urscript.translator import MAX_LENGTH, Translation
from coneskin.robot.ur.rtde_codec import (
    PacketKind,
    pack,
    pack_inputs_request,
    pack_outputs_request,
    split,
)
from tests.support.malformed_packets import SERVICES, malformed_packet

NAMES = ("timestamp", "actual_q")
SLOW_READER = 4096  # bytes that the operating system keeps for one that does not read


class Reader:
    """Client of RTDE that counts the packets of data that it is sent."""

    def __init__(self, server: Server, names: tuple[str, ...] = NAMES) -> None:
        self.socket = socket.create_connection((server.host, PORTS["RTDE"]), 60.0)
        self.socket.sendall(pack_outputs_request(names) + pack(PacketKind.START))
        self.socket.setblocking(False)
        self.count, self._rest = 0, b""

    def read(self) -> int:
        """Return how many packets have come since the last call."""
        before = self.count
        with contextlib.suppress(BlockingIOError):
            while data := self.socket.recv(65536):
                packets, self._rest = split(self._rest + data)
                self.count += sum(packet.kind is PacketKind.DATA for packet in packets)
        return self.count - before


@pytest.fixture(scope="module")
def started() -> Iterator[Server]:
    with Server(Controller(Options(start_delay=0.002)), free_host()) as made:
        yield made


@pytest.fixture
def server(started: Server) -> Iterator[Server]:
    """The server without clients and programs, as each test finds it."""
    yield started
    for name in SERVICES:
        started.drop_all(name)
    started.controller.stop_program("test")
    started.controller.unlock(early=True)
    turn(started, 50)


def turn(server: Server, cycles: int = 1) -> None:
    for _ in range(cycles):
        server._poll(0.0)
        server._cycle()
        server._publish()


def connect(server: Server, name: str) -> socket.socket:
    made = socket.create_connection((server.host, PORTS[name]), 60.0)
    made.setblocking(False)
    return made


@pytest.fixture
def reader(server: Server) -> Iterator[Reader]:
    made = Reader(server)
    turn(server, 20)
    made.read()
    assert made.count
    yield made
    made.socket.close()


@pytest.mark.parametrize("kind", [PacketKind.OUTPUTS, PacketKind.INPUTS])
@pytest.mark.parametrize("names", [b"x" * 400, b",".join([b"x" * 400] * 160), b"a," * 7000, b"\xff" * 400])
def test_names_that_are_long_or_many_are_answered_not_found(kind: PacketKind, names: bytes) -> None:
    controller = Controller(Options())
    session = RtdeSession(controller, RtdeOutputs(controller))
    ((answered, payload),), rest = split(
        session.receive(pack(kind, (struct.pack(">d", 500.0) if kind is PacketKind.OUTPUTS else b"") + names))
    )
    assert (answered, rest, payload[0]) == (kind, b"", 0)
    assert set(payload[1:].split(b",")) == {b"NOT_FOUND"}
    assert session.receive(pack(PacketKind.PROTOCOL_VERSION, b"\0\2"))  # it goes on


def test_of_three_thousand_programs_in_one_go_the_last_runs_and_no_cycle_waits(
    server: Server, reader: Reader, monkeypatch: pytest.MonkeyPatch
) -> None:
    translated: list[str] = []
    translate = compiler._translation

    def counted(text: str) -> Translation:
        translated.append(text)
        return translate(text)

    monkeypatch.setattr(compiler, "_translation", counted)
    with connect(server, "secondary") as client:
        data = b"".join(b"def p%d():\n while True:\n  sync()\n end\nend\n" % i for i in range(3000))
        cycles = 0
        while data or cycles < 50:
            with contextlib.suppress(BlockingIOError):
                data = data[client.send(data) :] if data else data
            turn(server)
            cycles += 1
            assert reader.read() >= 1
            assert cycles < 2000
    assert server.controller.program is not None
    assert server.controller.program.name == "p2999"
    assert len(translated) <= cycles  # one of each batch, not all


def test_secondary_programs_share_the_time_of_many_cycles(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]

    def translate(text: str) -> Translation:
        clock[0] += 0.0003
        return make(text)

    make = compiler._translation
    monkeypatch.setattr(compiler, "_translation", translate)
    monkeypatch.setattr(compiler.time, "thread_time", lambda: clock[0])
    for _ in range(100):
        server._program("sec s():\n  textmsg(1)\nend\n")
    done = [len(server._compiler.results()) for _ in range(60)]
    assert max(done) == 2  # 0.3 ms each, and none is begun after 0.5 ms
    assert sum(done) == 100


class FullSocket:
    """Connection whose system takes no more bytes until it is told to: when a real one is full, only it knows."""

    def __init__(self, sock: socket.socket) -> None:
        self.full = True
        self._socket = sock

    def send(self, data: bytes) -> int:
        if self.full:
            raise BlockingIOError
        return self._socket.send(data)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._socket, name)


def kinds_of(packets: bytes) -> list[int]:
    kinds = []
    while packets:
        kinds.append(packets[4])
        packets = packets[int.from_bytes(packets[:4], "big") :]
    return kinds


def test_a_client_that_lags_for_a_moment_misses_states_but_no_message(server: Server) -> None:
    with connect(server, "primary") as client:
        turn(server, 5)
        (seen,) = server._clients["primary"]
        seen.socket = lagging = FullSocket(seen.socket)  # type: ignore[assignment]
        turn(server, 100)
        assert kinds_of(seen.unsent) == [ROBOT_STATE]  # two were due
        client.sendall(b"def bad():\n  no_such()\nend\n")
        turn(server, 200)
        first, *others = kinds_of(seen.unsent)
        assert first == ROBOT_STATE
        assert set(others) == {MESSAGE}  # four states were due meanwhile
        lagging.full = False
        got = b""
        for _ in range(200):
            turn(server)
            with contextlib.suppress(BlockingIOError):
                got += client.recv(65536)
        assert b"compile_error_name_not_found:no_such:" in got
        assert kinds_of(got)[-1] == ROBOT_STATE  # it is up to date again


def test_one_that_is_seldom_sent_something_has_ten_seconds_to_read_it(
    server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What it was sent long ago and has read does not count."""
    clock = [1000.0]
    for module in (server_module, client_module):
        monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    with connect(server, "RTDE") as seldom:
        seldom.sendall(pack_outputs_request(NAMES, 5.0) + pack(PacketKind.START))
        turn(server, 150)
        (client,) = server._clients["RTDE"]
        assert client.stuck_since == 1000.0
        clock[0] = 1060.0
        client.socket = lagging = FullSocket(client.socket)  # type: ignore[assignment]
        turn(server, 150)
        assert client.unsent
        assert server._clients["RTDE"] == [client]
        clock[0] = 1069.9
        turn(server)
        assert server._clients["RTDE"] == [client]
        lagging.full = False
        turn(server)
        assert not client.unsent
        clock[0], lagging.full = 1200.0, True
        turn(server, 150)
        clock[0] = 1210.1
        turn(server)
        assert server._clients["RTDE"] == []


@pytest.mark.skipif(not hasattr(socket, "TCP_USER_TIMEOUT"), reason="an option of Linux")
@pytest.mark.long
def test_one_that_acknowledges_nothing_any_more_gives_its_inputs_back(
    server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To the system one that never reads is as one that is gone: before this process has anything left to send."""
    monkeypatch.setattr(server_module, "UNREAD_TIMEOUT", 0.1)
    with socket.socket() as gone:
        gone.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, SLOW_READER)
        gone.connect((server.host, PORTS["RTDE"]))
        gone.sendall(pack_inputs_request(("input_int_register_0",)))
        gone.sendall(pack_outputs_request([f"output_double_register_{i}" for i in range(48)]) + pack(PacketKind.START))
        turn(server, 5)
        assert server.controller.inputs.owners
        monkeypatch.setattr(server_module, "UNREAD_TIMEOUT", math.inf)  # for the server's own check of unread bytes
        end = time.monotonic() + 60.0
        while server._clients["RTDE"] and time.monotonic() < end:
            turn(server)
        assert server._clients["RTDE"] == []
        assert server.controller.inputs.owners == {}


def test_what_is_written_for_one_that_never_reads_has_a_bound(server: Server, reader: Reader) -> None:
    with socket.socket() as client:
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, SLOW_READER)
        client.connect((server.host, PORTS["primary"]))
        server._poll(1.0)
        (deaf,) = server._clients["primary"]
        deaf.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SLOW_READER)
        server._program('def chat():\n  while True:\n    textmsg("' + "x" * 900 + '")\n    sync()\n  end\nend\n')
        for _ in range(1000):
            turn(server)
            assert reader.read() >= 1
        assert 50_000 < len(deaf.unsent) < 150_000
        assert server._clients["primary"] == [deaf]


def test_a_program_that_does_not_start_is_told_to_its_sender(server: Server) -> None:
    with connect(server, "primary") as client:
        turn(server, 5)
        server.controller.protective_stop("test")
        client.sendall(b"def late():\n  sync()\nend\n")
        turn(server, 20)
        assert b"late does not start: RUNNING, PROTECTIVE_STOP" in client.recv(65536)


def test_a_program_that_is_too_long_is_told_to_its_sender_whose_connection_ends(server: Server) -> None:
    with connect(server, "primary") as client:
        data, got = b"x" * (MAX_LENGTH + 10), b""
        with contextlib.suppress(ConnectionError):
            for _ in range(500):
                with contextlib.suppress(BlockingIOError):
                    data = data[client.send(data) :] if data else data
                with contextlib.suppress(BlockingIOError):
                    got += client.recv(65536)
                turn(server)
        assert f"a program has at most {MAX_LENGTH} characters".encode() in got
        assert server._clients["primary"] == []


def test_ten_clients_of_rtde_are_all_served_in_each_cycle_beside_one_that_does_not_read(server: Server) -> None:
    with socket.socket() as deaf:
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, SLOW_READER)
        deaf.connect((server.host, PORTS["RTDE"]))
        deaf.sendall(pack_outputs_request([f"output_double_register_{i}" for i in range(48)]) + pack(PacketKind.START))
        readers = [Reader(server) for _ in range(10)]
        others = [connect(server, name) for name in SERVICES if name != "RTDE" for _ in range(10)]
        turn(server, 80)
        for one in readers:
            one.read()
        for _ in range(200):
            turn(server)
            assert [one.read() for one in readers] == [1] * 10
        assert all(len(server._clients[name]) == 10 for name in SERVICES if name != "RTDE")
        for sock in (*others, *(one.socket for one in readers)):
            sock.close()


@pytest.mark.parametrize("service", SERVICES)
def test_one_that_is_gone_without_a_word_makes_room(server: Server, reader: Reader, service: str) -> None:
    """As a computer does that is switched off and on: its system answers for nothing that was before (RST)."""
    gone = connect(server, service)
    if service == "RTDE":
        gone.sendall(pack_inputs_request(("input_int_register_0",)))
    turn(server, 5)
    before = len(server._clients[service])
    gone.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    gone.close()
    turn(server, 5)
    assert len(server._clients[service]) == before - 1
    assert server.controller.inputs.owners == {}
    assert reader.read() >= 5


def flood(server: Server, reader: Reader, service: str, number: int, seed: int, batch: int = 2000) -> None:
    """Send malformed packets, anew where the connection is ended; the reader has its packet in each cycle."""
    dice, left, waiting = random.Random(seed), number, b""
    client = connect(server, service)
    while left or waiting:
        try:
            while left and len(waiting) < batch:
                waiting += malformed_packet(service, dice)
                left -= 1
            with contextlib.suppress(BlockingIOError):
                waiting = waiting[client.send(waiting) :]
            with contextlib.suppress(BlockingIOError):
                if not client.recv(65536):
                    raise ConnectionError
        except ConnectionError:
            client.close()
            client, waiting = connect(server, service), b""
        turn(server)
        assert reader.read() >= 1
    client.close()
    turn(server, 5)


@pytest.mark.parametrize("service", SERVICES)
def test_malformed_packets_change_nothing_for_another_client(server: Server, reader: Reader, service: str) -> None:
    flood(server, reader, service, 300, 16)
    assert server._clients["RTDE"]  # the reader is still there


@pytest.mark.long
@pytest.mark.parametrize("service", SERVICES)
def test_many_malformed_packets_change_nothing_for_another_client(server: Server, reader: Reader, service: str) -> None:
    """Ten thousand at once; what is left of them goes with a connection that is ended."""
    flood(server, reader, service, 10_000, 17, batch=10_000)
    server.controller.stop_program("test")
    server.controller.unlock(early=True)
    with connect(server, "secondary") as client:
        client.sendall(b"sec good():\n write_output_integer_register(7, 42)\nend\n")
        turn(server, 50)
    assert server.controller.output_ints[7] == 42
