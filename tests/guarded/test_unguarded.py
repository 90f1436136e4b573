"""An arm that another program moves, and whose guard hangs or is gone: it stands, and it is held at standstill."""

import signal
import socket
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress

import pytest

from coneskin.core.channel import Channel, decode_json
from coneskin.core.errors import RobotConnectionError, SensorError
from coneskin.robot.driver.messages import LEAVE, Heartbeat
from coneskin.session.child_processes import ChildProcesses
from coneskin.session.session import guard
from tests.support.scenes import START

from .guarded_session import DEADLINE, fast, is_reset, kill, scene_for, until

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the virtual skin needs a pseudo-terminal")

from coneskin.robot.sim.process import SimulatedController, free_host  # noqa: E402

from .test_external_control import RAW, send  # noqa: E402


@pytest.fixture
def controller():
    with SimulatedController(model="UR5e", host=free_host(), start_q=START) as simulated:
        yield simulated


def external(simulated):
    return scene_for(simulated, control="external")


def start_again(controller):
    """A user's program that heals itself, and gets no farther than into a protective stop."""
    before = controller.wait_for_standstill()["q"][0]

    def is_held():
        now = controller.state()
        if now["runtime"] != "PLAYING" and now["safety"] != "PROTECTIVE_STOP":
            send(controller.host, 30002, RAW)  # the first stop, still under way, has taken its place: it hardly moved
        return now["safety"] == "PROTECTIVE_STOP"

    until(is_held)
    until(lambda: controller.state()["runtime"] != "PLAYING")  # the protective stop pauses it
    assert abs(controller.wait_for_standstill()["q"][0] - before) < 2.0, "rad; to its goals are 3.3"


@pytest.mark.promise("P46")
@pytest.mark.long
@pytest.mark.parametrize(("gone", "number"), [(("guard",), signal.SIGSTOP), (("watchdog", "guard"), signal.SIGKILL)])
def test_a_program_that_starts_again_without_a_guard_is_stopped_again(controller, gone, number):
    with guard(external(controller)) as session:
        send(controller.host, 30002, RAW)
        until(lambda: fast(controller))
        for name in gone:
            kill(session, name, number)
        controller.wait_for_standstill()
        lost = ("guard_exited",) if number is signal.SIGKILL else ("guard_unresponsive",)
        until(lambda: any(event.name in lost for event in session.events))
        start_again(controller)
        with pytest.raises(RobotConnectionError, match="ended unannounced" if number is signal.SIGKILL else "hangs"):
            session.check()
        with pytest.raises(RobotConnectionError):
            session.reset()
        # after its watch of 0.7 s
        until(lambda: any(event.name == "fallback_stop" and event.details["stands"] for event in session.events))
        for name in gone:
            kill(session, name, signal.SIGCONT)


@pytest.mark.promise("P46")
@pytest.mark.long
def test_a_guard_that_has_hung_guards_again_and_is_missed_again(controller):
    with guard(external(controller)) as session:
        kill(session, "guard", signal.SIGSTOP)
        assert session.wait_for(("guard_unresponsive",), DEADLINE) is not None
        kill(session, "guard", signal.SIGCONT)
        assert session.wait_for(("latched",), DEADLINE) is not None
        until(lambda: is_reset(session))
        send(controller.host, 30002, RAW)
        until(lambda: fast(controller))
        for name in ("watchdog", "guard"):
            kill(session, name, signal.SIGSTOP)
        controller.wait_for_standstill()  # the fallback stop was not used up
        for name in ("watchdog", "guard"):
            kill(session, name, signal.SIGCONT)


@pytest.mark.long
def test_a_touch_that_cannot_be_is_refused_and_nothing_else_happens(controller):
    with guard(external(controller)) as session:
        send(controller.host, 30002, RAW)
        until(lambda: fast(controller))
        for wrong, message in (
            ({"sensor": "nope"}, r"must be one of sensor 0/0 \(id 0\), got 'nope'"),
            ({"sensor": 1}, r"must be one of sensor 0/0 \(id 0\), got 1"),
            ({"u": 130.0}, "a touch must lie on sensor 0/0: u up to 0.26 m"),
            ({"phi": 90.0}, "a touch must lie on sensor 0/0"),
            ({"force": -3.0}, r"touch.force must be finite and not negative \[N\], got -3.0"),
            ({"duration": -3.0}, "must end after it starts"),
        ):
            with pytest.raises(SensorError, match=message):
                session.touch(**{"u": 0.13, "phi": 1.55, **wrong})
        assert fast(controller)
        session.check()
        session.touch(0.13, 1.55, duration=0.2, sensor=0)
        assert session.wait_for(("latched",), DEADLINE) is not None


# ---- the last resort, by whatever port opens


class Ports:
    """A controller of which only some ports answer, and none says a word."""

    def __init__(self, host, numbers):
        self.got = dict.fromkeys(numbers, b"")
        self._socks = []
        self._threads = []
        for number in numbers:
            sock = socket.create_server((host, number))
            self._socks.append(sock)
            self._run(self._accept, sock, number)

    def _run(self, target, *arguments):
        self._threads.append(threading.Thread(target=target, args=arguments, daemon=True))
        self._threads[-1].start()

    def _accept(self, sock, number):
        while True:
            try:
                other, _ = sock.accept()
            except OSError:
                return
            self._socks.append(other)
            self._run(self._read, other, number)

    def _read(self, sock, number):
        with suppress(OSError):
            while data := sock.recv(4096):
                self.got[number] += data

    def close(self):
        for sock in self._socks:
            with suppress(OSError):
                sock.shutdown(socket.SHUT_RDWR)
            sock.close()


@pytest.mark.promise("P45")
@pytest.mark.long
def test_a_stop_goes_out_by_whatever_port_opens():
    hosts = []
    for _ in range(4):
        hosts.append(free_host(hosts))
    with ThreadPoolExecutor() as pool:  # each waits for ports that do not answer
        list(pool.map(stop_by, hosts, [(30001, 29999), (30001, 29999, 30004), (30001,), (29999,)]))


def stop_by(host, numbers):
    """The second watchdog of a guard that is gone, alone with a controller that says nothing."""
    ports, ends = Ports(host, numbers), []
    scene, processes = scene_for(type("Host", (), {"host": host}), control="external"), ChildProcesses()
    session = processes._start_helper("second", "coneskin.robot.stop.guard_watchdog", scene, ends)
    guard = Channel(ends[0])
    try:
        until(lambda: guard.receive() != [])
        guard.send(Heartbeat().encode())
        guard.close()
        port, word = (30001, b"stopj(10.000)") if 30001 in numbers else (29999, b"stop\n")
        until(lambda: word in ports.got[port])
        seen = len(ports.got[port])
        until(lambda: len(ports.got[port]) > seen)  # and again, now and then
        session.send(LEAVE)
        assert processes.children["second"].wait(DEADLINE) == 0  # it gives up: nobody can say that it stands
        assert [decode_json(message) for message in session.receive()] == [{"stands": False}]
    finally:
        session.close()
        processes.children["second"].wait()
        ports.close()
