"""Run in which the collision of tests/data comes again and again, for the benches of a page that stays open."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

from coneskin.core.recording.block import END, Block
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.runs.replay.run import read_run

RUN_FILE = Path(__file__).parents[2] / "tests" / "data" / "collision.rec"
_PAUSE_TIME = 0.1  # s between two collisions
_TOUCH_STEP = 1000  # by which the numbers of touches go on with each collision


def header_of() -> Block:
    """Return the header with which such a run begins."""
    run = read_run(RUN_FILE)
    return Block(BlockKind.HEADER, next(iter(run.blocks)).time, json.dumps(run.header).encode())


def collisions_again() -> Iterator[tuple[int, Block]]:
    """Yield the number of the collision and a block of it, for ever: times and numbers of touches go on."""
    blocks = [block for block in read_run(RUN_FILE).blocks if block.kind not in (BlockKind.HEADER, END)]
    length = blocks[-1].time - blocks[0].time + _PAUSE_TIME
    number = 0
    while True:
        for block in blocks:
            payload = block.payload
            if block.kind == BlockKind.EVENT:
                name, details = json.loads(payload)
                if isinstance(details.get("number"), int):
                    details["number"] += _TOUCH_STEP * number
                payload = json.dumps([name, details]).encode()
            yield number, Block(block.kind, block.time + number * length, payload)
        number += 1
