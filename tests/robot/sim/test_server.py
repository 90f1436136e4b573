"""The sockets of the simulated controller, in this process and cycle by cycle: no wheel, no waiting."""

from __future__ import annotations

import contextlib
import io
import socket

import pytest

from coneskin.robot.sim.machine.controller import Controller
from coneskin.robot.sim.machine.states import Options
from coneskin.robot.sim.process import free_host
from coneskin.robot.sim.server import PORTS, Server
from coneskin.robot.ur.rtde_codec import Packet, PacketKind, Recipe, pack, pack_outputs_request, split

NAMES = ("timestamp", *(f"output_double_register_{i}" for i in range(48)))


def turn(server: Server, cycles: int) -> None:
    for _ in range(cycles):
        server._poll(0.0)
        server._cycle()
        server._publish()


def read_all(sock: socket.socket, server: Server, cycles: int) -> list[Packet]:
    """Return the packets of a client that reads in each cycle while the server goes on."""
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
        deaf.sendall(pack_outputs_request(NAMES) + pack(PacketKind.START))
        server._poll(1.0)
        (client,) = server._clients["RTDE"]
        client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
        turn(server, 2000)
        assert controller.cycle == 2000  # the cycle does not wait for it
        assert len(client.unsent) <= Recipe(NAMES).size + 3  # nothing piles up
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
        deaf.sendall(pack_outputs_request(NAMES) + pack(PacketKind.START))
        server._poll(1.0)
        (client,) = server._clients["RTDE"]
        client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
        since = None
        while not client.unsent or client.stuck_since != since:  # until the system takes nothing more
            since = client.stuck_since
            turn(server, 200)
        client.stuck_since -= 11.0
        turn(server, 1)
        assert server._clients["RTDE"] == []


def test_a_client_that_goes_gives_its_inputs_back() -> None:
    from coneskin.robot.ur.rtde_codec import pack_inputs_request

    controller = Controller(Options())
    with Server(controller, free_host()) as server:
        with socket.create_connection((server.host, PORTS["RTDE"])) as sock:
            sock.sendall(pack_inputs_request(("input_int_register_0",)))
            server._poll(1.0)
            server._poll(1.0)
            assert list(controller.inputs.owners) == ["input_int_register_0"]
        server._poll(1.0)
        assert controller.inputs.owners == {}


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


def test_a_cut_network_drops_packets_both_ways_and_closes_nothing() -> None:
    controller = Controller(Options(start_delay=0.002))
    with Server(controller, free_host()) as server:
        script = socket.create_connection((server.host, PORTS["realtime"]))
        rtde = socket.create_connection((server.host, PORTS["RTDE"]))
        rtde.sendall(pack_outputs_request(NAMES) + pack(PacketKind.START))
        turn(server, 5)
        assert read_all(rtde, server, 20)
        assert server.faults.answer("cut network") == '{"result": true}'
        read_all(rtde, server, 1)  # what was on its way
        script.sendall(b"def late():\n  sleep(100)\nend\n")
        cycle = controller.cycle
        assert read_all(rtde, server, 50) == []
        assert controller.cycle == cycle + 50  # the arm lives
        assert controller.program is None
        with pytest.raises(TimeoutError):
            socket.create_connection((server.host, PORTS["dashboard"]), 0.1)
        server.faults.answer("restore scripts")
        while controller.program is None:  # what was sent meanwhile arrives
            turn(server, 1)
        assert read_all(rtde, server, 20) == []  # the others are still cut
        server.faults.answer("restore network")
        assert read_all(rtde, server, 20)
        with socket.create_connection((server.host, PORTS["dashboard"]), 60.0) as new:
            turn(server, 20)
            assert new.recv(100).startswith(b"Connected")
        script.close()
        rtde.close()


