"""URScript functions of sockets and of XML-RPC: a program is the client of a server.

A read that has nothing to return by its timeout, or whose server has gone, returns at the earliest in the next cycle,
so that a program which reads for ever gives way; so does one that is sent more than it reads. A timeout of 0 waits
without an end. A pose is sent by XML-RPC as a struct of x, y, z, rx, ry and rz, and such a struct comes back as a pose.

Source: Universal Robots, "The URScript Programming Language", module interfaces (socket_close to socket_set_var,
rpc_factory) and chapter "Remote Procedure Call (RPC)"; its article "XML-RPC communication" for the types.
"""

from __future__ import annotations

import ipaddress
import math
import re
import struct
import xmlrpc.client
from collections.abc import Callable, Generator
from contextlib import suppress
from typing import Any
from urllib.parse import urlsplit
from xml.parsers.expat import ExpatError

from coneskin.robot.sim.urscript.value_functions import MAX_LINE, text_of
from coneskin.robot.sim.urscript.values import Array, PoseValue, ScriptError, Struct, make_list, number, show

from .script_host import CallingProgram, ScriptHost, ScriptSocket

_MAX_SOCKETS = 32  # of one program, at once; an assumption
_MAX_VALUES = 30  # of one read
CONNECT_TIMEOUT = 2.0  #: s; an assumption
_SOCKET_NAME = "socket_0"  # of a connection that the program does not name
_NUMBER_LIST = re.compile(rb"[^(]*\(([^()]*)\)")


