"""Server of a page: the only importer of viser. Behind the gate, on this computer alone unless asked otherwise."""

from __future__ import annotations

import asyncio
import contextlib
import io
import math
import threading
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from coneskin.core.errors import ConeSkinError, needed_package

from .connection_gate import ALLOWED, UPLOADS, ConnectionGate

LOOPBACK = frozenset({"127.0.0.1", "localhost", "::1"})
_MAX_UPLOAD_SIZE = 200_000_000  # bytes of a message, where files may be dropped
_FIELD_OF_VIEW = math.radians(50.0)  # from top to bottom; viser's own 75 deg makes what is far small
_starting = threading.Lock()


def _viser() -> Any:
    with needed_package("viser", "the page in a browser", "view"):
        import viser
    return viser


def browser_text(name: str) -> str:
    """Return a style sheet or a script of a page, from the files beside this one."""
    return (Path(__file__).with_name("browser") / name).read_text(encoding="utf-8")


def page_client(uploads: bool = False) -> str:
    """Return the HTML of viser's client, whose head begins with style and scripts of the panel.

    Args:
        uploads: files may be dropped onto the page.

    Raises:
        MissingExtra: viser is not installed.
    """
    client = Path(_viser().__file__).parent / "client" / "build" / "index.html"
    names = ["plain_edges.js", "panel.js", *(["file_drop.js"] if uploads else [])]
    scripts = "".join(f"<script>{browser_text(name)}</script>" for name in names)
    head = f"<head><style id=coneskin-style>{browser_text('panel.css')}</style>{scripts}"
    return client.read_text(encoding="utf-8").replace("<head>", head, 1)


class PageServer:
    """Server of one page.

    Args:
        title: of the page's panel.
        host: address to listen at; another than this computer's lets its network look in.
        port: to listen at; the next free one where it is taken.
        uploads: files may be dropped onto the page.

    Attributes:
        gate: in front of it.
        scene: what all viewers see: viser's ``SceneApi``.
        gui: the panel that all viewers see: viser's ``GuiApi``.
        together: context in which changes are sent at once, so that no picture shows half of them.
        serializer: makes viser's serializer, which takes up what the scene is told from now on.
        url: of the page.

    Raises:
        MissingExtra: viser is not installed.
        ConeSkinError: the address cannot be listened at, or there is no such port.
    """

    def __init__(self, title: str, host: str = "127.0.0.1", port: int = 8080, uploads: bool = False) -> None:
        if not 0 < port < 65536:  # viser would try a thousand ports beyond
            raise ConeSkinError(f"--port must be 1 to 65535, got {port}")
        viser = _viser()
        import msgspec

        def decode(data: bytes) -> Any:
            try:
                return msgspec.msgpack.decode(data)
            except (msgspec.DecodeError, RecursionError) as exc:
                raise ValueError(str(exc)) from exc

        hosts = LOOPBACK | {host} if host in LOOPBACK else None
        allowed = ALLOWED | UPLOADS if uploads else ALLOWED
        page = page_client(uploads)
        self.gate = ConnectionGate(decode, hosts, page, allowed, **({"largest": _MAX_UPLOAD_SIZE} if uploads else {}))
        _check_address(host)
        with _starting, _gated(self.gate), contextlib.redirect_stdout(io.StringIO()):
            self._server = viser.ViserServer(host=host, port=port, label=title, verbose=False)
        self.scene, self.gui, self.together = self._server.scene, self._server.gui, self._server.atomic
        self.serializer = self._server.get_scene_serializer
        shown = "127.0.0.1" if host in ("0.0.0.0", "::") else host
        self.url = f"http://{f'[{shown}]' if ':' in shown else shown}:{self._server.get_port()}"
        self._wake_from_its_own_thread()
        # what is drawn for a viewer who has just gone is nobody's mistake
        warnings.filterwarnings("ignore", message="Queued a .* on a closed connection", category=UserWarning)
        self.gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
        self.gui.main_panel.dock_right()

    def _wake_from_its_own_thread(self) -> None:
        """Have each buffer of messages wake its readers from the server's thread alone.

        viser 1.1 does so from the thread that draws as well, which ends that thread now and then: the readers change
        while it looks at them. The second call that it makes, from the server's thread, is enough.
        """
        library = self._server._websock_server
        thread = library._server_thread.ident

        class OwnThreadEvent(asyncio.Event):
            def set(self) -> None:
                if threading.get_ident() == thread:
                    super().set()

        library._broadcast_buffer.message_event = OwnThreadEvent()

        def connected(connection: Any) -> None:
            connection.get_message_buffer().message_event = OwnThreadEvent()

        library.on_client_connect(connected)

    def __enter__(self) -> PageServer:
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.redirect_stdout(io.StringIO()):
            self._server.stop()

    def look_from(self, position: tuple[float, float, float], at: tuple[float, float, float]) -> None:
        """Set from where viewers look, and at what [m]."""
        self._server.initial_camera.position = position
        self._server.initial_camera.look_at = at
        self._server.initial_camera.fov = _FIELD_OF_VIEW
        for client in self._server.get_clients().values():
            client.camera.position, client.camera.look_at = position, at

    def on_viewer(self, begin: Callable[[Any], Callable[[], None]]) -> None:
        """Call a function for each viewer that connects.

        Args:
            begin: takes viser's ``ClientHandle``, and returns what ends its work when the viewer has gone.
        """
        ends: dict[int, Callable[[], None]] = {}
        changing = threading.Lock()

        def meet(viewer: int, end: Callable[[], None]) -> Callable[[], None] | None:
            """Return what has been left for a viewer; where nothing has, leave an end for what comes later."""
            with changing:
                if (left := ends.pop(viewer, None)) is None:
                    ends[viewer] = end
            return left

        def connected(client: Any) -> None:
            if (aspect := client.camera.aspect) < 1.0:  # a phone's window is as wide as others are high
                client.camera.fov = 2.0 * math.atan(math.tan(0.5 * _FIELD_OF_VIEW) / aspect)
            end = _nothing
            try:
                end = begin(client)
            finally:
                if meet(client.client_id, end) is not None:  # it has gone meanwhile
                    end()

        def gone(client: Any) -> None:
            if (end := meet(client.client_id, _nothing)) is not None:
                end()

        self._server.on_client_connect(connected)
        self._server.on_client_disconnect(gone)


def _nothing() -> None:
    """End of what has not begun."""


def _check_address(host: str) -> None:
    """Refuse an address that is none of this computer's; viser would try a thousand ports and then hang."""
    import socket

    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.bind(address)
    except (OSError, UnicodeError) as exc:
        raise ConeSkinError(f"the page cannot be served at {host}: {exc}; leave out --host for this computer") from exc


@contextlib.contextmanager
def _gated(gate: ConnectionGate) -> Iterator[None]:
    """Put a gate into the server that is started inside; viser has no parameter for one."""
    import websockets.asyncio.server as library

    plain = library.serve

    def serve(handler: Any, host: Any, port: Any, **given: Any) -> Any:
        return plain(**gate.serve_arguments(handler, host=host, port=port, **given))

    library.serve = serve
    try:
        yield
    finally:
        library.serve = plain
