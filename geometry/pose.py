"""Rigid motion from one frame to another, named so that neighbours cancel: p_base = base_link.apply(p_link)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from coneskin.core.errors import GeometryError

if TYPE_CHECKING:
    from coneskin.core.arrays import Floats

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Pose:
    """Rotation and translation from an inner frame to an outer one; plain floats, for the live loop.

    Attributes:
        rotation: three rows of three; its columns are the axes of the inner frame seen from the outer one.
        translation: origin of the inner frame in the outer one [m].

    Raises:
        GeometryError: a value is not finite, or the rotation is not orthonormal and right-handed (to 1e-6).
    """

    rotation: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    translation: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if [len(row) for row in self.rotation] != [3, 3, 3] or len(self.translation) != 3:
            raise GeometryError("a pose needs a rotation of 3 x 3 and a translation of 3 numbers")
        a, b, c = ((float(x), float(y), float(z)) for x, y, z in self.rotation)
        shift = (float(self.translation[0]), float(self.translation[1]), float(self.translation[2]))
        rows = (a, b, c)
        if not all(math.isfinite(x) for row in (*rows, shift) for x in row):
            raise GeometryError(f"rotation and translation must be finite, got {rows} and {shift} m")
        right_handed = abs(_dot(a, _cross(b, c)) - 1.0) < 1e-6
        if not right_handed or any(abs(_dot(m, n) - float(m is n)) > 1e-6 for m in rows for n in rows):
            raise GeometryError(f"rotation must be orthonormal and right-handed, got {rows}")
        object.__setattr__(self, "rotation", rows)
        object.__setattr__(self, "translation", shift)

    @classmethod
    def trusted(cls, rotation: tuple[Vector, Vector, Vector], translation: Vector) -> Pose:
        """Make a pose of floats that were computed as one; nothing is checked, which is most of the cost of a pose."""
        pose = object.__new__(cls)
        object.__setattr__(pose, "rotation", rotation)
        object.__setattr__(pose, "translation", translation)
        return pose

    @classmethod
    def from_xyz_rpy(cls, xyz: Sequence[float] = (0.0, 0.0, 0.0), rpy: Sequence[float] = (0.0, 0.0, 0.0)) -> Pose:
        """Make a pose from xyz [m] and roll, pitch and yaw about the fixed x, y and z axes [rad], as in URDF.

        Raises:
            GeometryError: not three numbers each.
        """
        if len(xyz) != 3 or len(rpy) != 3:
            raise GeometryError(f"xyz and rpy need 3 numbers each, got {len(xyz)} and {len(rpy)}")
        (sr, sp, sy), (cr, cp, cy) = ([f(angle) for angle in rpy] for f in (math.sin, math.cos))
        return cls(
            (
                (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
                (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
                (-sp, cp * sr, cp * cr),
            ),
            (xyz[0], xyz[1], xyz[2]),
        )

    @classmethod
    def from_rotation_vector(cls, vector: Sequence[float], xyz: Sequence[float] = (0.0, 0.0, 0.0)) -> Pose:
        """Make a pose from a rotation vector, which is the axis times the angle [rad], and xyz [m] (Rodrigues)."""
        x, y, z = vector
        angle = math.sqrt(x * x + y * y + z * z)
        if angle < 1e-12:
            return cls(((1.0, -z, y), (z, 1.0, -x), (-y, x, 1.0)), (xyz[0], xyz[1], xyz[2]))
        x, y, z = x / angle, y / angle, z / angle
        c, s = math.cos(angle), math.sin(angle)
        k = 1.0 - c
        return cls(
            (
                (c + x * x * k, x * y * k - z * s, x * z * k + y * s),
                (y * x * k + z * s, c + y * y * k, y * z * k - x * s),
                (z * x * k - y * s, z * y * k + x * s, c + z * z * k),
            ),
            (xyz[0], xyz[1], xyz[2]),
        )

    @classmethod
    def along(cls, direction: Vector, xyz: Vector = (0.0, 0.0, 0.0)) -> Pose:
        """Make a pose whose z axis is along a direction of any length, and its origin at xyz [m]."""
        length = math.hypot(*direction) or 1.0
        z = (direction[0] / length, direction[1] / length, direction[2] / length)
        a, b, c = _cross((1.0, 0.0, 0.0) if abs(z[0]) < 0.7 else (0.0, 1.0, 0.0), z)
        length = math.hypot(a, b, c)
        x = (a / length, b / length, c / length)
        y = _cross(z, x)
        return cls.trusted(((x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2])), xyz)

    @property
    def quaternion(self) -> tuple[float, float, float, float]:
        """Rotation as w, x, y, z (Shepperd's method)."""
        (a, b, c), (d, e, f), (g, h, i) = self.rotation
        trace = a + e + i
        parts = (trace, a, e, i)
        largest = parts.index(max(parts))
        if largest == 0:
            w, x, y, z = 1.0 + trace, h - f, c - g, d - b
        elif largest == 1:
            w, x, y, z = h - f, 1.0 + a - e - i, b + d, c + g
        elif largest == 2:
            w, x, y, z = c - g, b + d, 1.0 - a + e - i, f + h
        else:
            w, x, y, z = d - b, c + g, f + h, 1.0 - a - e + i
        size = math.hypot(w, x, y, z)
        return w / size, x / size, y / size, z / size

    @property
    def rotation_vector(self) -> Vector:
        """Rotation vector [rad], its angle in [0, pi]; exact near 0 and near pi."""
        (a, b, c), (d, e, f), (g, h, i) = self.rotation
        x, y, z = h - f, c - g, d - b  # 2 sin(angle) axis
        twice_sine, cosine = math.sqrt(x * x + y * y + z * z), (a + e + i - 1.0) / 2.0
        angle = math.atan2(twice_sine / 2.0, cosine)
        if cosine > -0.9:
            factor = 0.5 * (1.0 + angle * angle / 6.0) if angle < 1e-4 else angle / twice_sine
            return x * factor, y * factor, z * factor
        # near pi the sine hardly determines the axis: take it from the symmetric part, its sign from the sine
        xy, xz, yz = 0.5 * (b + d), 0.5 * (c + g), 0.5 * (f + h)
        rows: tuple[Vector, ...] = (a - cosine, xy, xz), (xy, e - cosine, yz), (xz, yz, i - cosine)
        axis = rows[max(range(3), key=lambda k: rows[k][k])]
        factor = math.copysign(angle, _dot(axis, (x, y, z)) or 1.0) / math.hypot(*axis)
        return axis[0] * factor, axis[1] * factor, axis[2] * factor

    @property
    def rpy(self) -> Vector:
        """Roll, pitch and yaw [rad], the inverse of ``from_xyz_rpy``; pitch in [-pi/2, pi/2]."""
        (a00, _, _), (a10, _, _), (a20, a21, a22) = self.rotation
        level = math.hypot(a00, a10)
        if level < 1e-12:  # gimbal lock: only the difference of roll and yaw shows; all of it goes to roll
            return math.atan2(-self.rotation[1][2], self.rotation[1][1]), math.atan2(-a20, level), 0.0
        return math.atan2(a21, a22), math.atan2(-a20, level), math.atan2(a10, a00)

    def rotate(self, v: Vector) -> Vector:
        """Return a direction of the inner frame, seen from the outer one."""
        x, y, z = v
        a, b, c = self.rotation
        return (
            a[0] * x + a[1] * y + a[2] * z,
            b[0] * x + b[1] * y + b[2] * z,
            c[0] * x + c[1] * y + c[2] * z,
        )

    def apply(self, p: Vector) -> Vector:
        """Return a point of the inner frame [m], seen from the outer one."""
        x, y, z = self.rotate(p)
        t = self.translation
        return x + t[0], y + t[1], z + t[2]

    def apply_all(self, points: Floats) -> Floats:
        """Return points of the inner frame [m], shape (..., 3), seen from the outer one."""
        import numpy as np

        moved: Floats = points @ np.array(self.rotation).T + np.array(self.translation)
        return moved

    def inverse(self) -> Pose:
        """Return the pose of the outer frame, seen from the inner one."""
        a, b, c = self.rotation
        back = ((a[0], b[0], c[0]), (a[1], b[1], c[1]), (a[2], b[2], c[2]))
        x, y, z = Pose.trusted(back, (0.0, 0.0, 0.0)).rotate(self.translation)
        return Pose.trusted(back, (-x, -y, -z))

    def __matmul__(self, inner: Pose) -> Pose:
        """Chain two poses: (a_b @ b_c) maps frame c to frame a."""
        columns = [self.rotate(column) for column in zip(*inner.rotation, strict=True)]
        rows = tuple(zip(*columns, strict=True))
        return Pose((rows[0], rows[1], rows[2]), self.apply(inner.translation))


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
