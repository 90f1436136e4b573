"""Mutations of a recording whose checksums stay right: what an enemy or another version may have written."""

import json
import math
import struct
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

from coneskin.core.recording.block import Block
from coneskin.core.recording.recorder import Recorder
from coneskin.robot.guard.signals.journal import BlockKind, EventName
from coneskin.skin.wire import FRAME_LENGTH, encode, frame_at

_TIMES = (math.nan, math.inf, -math.inf, 1e300, -1e12, 0.0, 1e12)
_NUMBERS = (math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324, 0.0, -1.0, 1e6, 4.0)
_VALUES: tuple[Any, ...] = (
    None, True, [], {}, "", "x" * 5000, "\0", "\ud800", "\x1b[2J", "$x$", -1, 2**70, 10**400, *_NUMBERS,
    [1, 2, 3], {"a": {"b": []}}, ["no number"] * 3,
)  # fmt: skip
_DEEP = b"[" * 200_000
_SCENE_LINES = (
    'mesh = "/dev/zero"', 'file = "/dev/zero"', "height_mm = nan", "height_mm = 1e300", "radius1_mm = -1",
    "rate_hz = 0", 'model = "UR999"', "id = 7", "wrap_deg = 0.0001", "[[link]]", "[arm]", "a" + ".a" * 3000 + " = 1",
    "x = " + "[" * 5000,
    "touch_level = 1e-320", 'name = "$\\\\frac$"', 'kind = "retreat"', 'kind = "slow"', 'control = "external"',
)  # fmt: skip


def mutate(blocks: list[Block], random: Random) -> list[Block]:
    """Return the blocks of a recording with one to five mutations."""
    blocks = list(blocks)
    for _ in range(random.choice((1, 1, 1, 2, 5))):
        random.choice(_MUTATIONS)(blocks, random)
    return blocks


def write(path: Path, blocks: list[Block]) -> None:
    """Write blocks as a recording that was closed."""
    path.unlink(missing_ok=True)
    with Recorder(path) as recorder:
        recorder.write(*blocks)


def _pick(blocks: list[Block], random: Random, kind: int | None = None) -> int:
    places = [i for i, block in enumerate(blocks) if kind in (None, block.kind)]
    return random.choice(places or range(len(blocks)))


def _header(blocks: list[Block], random: Random) -> None:
    blocks[0] = blocks[0]._replace(payload=_mutated_json(blocks[0].payload, random))


def _scene(blocks: list[Block], random: Random) -> None:
    try:
        header = json.loads(blocks[0].payload)
        lines = header["scene"].splitlines()
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return
    for _ in range(random.randint(1, 3)):
        where = random.randrange(len(lines) + 1)
        lines[where : where + random.randint(0, 1)] = [random.choice(_SCENE_LINES)]
    header["scene"] = "\n".join(lines)
    blocks[0] = blocks[0]._replace(payload=json.dumps(header).encode())


def _event(blocks: list[Block], random: Random) -> None:
    where = _pick(blocks, random, BlockKind.EVENT)
    blocks[where] = blocks[where]._replace(payload=_mutated_json(blocks[where].payload, random))


def _new_event(blocks: list[Block], random: Random) -> None:
    details = random.choice(
        ({}, {"what": 1}, {"since": "a"}, {"since": 1.0, "until": None}, {"reasons": 5}, {"by": {}})
    )
    payload = json.dumps([random.choice(list(EventName)), details]).encode()
    where = _pick(blocks, random)
    blocks.insert(where + 1, Block(BlockKind.EVENT, blocks[where].time, payload))


