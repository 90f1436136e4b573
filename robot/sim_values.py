"""The values of URScript: lists that add up, poses p[x, y, z, rx, ry, rz], and what can be computed with them.

A pose's rotation is a rotation vector: the axis times the angle [rad] (Universal Robots calls it axis-angle).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from coneskin.geometry.pose import Pose, Vector

__all__ = [
    "Array",
    "PoseValue",
    "ScriptError",
    "copy",
    "interpolate",
    "numbers",
    "pose_of",
    "rotation_of",
    "rotvec_between",
    "rotvec_of",
    "values_of",
]

_Rotation = tuple[Vector, Vector, Vector]


class ScriptError(Exception):
    """A program that cannot be understood, or that must end: the controller logs it and stops the program."""


class Array(list[Any]):
    """A URScript list: + and - element by element, * with a number."""

    def __add__(self, other: Any) -> Any:
        return type(self)(x + y for x, y in zip(self, _same(self, other), strict=True))

    def __sub__(self, other: Any) -> Any:
        return type(self)(x - y for x, y in zip(self, _same(self, other), strict=True))

    def __mul__(self, factor: Any) -> Any:
        return type(self)(x * factor for x in self)

    __rmul__ = __mul__

    def __truediv__(self, factor: Any) -> Any:
        return type(self)(x / factor for x in self)

    def __neg__(self) -> Any:
        return type(self)(-x for x in self)


class PoseValue(Array):
    """A URScript pose: position [m] and rotation vector [rad], six numbers."""


def _same(values: Sequence[Any], other: Any) -> Sequence[Any]:
    if not isinstance(other, list) or len(other) != len(values):
        raise ScriptError(f"a list of {len(values)} needs another of the same length, got {other!r}")
    return other


def copy(value: Any) -> Any:
    """URScript assigns lists by value."""
    return type(value)(value) if isinstance(value, list) else value


def numbers(values: Any, count: int, name: str) -> list[float]:
    """A list of finite numbers of a program.

    Raises:
        ScriptError: there are more or fewer, or one is not a finite number.
    """
    if not isinstance(values, list) or len(values) != count or not all(isinstance(v, int | float) for v in values):
        raise ScriptError(f"{name} must be {count} numbers, got {values!r}")
    if not all(math.isfinite(value) for value in values):
        raise ScriptError(f"{name} must be finite, got {values!r}")
    return [float(value) for value in values]


def rotation_of(rotvec: Sequence[float]) -> _Rotation:
    """The rotation matrix of a rotation vector [rad] (Rodrigues)."""
    x, y, z = rotvec
    angle = math.sqrt(x * x + y * y + z * z)
    if angle < 1e-12:
        return (1.0, -z, y), (z, 1.0, -x), (-y, x, 1.0)
    x, y, z = x / angle, y / angle, z / angle
    c, s = math.cos(angle), math.sin(angle)
    k = 1.0 - c
    return (
        (c + x * x * k, x * y * k - z * s, x * z * k + y * s),
        (y * x * k + z * s, c + y * y * k, y * z * k - x * s),
        (z * x * k - y * s, z * y * k + x * s, c + z * z * k),
    )


def rotvec_of(rotation: _Rotation) -> Vector:
    """The rotation vector [rad] of a rotation matrix, its angle in [0, pi]; exact near 0 and near pi."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    x, y, z = h - f, c - g, d - b  # 2 sin(angle) axis
    twice_sine, cosine = math.sqrt(x * x + y * y + z * z), (a + e + i - 1.0) / 2.0
    angle = math.atan2(twice_sine / 2.0, cosine)
    if cosine > -0.9:
        factor = 0.5 * (1.0 + angle * angle / 6.0) if angle < 1e-4 else angle / twice_sine
        return x * factor, y * factor, z * factor
    # near pi the sine says little of the axis: take it from the symmetric part, its sign from the sine
    k = 1.0 - cosine
    diagonal = (a - cosine) / k, (e - cosine) / k, (i - cosine) / k
    lead = max(range(3), key=diagonal.__getitem__)
    first = math.sqrt(max(0.0, diagonal[lead]))
    symmetric = ((b + d) / (2 * k), (c + g) / (2 * k), (f + h) / (2 * k))  # xy, xz, yz
    if lead == 0:
        axis = (first, symmetric[0] / first, symmetric[1] / first)
    elif lead == 1:
        axis = (symmetric[0] / first, first, symmetric[2] / first)
    else:
        axis = (symmetric[1] / first, symmetric[2] / first, first)
    sign = -1.0 if axis[0] * x + axis[1] * y + axis[2] * z < 0.0 else 1.0
    factor = sign * angle / math.sqrt(axis[0] ** 2 + axis[1] ** 2 + axis[2] ** 2)
    return axis[0] * factor, axis[1] * factor, axis[2] * factor


def pose_of(values: Iterable[float]) -> Pose:
    """The rigid motion of x, y, z [m], rx, ry, rz [rad]."""
    x, y, z, rx, ry, rz = (float(value) for value in values)
    return Pose(rotation_of((rx, ry, rz)), (x, y, z))


def values_of(pose: Pose) -> PoseValue:
    """x, y, z [m], rx, ry, rz [rad] of a rigid motion."""
    return PoseValue((*pose.translation, *rotvec_of(pose.rotation)))


def rotvec_between(first: Pose, second: Pose) -> Vector:
    """The turn from one orientation to another [rad], in the axes of the first."""
    return rotvec_of((first.inverse() @ second).rotation)


def interpolate(start: Pose, shift: Vector, turn: Vector, share: float) -> Pose:
    """A part of the straight way: start moved by share * shift [m] and turned by share * turn [rad]."""
    spin = Pose(rotation_of((turn[0] * share, turn[1] * share, turn[2] * share)))
    p = start.translation
    here = (p[0] + share * shift[0], p[1] + share * shift[1], p[2] + share * shift[2])
    return Pose((Pose(start.rotation) @ spin).rotation, here)