def test_a_silent_dashboard_takes_commands_and_says_nothing() -> None:
    with Server(Controller(Options()), free_host()) as server, socket.socket() as client:
        server.faults.answer("dashboard silent")
        client.connect((server.host, PORTS["dashboard"]))
        server._poll(1.0)
        client.sendall(b"robotmode\n")
        server._poll(1.0)
        server.faults.answer("dashboard normal")
        client.sendall(b"quit\n")
        server._poll(1.0)
        assert client.makefile("rb").read() == b"Disconnected\n"  # no greeting, and no mode


def read_some(sock: socket.socket, server: Server, cycles: int) -> bytes:
    sock.setblocking(False)
    got = b""
    for _ in range(cycles):
        turn(server, 1)
        with contextlib.suppress(BlockingIOError):
            got += sock.recv(1 << 20)
    return got


def client_packets(data: bytes) -> list[tuple[int, bytes]]:
    """Cut what a client interface has sent into (kind, packet)."""
    found = []
    while data:
        size = int.from_bytes(data[:4], "big")
        found.append((data[4], data[:size]))
        data = data[size:]
    return found


def test_the_primary_interface_tells_of_a_program_and_of_its_mistake() -> None:
    with Server(Controller(Options()), free_host()) as server, socket.socket() as client:
        client.connect((server.host, PORTS["primary"]))
        server._poll(1.0)  # each waits until the bytes are there
        client.sendall(b'def good():\n  textmsg("hello")\n  sync()\nend\n')
        server._poll(1.0)
        got = read_some(client, server, 60)
        client.sendall(b"def bad():\n  no_such()\nend\n")
        server._poll(1.0)
        packets = client_packets(got + read_some(client, server, 60))
        assert [kind for kind, _ in packets[:2]] == [20, 16]  # version, state
        messages = b"".join(packet for kind, packet in packets if kind == 20)
        for text in (b"PROGRAM_XXX_STARTEDgood", b"hello", b"PROGRAM_XXX_STOPPEDgood"):
            assert text in messages
        assert b"\x0a\0\0\0\x02\0\0\0\x03compile_error_name_not_found:no_such:" in messages  # line 2, column 3
        assert sum(kind == 16 for kind, _ in packets) == 3  # and ten more a second


@pytest.mark.long
def test_the_secondary_interface_sends_the_state_alone_and_the_realtime_one_each_cycle() -> None:
    with Server(Controller(Options()), free_host()) as server:
        with socket.socket() as secondary, socket.socket() as realtime:
            secondary.connect((server.host, PORTS["secondary"]))
            realtime.connect((server.host, PORTS["realtime"]))
            server._poll(1.0)
            server._poll(1.0)
            secondary.sendall(b'textmsg("hello")\n')
            server._poll(1.0)
            fast = read_some(realtime, server, 100)
            slow = client_packets(read_some(secondary, server, 2))
        assert [kind for kind, _ in slow] == [20, 16, 16, 16]
        assert len(fast) // 1220 >= 100
        assert len(fast) % 1220 == 0


def test_one_that_uploads_and_never_reads_stays_connected_and_holds_nothing_up() -> None:
    controller = Controller(Options())
    with Server(controller, free_host()) as server, socket.socket() as deaf:
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        deaf.connect((server.host, PORTS["realtime"]))
        server._poll(1.0)
        (client,) = server._clients["realtime"]
        client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
        for _ in range(100):  # until the system takes nothing more for it
            turn(server, 200)
            if client.unsent:
                break
        assert 0 < len(client.unsent) <= 1220
        deaf.sendall(b"def late():\n  while True:\n    sync()\n  end\nend\n")
        server._poll(1.0)
        turn(server, 20)
        assert controller.program is not None
        assert controller.program.name == "late"


def test_the_commands_of_the_client_library_act_on_the_power_and_the_stop() -> None:
    controller = Controller(Options())
    with Server(controller, free_host()) as server, socket.socket() as client:
        client.connect((server.host, PORTS["primary"]))
        server._poll(1.0)

        def send(line: str) -> str:
            client.sendall(line.encode() + b"\n")
            server._poll(1.0)
            return f"{controller.robot_mode.name} {controller.safety.name}"

        assert send("power off") == "POWER_OFF NORMAL"
        assert send("power on") == "IDLE NORMAL"
        assert send("set robotmode run") == "RUNNING NORMAL"
        controller.protective_stop("test")
        assert send("set unlock protective stop") == "RUNNING NORMAL"


