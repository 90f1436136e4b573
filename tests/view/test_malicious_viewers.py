"""Viewers that mean no good: they change nothing for the others, and hold nobody up."""

import http.client
import socket
import threading
import time
from contextlib import ExitStack, suppress
from typing import Any

import pytest

from coneskin.view.page_server import PageServer
from coneskin.view.run_course import read_courses
from coneskin.view.run_page import show_runs

from .socket_viewer import SocketViewer, socket_viewer

pytest.importorskip("viser", reason="viser is not installed: no page is served")
from websockets.exceptions import ConnectionClosed, InvalidStatus

from tests.support.paths import COLLISION

RUN = COLLISION


def control(viewer: SocketViewer, kind: str) -> str:
    """The number that the server gave to a control of a viewer's panel, once all of the panel is there."""
    found = str(viewer.hear_until(lambda message: message["type"] == kind)["uuid"])
    viewer.hear_until(lambda message: clock_of(message).startswith("1.788"))
    return found


def clock_of(message: dict[str, Any]) -> str:
    """The time that a message puts onto the page; empty for another message."""
    content = message.get("updates", {}).get("content", "") if message["type"] == "GuiUpdateMessage" else ""
    return str(content).partition('coneskin-clock"')[2].partition(">")[2].partition("<")[0].strip()


def test_a_viewer_cannot_move_what_another_looks_at() -> None:
    with PageServer("runs", port=18180) as server:
        show_runs(server, read_courses([RUN]))
        with socket_viewer(server) as victim, socket_viewer(server) as attacker:
            slider, own = control(victim, "GuiSliderMessage"), control(attacker, "GuiSliderMessage")
            assert slider != own
            attacker.send(type="GuiUpdateMessage", uuid=slider, updates={"value": 3.5})
            attacker.send(type="GuiUpdateMessage", uuid=own, updates={"value": 3.25})
            attacker.hear_until(lambda message: clock_of(message).startswith("3.250"))
            victim.send(type="GuiUpdateMessage", uuid=slider, updates={"value": 2.125})
            assert clock_of(victim.hear_until(clock_of)).startswith("2.125")


@pytest.mark.long
def test_nonsense_in_a_control_leaves_the_next_viewer_a_page() -> None:
    with PageServer("runs", port=18180) as server:
        show_runs(server, read_courses([RUN]))
        for kind, values in (
            ("GuiDropdownMessage", ("nanx", "1e308x", "\U0001f600")),
            ("GuiSliderMessage", (1e300, "x", None, [1.0])),
        ):
            for value in values:  # each of them from a viewer of its own, whose player it may end
                with socket_viewer(server) as attacker:
                    attacker.send(type="GuiUpdateMessage", uuid=control(attacker, kind), updates={"value": value})
                    attacker.socket.ping().wait(60)
        with socket_viewer(server) as viewer:
            slider = control(viewer, "GuiSliderMessage")
            viewer.send(type="GuiUpdateMessage", uuid=slider, updates={"value": 2.125})
            viewer.hear_until(lambda message: clock_of(message).startswith("2.125"))


def test_a_viewer_who_never_reads_holds_nobody_up_and_costs_no_memory() -> None:
    with PageServer("a page", port=18180) as server:
        text = server.gui.add_html("")
        frame = server.scene.add_frame("/moved", show_axes=False)
        with socket_viewer(server) as lazy, socket_viewer(server) as viewer:
            viewer.hear()
            buffer = server._server._websock_server._broadcast_buffer
            padding = "x" * 200_000  # a system's buffers are full after a few
            for number in range(150):
                with server.together():
                    frame.position = (0.001 * number, 0.0, 0.0)
                    text.content = f"picture {number} {padding}"
            viewer.hear_until(lambda message: "picture 149 " in str(message.get("updates", ""))[:60])
            kept = len(buffer.message_from_id)
            for number in range(150):
                text.content = f"more {number} {padding}"
            assert len(buffer.message_from_id) <= kept + 2
            assert lazy.socket.state.name == "OPEN"


@pytest.mark.long
def test_three_hundred_connections_that_say_nothing_leave_the_page_served() -> None:
    with PageServer("a page", port=18180) as server, ExitStack() as stack:
        server.gui.add_html("words")
        port = int(server.url.rpartition(":")[2])
        for _ in range(300):
            stack.enter_context(socket.create_connection(("127.0.0.1", port), timeout=60))
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
        connection.request("GET", "/")
        assert connection.getresponse().status == 200
        connection.close()
        with socket_viewer(server) as viewer:
            assert viewer.hear()


@pytest.mark.long
def test_no_more_than_32_viewers_get_in_and_the_next_one_when_one_has_gone() -> None:
    with PageServer("a page", port=18180) as server:
        server.gui.add_html("words")
        with ExitStack() as stack:
            viewers = [stack.enter_context(socket_viewer(server)) for _ in range(32)]
            assert all(viewer.hear() for viewer in viewers)
            with pytest.raises(InvalidStatus, match="403"), socket_viewer(server):
                pass
        deadline = time.monotonic() + 60.0
        while server.gate.viewers and time.monotonic() < deadline:
            threading.Event().wait(0.01)
        with socket_viewer(server) as viewer:
            assert viewer.hear()


def test_ten_viewers_are_told_the_same() -> None:
    with PageServer("a page", port=18180) as server, ExitStack() as stack:
        text = server.gui.add_html("")
        viewers = [stack.enter_context(socket_viewer(server)) for _ in range(10)]
        for viewer in viewers:
            viewer.hear()
        text.content = "stopping"
        for viewer in viewers:
            viewer.hear_until(lambda message: message.get("updates") == {"content": "stopping"})


@pytest.mark.long
def test_a_viewer_who_floods_is_read_no_faster_than_a_person_moves_a_control() -> None:
    """400 at once, then 200 a second; the others are told what is new meanwhile."""
    with PageServer("a page", port=18180) as server, socket_viewer(server) as attacker, socket_viewer(server) as viewer:
        text = server.gui.add_html("")
        viewer.hear()

        def flood() -> None:
            with suppress(ConnectionClosed):
                while True:
                    attacker.send(type="ShareUrlRequest", words="x" * 60_000)

        threading.Thread(target=flood, daemon=True).start()
        while server.gate.refused < 400:
            threading.Event().wait(0.01)
        text.content = "news"
        viewer.hear_until(lambda message: message.get("updates") == {"content": "news"})
        assert server.gate.refused < 5000