class SocketFunctions:
    """URScript functions of sockets."""

    _host: ScriptHost
    _program: CallingProgram
    _tell_not_simulated: Callable[[str], None]

    def socket_open(self, address: Any, port: Any, socket_name: Any = _SOCKET_NAME) -> Generator[None, None, bool]:
        """Connect to a server; return whether that worked."""
        try:
            where = _may_connect(str(address), self._host.beyond)
        except ScriptError as exc:
            self._tell_not_simulated(str(exc))
            yield
            return False
        if not 0 < int(port) < 65536:
            raise ScriptError(f"a port is from 1 to 65535, got {show(port)}")
        self.socket_close(socket_name)
        if len(self._program.sockets) >= _MAX_SOCKETS:
            raise ScriptError(f"a program opens at most {_MAX_SOCKETS} sockets at once")
        self._program.sockets[str(socket_name)] = connection = ScriptSocket(where, int(port))
        for _ in range(round(CONNECT_TIMEOUT / self._host.steptime)):
            connected = connection.connect()
            if connected:
                return True
            if connected is not None:
                break
            yield
        self.socket_close(socket_name)
        yield
        return False

    def rpc_factory(self, type: Any, url: Any) -> RemoteHandle:
        """Return a handle of a server of XML-RPC; its methods are those of the server."""
        if str(type).lower() != "xmlrpc":
            raise ScriptError(f'rpc_factory knows "xmlrpc" alone, got {show(type)}')
        return RemoteHandle(str(url), self._host.beyond)

    def socket_close(self, socket_name: Any = _SOCKET_NAME) -> None:
        """Close a connection, if there is one of that name."""
        connection = self._program.sockets.pop(str(socket_name), None)
        if connection is not None:
            connection.close()

    # write

    def socket_send_byte(self, value: Any, socket_name: Any = _SOCKET_NAME) -> bool:
        """Send one byte; return whether that worked."""
        return self._send(bytes([int(value) & 0xFF]), socket_name)

    def socket_send_byte_list(self, values: Any, socket_name: Any = _SOCKET_NAME) -> bool:
        """Send bytes; return whether that worked."""
        return self._send(bytes(int(value) & 0xFF for value in values), socket_name)

    def socket_send_int(self, value: Any, socket_name: Any = _SOCKET_NAME) -> bool:
        """Send a whole number as four bytes, the highest first; return whether that worked."""
        return self._send(struct.pack(">I", int(value) & 0xFFFFFFFF), socket_name)

    def socket_send_line(self, str: Any, socket_name: Any = _SOCKET_NAME) -> bool:
        """Send a value as text with an end of line; return whether that worked."""
        return self._send(text_of(str).encode() + b"\n", socket_name)

    def socket_send_string(self, str: Any, socket_name: Any = _SOCKET_NAME) -> bool:
        """Send a value as text; return whether that worked."""
        return self._send(text_of(str).encode(), socket_name)

    def socket_set_var(self, name: Any, value: Any, socket_name: Any = _SOCKET_NAME) -> None:
        """Send ``SET name value``, as a server of variables takes it."""
        self._send(f"SET {text_of(name)} {int(value)}\n".encode(), socket_name)

    def _send(self, data: bytes, name: Any) -> bool:
        connection = self._program.sockets.get(str(name))
        return connection is not None and connection.send(data)

    # read

    def socket_get_var(self, name: Any, socket_name: Any = _SOCKET_NAME) -> Generator[None, None, int]:
        """Ask a server of variables for a whole number; 0 where it does not answer within 2 s."""
        self._send(f"GET {text_of(name)}\n".encode(), socket_name)
        line = yield from self.socket_read_line(socket_name)
        match = re.fullmatch(rf"{re.escape(text_of(name))}\s+(-?\d{{1,10}})\s*", line)
        return int(match[1]) if match else 0

    def socket_read_ascii_float(
        self, number: Any, socket_name: Any = _SOCKET_NAME, timeout: Any = 2
    ) -> Generator[None, None, Array]:
        """Read numbers as text, ``(1.5, 2)``; return how many came, and their values; 0 and NaN after the timeout."""
        count = _count(number)

        def take(connection: ScriptSocket) -> bytes | None:
            match = _NUMBER_LIST.match(connection.unread)
            if match is None:
                connection.forget_if_full()
                return None
            text: bytes = match[1]  # a match reads the bytes again, so before they are taken
            connection.pop(match.end())
            return text

        text = yield from self._wait(socket_name, timeout, take)
        values: list[float] = []
        with suppress(ValueError):
            for part in text.split(b",")[:count]:
                values.append(float(part))
        return Array([len(values), *values, *[math.nan] * (count - len(values))])

    def socket_read_binary_integer(
        self, number: Any, socket_name: Any = _SOCKET_NAME, timeout: Any = 2
    ) -> Generator[None, None, Array]:
        """Read whole numbers of four bytes; return their number, and them; 0 and -1 after the timeout."""
        return (yield from self._read_values(number, "i", socket_name, timeout))

    def socket_read_byte_list(
        self, number: Any, socket_name: Any = _SOCKET_NAME, timeout: Any = 2
    ) -> Generator[None, None, Array]:
        """Read bytes; return their number, and them; 0 and -1 after the timeout."""
        return (yield from self._read_values(number, "B", socket_name, timeout))

    def socket_read_line(self, socket_name: Any = _SOCKET_NAME, timeout: Any = 2) -> Generator[None, None, str]:
        """Read a line, without its end; an empty text after the timeout."""
        line = yield from self.socket_read_string(socket_name, suffix="\n", timeout=timeout)
        return line.removesuffix("\r")

    def socket_read_string(
        self,
        socket_name: Any = _SOCKET_NAME,
        prefix: Any = "",
        suffix: Any = "",
        interpret_escape: Any = False,
        timeout: Any = 2,
    ) -> Generator[None, None, str]:
        """Read a text: what stands between prefix and suffix, or without them what has come."""
        first, last = (_bytes(text, bool(interpret_escape)) for text in (prefix, suffix))

        def take(connection: ScriptSocket) -> bytes | None:
            unread = connection.unread
            start = unread.find(first) if first else 0
            end = len(unread)
            if start >= 0 and last:
                end = unread.find(last, start + len(first))
            if start < 0 or end < 0 or not unread:
                connection.forget_if_full()
                return None
            return connection.pop(end + len(last))[start + len(first) : end][:MAX_LINE]

        text = yield from self._wait(socket_name, timeout, take)
        return text.decode("utf-8", "replace")

    def _read_values(self, number: Any, code: str, name: Any, timeout: Any) -> Generator[None, None, Array]:
        """Read so many values that the struct module has a code for."""
        count = _count(number)
        layout = struct.Struct(f">{count}{code}")

        def take(connection: ScriptSocket) -> bytes | None:
            return connection.pop(layout.size) if len(connection.unread) >= layout.size else None

        data = yield from self._wait(name, timeout, take)
        return Array([count, *layout.unpack(data)] if data else [0, *[-1] * count])

    def _wait(
        self, name: Any, timeout: Any, take: Callable[[ScriptSocket], bytes | None]
    ) -> Generator[None, None, bytes]:
        """Return what could be taken; nothing once the timeout [s] is over, or the server has gone."""
        limit = number(timeout, "a timeout")
        cycles = round(limit / self._host.steptime) if limit > 0.0 else 0
        begin, waited = self._host.outside_time(), 0
        while True:
            connection = self._program.sockets.get(str(name))
            if connection is not None:
                connection.fill()
                if connection.gives_way(self._host.cycle):
                    yield
                    continue
                if (taken := take(connection)) is not None:
                    return taken
            yield
            waited += 1
            late = (
                waited >= cycles and self._host.outside_time() - begin > limit - 0.5 * self._host.steptime
            )  # the server's time too
            if connection is None or connection.ended or (limit > 0.0 and late):
                return b""


