"""The sockets of the simulated controller, in this process and cycle by cycle: no wheel, no waiting."""

from __future__ import annotations

import socket

from coneskin.robot.rtde_codec import Packet, PacketKind, Recipe, pack_outputs_request, pack_start_request, split
from coneskin.robot.sim_controller import Controller
from coneskin.robot.sim_options import Options
from coneskin.robot.sim_process import free_host
from coneskin.robot.sim_server import PORTS, Server

NAMES = ("timestamp", *(f"output_double_register_{i}" for i in range(48)))


def turn(server: Server, cycles: int) -> None:
    for _ in range(cycles):
        server._poll(0.0)
        server._cycle()
        server._publish()


def read_all(sock: socket.socket, server: Server, cycles: int) -> list[Packet]:
    """What a client reads that has time to read, while the server goes on."""
    sock.setblocking(False)
    packets, rest = [], b""
    for _ in range(cycles):
        turn(server, 1)
        try:
            while data := sock.recv(65536):
                more, rest = split(rest + data)
                packets += more
        except BlockingIOError:
            pass
    return packets


def test_a_client_that_does_not_read_gets_whole_packets_and_the_newest_later() -> None:
    controller = Controller(Options())
    with Server(controller, free_host()) as server, socket.socket() as deaf:
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        deaf.connect((server.host, PORTS["RTDE"]))
        deaf.sendall(pack_outputs_request(NAMES) + pack_start_request())
        server._poll(1.0)
        (client,) = server._clients["RTDE"]
        client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
        turn(server, 2000)
        assert controller.cycle == 2000  # the cycle does not wait for it
        assert 0 < len(client.unsent) <= Recipe(NAMES).size + 3  # nothing piles up
        packets = read_all(deaf, server, 200)
        data = [packet for packet in packets if packet.kind is PacketKind.DATA]
        stamps = [float(str(Recipe(NAMES).unpack(packet.payload)[0])) for packet in data]
        assert stamps == sorted(stamps)
        assert len(stamps) < 1000  # what it could not read was skipped
        assert stamps[-1] > 2000 * 0.002  # and now it is up to date


def test_a_client_that_reads_nothing_for_ten_seconds_is_dropped() -> None:
    controller = Controller(Options())
    with Server(controller, free_host()) as server, socket.socket() as deaf:
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        deaf.connect((server.host, PORTS["RTDE"]))
        deaf.sendall(pack_outputs_request(NAMES) + pack_start_request())
        server._poll(1.0)
        (client,) = server._clients["RTDE"]
        client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
        turn(server, 2000)
        client.stuck_since -= 11.0
        turn(server, 1)
        assert server._clients["RTDE"] == []


def test_a_client_that_goes_gives_its_inputs_back() -> None:
    from coneskin.robot.rtde_codec import pack_inputs_request

    controller = Controller(Options())
    with Server(controller, free_host()) as server:
        with socket.create_connection((server.host, PORTS["RTDE"])) as sock:
            sock.sendall(pack_inputs_request(("input_int_register_0",)))
            server._poll(1.0)
            server._poll(1.0)
            assert list(controller.owners) == ["input_int_register_0"]
        server._poll(1.0)
        assert controller.owners == {}


def test_a_program_that_another_overtakes_while_it_is_translated_never_starts() -> None:
    controller = Controller(Options(start_delay=0.002))
    long = "def long():\n" + "  set_standard_digital_out(0, True)\n" * 400 + "  sleep(100)\nend\n"
    with Server(controller, free_host()) as server:
        with socket.create_connection((server.host, PORTS["primary"])) as sock:
            sock.sendall(long.encode() + b"def short():\n  sleep(100)\nend\n")
            while controller.program is None:
                turn(server, 1)
        server._compiler.__exit__()  # the long one is translated by now
        turn(server, 10)
        assert controller.program.name == "short"
        assert controller.digital_outputs == 0
