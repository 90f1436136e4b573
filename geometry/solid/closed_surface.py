"""Closed surface of triangles between an inner and an outer grid of points, and its STL file."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from coneskin.core.arrays import frozen
from coneskin.core.errors import GeometryError

__all__ = ["ClosedSurface", "shell_surface", "to_stl"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_WELD = 1e-7  # m; corners nearer to each other are one
_STL_FACE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


@dataclass(frozen=True, slots=True, eq=False)
class ClosedSurface:
    """Triangles that enclose a solid; every edge belongs to two of them.

    Attributes:
        vertices: corners [m], shape (n, 3).
        faces: indices of three corners, anticlockwise as seen from outside, shape (m, 3).
    """

    vertices: Floats
    faces: Indices

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", frozen(self.vertices, (None, 3), "vertices"))
        faces = np.array(self.faces, dtype=np.int64)
        faces.setflags(write=False)
        object.__setattr__(self, "faces", faces)

    @property
    def volume(self) -> float:
        """Volume of the solid [m3]."""
        a, b, c = self.vertices[self.faces].transpose(1, 0, 2)
        return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0

    @property
    def size(self) -> tuple[float, float, float]:
        """Extents along the axes [m]."""
        x, y, z = np.ptp(self.vertices, axis=0).tolist()
        return x, y, z


def shell_surface(inner: ArrayLike, outer: ArrayLike) -> ClosedSurface:
    """Return the surface of the shell between two grids of points.

    Args:
        inner: points of one face [m], shape (rows, columns, 3).
        outer: points of the other face, the same shape.

    Raises:
        GeometryError: the grids differ, are too small, or enclose nothing.
    """
    inner, outer = np.asarray(inner, float), np.asarray(outer, float)
    if inner.shape != outer.shape or inner.ndim != 3 or min(inner.shape[:2]) < 2:
        raise GeometryError(f"two grids of at least 2 x 2 points are needed, got {inner.shape} and {outer.shape}")
    rows, columns, _ = inner.shape
    # of each column a loop: up the inner face and down the outer one; the columns make a tube with two caps
    loops = np.concatenate([inner, outer[::-1]]).transpose(1, 0, 2)
    index = np.arange(columns * 2 * rows).reshape(columns, 2 * rows)
    here, there = index[:-1], index[1:]
    here_next, there_next = np.roll(here, -1, axis=1), np.roll(there, -1, axis=1)
    faces = [np.stack([here, there, there_next], -1), np.stack([here, there_next, here_next], -1)]
    steps = np.arange(rows - 1)
    for loop, order in ((index[0], 1), (index[-1], -1)):
        low, high = loop[steps], loop[steps + 1]
        low_out, high_out = loop[2 * rows - 1 - steps], loop[2 * rows - 2 - steps]
        faces += [np.stack([low, high, high_out], -1)[:, ::order], np.stack([low, high_out, low_out], -1)[:, ::order]]
    corners = loops.reshape(-1, 3)
    _, first, inverse = np.unique(np.round(corners / _WELD), axis=0, return_index=True, return_inverse=True)
    joined = inverse.reshape(-1)[np.concatenate([face.reshape(-1, 3) for face in faces])]
    a, b, c = joined.T
    joined = joined[(a != b) & (b != c) & (c != a)]
    surface = ClosedSurface(corners[first], joined)
    if surface.volume < 0.0:
        surface = ClosedSurface(surface.vertices, joined[:, ::-1])
    if not surface.volume > 0.0:
        raise GeometryError("the two faces of the shell enclose nothing")
    return surface


def to_stl(surface: ClosedSurface, title: str = "") -> bytes:
    """Return a surface as a binary STL file in millimetres, the unit that printing programs take."""
    corners = (1e3 * surface.vertices).astype("<f4")[surface.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    table = np.zeros(len(corners), _STL_FACE)
    table["normal"] = normals / np.where(length > 0.0, length, 1.0)
    table["corners"] = corners
    # a header that begins with "solid" would be taken for text
    header = f"binary STL, mm: {title}".encode("ascii", "replace")[:80].ljust(80)
    return header + len(table).to_bytes(4, "little") + table.tobytes()
