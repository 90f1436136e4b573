"""Record of the surfaces below sensors on meshes, so that a replay needs no mesh file: names and grids of heights."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import RecordingError
from coneskin.core.text import read_json

if TYPE_CHECKING:
    from coneskin.core.arrays import Floats
    from coneskin.core.recording.block import Block

    from .build import SensorOnArm

_MAX_NODES = 2048  # of a grid, along and around; ``build`` makes 65 x 129


def encode_surfaces(placed: Iterable[SensorOnArm], time: float) -> list[Block]:
    """Return a block, with a host time [s], for each sensor that lies on a mesh."""
    from coneskin.core.recording.block import Block
    from coneskin.robot.guard.signals.journal import BlockKind

    blocks = []
    for item in placed:
        if item.surface is not None:
            rows, columns = item.surface.heights.shape
            head = json.dumps({"sensor": item.name, "rows": rows, "columns": columns}).encode()
            payload = head + b"\n" + item.surface.heights.astype("<f8").tobytes()
            blocks.append(Block(BlockKind.SURFACE, time, payload))
    return blocks


def decode_surfaces(blocks: Iterable[Block]) -> dict[str, Floats]:
    """Return the heights of the meshes [m] by the names of the sensors, from a recording's blocks of any kind.

    Raises:
        RecordingError: a block of this kind holds no grid of finite heights.
    """
    from coneskin.robot.guard.signals.journal import BlockKind

    return dict(_decode(block) for block in blocks if block.kind == BlockKind.SURFACE)


def _decode(block: Block) -> tuple[str, Floats]:
    import numpy as np

    head, _, body = block.payload.partition(b"\n")
    try:
        facts: dict[str, Any] = read_json(head)
        name, shape = facts["sensor"], (facts["rows"], facts["columns"])
        if not all(type(count) is int and 2 <= count <= _MAX_NODES for count in shape):
            raise ValueError(f"its grid has {shape[0]!r} x {shape[1]!r} nodes")
        heights = np.frombuffer(body, "<f8").reshape(shape)
        if not isinstance(name, str) or not np.isfinite(heights).all():
            raise ValueError("its name is no text, or a height is not finite")
    except (ValueError, TypeError, KeyError) as exc:
        raise RecordingError(f"the block of {block.time:.6f} s holds no surface of a sensor: {exc}") from exc
    return name, heights
