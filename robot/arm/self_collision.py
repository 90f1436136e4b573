"""Distances between the arm's own links, so that a motion away from a touch does not fold the arm into itself.

Pure. Links are thick lines along those of ``skeleton``, which are the axes of the tubes in the meshes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from coneskin.geometry.pose import Vector

from .model import ArmModel

__all__ = ["PartPair", "clearance_needed", "close_pairs", "segment_distance"]

#: names of the parts between the corners of the skeleton, from the base on
_PART_NAMES = ("base", "shoulder", "upper arm", "elbow", "forearm", "wrist 1", "wrist 2", "wrist 3")
#: pairs of parts that can meet; neighbours cannot, and a forearm folds beside its upper arm, not onto it
_PART_PAIRS = tuple((a, b) for a in (0, 1, 2) for b in (4, 5, 6, 7) if (a, b) != (2, 4) and (a, b) != (2, 5))


def clearance_needed(model: ArmModel) -> float:
    """Return the distance of two axes below which the arm counts as touching itself [m].

    The wrist's joints are about as thick as d5 is long, its fifth joint offset, and no tube of the family is thicker:
    43 mm of radius against d5 / 2 = 50 mm on the UR5e's upper arm, 54 against 58 on the UR10's (their meshes).
    """
    return model.d[4]


class PartPair(NamedTuple):
    """PartPair of parts that are close to each other.

    Attributes:
        first: index of the part nearer to the base.
        second: index of the other part.
        distance: distance of their axes [m].
    """

    first: int
    second: int
    distance: float

    @property
    def why(self) -> str:
        """Sentence about the pair for a person."""
        first, second = _PART_NAMES[self.first], _PART_NAMES[self.second]
        return f"the {second} would come within {1e3 * self.distance:.0f} mm of the {first}, axis to axis"

    def distance_in(self, corners: Sequence[Vector]) -> float:
        """Return the distance of the same two parts in another skeleton [m]."""
        a, b = self.first, self.second
        return segment_distance(corners[a], corners[a + 1], corners[b], corners[b + 1])


def close_pairs(model: ArmModel, corners: Sequence[Vector]) -> list[PartPair]:
    """Return the pairs of parts that are closer than ``clearance_needed``.

    Args:
        model: the arm.
        corners: its skeleton [m].
    """
    least = clearance_needed(model)
    pairs = (
        PartPair(a, b, segment_distance(corners[a], corners[a + 1], corners[b], corners[b + 1])) for a, b in _PART_PAIRS
    )
    return [pair for pair in pairs if pair.distance < least]


def segment_distance(a: Vector, b: Vector, c: Vector, d: Vector) -> float:
    """Return the least distance between the line segments a b and c d [m]; either may be a point.

    The distance is convex along each segment, so the least one is between an end and its foot on the other segment, or
    where both feet are inside. All are tried, so that parallel segments need no case of their own.
    """
    best = min(_to_segment(a, c, d), _to_segment(b, c, d), _to_segment(c, a, b), _to_segment(d, a, b))
    u, v, w = _minus(b, a), _minus(d, c), _minus(a, c)
    uu, uv, vv, uw, vw = _dot(u, u), _dot(u, v), _dot(v, v), _dot(u, w), _dot(v, w)
    det = uu * vv - uv * uv
    if det <= 0.0:
        return best  # parallel, or a point: the least distance is at a corner
    s, t = (uv * vw - vv * uw) / det, (uu * vw - uv * uw) / det
    if not (0.0 < s < 1.0 and 0.0 < t < 1.0):
        return best
    x, y, z = (w[k] + s * u[k] - t * v[k] for k in range(3))
    return min(best, math.sqrt(x * x + y * y + z * z))


def _to_segment(p: Vector, a: Vector, b: Vector) -> float:
    along, from_a = _minus(b, a), _minus(p, a)
    length = _dot(along, along)
    share = min(1.0, max(0.0, _dot(from_a, along) / length)) if length > 0.0 else 0.0
    return math.dist(p, (a[0] + share * along[0], a[1] + share * along[1], a[2] + share * along[2]))


def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
