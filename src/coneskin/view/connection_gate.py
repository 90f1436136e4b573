"""Gate in front of a page's server: who may connect, which file may be asked for, and which messages get in.

The library that serves the page hands out any file that a path with ``..`` leads to, opens a tunnel to the internet
when a message asks for it, lets pages of other origins connect, and sets any property of a control that a message
names. A page here only shows: what comes from a browser is its camera, and the values of its own panel's controls.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable
from http import HTTPStatus
from time import monotonic
from typing import Any
from urllib.parse import unquote, urlsplit

#: types of message that a page may send
ALLOWED = frozenset({"ViewerCameraMessage", "GuiUpdateMessage"})
#: and those with which a file is dropped onto it
UPLOADS = frozenset({"FileTransferStartUpload", "FileTransferPart"})
_UPDATE_MESSAGE = "GuiUpdateMessage"
_PAGE_PATHS = frozenset({"/", "/index.html"})
_MAX_MESSAGE_SIZE = 1 << 16  # bytes of a message that is no part of a file
_MAX_VIEWERS = 32  # that are served at once
_MAX_MESSAGE_RATE = 200.0  # messages a second of a viewer, who drags a handle or the camera at 60; more have to wait
_MAX_BURST = 400  # messages that may come at once, before they have to wait
_MAX_VALUE_LENGTH = 1000  # letters of a value
_MAX_LIST_ITEMS = 8  # of a value that is a list


def _is_value(value: Any, depth: int = 1) -> bool:
    """Tell whether a value may be that of a control: a finite number, a few words, yes or no, or a few of them."""
    if isinstance(value, list | tuple):
        return depth > 0 and len(value) <= _MAX_LIST_ITEMS and all(_is_value(item, depth - 1) for item in value)
    if isinstance(value, str):
        return len(value) <= _MAX_VALUE_LENGTH
    return value is None or (isinstance(value, int | float) and math.isfinite(value))


def _refusal_of(path: str, host: str, origin: str | None, hosts: frozenset[str] | None) -> str:
    """Return why a request is refused; empty where it is not.

    An origin comes with a web socket alone. A name that another's page has led here is none of the ``hosts``.
    """
    plain = unquote(path.partition("?")[0])
    if not plain.startswith("/") or ".." in plain.split("/") or "//" in plain or "\\" in plain or "\0" in plain:
        return "no such page"
    try:
        name = urlsplit(f"//{host}").hostname or ""
        if hosts is not None and name not in hosts:
            return f"this server is not {name}"
        if origin is not None and urlsplit(origin).netloc != host:
            return "a page of another origin may not look in"
    except ValueError:  # half a bracket
        return "that is no address"
    return ""


class ConnectionGate:
    """Gate of one server.

    Args:
        decode: bytes of a message -> the message as a dict; raises ValueError for what is none.
        hosts: names of this server; None for any.
        page: HTML that is given out in the place of the library's own; None for that.
        allowed: types of message that get in.
        largest: bytes of a message.

    Attributes:
        refused: messages and requests that were not let in.
        viewers: connections that are open.
    """

    def __init__(
        self,
        decode: Callable[[bytes], Any],
        hosts: frozenset[str] | None,
        page: str | None = None,
        allowed: frozenset[str] = ALLOWED,
        largest: int = _MAX_MESSAGE_SIZE,
    ) -> None:
        self.refused = self.viewers = 0
        self._decode, self._hosts, self._allowed, self._largest = decode, hosts, allowed, largest
        self._page = page

    def serve_arguments(self, handler: Callable[[Any], Awaitable[None]], **given: Any) -> dict[str, Any]:
        """Return the arguments of the server's ``serve`` with this gate in them."""
        answer = given.get("process_request")

        def process_request(connection: Any, request: Any) -> Any:
            headers = request.headers
            why = _refusal_of(request.path, headers.get("Host", ""), headers.get("Origin"), self._hosts)
            if not why and headers.get("Upgrade") and self.viewers >= _MAX_VIEWERS:
                why = f"{_MAX_VIEWERS} viewers are served already"
            if why:
                self.refused += 1
                return connection.respond(HTTPStatus.FORBIDDEN, f"{why}\n")
            if self._page is not None and not headers.get("Upgrade") and request.path.partition("?")[0] in _PAGE_PATHS:
                response = connection.respond(HTTPStatus.OK, self._page)
                del response.headers["Content-Type"]
                response.headers["Content-Type"] = "text/html; charset=utf-8"
                return response
            return answer(connection, request) if answer is not None else None

        async def handle(connection: Any) -> None:
            self.viewers += 1
            try:
                await handler(_Sieve(connection, self))
            finally:
                self.viewers -= 1

        return {**given, "handler": handle, "process_request": process_request, "max_size": self._largest}

    def lets_in(self, data: Any) -> bool:
        """Tell whether a message gets in; one that does not is counted."""
        try:
            message = self._decode(data) if isinstance(data, bytes) else None
            kind = message.get("type") if isinstance(message, dict) else None
        except ValueError:
            message = kind = None
        if isinstance(kind, str) and kind in self._allowed and (kind != _UPDATE_MESSAGE or _sets_a_value(message)):
            return True
        self.refused += 1
        return False


def _sets_a_value(message: Any) -> bool:
    """Tell whether an update sets the value of a control, and nothing else of it."""
    updates = message.get("updates")
    return isinstance(updates, dict) and set(updates) == {"value"} and _is_value(updates["value"])


class _Sieve:
    """Connection of which only the messages that the gate lets in are received, and no more than a person makes.

    What comes faster waits in the connection, and then at its sender.
    """

    def __init__(self, connection: Any, gate: ConnectionGate) -> None:
        self._connection, self._gate = connection, gate
        self._spare, self._then = float(_MAX_BURST), monotonic()

    async def recv(self) -> bytes:
        while True:
            data = await self._connection.recv()
            await self._wait_its_turn()
            if self._gate.lets_in(data):
                return bytes(data)

    async def _wait_its_turn(self) -> None:
        now = monotonic()
        self._spare = min(float(_MAX_BURST), self._spare + _MAX_MESSAGE_RATE * (now - self._then)) - 1.0
        self._then = now
        if self._spare < 0.0:
            await asyncio.sleep(-self._spare / _MAX_MESSAGE_RATE)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._connection, name)
