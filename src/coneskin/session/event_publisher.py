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
from typing import Any
from urllib.parse import urlsplit

from coneskin.core.errors import MissingExtra, SceneError
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


class _UdpChannel:
    def __init__(self, family: int, address: tuple[Any, ...], beyond: bool) -> None:
        self._address = address
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        if beyond and family == socket.AF_INET:  # the address may be that of a whole network
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)

    def send(self, _: str, data: bytes) -> None:
        self._socket.sendto(data, self._address)

    def close(self) -> None:
        self._socket.close()


_ZMQ_CLOSE_TIMEOUT = 200  # ms for the last events to leave


class _ZmqChannel:
    """A bound PUB socket; a message has two parts, the event's name, by which subscribers choose, and the JSON.

    Raises:
        SceneError: the address is taken, or not one of this computer.
        MissingExtra: pyzmq is not installed.
    """

    def __init__(self, host: str, port: int) -> None:
        try:
            import zmq
        except ModuleNotFoundError as exc:
            raise MissingExtra("pyzmq", "publishing by ZeroMQ", "zmq") from exc
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.PUB)
        self._no_wait = zmq.NOBLOCK
        self._socket.setsockopt(zmq.IPV6, ":" in host)
        address = f"tcp://[{host}]:{port}" if ":" in host else f"tcp://{host}:{port}"
        try:
            self._socket.bind(address)
        except zmq.ZMQError as exc:
            self._context.destroy(linger=0)
            raise SceneError([f"cannot publish at {address}: {exc.strerror}; name another port"], "--publish") from exc

    def send(self, name: str, data: bytes) -> None:
        """Hand a message to the socket, which drops it where a subscriber is too slow.

        Raises:
            OSError: it is closed.
        """
        if self._socket.closed:
            raise OSError("closed")
        self._socket.send_multipart([name.encode(), data], self._no_wait)

    def close(self) -> None:
        """Close the socket; may be called again."""
        self._context.destroy(linger=_ZMQ_CLOSE_TIMEOUT)


_ANSWER_TIMEOUT = 5.0  # s for the broker to answer
_MQTT_CLOSE_TIMEOUT = 0.5  # s for the last events to leave


class _MqttChannel:
    """A connection to a broker, made again where it is lost. An event's topic is ``topic`` and its name.

    Raises:
        SceneError: no broker answers, or it refuses.
        MissingExtra: paho-mqtt is not installed.
    """

    def __init__(self, host: str, port: int, topic: str, user: str | None = None, password: str | None = None) -> None:
        try:
            from paho.mqtt.client import Client
            from paho.mqtt.enums import CallbackAPIVersion
        except ModuleNotFoundError as exc:
            raise MissingExtra("paho-mqtt", "publishing by MQTT", "mqtt") from exc
        answers: queue.SimpleQueue[str] = queue.SimpleQueue()  # no callback holds this channel: no circle of references
        ended = self._ended = threading.Event()
        client = self._client = Client(CallbackAPIVersion.VERSION2)
        client.on_connect = lambda *said: answers.put(str(said[3]) if said[3].is_failure else "")
        client.on_disconnect = lambda *_: ended.set()
        client.reconnect_delay_set(1, 10)
        client.username_pw_set(user, password)
        client.connect_timeout = _ANSWER_TIMEOUT
        self._topic = topic
        try:
            client.connect(host, port)
            client.loop_start()
            refusal = answers.get(timeout=_ANSWER_TIMEOUT)
        except (OSError, queue.Empty) as exc:
            refusal = getattr(exc, "strerror", "") or str(exc) or "it does not answer"
        if refusal:
            self.close()
            why = f"no MQTT broker takes events at {host}:{port}: {refusal}; start one there, such as mosquitto"
            raise SceneError([why], "--publish")

    def send(self, name: str, data: bytes) -> None:
        """Hand a message to the thread of the connection.

        Raises:
            OSError: there is no connection.
        """
        if self._client.publish(f"{self._topic}/{name}", data).rc:
            raise OSError("not connected")

    def close(self) -> None:
        """Close the connection; may be called again."""
        self._ended.clear()
        if self._client.disconnect() or self._ended.wait(_MQTT_CLOSE_TIMEOUT):
            self._client.loop_stop()


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
        except ValueError:  # a port of words, half a bracket
            host, port, known = None, None, False
        if not known or not host or not port or parts.query or parts.fragment or "+" in topic:
            raise SceneError([f"an address to publish to is {_URL_FORMS}, got {url!r}; {_URL_EXAMPLE}"], "--publish")
        try:
            family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        except (OSError, UnicodeError) as exc:  # a name that no network can have
            why = exc.strerror if isinstance(exc, OSError) else "that is no name of a computer"
            raise SceneError([f"{host} cannot be found: {why or exc}"], "--publish") from exc
        if not beyond and not ipaddress.ip_address(address[0]).is_loopback:
            why = f"{host} is not this computer, and whoever is on its network could read the events; {_URL_EXAMPLE}"
            raise SceneError([f"{why}, or allow it with --publish-beyond"], "--publish")
        self._channel: _UdpChannel | _ZmqChannel | _MqttChannel
        if parts.scheme == "udp":
            self._channel = _UdpChannel(family, address, beyond)
        elif parts.scheme == "zmq":
            self._channel = _ZmqChannel(str(address[0]), port)
        else:
            self._channel = _MqttChannel(host, port, topic or "coneskin", parts.username, parts.password)

    def publish(self, event: GuardEvent, began: float) -> None:
        """Send an event, or drop it; times count from when the run began [s]. It never waits and never raises."""
        try:
            self._channel.send(event.name, _event_message(event, began, self._arm))
        except (OSError, ValueError, TypeError):
            self.dropped += 1
        else:
            self.sent += 1

    def close(self) -> None:
        """Close the connection, once what was sent has left, for which it waits a moment; may be called again."""
        self._channel.close()
