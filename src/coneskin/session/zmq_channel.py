"""Channel of events by ZeroMQ, with pyzmq: a PUB socket to which subscribers connect."""

from __future__ import annotations

from coneskin.core.errors import MissingExtra, SceneError

_CLOSE_TIMEOUT_MS = 200  # for the last events to leave


class ZmqChannel:
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
        self._context.destroy(linger=_CLOSE_TIMEOUT_MS)
