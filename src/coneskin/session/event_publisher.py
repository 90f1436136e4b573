"""Publisher of events: each is a JSON object in a UDP datagram, for dashboards and other programs that only listen.

It belongs to the session. The guard sends its events to the session in any case, so that publishing costs the guard
nothing; a datagram that the network does not take is dropped and counted, and nobody waits.
"""

from __future__ import annotations

import ipaddress
import json
import socket
from urllib.parse import urlsplit

from coneskin.core.errors import SceneError
from coneskin.core.text import finite
from coneskin.robot.guard.signals.journal import GuardEvent

_MAX_DATAGRAM = 8000  # bytes of a datagram; loopback and most networks carry them
_URL_EXAMPLE = "write udp://127.0.0.1:9870"


def _event_message(event: GuardEvent, began: float) -> bytes:
    """Return an event as JSON: ``t`` [s] since the run began, ``name``, and its details; what is not finite is null."""
    message = {"t": round(event.time - began, 6), "name": str(event.name), **finite(event.details)}
    data = json.dumps(message, separators=(",", ":")).encode()
    if len(data) > _MAX_DATAGRAM:
        data = json.dumps({"t": message["t"], "name": message["name"], "cut": len(data)}).encode()
    return data


class EventPublisher:
    """Publisher to one address, ``udp://HOST:PORT``.

    Args:
        beyond: True to allow a host that is not this computer: whoever is on its network can read the events.

    Attributes:
        sent: datagrams that the system took.
        dropped: those that it did not.

    Raises:
        SceneError: the URL is none of these, or names another computer without ``beyond``.
    """

    def __init__(self, url: str, beyond: bool = False) -> None:
        self.sent = self.dropped = 0
        try:
            parts = urlsplit(url)
            host, port = parts.hostname, parts.port
            known = parts.scheme == "udp" and not (parts.path.strip("/") or parts.query or parts.fragment)
        except ValueError:  # a port of words, half a bracket
            host, port, known = None, None, False
        if not known or not host or not port:
            raise SceneError([f"an address to publish to is udp://HOST:PORT, got {url!r}; {_URL_EXAMPLE}"], "--publish")
        try:
            family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        except (OSError, UnicodeError) as exc:  # a name that no network can have
            why = exc.strerror if isinstance(exc, OSError) else "that is no name of a computer"
            raise SceneError([f"{host} cannot be found: {why or exc}"], "--publish") from exc
        if not beyond and not ipaddress.ip_address(address[0]).is_loopback:
            why = f"{host} is not this computer, and whoever is on its network could read the events; {_URL_EXAMPLE}"
            raise SceneError([f"{why}, or allow it with --publish-beyond"], "--publish")
        self._address = address
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        if beyond and family == socket.AF_INET:  # the address may be that of a whole network
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)

    def publish(self, event: GuardEvent, began: float) -> None:
        """Send an event, or drop it; times count from when the run began [s]. It never waits and never raises."""
        try:
            self._socket.sendto(_event_message(event, began), self._address)
        except (OSError, ValueError, TypeError):
            self.dropped += 1
        else:
            self.sent += 1

    def close(self) -> None:
        """Close the socket; may be called again."""
        self._socket.close()