def test_the_dashboard_ends_a_connection_that_has_said_quit() -> None:
    with Server(Controller(Options()), free_host()) as server, socket.socket() as client:
        client.connect((server.host, PORTS["dashboard"]))
        server._poll(1.0)
        client.sendall(b"robotmode\nquit\n")
        server._poll(1.0)
        said = client.makefile("rb").read()  # until the other side has closed
        assert said.splitlines()[1:] == [b"Robotmode: RUNNING", b"Disconnected"]
        assert server._clients["dashboard"] == []


def test_a_read_only_port_sends_what_the_other_does_and_takes_no_program() -> None:
    """Nor a command; ports 30011 to 30013."""
    log = io.StringIO()
    with Server(Controller(Options(), log), free_host()) as server, contextlib.ExitStack() as stack:
        ports = (30001, 30011, 30012, 30013)
        socks = {port: stack.enter_context(socket.create_connection((server.host, port), 60.0)) for port in ports}
        turn(server, 10)
        for port, text in ((30011, b"stop program\n"), (30012, b"set_digital_out(0, True)\n"), (30013, b"halt\n")):
            socks[port].sendall(text)
        turn(server, 100)
        assert log.getvalue().count("this port is read-only") == 3
        assert '"event": "script"' not in log.getvalue()
        said = {port: sock.recv(1 << 20) for port, sock in socks.items()}
    assert said[30011].startswith(said[30001][:500])
    assert len(said[30012]) > 2000
    assert said[30013][:4] == (1220).to_bytes(4, "big")


def test_ten_clients_of_each_service_are_greeted_and_looked_after() -> None:
    with Server(Controller(Options()), free_host()) as server, contextlib.ExitStack() as stack:
        for name, port in PORTS.items():
            for _ in range(10):
                stack.enter_context(socket.create_connection((server.host, port), 60.0))
                server._poll(1.0)
            clients = server._clients[name]
            assert len(clients) == 10
            # one that is gone without a word is noticed by the operating system
            assert all(client.socket.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE) for client in clients)
        turn(server, 100)
        assert all(len(clients) == 10 for name, clients in server._clients.items() if name in PORTS)


@pytest.mark.parametrize(
    ("options", "missing"),
    [
        ({"closed": frozenset({"primary", "RTDE"})}, {"primary", "primary (read-only)", "RTDE"}),
        ({"version": (10, 11)}, {"dashboard"}),
    ],
)
def test_what_is_switched_off_or_not_there_takes_no_connection(options: dict[str, object], missing: set[str]) -> None:
    with Server(Controller(Options(**options)), free_host()) as server:  # type: ignore[arg-type]
        server.cut("dashboard")
        server.restore("dashboard")
        for name, port in PORTS.items():
            if name not in missing:
                socket.create_connection((server.host, port), 60.0).close()
                continue
            with pytest.raises(ConnectionRefusedError):
                socket.create_connection((server.host, port), 60.0)


@pytest.mark.long
def test_a_controller_that_was_frozen_has_lost_cycles_and_no_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """A client would else take every later state for a late one."""
    now = [100.0]
    monkeypatch.setattr("coneskin.robot.sim.server.time.monotonic", lambda: now[0])
    controller = Controller(Options())
    with Server(controller, free_host()) as server:

        def wait(timeout: float) -> None:
            now[0] += max(timeout, 1e-4)
            if controller.cycle == 50 and controller.frozen == 0.0:
                now[0] += 0.3  # in both waits of that cycle
            if controller.cycle == 100:
                server.stop()

        monkeypatch.setattr(server, "_poll", wait)
        server.run()
    assert controller.cycle == 100
    # a cycle, and the steps of this test's own clock
    assert controller.timestamp == pytest.approx(now[0] - 100.0, abs=0.003)
    assert controller.frozen == pytest.approx(0.6, abs=0.003)
