"""Surface of a sheet as it lies on its link: the active area with its rims and its two electrodes along the wrap."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from coneskin.core.arrays import Floats, Ints
    from coneskin.scene.build import SensorOnArm
    from coneskin.skin.sensor import Sensor

_SHEET_HEIGHT = (
    0.0015  # m above the surface that is sensed: the sheets are that thick, and their link is not to shine through
)
_MAX_SAGITTA = 0.0005  # m by which a flat piece may lie below the round side, so that the link does not shine through
_VERTEX_DISTANCE = 0.008  # m between two vertices along a side that is not straight, about
_MAX_VERTICES = 96  # vertices along or around
_RIM_WIDTH, _RIM_ABOVE = 0.005, 0.0006  # m; of the band that shows where the active area ends, above the sheet


class SheetSurface(NamedTuple):
    """Active area of a sensor.

    Attributes:
        name: of the sensor.
        link: index of the DH frame that it moves with.
        vertices: in that frame [m], shape (n, 3).
        faces: indices of vertices, shape (m, 3).
        rim_vertices: of a narrow band inside of the active area's edges, in that frame [m], shape (k, 3).
        rim_faces: indices of those vertices, shape (l, 3).
        touch_level: from which the sensor is touched.
        slimmest: the least radius of its link there [m].
        sensor: with its electronics, and what force its level stands for.
        item: its place on the arm.
    """

    name: str
    link: int
    vertices: Floats
    faces: Ints
    rim_vertices: Floats
    rim_faces: Ints
    touch_level: float
    slimmest: float
    sensor: Sensor
    item: SensorOnArm

    @classmethod
    def of(cls, item: SensorOnArm, sensor: Sensor) -> SheetSurface:
        """Return the active area of a sensor at its place on the arm, in the DH frame of its link."""
        import numpy as np

        cone = item.frustum.frustum
        largest = max(cone.radius1, cone.radius2)
        straight = item.surface is None  # a mesh lies below another sheet, and is not quite a cone
        u = np.linspace(0.0, cone.slant, 2 if straight else _count(cone.slant / _VERTEX_DISTANCE, 8))
        step = 2.0 * math.acos(1.0 - min(_MAX_SAGITTA / largest, 1.0)) if straight else _VERTEX_DISTANCE / largest
        phi = np.linspace(0.0, cone.wrap, _count(cone.wrap / step, 24))
        vertices, faces = _strip(item, u, phi, _SHEET_HEIGHT)
        width, turn = min(_RIM_WIDTH, cone.slant), min(_RIM_WIDTH / largest, cone.wrap)
        bands = [(u[[0]] + (0.0, width), phi), (u[[-1]] - (width, 0.0), phi)]
        bands += [(u, phi[[0]] + (0.0, turn)), (u, phi[[-1]] - (turn, 0.0))]
        rim_vertices, rim_faces, before = [], [], 0
        for along, around in bands:
            points, triangles = _strip(item, along, around, _SHEET_HEIGHT + _RIM_ABOVE)
            rim_vertices.append(points)
            rim_faces.append(before + triangles)
            before += len(points)
        return cls(
            item.name,
            item.link,
            vertices,
            faces,
            np.concatenate(rim_vertices),
            np.concatenate(rim_faces),
            sensor.thresholds.touch_level,
            0.97 * min(cone.radius1, cone.radius2),
            sensor,
            item,
        )


def _strip(item: SensorOnArm, u: Floats, phi: Floats, above: float) -> tuple[Floats, Ints]:
    """Return vertices and faces of the part of a side between places, so far above what is sensed [m]."""
    import numpy as np

    rows, columns = np.meshgrid(u, phi, indexing="ij")
    points, normals = item.frustum.place(rows, columns)
    if item.surface is not None:
        flat = zip(rows.ravel().tolist(), columns.ravel().tolist(), strict=True)
        points = np.array([item.surface.point(a, b) for a, b in flat]).reshape(points.shape)
    index = np.arange(rows.size).reshape(rows.shape)
    a, b, c, d = index[:-1, :-1].ravel(), index[1:, :-1].ravel(), index[1:, 1:].ravel(), index[:-1, 1:].ravel()
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return (points + above * normals).reshape(-1, 3), faces


def _count(pieces: float, least: int) -> int:
    return min(max(math.ceil(pieces) + 1, least), _MAX_VERTICES)
