"""Publisher of events: each is a JSON object that UDP, ZeroMQ or MQTT carries, for programs that only listen.

It belongs to the session. The guard sends its events to the session in any case, so that publishing costs the guard
nothing; what the network does not take is dropped and counted, and nobody waits.
"""

from __future__ import annotations

import ipaddress
import json
import queue
import socket
import threading
from collections import deque
from collections.abc import Callable
from urllib.parse import urlsplit

from coneskin.core.errors import SceneError, needed_package
from coneskin.core.text import finite
from coneskin.robot.guard.signals.journal import GuardEvent

_MAX_DATAGRAM = 8000  # bytes of a message; loopback and most networks carry them in one datagram
_URL_FORMS = "udp://HOST:PORT, zmq://HOST:PORT or mqtt://HOST:PORT/TOPIC"
_URL_EXAMPLE = "write udp://127.0.0.1:9870"


def _event_message(event: GuardEvent, began: float, arm: str = "") -> bytes:
    """Return an event as JSON: ``t`` [s] from the run's beginning, ``name``, ``arm``, details; not finite is null."""
    message = {"t": round(event.time - began, 6), "name": str(event.name), **({"arm": arm} if arm else {})}
    data = json.dumps({**message, **finite(event.details)}, separators=(",", ":")).encode()
    return data if len(data) <= _MAX_DATAGRAM else json.dumps({**message, "cut": len(data)}).encode()


_Channel = tuple[Callable[[str, bytes], object], Callable[[], object]]  # what sends, or raises OSError; what closes
_ZMQ_CLOSE_TIMEOUT = 200  # ms for the last events to leave


def _open_zmq(host: str, port: int) -> _Channel:
    """Bind a PUB socket, which drops a message for which a subscriber is too slow.

    A message has two parts, the event's name, by which subscribers choose, and the JSON.
    """
    with needed_package("pyzmq", "publishing by ZeroMQ", "zmq"):
        import zmq
    context = zmq.Context()
    sock = context.socket(zmq.PUB)
    sock.setsockopt(zmq.IPV6, ":" in host)
    address = f"tcp://[{host}]:{port}" if ":" in host else f"tcp://{host}:{port}"
    try:
        sock.bind(address)
    except zmq.ZMQError as exc:
        context.destroy(linger=0)
        raise SceneError([f"cannot publish at {address}: {exc.strerror}; name another port"], "--publish") from exc

    def send(name: str, data: bytes) -> None:
        try:
            sock.send_multipart([name.encode(), data], zmq.NOBLOCK)
        except zmq.ZMQError as exc:  # closed, by another thread too
            raise OSError(exc.strerror) from exc

    return send, lambda: context.destroy(linger=_ZMQ_CLOSE_TIMEOUT)


_ANSWER_TIMEOUT = 5.0  # s for the broker to answer
_MQTT_CLOSE_TIMEOUT = 0.5  # s for the last events to leave
_MAX_WAITING = 200  # events that a broker has not read; further ones are dropped
_MAX_TOPIC = 1000  # letters; a broker takes 65 535 bytes


