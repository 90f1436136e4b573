"""Surface of a sheet as it lies on its link: the active area with its rims and its two electrodes along the wrap."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from coneskin.scene.build import SensorOnArm
    from coneskin.skin.sensor import Sensor

__all__ = ["SheetSurface", "sheet_surfaces"]

_ABOVE = 0.0015  # m above the surface that is sensed: the sheets are that thick, and their link is not to shine through
_STEP = 0.008  # m between two vertices, about
_MOST = 96  # vertices along or around


class SheetSurface(NamedTuple):
    """Active area of a sensor.

    Attributes:
        name: of the sensor.
        link: index of the DH frame that it moves with.
        vertices: in that frame [m], shape (n, 3).
        faces: indices of vertices, shape (m, 3).
        rim: line segments around the active area [m], shape (k, 2, 3).
        touch_level: from which the sensor is touched.
        slimmest: the least radius of its link there [m].
        sensor: with its electronics, and what force its level stands for.
        item: its place on the arm.
    """

    name: str
    link: int
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    rim: NDArray[np.float64]
    touch_level: float
    slimmest: float
    sensor: Sensor
    item: SensorOnArm


def sheet_surfaces(placed: Sequence[SensorOnArm], sensors: Sequence[Sensor]) -> tuple[SheetSurface, ...]:
    """Return the active areas of sensors, each in the DH frame of its link.

    Args:
        placed: the sensors on the arm.
        sensors: the same ones.
    """
    return tuple(_surface(item, sensor) for item, sensor in zip(placed, sensors, strict=True))


def _surface(item: SensorOnArm, sensor: Sensor) -> SheetSurface:
    import numpy as np

    cone = item.frustum.frustum
    along = _count(cone.slant)
    around = _count(cone.wrap * max(cone.radius1, cone.radius2), least=24)
    u, phi = np.meshgrid(np.linspace(0.0, cone.slant, along), np.linspace(0.0, cone.wrap, around), indexing="ij")
    points, normals = item.frustum.place(u, phi)
    if item.surface is not None:  # a mesh lies below the sheet, and is not quite a cone
        flat = zip(u.ravel().tolist(), phi.ravel().tolist(), strict=True)
        points = np.array([item.surface.point(a, b) for a, b in flat]).reshape(points.shape)
    points = points + _ABOVE * normals
    index = np.arange(along * around).reshape(along, around)
    a, b, c, d = index[:-1, :-1].ravel(), index[1:, :-1].ravel(), index[1:, 1:].ravel(), index[:-1, 1:].ravel()
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    edges = [points[0], points[-1], points[:, 0], points[:, -1]]
    rim = np.concatenate([np.stack([edge[:-1], edge[1:]], axis=1) for edge in edges])
    touch_level = sensor.thresholds.touch_level
    slimmest = 0.97 * min(cone.radius1, cone.radius2)
    return SheetSurface(item.name, item.link, points.reshape(-1, 3), faces, rim, touch_level, slimmest, sensor, item)


def _count(length: float, least: int = 8) -> int:
    return min(max(math.ceil(length / _STEP) + 1, least), _MOST)
