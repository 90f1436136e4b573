"""Rotations as the page's scene takes them."""

from __future__ import annotations

import math

from coneskin.geometry.pose import Pose, Vector

__all__ = ["along", "quaternion"]


def along(normal: Vector) -> Pose:
    """Return a pose whose z axis is along a direction."""
    x, y, z = normal
    length = math.sqrt(x * x + y * y + z * z) or 1.0
    x, y, z = x / length, y / length, z / length
    ax, ay, az = (1.0, 0.0, 0.0) if abs(x) < 0.7 else (0.0, 1.0, 0.0)
    ux, uy, uz = ay * z - az * y, az * x - ax * z, ax * y - ay * x
    length = math.sqrt(ux * ux + uy * uy + uz * uz)
    ux, uy, uz = ux / length, uy / length, uz / length
    vx, vy, vz = y * uz - z * uy, z * ux - x * uz, x * uy - y * ux
    return Pose.trusted(((ux, vx, x), (uy, vy, y), (uz, vz, z)), (0.0, 0.0, 0.0))


def quaternion(pose: Pose) -> tuple[float, float, float, float]:
    """Return the rotation of a pose as w, x, y, z (Shepperd's method)."""
    (a, b, c), (d, e, f), (g, h, i) = pose.rotation
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
    size = math.sqrt(w * w + x * x + y * y + z * z)
    return w / size, x / size, y / size, z / size
