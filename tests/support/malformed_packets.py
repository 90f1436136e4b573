"""Malformed packets for each service of a UR controller, drawn from a seed: what a server has to survive."""

from __future__ import annotations

import random
import struct
from collections.abc import Callable

from coneskin.robot.ur.rtde_codec import VARIABLES, PacketKind

_KINDS = tuple(int(kind) for kind in PacketKind)
_NAMES = tuple(VARIABLES)
_COMMANDS = ("load", "play", "pause", "popup", "addToLog", "programState", "get variable", "saveLog", "setUserRole")
_PIECES = "def f(): / end / if / while True: / thread t(): / sec s(): / movej( / p[1,2 / 9^9^9 / $ 1 / sync()"
_WORDS = (*'ab19.,()[]=:+-*/^%<>"\\\0', *_PIECES.split(" / "), "\n", "\n")


def _noise(dice: random.Random, most: int) -> bytes:
    return dice.randbytes(dice.randrange(most))


def _rtde(dice: random.Random) -> bytes:
    match dice.randrange(5):
        case 0:
            return _noise(dice, 60)
        case 1:  # a size that is not that of the packet
            return struct.pack(">HB", dice.choice((0, 1, 2, 3, 200)), dice.choice(_KINDS)) + _noise(dice, 40)
        case 2:  # names that do not exist, are too long or too many
            name = dice.choice((b"a", b"x" * 400, b"\xff" * 20, b",", dice.choice(_NAMES).encode()))
            body = struct.pack(">d", dice.choice((0.0, -1.0, 1e-320, 1e308, float("nan")))) + b",".join(
                [name] * dice.choice((1, 3, 40))
            )
            return struct.pack(">HB", len(body) + 3, dice.choice((ord("O"), ord("I")))) + body
        case _:
            body = _noise(dice, 40)
            return struct.pack(">HB", len(body) + 3, dice.choice(_KINDS)) + body


def _dashboard(dice: random.Random) -> bytes:
    line = _noise(dice, 40) if dice.random() < 0.5 else dice.choice(_COMMANDS).encode() + b" " + _noise(dice, 30)
    return line + dice.choice((b"\n", b"\r\n", b"\n\n", b""))


def _script(dice: random.Random) -> bytes:
    if dice.random() < 0.3:
        return _noise(dice, 60)
    return " ".join(dice.choices(_WORDS, k=dice.randrange(12))).encode() + b"\n"


_KINDS_OF: dict[str, Callable[[random.Random], bytes]] = {
    "RTDE": _rtde,
    "dashboard": _dashboard,
    "primary": _script,
    "secondary": _script,
    "realtime": _script,
}

#: names of the services
SERVICES = tuple(_KINDS_OF)


def malformed_packet(service: str, dice: random.Random) -> bytes:
    """Return bytes that a client of a service might send by mistake or in malice; not all of them are wrong.

    Args:
        service: one of `SERVICES`.
        dice: source of chance, so that a seed repeats it.
    """
    return _KINDS_OF[service](dice)