def _may_connect(address: str, beyond: bool) -> str:
    """Return the numeric address to which a program may connect.

    Args:
        address: IPv4 address, or "localhost"; the simulator looks no names up, as that could take seconds.
        beyond: whether it may be another computer: only where others reach the simulator as well.

    Raises:
        ScriptError: the program may not connect to it.
    """
    try:
        found = ipaddress.IPv4Address("127.0.0.1" if address == "localhost" else address)
    except ValueError as exc:
        raise ScriptError(f"socket_open takes an IPv4 address or localhost, got {address[:99]!r}") from exc
    if not (found.is_loopback or beyond):
        raise ScriptError(
            f"socket_open({address!r}): a simulator that listens on this computer alone connects to nothing beyond it; "
            "start it with --host 0.0.0.0"
        )
    return str(found)


def _count(value: Any) -> int:
    if not 1 <= int(value) <= _MAX_VALUES:
        raise ScriptError(f"one read takes 1 to {_MAX_VALUES} values, got {show(value)}")
    return int(value)


def _bytes(value: Any, interpret_escape: bool) -> bytes:
    if not isinstance(value, str):
        raise ScriptError(f"expected a text, got {show(value)}")
    text: str = value
    if interpret_escape:
        for written, meant in (("\\n", "\n"), ("\\r", "\r"), ("\\t", "\t"), ("\\\\", "\\")):
            text = text.replace(written, meant)
    return text.encode()


_ANSWER_TIME = 60.0  # s that a server has for its answer; an assumption
_POSE_MEMBERS = ("x", "y", "z", "rx", "ry", "rz")


class RemoteHandle:
    """Handle of a server of procedures.

    Args:
        beyond: whether it may be another computer.

    Raises:
        ScriptError: the URL is not one, or the program may not connect to it.
    """

    def __init__(self, url: str, beyond: bool) -> None:
        parts = urlsplit(url)
        try:
            port = parts.port or 80
        except ValueError:
            port = 0
        if parts.scheme != "http" or not parts.hostname or not port:
            raise ScriptError(f'rpc_factory takes a URL such as "http://127.0.0.1:8000/RPC2", got {show(url)}')
        self._address = _may_connect(parts.hostname, beyond), port
        self._path = (parts.path or "/RPC2").encode("ascii", "replace")

    def call(self, name: str, arguments: Any, host: ScriptHost) -> Generator[None, None, Any]:
        """Call a procedure, and return its result.

        Raises:
            ScriptError: there is no server, no answer, or the answer is a fault: each ends the program, as on a robot.
        """
        if name == "closeXMLRPCClientConnection":
            return None
        body = xmlrpc.client.dumps(tuple(map(_to_python, arguments)), name, allow_none=True).encode()
        head = b"POST %b HTTP/1.0\r\nHost: robot\r\nContent-Type: text/xml\r\nContent-Length: %d\r\n\r\n"
        connection = ScriptSocket(*self._address)
        try:
            while (connected := connection.connect()) is None:
                yield
            if not (connected and connection.send(head % (self._path, len(body)) + body)):
                raise ScriptError(f"{name}: no server answers at {self._address[0]} port {self._address[1]}")
            end = host.outside_time() + _ANSWER_TIME
            while not connection.ended:
                connection.fill()
                if host.outside_time() > end:
                    raise ScriptError(f"{name}: the server has not answered within {_ANSWER_TIME:g} s")
                yield
            answer = bytes(connection.unread)
        finally:
            connection.close()
        return _result(name, answer)


def _result(name: str, answer: bytes) -> Any:
    """Return what an answer in HTTP holds."""
    status, _, text = answer.partition(b"\r\n\r\n")
    if b" 200 " not in status.partition(b"\r\n")[0] or b"<!DOCTYPE" in text:
        raise ScriptError(f"{name}: the server refuses the call: {status[:99].decode('ascii', 'replace')!r}")
    try:
        values, _ = xmlrpc.client.loads(text)
    except xmlrpc.client.Fault as exc:
        raise ScriptError(f"{name}: {exc.faultString[:500]}") from exc
    except (ExpatError, xmlrpc.client.ResponseError, ValueError, TypeError, LookupError) as exc:
        raise ScriptError(f"{name}: the answer cannot be read: {exc}") from exc
    return _to_script(values[0]) if values else None


def _to_python(value: Any) -> Any:
    if isinstance(value, PoseValue):
        return dict(zip(_POSE_MEMBERS, map(float, value), strict=True))
    if isinstance(value, Struct):
        return {name: _to_python(item) for name, item in value.items()}
    if isinstance(value, list):
        return list(map(_to_python, value))
    if not isinstance(value, bool | int | float | str):
        raise ScriptError(f"{show(value)} cannot be sent to a server")
    return value


def _to_script(value: Any) -> Any:
    if isinstance(value, dict):
        if set(value) == set(_POSE_MEMBERS):
            return PoseValue(float(value[name]) for name in _POSE_MEMBERS)
        return Struct({name: _to_script(item) for name, item in value.items()})
    if isinstance(value, list):
        return make_list(map(_to_script, value))
    return value if isinstance(value, bool | int | float | str) else str(value)
