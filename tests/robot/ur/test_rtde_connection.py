"""State reader and stop sockets against the simulated controller, and against peers that misbehave."""

import math
import select
import socket
import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coneskin.core.errors import RobotConnectionError, RobotRefused, RobotTimeout
from coneskin.robot.driver.values import StopPath
from coneskin.robot.sim.process import free_host
from coneskin.robot.ur import rtde_codec
from coneskin.robot.ur.rtde_codec import STATE_RECIPE, decode_state
from coneskin.robot.ur.rtde_connection import RtdeConnection, StateReader
from coneskin.robot.ur.stop_sockets import StopSockets
from tests.support.served_controller import served

PATIENCE = 60.0  # s; a slow machine is no failure
ZEROS = (0.0,) * 6
Q = (0.1, -1.2, 1.3, -1.4, -1.5, 0.6)


@pytest.fixture(scope="module")
def controller():
    with served(model="ur5e", start_q=Q) as controller:
        yield controller


def test_it_reads_what_the_controller_does(controller):
    with StateReader(controller.host, PATIENCE) as reader:
        first, second = reader.wait(PATIENCE), reader.wait(PATIENCE)
    assert first.q == Q
    assert first.speed == 0.0
    assert first.powered
    assert not first.stopped_by_safety
    cycles = (second.controller_time - first.controller_time) / 0.002
    assert cycles == pytest.approx(round(cycles), abs=1e-6)
    assert round(cycles) >= 1
    reader.close()
    with pytest.raises(RobotConnectionError, match="is not open"):
        reader.read()


def test_it_reads_the_currents_that_the_motors_take(controller):
    assert controller.call("resist 0 3.5 0 0 0 -1e-1") == {"result": [0.0, 3.5, 0.0, 0.0, 0.0, -0.1]}
    with StateReader(controller.host, PATIENCE) as reader:
        state = reader.wait(PATIENCE)
    controller.call("resist 0 0 0 0 0 0")
    assert state.current == (0.0, 3.5, 0.0, 0.0, 0.0, -0.1)
    assert state.target_current == ZEROS


@pytest.mark.parametrize("line", ["resist 1 1 1 1 1", "resist 1 1 1 1 1 1 1", "resist 1 1 1 nan 1 1"])
def test_a_current_that_cannot_be_is_refused(controller, line):
    assert "unknown fault" in controller.call(line)["error"]


def test_a_state_without_currents_has_none_and_one_with_nonsense_is_refused():
    modes = (0.0, ZEROS, ZEROS, 7, 1, 2)
    old = STATE_RECIPE.pack((*modes, ZEROS, ZEROS))[: -2 * 6 * 8]
    assert decode_state(0.0, old).current is None
    with pytest.raises(RobotConnectionError, match="motor currents are not finite"):
        decode_state(0.0, STATE_RECIPE.pack((*modes, (math.nan,) * 6, ZEROS)))


def test_safety_bits_and_modes_mean_what_the_manual_says():
    def state(mode=7, bits=1, runtime=2):
        qd = (0.0, -3.0, 2.0, 0.0, 0.0, 0.0)
        return decode_state(0.0, STATE_RECIPE.pack((0.0, ZEROS, qd, mode, bits, runtime, ZEROS, ZEROS)))

    assert state().speed == 3
    assert not state(bits=0b11).stopped_by_safety  # normal and reduced
    assert [bit for bit in range(11) if state(bits=1 << bit).stopped_by_safety] == [*range(2, 11)]
    assert not state(mode=5).powered
    assert state().program_running
    assert not state(runtime=4).program_running
    with pytest.raises(RobotConnectionError, match="must hold"):
        decode_state(0.0, b"\x01")


def test_external_stops_reach_the_arm(controller):
    with StopSockets(controller.host, PATIENCE) as stops, StateReader(controller.host, PATIENCE) as reader:
        assert list(stops.sockets()) == ["program", "command"]
        stops.drain()
        for path in (StopPath.PROGRAM, StopPath.COMMAND):
            assert stops.use(path, 5.0)
        assert stops.use(StopPath.PROTECTIVE, 5.0)
        for _ in range(500):
            if reader.wait(PATIENCE).stopped_by_safety:
                break
        else:
            pytest.fail("the protective stop did not reach the controller")
    assert stops.use(StopPath.PROGRAM, 5.0) is False
    stops.close()


