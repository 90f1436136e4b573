"""Messages of HTTP/1.1, as far as the robot API needs them: bytes to requests, answers to bytes. Pure.

Source: RFC 9112 (messages) and RFC 7578 (form data). A body has its length in a header; chunks are not taken.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from urllib.parse import unquote

__all__ = ["Answer", "Request", "RequestReader", "uploaded_file"]

MAX_HEAD = 16_000  #: bytes of the request line and the headers
MAX_BODY = 2_000_000  #: bytes; a program of PolyScope X that only waits has 100 000
_REASONS = {
    **{200: "OK", 400: "Bad Request", 403: "Forbidden"},
    **{404: "Not Found", 405: "Method Not Allowed", 409: "Conflict"},
}


@dataclass(frozen=True, slots=True)
class Request:
    """Request of a client.

    Attributes:
        method: such as GET.
        path: without the query, decoded.
        headers: name in small letters -> value.
        body: what follows them.
    """

    method: str
    path: str
    headers: dict[str, str]
    body: bytes = b""


@dataclass(frozen=True, slots=True)
class Answer:
    """Answer to a request.

    Attributes:
        status: number of HTTP.
        content: what is sent, as JSON.
    """

    status: int
    content: object

    def encode(self) -> bytes:
        """Return the bytes of the answer."""
        body = json.dumps(self.content).encode()
        head = (
            f"HTTP/1.1 {self.status} {_REASONS.get(self.status, 'Error')}\r\n"
            f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n"
        )
        return head.encode() + body


class RequestReader:
    """Reader of requests: bytes in, answers to whole requests out."""

    def __init__(self, answer: Callable[[Request], Answer]) -> None:
        self._answer = answer
        self._rest = b""

    def __call__(self, data: bytes) -> bytes:
        """Take bytes, and return the answers to the requests that they complete.

        Raises:
            ValueError: they are not a request, or it is too long.
        """
        self._rest += data
        answers = b""
        while (end := self._rest.find(b"\r\n\r\n")) >= 0:
            request = _parse_head(self._rest[:end])
            size = _length(request)
            if len(self._rest) < end + 4 + size:
                return answers
            body, self._rest = self._rest[end + 4 : end + 4 + size], self._rest[end + 4 + size :]
            answers += self._answer(Request(request.method, request.path, request.headers, body)).encode()
        if len(self._rest) > MAX_HEAD:
            raise ValueError(f"a request has at most {MAX_HEAD} bytes of headers")
        return answers


def _parse_head(head: bytes) -> Request:
    first, *lines = head.decode("latin-1").split("\r\n")
    match = re.fullmatch(r"([A-Z]+) (/\S*) HTTP/1\.[01]", first)
    if match is None:
        raise ValueError(f"not a request: {first[:100]!r}")
    pairs = (line.partition(":") for line in lines)
    headers = {name.strip().lower(): value.strip() for name, _, value in pairs}
    return Request(match[1], unquote(match[2].partition("?")[0]), headers)


def _length(request: Request) -> int:
    if "transfer-encoding" in request.headers:
        raise ValueError("a body in chunks is not taken")
    length = request.headers.get("content-length", "0")
    if not re.fullmatch(r"[0-9]{1,9}", length) or int(length) > MAX_BODY:
        raise ValueError(f"the length of a body is a number up to {MAX_BODY}, got {length[:20]!r}")
    return int(length)


def uploaded_file(request: Request) -> bytes:
    """Return the file that a form uploads; the whole body where it is no form.

    Raises:
        ValueError: the form has no file.
    """
    match = re.match(r'multipart/form-data;.*boundary="?([^";]+)"?', request.headers.get("content-type", ""))
    if match is None:
        return request.body
    for part in request.body.split(b"--" + match[1].encode())[1:]:
        head, found, content = part.partition(b"\r\n\r\n")
        if found and b'name="file"' in head:
            return content.removesuffix(b"\r\n")
    raise ValueError("the form has no part named file")
