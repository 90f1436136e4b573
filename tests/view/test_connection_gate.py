"""What gets through the gate of a page, and what does not."""

import asyncio
from types import SimpleNamespace
from typing import Any

import pytest

from coneskin.view.connection_gate import ConnectionGate, _is_value, _refusal_of

HOSTS = frozenset({"127.0.0.1", "localhost"})


@pytest.mark.parametrize(
    ("path", "host", "origin"),
    [
        ("/../../etc/passwd", "127.0.0.1:8080", None),
        ("/%2e%2e/%2e%2e/etc/passwd", "127.0.0.1:8080", None),
        ("/assets/..%2f..%2fsecret", "127.0.0.1:8080", None),
        ("//etc/passwd", "127.0.0.1:8080", None),
        ("/..\\secret", "127.0.0.1:8080", None),
        ("etc/passwd", "127.0.0.1:8080", None),
        ("/", "rebound.example:8080", None),
        ("/", "127.0.0.1:8080", "http://elsewhere.example"),
        ("/", "127.0.0.1:8080", "http://127.0.0.1:9000"),
        ("/", "127.0.0.1:8080", "null"),
        ("/", "[127.0.0.1:8080", None),
        ("/", "127.0.0.1:8080", "http://[127.0.0.1:8080"),
    ],
)
def test_a_request_that_asks_for_too_much_is_refused(path: str, host: str, origin: str | None) -> None:
    assert _refusal_of(path, host, origin, HOSTS)


@pytest.mark.parametrize("path", ["/", "/?darkMode", "/index.html", "/hdri/studio..jpg", "/a?x=../y"])
def test_the_page_itself_is_given(path: str) -> None:
    assert _refusal_of(path, "127.0.0.1:8080", None, HOSTS) == ""
    assert _refusal_of(path, "localhost:8080", "http://localhost:8080", HOSTS) == ""


def test_a_server_for_a_network_answers_to_any_name() -> None:
    assert _refusal_of("/", "cell-3:8080", "http://cell-3:8080", None) == ""
    assert _refusal_of("/", "cell-3:8080", "http://elsewhere.example", None)


def decode(data: bytes) -> Any:
    if data == b"garbage":
        raise ValueError("no message")
    return {"type": data.decode(), "updates": {"value": 1.0}}


@pytest.mark.parametrize("kind", [["GuiUpdateMessage"], {}, None, 5, "Else"])
def test_a_type_that_is_no_name_is_refused_and_ends_no_connection(kind: Any) -> None:
    gate = ConnectionGate(lambda _: {"type": kind}, HOSTS)
    assert not gate.lets_in(b"message")
    assert gate.refused == 1


class Connection:
    """Connection that sends some messages."""

    def __init__(self, *messages: bytes | str) -> None:
        self.messages = list(messages)

    async def recv(self) -> bytes | str:
        if not self.messages:
            raise ConnectionError("over")
        return self.messages.pop(0)

    def respond(self, status: int, text: str) -> tuple[int, str]:
        return int(status), text


def received(*messages: bytes | str) -> tuple[list[bytes], ConnectionGate]:
    """What a handler behind the gate receives."""
    gate, got = ConnectionGate(decode, HOSTS), []

    async def handler(connection: Any) -> None:
        while True:
            got.append(await connection.recv())

    arguments = gate.serve_arguments(handler, host="127.0.0.1")
    with pytest.raises(ConnectionError):
        asyncio.run(arguments["handler"](Connection(*messages)))
    assert gate.viewers == 0
    return got, gate


def test_only_the_camera_and_the_panel_get_in() -> None:
    got, gate = received(
        *(b"ViewerCameraMessage", b"ShareUrlRequest", b"FileTransferStartUpload", b"garbage", "text"),
        *(b"RunJavascriptMessage", b"GuiUpdateMessage", b"SceneNodeClickMessage"),
    )
    assert got == [b"ViewerCameraMessage", b"GuiUpdateMessage"]
    assert gate.refused == 6


def test_too_many_viewers_are_refused_and_the_page_is_still_given() -> None:
    gate = ConnectionGate(decode, HOSTS)
    asked: list[Any] = []
    arguments = gate.serve_arguments(None, process_request=lambda _connection, request: asked.append(request))
    plain = SimpleNamespace(path="/", headers={"Host": "localhost:8080"})
    socket = SimpleNamespace(path="/", headers={"Host": "localhost:8080", "Upgrade": "websocket"})
    gate.viewers = 32
    assert arguments["process_request"](Connection(), socket)[0] == 403
    assert arguments["process_request"](Connection(), plain) is None
    gate.viewers = 31
    assert arguments["process_request"](Connection(), socket) is None
    assert asked == [plain, socket]
    assert gate.refused == 1


@pytest.mark.parametrize("value", [0, 1.5, True, None, "1x", "", [0.1, 2.0], ("a", "b")])
def test_a_control_may_have_a_value(value: Any) -> None:
    assert _is_value(value)


@pytest.mark.parametrize(
    "value", [float("nan"), float("inf"), "x" * 1001, [0.0] * 9, [[1.0]], {"a": 1}, b"bytes", [{}], [float("nan")]]
)
def test_a_control_may_not_have_any_value(value: Any) -> None:
    assert not _is_value(value)


@pytest.mark.parametrize(
    "updates", [None, [], {}, {"visible": False}, {"value": 1.0, "removed": True}, {"update_cb": []}, {"value": {}}]
)
def test_a_message_sets_no_property_but_a_value(updates: Any) -> None:
    """viser sets what a message names, its lists of callbacks among them."""
    gate = ConnectionGate(lambda _: {"type": "GuiUpdateMessage", "updates": updates}, HOSTS)
    assert not gate.lets_in(b"message")
    assert gate.refused == 1


def test_a_viewer_who_sends_more_than_a_person_can_has_to_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    """As long as it takes for 200 a second, beyond the first 400; here no time passes."""
    slept: list[float] = []

    async def sleep(seconds: float) -> None:
        slept.append(seconds)

    monkeypatch.setattr("coneskin.view.connection_gate.monotonic", lambda: 5.0)
    monkeypatch.setattr("coneskin.view.connection_gate.asyncio.sleep", sleep)
    got, gate = received(*[b"GuiUpdateMessage"] * 500)
    assert len(got) == 500
    assert gate.refused == 0
    assert slept == pytest.approx([k / 200.0 for k in range(1, 101)])
