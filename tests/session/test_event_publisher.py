"""Published events: what a subscriber in Python, C and JavaScript gets, and what never reaches the guard.

ZeroMQ's own socket and a broker of Debian (mosquitto) take what the others publish.
"""

import json
import logging
import math
import os
import shutil
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from coneskin.cli import main
from coneskin.core.errors import MissingExtra, SceneError
from coneskin.robot.guard.signals.journal import EventName, GuardEvent
from coneskin.scene.reader import parse_scene
from coneskin.session.event_log import EventLog
from coneskin.session.event_publisher import EventPublisher, _event_message
from tests.support.paths import ROOT

from ..scene.scenes import FULL, SKIN_ONLY

FOLDER = ROOT / "demos" / "subscribers"
CONTACT = GuardEvent(EventName.CONTACT, 12.5, {"sensor": "skin", "u": 0.1, "phi": math.nan, "normal": (0.0, math.inf)})
ENDING = GuardEvent(EventName.ENDING, 13.0, {"what": "told to end"})


def commands(folder: Path) -> dict[str, list[str]]:
    """How each subscriber is run; C is compiled."""
    return {
        "py": [sys.executable, str(FOLDER / "subscribe.py")],
        "c": [str(folder / "subscribe")],
        "js": ["node", str(FOLDER / "subscribe.js")],
    }


@pytest.mark.parametrize("kind", ["py", "c", "js"])
def test_a_subscriber_gets_the_events(kind: str, tmp_path: Path) -> None:
    needed = {"py": sys.executable, "c": "cc", "js": "node"}[kind]
    if shutil.which(needed) is None:
        pytest.skip(f"there is no {needed}")
    if kind == "c":
        source, program = str(FOLDER / "subscribe.c"), str(tmp_path / "subscribe")
        subprocess.run(["cc", "-std=gnu11", "-Wall", "-Werror", "-o", program, source], check=True, timeout=60)
    with subprocess.Popen([*commands(tmp_path)[kind], "0"], stdout=subprocess.PIPE, text=True) as subscriber:
        assert subscriber.stdout is not None
        word, port = subscriber.stdout.readline().split()
        assert word == "listening"
        publisher = EventPublisher(f"udp://127.0.0.1:{port}")
        for event in (CONTACT, ENDING):
            publisher.publish(event, 10.0)
        said = subscriber.stdout.read()
        publisher.close()
    assert subscriber.returncode == 0
    assert [word in line for word, line in zip(("2.5", "3"), said.splitlines(), strict=True)] == [True, True]
    assert [word in line for word, line in zip(("contact", "ending"), said.splitlines(), strict=True)] == [True, True]
    assert len((FOLDER / f"subscribe.{kind}").read_text().splitlines()) <= 20
    assert (publisher.sent, publisher.dropped) == (2, 0)


def test_an_event_is_json_that_every_language_reads() -> None:
    data = _event_message(CONTACT, 10.0)
    assert json.loads(data, parse_constant=pytest.fail) == {
        **{"t": 2.5, "name": "contact", "sensor": "skin", "u": 0.1},
        **{"phi": None, "normal": [0.0, None]},
    }
    assert json.loads(_event_message(ENDING, 10.0, "UR5e at 10.0.0.2"))["arm"] == "UR5e at 10.0.0.2"
    long = _event_message(GuardEvent(EventName.MESSAGE, 11.0, {"what": "x" * 10_000}), 10.0)
    assert json.loads(long) == {"t": 1.0, "name": "message", "cut": 10_036}