def _doubles(blocks: list[Block], random: Random) -> None:
    where = _pick(blocks, random, random.choice((BlockKind.ARM, BlockKind.SLIDER)))
    for block in range(where, min(len(blocks), where + random.choice((1, 1, 50)))):
        if blocks[block].kind in (BlockKind.ARM, BlockKind.SLIDER) and len(blocks[block].payload) > 8:
            payload = bytearray(blocks[block].payload)
            at = 1 + 8 * random.randrange((len(payload) - 1) // 8)
            struct.pack_into(">d", payload, at, random.choice((*_NUMBERS, random.uniform(-1e4, 1e4))))
            blocks[block] = blocks[block]._replace(payload=bytes(payload))


def _frame(blocks: list[Block], random: Random) -> None:
    """Change fields of frames, with the right checksum of the frame as well."""
    where = _pick(blocks, random, BlockKind.SKIN)
    for at in range(where, min(len(blocks), where + random.choice((1, 20, 400)))):
        if blocks[at].kind != BlockKind.SKIN or (frame := frame_at(blocks[at].payload)) is None:
            continue
        name = random.choice([*frame._fields[1:-4], "supply"])
        bits = {"sensor": 8, "status": 8, "clock_us": 32}.get(name, 16)
        names = [name] if name != "supply" else ["touch_supply", "radial_supply", "angular_supply"]
        changed = frame._replace(**dict.fromkeys(names, random.choice((0, 1, 2**bits - 1, random.randrange(2**bits)))))
        blocks[at] = blocks[at]._replace(payload=encode(changed) + blocks[at].payload[FRAME_LENGTH:])


def _bytes(blocks: list[Block], random: Random) -> None:
    where = _pick(blocks, random)
    payload = blocks[where].payload
    new = random.choice(
        (b"", payload[: len(payload) // 2], payload * 3, random.randbytes(len(payload)), _DEEP, b"\xff" * 40)
    )
    blocks[where] = blocks[where]._replace(payload=new)


def _time(blocks: list[Block], random: Random) -> None:
    where = _pick(blocks, random)
    for at in range(where, min(len(blocks), where + random.choice((1, 1, 300)))):
        time = random.choice((*_TIMES[3:], blocks[at].time - 1.0, blocks[at].time + random.uniform(-3, 3)))
        blocks[at] = blocks[at]._replace(time=time)


def _no_time(blocks: list[Block], random: Random) -> None:
    where = _pick(blocks, random)
    blocks[where] = blocks[where]._replace(time=random.choice(_TIMES))


def _kind(blocks: list[Block], random: Random) -> None:
    where = _pick(blocks, random)
    kind = random.choice((*BlockKind, 0, 8, 9, 12, 23, 255))
    blocks[where] = blocks[where]._replace(kind=kind)


def _order(blocks: list[Block], random: Random) -> None:
    start = _pick(blocks, random)
    part = blocks[start : start + random.choice((2, 100, 5000))]
    made = random.choice((part[::-1], [], part * 2, random.sample(part, len(part))))
    blocks[start : start + len(part)] = made
    if not blocks:
        blocks.append(Block(BlockKind.TICK, 0.0, b""))


def _insert(blocks: list[Block], random: Random) -> None:
    where = _pick(blocks, random)
    kind, payloads = random.choice(
        (
            (BlockKind.RESET, (b"", b"{}", b"\xff")),
            (BlockKind.LOST, (b"", b"skin", b"driver\nx", b"watchdog\n", b"slider\nx", b"session\nend", b"\xff\n\xff")),
            (BlockKind.DRIVER, (b"", b"ready\n", b"error\n\x1b[2J", b"done", b"\xff\xff")),
            (BlockKind.SURFACE, (b"", b"{}\n", b'{"sensor": "a", "rows": 2, "columns": 2}\n' + bytes(32), _DEEP)),
            (BlockKind.COMMAND, (b"", b"driver\nS", b"\xff")),
            (BlockKind.OVERRUN, (b"", b"[]", _DEEP)),
            (BlockKind.HEADER, (b"", b"{}")),
        )
    )
    blocks.insert(where + 1, Block(kind, blocks[where].time, random.choice(payloads)))


_MUTATIONS: tuple[Callable[[list[Block], Random], None], ...] = (
    _header, _scene, _scene, _event, _event, _new_event, _doubles, _doubles, _frame, _frame, _bytes, _bytes, _time,
    _no_time, _kind, _order, _insert,
)  # fmt: skip


def _mutated_json(payload: bytes, random: Random) -> bytes:
    try:
        value = json.loads(payload)
    except (ValueError, RecursionError):
        return payload
    places: list[tuple[Any, Any]] = []
    _walk(value, places)
    if not places or random.random() < 0.1:
        return random.choice((b"", _DEEP, b"5", b"{}", b"[]", b"[1, 2]", b'["contact", 1]', payload[:-1], b"\xff"))
    holder, key = random.choice(places)
    if isinstance(holder, dict) and random.random() < 0.3:
        del holder[key]
    else:
        holder[key] = random.choice(_VALUES)
    return json.dumps(value).encode()


def _walk(value: Any, places: list[tuple[Any, Any]]) -> None:
    for key in list(value) if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ():
        places.append((value, key))
        _walk(value[key], places)