def test_a_controller_in_local_control_is_refused_and_one_that_is_switched_is_told(controller):
    """Its script port and its dashboard take connections, and no stop: found at the start, and while it is watched."""
    with StopSockets(controller.host, PATIENCE) as stops:
        stops.ask()
        assert select.select(list(stops.sockets().values()), (), (), PATIENCE)[0]
        assert stops.drain() == []
        controller.call("local control")
        try:
            gone = []
            while stops.sockets():
                stops.ask()
                select.select(list(stops.sockets().values()), (), (), PATIENCE)
                gone += stops.drain()
            assert {name for name, _, _ in gone} == {"program", "command"}
            assert all("local control" in why for _, _, why in gone)
            assert any("Choose Remote Control" in why for _, _, why in gone)
            assert stops.sockets() == {}
            with (
                pytest.raises(RobotRefused, match="local control: it refuses every stop"),
                StopSockets(controller.host),
            ):
                pass
        finally:
            controller.call("remote control")
            for _, sock, _ in gone:
                sock.close()


def test_a_read_only_connection_is_told_by_the_answer_to_a_stop(controller):
    """Opened in local control, and the controller is in remote control again: only the program is refused."""
    with StopSockets(controller.host, PATIENCE) as stops:
        controller.call("local control")
        try:
            gone = []
            while not gone:
                select.select([stops.sockets()["program"]], (), (), PATIENCE)
                gone = stops.drain()
            assert [name for name, _, _ in gone] == ["program"]
            assert stops.reopen()
            assert select.select([stops.sockets()["program"]], (), (), PATIENCE)[0]  # taken while it is local
        finally:
            controller.call("remote control")
        assert stops.use(StopPath.PROGRAM, 5.0)
        refused = []
        while not refused:
            select.select([stops.sockets()["program"]], (), (), PATIENCE)
            refused = stops.drain()
        assert [name for name, _, _ in refused] == ["program"]
        assert "is read-only (C210)" in refused[0][2]
        assert "Choose Remote Control" in refused[0][2]
        assert stops.reopen()
        assert stops.use(StopPath.PROGRAM, 5.0)
        assert stops.drain() == []
        for _, sock, _ in (*gone, *refused):
            sock.close()


@pytest.mark.parametrize("size", [1, 7, 19, 1400, 70_000])
def test_what_the_primary_interface_says_is_told_apart_however_it_is_chopped(size):
    error = bytes.fromhex("0000002714") + bytes(8) + b"\xfd\x06" + (210).to_bytes(4, "big") + bytes(20)
    other = error.replace((210).to_bytes(4, "big"), (153).to_bytes(4, "big"))
    state = (1400).to_bytes(4, "big") + b"\x10" + bytes(1395)
    for said, wanted in ((state + other + state, False), (state + error[:-1], False), (state + error + state, True)):
        stops = StopSockets("host")
        for start in range(0, len(said), size):
            assert stops.refusal("program", said[start : start + size]) == ""
        assert stops._read_only is wanted


@given(st.binary(max_size=200))
def test_nonsense_on_the_primary_interface_is_no_error(data):
    stops = StopSockets("host")
    stops.refusal("program", data)
    assert len(stops._rest) <= len(data)


@pytest.mark.long
def test_a_program_that_is_not_seen_to_run_proves_no_stop(controller, monkeypatch):
    """The dashboard answers, and the script port swallows what it is sent, as a read-only one does."""
    monkeypatch.setattr(StopSockets, "run", lambda *_: True)
    with pytest.raises(RobotRefused, match=r"has not run a test program .* \(C210\).* Remote Control"):
        StopSockets(controller.host, 0.5).__enter__()


def test_a_refused_stop_is_an_answer_too(controller):
    with StopSockets(controller.host, PATIENCE) as stops:
        controller.call("local control")
        try:
            stops.use(StopPath.COMMAND, 5.0)
            gone = []
            while not gone:
                select.select([stops.sockets()["command"]], (), (), PATIENCE)
                gone = stops.drain()
            assert all("local control" in why for _, _, why in gone)
        finally:
            controller.call("remote control")
            for _, sock, _ in gone:
                sock.close()


def test_polyscope_x_is_refused_in_one_line():
    with (
        served(version=(10, 11)) as controller,
        pytest.raises(RobotRefused, match=r"PolyScope X \(10\.11\)") as refused,
    ):
        StopSockets(controller.host, PATIENCE).__enter__()
    assert "29999" not in str(refused.value)


