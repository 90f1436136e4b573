"""Sides of an arm that no skin covers, and how far a motion moves them outward. Pure.

A motion away from a touch moves the far side of the arm towards what no one has seen. Where a skin is there, it feels
what it meets. Where none is, nothing does until the joints feel it. So the way of every bare surface is computed:

    part of the arm            how far it moves outward when its middle moves by d
    no skin                    |d|
    sheet of a full wrap       0
    sheet with a bare strip    max(0, max of n . d over the normals n of the strip)

Each of these is convex along a part that is straight, so that its largest value is at an end of the part, or of a sheet
on it. A skin counts only while it is ready. A guard whose skin is not ready has a fault, and moves nothing.

Where the arm gives way to a push, it is a lever: what it meets where it moves a tenth as fast bears ten times the push,
and the joints feel no more than a lighter push. So "allowed" does not hold for that: pushed with 15 N, an arm pressed
124 N on a wall behind its elbow.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from coneskin.geometry.pose import Vector
from coneskin.robot.arm.kinematics import link_poses
from coneskin.robot.arm.vectors import dot, minus
from coneskin.robot.arm.workspace import arm_parts

if TYPE_CHECKING:
    from coneskin.geometry.placed_frustum import PlacedFrustum
    from coneskin.robot.arm.model import ArmModel, Joints

#: m by which a surface that no skin covers may move outward in a motion of ours, unless the scene allows more; 19 N at
#: 75 N/mm, the hardest that ISO/TS 15066 has of a hand and a face
MAX_BARE_WAY = 0.00025
_FULL_WRAP = math.radians(359.0)  # from which on no finger fits between the ends of a sheet
_MIN_LENGTH = 0.005  # m of a part between two sheets; in a narrower one both feel what comes


class _Station(NamedTuple):
    """End of a bare part of a link, or of a sheet with a bare strip, in the link's frame."""

    name: str
    link: int
    place: Vector
    strip: tuple[Vector, Vector, float] | None = None  #: middle of the strip, direction around, half its angle [rad]


class BareSides:
    """Sides of one arm that its skins leave bare.

    Args:
        sheets: each skin: index of its link's DH frame, and its side in that frame.

    Attributes:
        parts: of the arm, in words, that have such a side.
    """

    def __init__(self, model: ArmModel, sheets: Sequence[tuple[int, PlacedFrustum]]) -> None:
        self._model = model
        stations: list[_Station] = []
        for name, link, begin, end in arm_parts(model):
            length = math.dist(begin, end)
            covered = []
            for sheet_link, sheet in sheets:
                span = _span(begin, end, sheet) if sheet_link == link else None
                if span is not None:
                    covered.append(span)
                    strip = _strip(sheet)
                    stations += [_Station(name, link, _along(begin, end, at), strip) for at in span if strip]
            at = 0.0
            for low, high in [*sorted(covered), (1.0, 1.0)]:
                if (low - at) * length > _MIN_LENGTH:
                    stations += [_Station(name, link, _along(begin, end, t)) for t in (at, low)]
                at = max(at, high)
        self._stations = tuple(stations)
        self.parts = tuple(dict.fromkeys(f"strip of the {one.name}" if one.strip else one.name for one in stations))

    def way(self, q: Joints, there: Sequence[float]) -> tuple[float, str]:
        """Return how far a bare surface moves outward at most [m], and which part's that is.

        From joint positions to others [rad] that are not far from them.
        """
        here, then = link_poses(self._model, q), link_poses(self._model, there)
        farthest, part = 0.0, ""
        for name, link, place, strip in self._stations:
            step = minus(then[link].apply(place), here[link].apply(place))
            if strip is None:
                way, what = math.sqrt(dot(step, step)), name
            else:
                middle, around, half = strip
                turn = here[link].rotate
                way, what = _outward(step, turn(middle), turn(around), half), f"strip of the {name}"
            if way > farthest:
                farthest, part = way, what
        return farthest, part


def _outward(step: Vector, middle: Vector, around: Vector, half: float) -> float:
    """Return how far the normals of a strip move outward at most in a step of its link [m]."""
    along, across = dot(step, middle), dot(step, around)
    off = max(0.0, abs(math.atan2(across, along)) - half)  # of the nearest normal from the way
    return max(0.0, math.hypot(along, across) * math.cos(off))


def _strip(sheet: PlacedFrustum) -> tuple[Vector, Vector, float] | None:
    """Return the strip beside a sheet: its middle, the direction around, half its angle. None of a full wrap."""
    wrap = sheet.frustum.wrap
    if wrap >= _FULL_WRAP:
        return None
    half = 0.5 * (math.tau - wrap)
    turn = sheet.link_frustum.rotate
    middle, around = wrap + half, wrap + half + 0.5 * math.pi
    return (turn((math.cos(middle), math.sin(middle), 0.0)), turn((math.cos(around), math.sin(around), 0.0)), half)


def _span(begin: Vector, end: Vector, sheet: PlacedFrustum) -> tuple[float, float] | None:
    """Return the share of a part that a sheet lies around, from where to where. None where it lies beside it."""
    way = minus(end, begin)
    square = dot(way, way)
    if square <= 0.0:
        return None
    ends = sheet.centre(0.0), sheet.centre(sheet.frustum.slant)
    a, b = sorted(dot(minus(at, begin), way) / square for at in ends)
    low, high = max(a, 0.0), min(b, 1.0)
    middle = _along(begin, end, 0.5 * (low + high))
    beside = math.dist(middle, _along(*ends, 0.5)) > max(sheet.frustum.radius1, sheet.frustum.radius2) + (b - a)
    return None if high <= low or beside else (low, high)


def _along(begin: Vector, end: Vector, share: float) -> Vector:
    x, y, z = (a + share * (b - a) for a, b in zip(begin, end, strict=True))
    return x, y, z
