"""Energy that a padding stores."""

from __future__ import annotations

import math

from coneskin.skin.materials import Padding


def stored_energy(padding: Padding, depth: float) -> float:
    """Return the energy stored in an indentation [J]."""
    ends = (*(start for start, _, _ in padding.pieces[1:]), math.inf)
    ways = [max(0.0, min(depth, end) - piece[0]) for piece, end in zip(padding.pieces, ends, strict=True)]
    return sum(way * (f + 0.5 * slope * way) for way, (_, f, slope) in zip(ways, padding.pieces, strict=True))
