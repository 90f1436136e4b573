"""Joint between two sheets that follow each other along one axis."""

from __future__ import annotations

import math
from dataclasses import dataclass

from coneskin.geometry.drawing.layer_stack import LayerStack
from coneskin.geometry.placed_frustum import PlacedFrustum

__all__ = ["SheetJoint", "adjoin", "find_joint"]

_TURN = 2.0 * math.pi


@dataclass(frozen=True, slots=True)
class SheetJoint:
    """The joint between a sheet and the next one on the axis.

    Attributes:
        inner: distance along the axis at the faces on the link [m].
        outer: the same at the outer faces [m].
        trimmed: length by which both sheets together were shortened along the axis [m].
    """

    inner: float
    outer: float
    trimmed: float


def adjoin(one: PlacedFrustum, two: PlacedFrustum) -> bool:
    """Tell whether two sheets follow each other along one axis, with the same wrap."""
    turn = one.link_frustum.inverse() @ two.link_frustum
    x, y, z = turn.translation
    tilt = math.hypot(turn.rotation[0][2], turn.rotation[1][2])
    same = abs(one.frustum.wrap - two.frustum.wrap) < 1e-6
    same &= one.frustum.wrap > _TURN - 1e-6 or turn.rotation[0][0] > 1.0 - 1e-9
    return same and tilt < 1e-6 and math.hypot(x, y) < 1e-6 and z > 0.5 * one.frustum.height


def find_joint(one: PlacedFrustum, two: PlacedFrustum, stack: LayerStack, gap: float) -> SheetJoint:
    """Return the joint of two neighbours, trimmed so that no layer of one runs into the other.

    A face at the height t above the link is shifted along the axis by -t sin(half angle): at a belt the outer faces
    separate, at a waist they approach.
    """
    start = two.link_frustum.translation
    apart = one.link_frustum.inverse().apply(start)[2] - one.frustum.height
    opening = stack.thickness * (one.frustum.sin_half_angle - two.frustum.sin_half_angle)
    trimmed = max(0.0, gap - apart - min(0.0, opening))
    return SheetJoint(apart + trimmed, apart + trimmed + opening, trimmed)