@pytest.mark.parametrize("answer", [b"", b"Connected: Universal Robots Dashboard Server\n"])
def test_a_dashboard_that_answers_nothing_proves_no_stop(monkeypatch, answer):
    ours, theirs = socket.socketpair()
    with ours, theirs:
        theirs.sendall(answer)
        monkeypatch.setattr(StopSockets, "_open", lambda *_: ours)
        monkeypatch.setattr(StopSockets, "_refuse_polyscope_x", lambda _: None)
        with pytest.raises(RobotConnectionError, match="does not answer within"), StopSockets("127.0.0.1", 0.05):
            pass


def test_software_that_knows_no_local_control_is_taken(monkeypatch):
    ours, theirs = socket.socketpair()
    with ours, theirs:
        theirs.sendall(b"Connected: Universal Robots Dashboard Server\ncould not understand: 'is in remote control'\n")
        monkeypatch.setattr(StopSockets, "_open", lambda *_: ours)
        monkeypatch.setattr(StopSockets, "_refuse_polyscope_x", lambda _: None)
        monkeypatch.setattr(StopSockets, "_prove_program", lambda _: None)
        with StopSockets("127.0.0.1", PATIENCE) as stops:
            assert list(stops.sockets()) == ["program", "command"]


class Peer:
    """Something on the RTDE port that is no controller: answers each read with the next of these bytes."""

    def __init__(self, *answers, close=True):
        self.host = free_host()
        self._server = socket.create_server((self.host, RtdeConnection.port))
        self._answers, self._close = answers, close
        self._thread = threading.Thread(target=self._serve)

    def __enter__(self):
        self._thread.start()
        return self

    def _serve(self):
        client, _ = self._server.accept()
        with client:
            for answer in self._answers:
                client.recv(4096)
                client.sendall(answer)
            if not self._close:
                client.recv(4096)  # silent until the reader goes away
                client.recv(4096)

    def __exit__(self, *_):
        self._thread.join(60)
        self._server.close()


GONE = "has closed the connection during set-up|is gone: Connection reset"  # whichever the system sees first
ACCEPTED = rtde_codec.pack(ord("V"), b"\x01")
NO_Q = rtde_codec.pack(ord("O"), b"\x01DOUBLE,NOT_FOUND,VECTOR6D,INT32,UINT32,UINT32,VECTOR6D,VECTOR6D")
TYPES = rtde_codec.pack(ord("O"), b"\x01DOUBLE,VECTOR6D,VECTOR6D,INT32,UINT32,UINT32,VECTOR6D,VECTOR6D")


@pytest.mark.parametrize(
    ("answers", "close", "error", "words"),
    [
        ((), False, RobotTimeout, "no answer from the controller"),
        ((rtde_codec.pack(ord("V"), b"\x00"),), True, RobotConnectionError, "does not speak RTDE version 2"),
        ((ACCEPTED, NO_Q), True, RobotRefused, "actual_q is not known"),
        ((ACCEPTED, TYPES, rtde_codec.pack(ord("S"), b"\x00")), True, RobotConnectionError, "does not start"),
        ((ACCEPTED,), True, RobotConnectionError, GONE),
        ((b"HTTP/1.1 400 Bad Request\r\n\r\n",), True, RobotConnectionError, GONE),
    ],
)  # fmt: skip
def test_a_peer_that_is_no_controller_is_one_clear_line(answers, close, error, words):
    with Peer(*answers, close=close) as peer:
        reader = StateReader(peer.host, timeout=60.0 if answers else 0.3)
        with pytest.raises(error, match=words), reader:
            pass
        assert reader.fileno() == -1


def test_the_end_of_the_connection_is_an_error_and_not_silence():
    with (
        Peer(ACCEPTED, TYPES, rtde_codec.pack(ord("S"), b"\x01")) as peer,
        StateReader(peer.host, timeout=60.0) as reader,
        pytest.raises(RobotConnectionError, match="has closed the connection"),
    ):
        reader.wait(60.0)


def test_no_controller_there():
    host = free_host()
    with pytest.raises(RobotConnectionError, match=rf"cannot reach the controller {host}:30004"):
        StateReader(host).__enter__()
    with pytest.raises(RobotConnectionError, match=rf"cannot reach the controller {host}:30004"):
        StopSockets(host).__enter__()
    with (
        served(closed=frozenset({"primary"})) as controller,
        pytest.raises(RobotConnectionError, match=rf"cannot reach port 30001 of the controller {controller.host}"),
    ):
        StopSockets(controller.host).__enter__()
