"""Server of a page, looked at by clients that mean no good."""

import http.client
import socket
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock, patch

import pytest

from coneskin.core.errors import ConeSkinError
from coneskin.view.page_server import PageServer, page_client

pytest.importorskip("viser", reason="viser is not installed: no page is served")
import msgspec
import viser
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect


@pytest.fixture(scope="module")
def server() -> Iterator[PageServer]:
    with PageServer("a page", port=18180) as served:
        served.gui.add_slider("shared", 0.0, 1.0, 0.1, 0.5)
        yield served


def get(server: PageServer, path: str, **headers: str) -> tuple[int, bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", int(server.url.rpartition(":")[2]), timeout=60)
    connection.putrequest("GET", path, skip_host="Host" in headers)
    for name, value in headers.items():
        connection.putheader(name, value)
    connection.endheaders()
    answer = connection.getresponse()
    try:
        return answer.status, answer.read()
    finally:
        connection.close()


def test_the_page_is_given(server: PageServer) -> None:
    status, body = get(server, "/")
    assert status == 200
    assert b"<html" in body.lower()


@pytest.mark.parametrize("path", ["/", "/index.html", "/?darkMode"])
def test_the_page_has_the_script_for_computers_without_a_gpu(server: PageServer, path: str) -> None:
    status, body = get(server, path)
    assert status == 200
    assert body.decode() == page_client()
    assert body.index(b"antialias: false") < body.index(b"<title")


@pytest.mark.parametrize(
    "path", ["/../../__init__.py", "/../../../../../../../../etc/passwd", "/%2e%2e/%2e%2e/_viser.py"]
)
def test_no_file_beside_the_page_is_given(server: PageServer, path: str) -> None:
    status, body = get(server, path)
    assert status == 403
    assert b"import" not in body
    assert b"root" not in body


def test_another_name_is_not_answered(server: PageServer) -> None:
    assert get(server, "/", Host="rebound.example")[0] == 403


def send_too_much(socket: Any) -> None:
    """Send a message that is too long and receive until the server has had enough; it may have had so before."""
    socket.send(bytes(1 << 17))
    while True:
        socket.recv(timeout=60)


def viewer(server: PageServer, **more: Any) -> Any:
    protocol = f"viser-v{viser.__version__}"
    return connect(server.url.replace("http", "ws"), subprotocols=[protocol], compression=None, **more)  # type: ignore[list-item]


def test_a_page_of_another_origin_may_not_look_in(server: PageServer) -> None:
    with pytest.raises(InvalidStatus, match="403"):
        viewer(server, origin="http://elsewhere.example")
    with viewer(server, origin=server.url) as socket:  # type: ignore[arg-type]
        assert socket.recv(timeout=60)


def test_a_message_that_a_page_has_no_use_for_does_nothing(server: PageServer) -> None:
    """Among them the one that has viser open a tunnel to the internet."""
    before = server.gate.refused
    with viewer(server) as socket:
        socket.recv(timeout=60)
        for kind in ("ShareUrlRequest", "FileTransferStartUpload", "SetPositionMessage", "ResetGuiMessage"):
            socket.send(msgspec.msgpack.encode({"type": kind, "name": "/run", "position": [9.0, 9.0, 9.0]}))
        socket.send(b"\xc1 garbage")
        socket.send("text")
        socket.send(msgspec.msgpack.encode([1, 2, 3]))
        socket.ping().wait(60)
    assert server._server._share_tunnel is None
    assert server.gate.refused == before + 7


def test_a_viewer_who_sends_nonsense_is_gone_and_leaves_nothing(server: PageServer) -> None:
    with viewer(server) as socket:
        socket.recv(timeout=60)
        socket.send(msgspec.msgpack.encode({"type": "ViewerCameraMessage", "wxyz": "x"}))
        with pytest.raises(ConnectionClosed):
            send_too_much(socket)
    assert get(server, "/")[0] == 200


def test_a_thread_that_draws_never_wakes_the_readers_itself(server: PageServer) -> None:
    """It would end now and then, by an error of a list that changes meanwhile."""
    with viewer(server) as socket:
        socket.recv(timeout=60)
        (client,) = (state.message_buffer for state in server._server._websock_server._client_state_from_id.values())
        for buffer in (server._server._websock_server._broadcast_buffer, client):
            buffer.message_event.clear()
            buffer.message_event.set()
            assert not buffer.message_event.is_set()
        server.scene.add_frame("/drawn", show_axes=False)
        assert socket.recv(timeout=60)


def test_an_address_that_is_not_ours_is_refused() -> None:
    with pytest.raises(ConeSkinError, match=r"cannot be served at 192\.0\.2\.1"):
        PageServer("a page", "192.0.2.1", 18180)


@pytest.mark.parametrize("port", [0, -5, 65536, 99999])
def test_a_port_that_cannot_be_is_refused_at_once(port: int) -> None:
    """viser would try the next thousand, and then wait for ever."""
    with pytest.raises(ConeSkinError, match=f"must be 1 to 65535, got {port}"):
        PageServer("a page", port=port)


def test_the_next_free_port_is_taken() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with PageServer("a page", port=port) as server:
            assert server.url != f"http://127.0.0.1:{port}"
            assert get(server, "/")[0] == 200


@pytest.mark.parametrize("leaves", ["before its page stands", "later"])
def test_what_a_viewer_began_ends_though_it_left_at_once(server: PageServer, leaves: str) -> None:
    callbacks: dict[str, Any] = {}
    library = SimpleNamespace(
        on_client_connect=lambda callback: callbacks.update(connected=callback),
        on_client_disconnect=lambda callback: callbacks.update(gone=callback),
    )
    client = SimpleNamespace(client_id=7, camera=SimpleNamespace(aspect=1.6))
    ended = []

    def begin(client: Any) -> Any:
        if leaves != "later":
            callbacks["gone"](client)
        return lambda: ended.append(client.client_id)

    with patch.object(server, "_server", library):
        server.on_viewer(begin)
    callbacks["connected"](client)
    if leaves == "later":
        assert ended == []
        callbacks["gone"](client)
    assert ended == [7]


def test_a_viewer_whose_work_fails_leaves_nothing_behind(server: PageServer) -> None:
    """The next one of its number ends when it goes, and not at once."""
    callbacks: dict[str, Any] = {}
    library = SimpleNamespace(
        on_client_connect=lambda callback: callbacks.update(connected=callback),
        on_client_disconnect=lambda callback: callbacks.update(gone=callback),
    )
    client, ended = SimpleNamespace(client_id=7, camera=SimpleNamespace(aspect=1.6)), []
    begin = Mock(side_effect=[RuntimeError, lambda: ended.append(7)])
    with patch.object(server, "_server", library):
        server.on_viewer(begin)
    with pytest.raises(RuntimeError):
        callbacks["connected"](client)
    callbacks["gone"](client)
    callbacks["connected"](client)
    assert ended == []
    callbacks["gone"](client)
    assert ended == [7]
