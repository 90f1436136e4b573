"""Messages of the primary interface: notices in, bytes out. Pure.

All numbers are big endian; a packet is its length with these four bytes, its kind, and for a message (kind 20) the
controller's time [us], its source and the kind of message.

Source: Universal Robots, "Client Interface" (primary and secondary, version 5.x), robot messages.
"""

from __future__ import annotations

import struct

from coneskin.robot.sim.machine.notices import (
    ErrorNotice,
    Notice,
    PopupNotice,
    ProgramFailed,
    ProgramNotice,
    SafetyNotice,
    TextNotice,
)
from coneskin.robot.sim.machine.options import Version

__all__ = ["encode_notice", "encode_version", "pack"]

MESSAGE = 20  #: kind of a packet that holds one message
_TEXT, _POPUP, _VERSION, _SAFETY, _ERROR, _KEY, _FAILED = 0, 2, 3, 5, 6, 7, 10
_RUNTIME, _INTERFACE = 253, 254  # source of a message: the runtime machine, the interface itself
_NO_DATA = 0  # of a report: it carries no further value
_LARGEST_TITLE = 255  # bytes: its length is one byte


def pack(kind: int, body: bytes) -> bytes:
    """Return a packet of the client interface."""
    return struct.pack(">iB", 5 + len(body), kind) + body


def _message(time: float, source: int, kind: int, body: bytes) -> bytes:
    return pack(MESSAGE, struct.pack(">QBB", round(time * 1e6), source, kind) + body)


def _bytes(text: str) -> bytes:
    """Return a text; a half of a pair of surrogates, which a file in JSON can hold, becomes a question mark."""
    return text.encode("utf-8", "replace")


def encode_version(time: float, version: Version) -> bytes:
    """Return the message that a client of the primary interface gets first.

    Args:
        time: since power-on [s].
        version: of the controller's software.
    """
    major, minor = version
    name, date = b"URControl", b"01-01-2026, 00:00:00"
    body = struct.pack(">B", len(name)) + name + struct.pack(">BBii", major, minor, 0, 1) + date
    return _message(time, _INTERFACE, _VERSION, body)


def encode_notice(time: float, notice: Notice) -> bytes:
    """Return a notice as a message.

    Args:
        time: since power-on [s].
        notice: what has happened.
    """
    match notice:
        case TextNotice(text):
            return _message(time, _RUNTIME, _TEXT, _bytes(text))
        case PopupNotice(title, text, warning, error):
            head = _bytes(title)[:_LARGEST_TITLE]
            flags = struct.pack(">IBBBBB", 0, 0, warning, error, False, len(head))
            return _message(time, _RUNTIME, _POPUP, flags + head + _bytes(text))
        case ProgramNotice(name, event):
            key = f"PROGRAM_XXX_{event}".encode()
            return _message(time, _RUNTIME, _KEY, struct.pack(">iiB", 0, 0, len(key)) + key + _bytes(name))
        case ProgramFailed(text, line, column):
            return _message(time, _RUNTIME, _FAILED, struct.pack(">ii", line, column) + _bytes(text))
        case SafetyNotice(mode):
            return _message(time, _RUNTIME, _SAFETY, struct.pack(">iiBiI", 0, 0, mode, _NO_DATA, 0))
        case ErrorNotice(code, argument, report, text):
            body = struct.pack(">iiiII", code, argument, report, _NO_DATA, 0)
            return _message(time, _RUNTIME, _ERROR, body + _bytes(text))