def _open_mqtt(host: str, port: int, topic: str, user: str | None, password: str | None) -> _Channel:
    """Connect to a broker, and again where the connection is lost. An event's topic is ``topic`` and its name."""
    with needed_package("paho-mqtt", "publishing by MQTT", "mqtt"):
        from paho.mqtt.client import Client, MQTTMessageInfo
        from paho.mqtt.enums import CallbackAPIVersion
    answers: queue.SimpleQueue[str] = queue.SimpleQueue()
    waiting: deque[MQTTMessageInfo] = deque()
    ended = threading.Event()
    client = Client(CallbackAPIVersion.VERSION2)  # no callback holds it: no circle of references
    client.on_connect = lambda *said: answers.put(str(said[3]) if said[3].is_failure else "")
    client.on_disconnect = lambda *_: ended.set()
    client.reconnect_delay_set(1, 10)
    client.username_pw_set(user, password)
    client.connect_timeout = _ANSWER_TIMEOUT

    def send(name: str, data: bytes) -> None:
        while waiting and (waiting[0].rc or waiting[0].is_published()):
            waiting.popleft()
        if not client.is_connected() or len(waiting) >= _MAX_WAITING:
            raise OSError("not connected, or the broker does not read")
        waiting.append(client.publish(f"{topic}/{name}", data))
        if waiting[-1].rc:
            raise OSError("not connected")

    def close() -> None:
        ended.clear()
        if client.disconnect() or ended.wait(_MQTT_CLOSE_TIMEOUT):
            stopping = threading.Thread(target=client.loop_stop, daemon=True)  # it waits for an attempt to connect
            stopping.start()
            stopping.join(_MQTT_CLOSE_TIMEOUT)

    try:
        client.connect(host, port)
        client.loop_start()
        refusal = answers.get(timeout=_ANSWER_TIMEOUT)
    except (OSError, queue.Empty) as exc:
        refusal = getattr(exc, "strerror", "") or str(exc) or "it does not answer"
    if refusal:
        close()
        why = f"no MQTT broker takes events at {host}:{port}: {refusal}; start one there, such as mosquitto"
        raise SceneError([why], "--publish")
    return send, close


class EventPublisher:
    """Publisher to one address: ``udp://HOST:PORT``, ``zmq://HOST:PORT`` or ``mqtt://HOST:PORT/TOPIC``.

    Args:
        beyond: True to allow a host that is not this computer: whoever is on its network can read the events.
        arm: how each message names the arm.

    Attributes:
        sent: messages that the system took.
        dropped: those that it did not.

    Raises:
        SceneError: the URL is none of these, names another computer without ``beyond``, or no broker answers there.
        MissingExtra: the package of ZeroMQ or MQTT is not installed.
    """

    def __init__(self, url: str, beyond: bool = False, arm: str = "") -> None:
        self.sent = self.dropped = 0
        self._arm = arm
        try:
            parts = urlsplit(url)
            host, port, topic = parts.hostname, parts.port, parts.path.strip("/")
            known = parts.scheme == "mqtt" or (parts.scheme in ("udp", "zmq") and not topic)
            known = known and not parts.query and not parts.fragment and "+" not in topic and len(topic) <= _MAX_TOPIC
        except ValueError:  # a port of words, half a bracket
            host, port, known = None, None, False
        if not (known and host and port):
            raise SceneError([f"an address to publish to is {_URL_FORMS}, got {url!r}; {_URL_EXAMPLE}"], "--publish")
        try:
            family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        except (OSError, UnicodeError) as exc:  # a name that no network can have
            why = exc.strerror if isinstance(exc, OSError) else "that is no name of a computer"
            raise SceneError([f"{host} cannot be found: {why or exc}"], "--publish") from exc
        if not beyond and not ipaddress.ip_address(address[0]).is_loopback:
            why = f"{host} is not this computer, and whoever is on its network could read the events; {_URL_EXAMPLE}"
            raise SceneError([f"{why}, or allow it with --publish-beyond"], "--publish")
        if parts.scheme == "zmq":
            self._send, self._close = _open_zmq(str(address[0]), port)
        elif parts.scheme == "mqtt":
            self._send, self._close = _open_mqtt(host, port, topic or "coneskin", parts.username, parts.password)
        else:
            sock = socket.socket(family, socket.SOCK_DGRAM)
            sock.setblocking(False)
            if beyond and family == socket.AF_INET:  # the address may be that of a whole network
                sock.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
            self._send, self._close = lambda _, data: sock.sendto(data, address), sock.close

    def publish(self, event: GuardEvent, began: float) -> None:
        """Send an event, or drop it; times count from when the run began [s]. It never waits and never raises."""
        try:
            self._send(event.name, _event_message(event, began, self._arm))
        except (OSError, ValueError, TypeError):
            self.dropped += 1
        else:
            self.sent += 1

    def close(self) -> None:
        """Close the connection, once what was sent has left, for which it waits a moment; may be called again."""
        self._close()
