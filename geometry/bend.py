"""Bend: a strip of a side between two rulings, by its share of the wrap and the turn of its normal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from coneskin.core.errors import GeometryError

__all__ = ["Bend", "bends_between", "check_bends"]

_TURN = 2.0 * math.pi
_SLACK = 1e-6  # rad; the widths of the bends add up to the wrap but for rounding
_NARROWEST = 1e-9  # rad; what is left of a bend that is cut is at least so wide


@dataclass(frozen=True, slots=True)
class Bend:
    """A strip between two rulings, bent evenly.

    Attributes:
        width: azimuth that it takes [rad], above 0.
        turn: angle by which its normal turns from one ruling to the other [rad]; 0 for a plane, negative for a hollow.
    """

    width: float
    turn: float


def check_bends(bends: Sequence[Bend], wrap: float) -> None:
    """Check that bends are possible and add up to a wrap [rad].

    Raises:
        GeometryError: a bend is not finite or turns too far, or they do not add up.
    """
    for bend in bends:
        if not (math.isfinite(bend.width) and bend.width > 0.0 and math.isfinite(bend.turn)):
            raise GeometryError(f"a bend needs a width above 0 rad and a finite turn, got {bend}")
        if abs(bend.turn) > _TURN:
            raise GeometryError(f"a bend turns by a full turn (2 pi rad) at most, got {bend.turn!r} rad")
    width = math.fsum(bend.width for bend in bends)
    if abs(width - wrap) > _SLACK:
        raise GeometryError(
            f"the widths of the bends must add up to the wrap of {math.degrees(wrap):.6g} deg, they are "
            f"{math.degrees(width):.6g} deg"
        )


def bends_between(bends: Sequence[Bend], phi1: float, phi2: float, around: bool = False) -> tuple[Bend, ...]:
    """Return the bends between two azimuths [rad], those at the edges cut.

    Args:
        bends: from phi = 0 on.
        phi1: first azimuth, not below 0.
        phi2: last azimuth.
        around: True where the first bend follows the last one again; else the last one goes on.
    """
    parts, begin = [], 0.0
    wrap = math.fsum(bend.width for bend in bends)
    beyond = phi2 - wrap
    if around:
        bends = tuple(bends) * max(1, math.ceil(phi2 / wrap - _NARROWEST))
    elif beyond > _NARROWEST:
        bends = (*bends, Bend(beyond, bends[-1].turn * beyond / bends[-1].width))
    for bend in bends:
        low, high = max(begin, phi1), min(begin + bend.width, phi2)
        if high - low > _NARROWEST:
            parts.append(Bend(high - low, bend.turn * (high - low) / bend.width))
        begin += bend.width
    return tuple(parts)
