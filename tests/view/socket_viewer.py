"""Viewer without a browser: it connects as viser's page does, and reads what it is told, or does not."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from coneskin.view.page_server import PageServer

CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": [1.0, 0.0, 0.0, 0.0],
    "position": [1.0, 1.0, 1.0],
    "fov": 1.0,
    "near": 0.1,
    "far": 10.0,
    "image_height": 100,
    "image_width": 100,
    "look_at": [0.0, 0.0, 0.0],
    "up_direction": [0.0, 0.0, 1.0],
}


class SocketViewer:
    """Viewer at the other end of a web socket.

    Attributes:
        heard: messages that have come and were not looked at yet.
    """

    def __init__(self, socket: Any) -> None:
        self.socket = socket
        self.heard: list[dict[str, Any]] = []

    def send(self, **message: Any) -> None:
        """Send a message."""
        import msgspec

        self.socket.send(msgspec.msgpack.encode(message))

    def hear(self, timeout: float = 60.0) -> list[dict[str, Any]]:
        """Return the messages of the next parcel."""
        import msgspec
        import zstandard

        data = self.socket.recv(timeout=timeout)
        size, packed = (int.from_bytes(data[at : at + 8], "little") for at in (0, 8))
        inner = zstandard.ZstdDecompressor().decompress(data[16 : 16 + packed], size)
        return list(msgspec.msgpack.decode(inner)["messages"])

    def hear_until(self, fits: Any) -> dict[str, Any]:
        """Return the first message that fits."""
        while True:
            while self.heard:
                if fits(message := self.heard.pop(0)):
                    return message
            self.heard += self.hear()


@contextmanager
def socket_viewer(server: PageServer, **more: Any) -> Iterator[SocketViewer]:
    """Connect, and say where the camera is, from which on one is a viewer."""
    import viser
    from websockets.sync.client import connect

    protocol: Any = f"viser-v{viser.__version__}"
    address = server.url.replace("http", "ws")
    with connect(address, subprotocols=[protocol], compression=None, max_size=None, **more) as socket:
        found = SocketViewer(socket)
        found.send(**CAMERA)
        yield found
