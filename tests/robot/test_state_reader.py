"""The state reader and the foreign stops against the simulated controller, and against peers that misbehave."""

import socket
import threading

import pytest

from coneskin.errors import RobotConnectionError, RobotRefused, RobotTimeout
from coneskin.robot import rtde_codec, rtde_connection
from coneskin.robot.foreign import ForeignStops
from coneskin.robot.sim_process import SimulatedController, free_host
from coneskin.robot.state_reader import ControllerState, StateReader, decode_state
from coneskin.robot.stop_watch import Way

Q = (0.1, -1.2, 1.3, -1.4, -1.5, 0.6)


@pytest.fixture(scope="module")
def controller():
    with SimulatedController(model="ur5e", host=free_host(), start_q=Q) as simulated:
        yield simulated


def test_it_reads_what_the_controller_does(controller):
    with StateReader(controller.host) as reader:
        first, second = reader.wait(2.0), reader.wait(2.0)
    assert first.q == pytest.approx(Q, abs=1e-9)  # degrees on the simulator's command line
    assert first.speed == 0.0
    assert first.running
    assert not first.stopped_by_safety
    cycles = (second.controller_time - first.controller_time) / 0.002
    assert cycles == pytest.approx(round(cycles), abs=1e-6)
    assert round(cycles) >= 1
    reader.close()
    with pytest.raises(RobotConnectionError, match="is not open"):
        reader.read()


def test_safety_bits_and_modes_mean_what_the_manual_says():
    def state(mode=7, bits=1, runtime=2):
        return ControllerState(0.0, 0.0, (0,) * 6, (0, -3, 2, 0, 0, 0), mode, bits, runtime)

    assert state().speed == 3
    assert not state(bits=0b11).stopped_by_safety  # normal and reduced
    assert [bit for bit in range(11) if state(bits=1 << bit).stopped_by_safety] == [*range(2, 11)]
    assert not state(mode=5).running
    assert state().playing
    assert not state(runtime=4).playing
    with pytest.raises(RobotConnectionError, match="must hold"):
        decode_state(0.0, b"\x01")


def test_foreign_stops_reach_the_arm(controller):
    with ForeignStops(controller.host) as stops, StateReader(controller.host) as reader:
        assert list(stops.sockets()) == ["script", "dashboard"]
        stops.drain()
        for way in (Way.SCRIPT, Way.DASHBOARD):
            assert stops.use(way, 5.0)
        assert stops.use(Way.PROTECTIVE, 5.0)
        for _ in range(500):
            if reader.wait(2.0).stopped_by_safety:
                break
        else:
            pytest.fail("the protective stop did not reach the controller")
    assert stops.use(Way.SCRIPT, 5.0) is False
    stops.close()


class Peer:
    """Something on the RTDE port that is no controller: answers each read with the next of these bytes."""

    def __init__(self, *answers, close=True):
        self.host = free_host()
        self._server = socket.create_server((self.host, rtde_connection.PORT))
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
        self._thread.join(10)
        self._server.close()


ACCEPTED = rtde_codec.pack(ord("V"), b"\x01")
NO_Q = rtde_codec.pack(ord("O"), b"\x01DOUBLE,NOT_FOUND,VECTOR6D,INT32,UINT32,UINT32")
TYPES = rtde_codec.pack(ord("O"), b"\x01DOUBLE,VECTOR6D,VECTOR6D,INT32,UINT32,UINT32")


@pytest.mark.parametrize(
    ("answers", "close", "error", "words"),
    [
        ((), False, RobotTimeout, "no answer from the controller"),
        ((rtde_codec.pack(ord("V"), b"\x00"),), True, RobotConnectionError, "does not speak RTDE version 2"),
        ((ACCEPTED, NO_Q), True, RobotRefused, "actual_q is not known"),
        ((ACCEPTED, TYPES, rtde_codec.pack(ord("S"), b"\x00")), True, RobotConnectionError, "does not start"),
        ((ACCEPTED,), True, RobotConnectionError, "has closed the connection during set-up"),
        ((b"HTTP/1.1 400 Bad Request\r\n\r\n",), True, RobotConnectionError, "has closed the connection during set-up"),
    ],
)  # fmt: skip
def test_a_peer_that_is_no_controller_is_one_clear_line(answers, close, error, words):
    with Peer(*answers, close=close) as peer:
        reader = StateReader(peer.host, timeout=0.3)
        with pytest.raises(error, match=words), reader:
            pass
        assert reader.fileno() == -1


def test_the_end_of_the_connection_is_an_error_and_not_silence():
    with (
        Peer(ACCEPTED, TYPES, rtde_codec.pack(ord("S"), b"\x01")) as peer,
        StateReader(peer.host, timeout=1.0) as reader,
        pytest.raises(RobotConnectionError, match="has closed the connection"),
    ):
        reader.wait(5.0)


def test_nobody_there():
    host = free_host()
    with pytest.raises(RobotConnectionError, match=rf"cannot reach the controller {host}:30004"):
        StateReader(host).__enter__()
    with pytest.raises(RobotConnectionError, match=rf"cannot reach port 30003 of the controller {host}"):
        ForeignStops(host).__enter__()