def test_what_the_network_does_not_take_is_dropped() -> None:
    publisher = EventPublisher("udp://127.0.0.1:9")
    publisher.close()
    publisher.publish(CONTACT, 0.0)
    publisher.publish(GuardEvent(EventName.MESSAGE, 0.0, {"what": object()}), 0.0)
    assert (publisher.sent, publisher.dropped) == (0, 2)


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("tcp://127.0.0.1:9870", "an address to publish to is udp://HOST:PORT"),
        ("udp://127.0.0.1", "an address to publish to is udp://HOST:PORT"),
        ("udp://127.0.0.1:door", "an address to publish to is udp://HOST:PORT"),
        ("udp://[::1", "an address to publish to is udp://HOST:PORT"),
        ("udp://127.0.0.1:9870?x", "an address to publish to is udp://HOST:PORT"),
        ("zmq://127.0.0.1:9870/topic", "an address to publish to is udp://HOST:PORT, zmq://HOST:PORT or mqtt://"),
        ("mqtt://127.0.0.1:9870/cell/+", "an address to publish to is udp://HOST:PORT"),
        ("mqtt://192.0.2.7:1883", "192.0.2.7 is not this computer"),
        (f"udp://{64 * 'a'}:9870", "aaa cannot be found: that is no name of a computer"),
        ("udp://192.0.2.7:9870", "192.0.2.7 is not this computer"),
        ("udp://255.255.255.255:9870", "255.255.255.255 is not this computer"),
    ],
)
def test_addresses_that_are_refused(url: str, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        EventPublisher(url)


def test_each_address_is_published_to(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.toml").write_text(SKIN_ONLY)
    for urls in (["udp://127.0.0.1:9", "tcp://one"], ["tcp://one", "udp://127.0.0.1:9"]):
        words = [word for url in urls for word in ("--publish", url)]
        assert main(["guard", str(tmp_path / "scene.toml"), "--duration-s", "0.01", *words]) == 1
        assert "got 'tcp://one'" in capsys.readouterr().err


def test_a_whole_network_is_published_to_where_that_is_allowed() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("", 0))
        receiver.settimeout(60.0)
        publisher = EventPublisher(f"udp://127.255.255.255:{receiver.getsockname()[1]}", beyond=True)
        publisher.publish(ENDING, 10.0)
        publisher.close()
        assert (publisher.sent, publisher.dropped) == (1, 0)  # dropped without a word before it was allowed
        assert json.loads(receiver.recv(9000))["name"] == "ending"


def test_another_computer_is_published_to_where_that_is_allowed() -> None:
    EventPublisher("udp://192.0.2.7:9870", beyond=True).close()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        EventPublisher(f"udp://localhost:{receiver.getsockname()[1]}").close()


def test_every_event_is_logged_and_a_stop_is_a_warning(caplog: pytest.LogCaptureFixture) -> None:
    log = EventLog()
    with caplog.at_level(logging.INFO, "coneskin.events"):
        log.report(EventName.ACTIVATED)
        log.report(EventName.STOPPING, why="touch")
    assert [(record.levelname, record.getMessage()) for record in caplog.records] == [
        ("INFO", "activated {}"),
        ("WARNING", "stopping {'why': 'touch'}"),
    ]


def test_a_line_of_logging_says_which_arm(caplog: pytest.LogCaptureFixture) -> None:
    scene = parse_scene(FULL)
    with caplog.at_level(logging.INFO, "coneskin.events"):
        EventLog(arm=scene.arm_label).report(EventName.ACTIVATED)
    assert [record.getMessage() for record in caplog.records] == ["UR5e at 127.0.0.1: activated {}"]


def free_port() -> int:
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return int(sock.getsockname()[1])


def test_zeromq_carries_the_events_to_whoever_connects() -> None:
    zmq = pytest.importorskip("zmq", reason="the extra coneskin[zmq] is not installed")
    port = free_port()
    publisher = EventPublisher(f"zmq://127.0.0.1:{port}", arm="UR5e at 127.0.0.1")
    with pytest.raises(SceneError, match=f"cannot publish at tcp://127.0.0.1:{port}: .*; name another port"):
        EventPublisher(f"zmq://127.0.0.1:{port}")
    context = zmq.Context()
    subscriber = context.socket(zmq.SUB)
    subscriber.rcvtimeo = 50
    subscriber.subscribe(b"contact")
    subscriber.connect(f"tcp://127.0.0.1:{port}")
    try:
        for _ in range(200):  # what is published before a subscriber is known goes nowhere
            publisher.publish(CONTACT, 10.0)
            if subscriber.poll(50):
                break
        name, data = subscriber.recv_multipart()
        assert (name, json.loads(data)["arm"]) == (b"contact", "UR5e at 127.0.0.1")
        sent = publisher.sent
        publisher.close()
        publisher.close()
        publisher.publish(CONTACT, 10.0)
        assert (publisher.sent, publisher.dropped) == (sent, 1)
    finally:
        context.destroy(linger=0)


@pytest.fixture
def broker() -> Iterator[int]:
    """Port of a real broker."""
    pytest.importorskip("paho.mqtt", reason="the extra coneskin[mqtt] is not installed")
    program = shutil.which("mosquitto", path=f"{os.environ['PATH']}:/usr/sbin:/usr/local/sbin")
    if program is None:
        pytest.skip("there is no mosquitto: apt-get install mosquitto")
    port = free_port()
    with subprocess.Popen([program, "-p", str(port)], stderr=subprocess.DEVNULL) as process:
        try:
            for _ in range(3000):  # a minute
                with socket.socket() as sock:
                    if sock.connect_ex(("127.0.0.1", port)) == 0:
                        break
                time.sleep(0.02)
            yield port
        finally:
            process.kill()


def test_mqtt_carries_the_events_by_a_broker(broker: int) -> None:
    from paho.mqtt.client import Client
    from paho.mqtt.enums import CallbackAPIVersion

    got: dict[str, dict[str, object]] = {}
    ready, done = threading.Event(), threading.Event()

    def take(_client: object, _data: object, message: object) -> None:
        got[message.topic] = json.loads(message.payload)
        if message.topic.endswith("ending"):
            done.set()

    subscriber = Client(CallbackAPIVersion.VERSION2)
    subscriber.on_subscribe = lambda *_: ready.set()
    subscriber.on_message = take
    subscriber.connect("127.0.0.1", broker)
    subscriber.loop_start()
    try:
        subscriber.subscribe("#")
        assert ready.wait(60.0)
        publisher = EventPublisher(f"mqtt://127.0.0.1:{broker}/cell/7", arm="UR5e at 127.0.0.1")
        publisher.publish(CONTACT, 10.0)
        publisher.publish(ENDING, 10.0)
        publisher.close()  # what was sent has left
        publisher.close()
        publisher.publish(CONTACT, 10.0)
        assert done.wait(60.0)
    finally:
        subscriber.disconnect()
        subscriber.loop_stop()
    assert (publisher.sent, publisher.dropped) == (2, 1)
    assert got["cell/7/contact"]["u"] == 0.1
    assert got["cell/7/ending"] == {"t": 3.0, "name": "ending", "arm": "UR5e at 127.0.0.1", "what": "told to end"}


@pytest.fixture
def deaf_broker() -> Iterator[int]:
    """A broker that takes a connection and reads nothing more; the port."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        taken: list[socket.socket] = []

        def serve() -> None:
            connection, _ = listening.accept()
            taken.append(connection)
            connection.recv(1024)
            connection.sendall(b"\x20\x02\x00\x00")  # CONNACK

        server = threading.Thread(target=serve, daemon=True)
        server.start()
        yield listening.getsockname()[1]
        server.join()
        taken[0].close()


@pytest.mark.long
def test_what_a_broker_does_not_read_is_dropped_and_counted(deaf_broker: int) -> None:
    pytest.importorskip("paho.mqtt", reason="the extra coneskin[mqtt] is not installed")
    publisher = EventPublisher(f"mqtt://127.0.0.1:{deaf_broker}")
    long = CONTACT._replace(details={"what": "x" * 6000})
    while not publisher.dropped:  # the system's own buffers take some megabytes
        publisher.publish(long, 10.0)
        assert publisher.sent < 10_000
    publisher.close()


@pytest.mark.long
def test_an_attempt_to_connect_again_holds_no_program_up(deaf_broker: int, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("paho.mqtt", reason="the extra coneskin[mqtt] is not installed")
    from paho.mqtt.client import Client

    let_go, stopped, stop = threading.Event(), threading.Event(), Client.loop_stop

    def hang(client: Client) -> None:
        let_go.wait(60.0)
        stop(client)
        stopped.set()

    publisher = EventPublisher(f"mqtt://127.0.0.1:{deaf_broker}")
    monkeypatch.setattr(Client, "loop_stop", hang)
    publisher.close()
    assert not stopped.is_set()
    let_go.set()
    assert stopped.wait(60.0)


def test_a_broker_that_is_not_there_is_said_before_anything_is_guarded() -> None:
    pytest.importorskip("paho.mqtt", reason="the extra coneskin[mqtt] is not installed")
    port = free_port()
    with pytest.raises(SceneError, match=f"no MQTT broker takes events at 127.0.0.1:{port}: .*; start one there"):
        EventPublisher(f"mqtt://127.0.0.1:{port}")
    assert not [thread for thread in threading.enumerate() if "paho" in thread.name]


@pytest.mark.parametrize(("scheme", "module", "extra"), [("zmq", "zmq", "zmq"), ("mqtt", "paho.mqtt.client", "mqtt")])
def test_a_package_that_is_missing_is_named(
    scheme: str, module: str, extra: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(MissingExtra, match=rf"pip install 'coneskin\[{extra}\]'"):
        EventPublisher(f"{scheme}://127.0.0.1:{free_port()}")
