"""Publisher of events: each is a JSON object that UDP, ZeroMQ or MQTT carries, for programs that only listen.

It belongs to the session. The guard sends its events to the session in any case, so that publishing costs the guard
nothing; what the network does not take is dropped and counted, and nobody waits.
"""

from __future__ import annotations

import ipaddress
import json
import socket
from typing import Any
from urllib.parse import urlsplit

from coneskin.core.errors import SceneError
from coneskin.core.text import finite
from coneskin.robot.guard.signals.journal import GuardEvent

from .mqtt_channel import MqttChannel
from .zmq_channel import ZmqChannel

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
        self._channel: _UdpChannel | ZmqChannel | MqttChannel
        if parts.scheme == "udp":
            self._channel = _UdpChannel(family, address, beyond)
        elif parts.scheme == "zmq":
            self._channel = ZmqChannel(str(address[0]), port)
        else:
            self._channel = MqttChannel(host, port, topic or "coneskin", parts.username, parts.password)

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
