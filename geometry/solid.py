"""Solids: the closed surface of a printed part with its STL file, and the STEP file of a wrapped sheet.

The only importer of OCP (cadquery-ocp), Open CASCADE's kernel.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from coneskin.core.arrays import Floats
from coneskin.core.errors import GeometryError, needed_package
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.pose import Pose

if TYPE_CHECKING:
    from trimesh import Trimesh


def widest_nearby(values: Floats, rows: int, columns: int) -> Floats:
    """Return the greatest value among neighbours up to a number of rows and columns away."""
    from scipy.ndimage import maximum_filter

    return np.asarray(maximum_filter(values, (2 * rows + 1, 2 * columns + 1), mode="nearest"))


def without_undercut(radius: Floats, phi: Floats) -> Floats:
    """Return radii that only grow seen from the middle of a part outwards, so that it can be pulled off that way."""
    away = phi - 0.5 * (phi[0] + phi[-1])
    half = np.sin(np.minimum(np.abs(away), 0.5 * math.pi))
    opened = radius.copy()
    for columns in (np.flatnonzero(away >= 0.0), np.flatnonzero(away <= 0.0)[::-1]):
        width = np.maximum.accumulate(radius[:, columns] * half[columns], axis=1)
        opened[:, columns] = np.maximum(radius[:, columns], width / np.maximum(half[columns], 1e-9))
    return opened


_WELD_DIGITS = 7  # of a metre; corners that agree so far are one


def shell_surface(inner: ArrayLike, outer: ArrayLike) -> Trimesh:
    """Return the closed surface of the shell between two grids of points, its faces turned outwards.

    Args:
        inner: points of one face [m], shape (rows, columns, 3).
        outer: points of the other face, the same shape.

    Raises:
        GeometryError: the grids differ, are too small, or enclose nothing.
    """
    from trimesh import Trimesh

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
    shell = Trimesh(loops.reshape(-1, 3), np.concatenate([face.reshape(-1, 3) for face in faces]), process=False)
    shell.merge_vertices(digits_vertex=_WELD_DIGITS)
    a, b, c = shell.faces.T
    shell.update_faces((a != b) & (b != c) & (c != a))
    with np.errstate(divide="ignore", invalid="ignore"):  # the centre of nothing
        volume = shell.volume if len(shell.faces) else 0.0
    if volume < 0.0:
        shell.invert()
    if not abs(volume) > 0.0:
        raise GeometryError("the two faces of the shell enclose nothing")
    return shell


def to_stl(surface: Trimesh, title: str = "") -> bytes:
    """Return a surface as a binary STL file in millimetres, the unit that printing programs take."""
    data = bytes(surface.copy().apply_scale(_MM_PER_M).export(file_type="stl"))
    # a header that begins with "solid" would be taken for text
    return f"binary STL, mm: {title}".encode("ascii", "replace")[:80].ljust(80) + data[80:]


_MM_PER_M = 1e3


class WrappedLayer(NamedTuple):
    """One layer as it lies on the link: the space between two parallel cones."""

    name: str  #: of its body in the file
    inner: Frustum  #: its inner face, as it would be placed by ``pose``
    thickness: float  #: outwards along the normal [m]
    pose: Pose  #: of the frame of the inner face in the frame of the file


def require_step_writer() -> None:
    """Refuse a STEP file before the work for it begins, if none can be written.

    Raises:
        MissingExtra: cadquery-ocp is not installed.
    """
    with needed_package("cadquery-ocp-novtk", "writing a STEP file", "cad"):
        import OCP  # noqa: F401


def write_step(path: Path, layers: Sequence[WrappedLayer]) -> None:
    """Write the layers, at least one, as named solids into a STEP file (AP214), in millimetres.

    Their faces are exact cones, cylinders and planes, so a CAD program measures radii and distances on them.

    Raises:
        GeometryError: the kernel refuses a shape, or the file cannot be written.
        MissingExtra: cadquery-ocp is not installed.
    """
    require_step_writer()
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeRevol
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Trsf
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.Message import Message
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopLoc import TopLoc_Location
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    Message.DefaultMessenger_s().ChangePrinters().Clear()  # it would write to standard output
    document = TDocStd_Document(TCollection_ExtendedString("coneskin"))
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    for layer in layers:
        polygon = BRepBuilderAPI_MakePolygon()
        for radius, z in _section(layer.inner, layer.thickness):
            polygon.Add(gp_Pnt(_MM_PER_M * radius, 0.0, _MM_PER_M * z))
        polygon.Close()
        axis = gp_Ax1(gp_Pnt(0.0, 0.0, 0.0), gp_Dir(0.0, 0.0, 1.0))
        face = BRepBuilderAPI_MakeFace(polygon.Wire()).Face()
        turned = BRepPrimAPI_MakeRevol(face, axis, layer.inner.wrap)
        if not turned.IsDone():
            raise GeometryError(f"{layer.name}: the CAD kernel makes no solid of it")
        move = gp_Trsf()
        rows = zip(layer.pose.rotation, layer.pose.translation, strict=True)
        move.SetValues(*(value for row, shift in rows for value in (*row, _MM_PER_M * shift)))
        label = shapes.AddShape(turned.Shape().Moved(TopLoc_Location(move)), False)
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(layer.name))
    writer = STEPCAFControl_Writer()
    writer.Transfer(document)
    if writer.Write(str(path)) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise GeometryError(f"{path}: the CAD kernel cannot write it")


def _section(inner: Frustum, thickness: float) -> list[tuple[float, float]]:
    """Return radius and z of the four corners of a section along the axis [m]."""
    across, along = thickness * inner.cos_half_angle, -thickness * inner.sin_half_angle
    low, high = (inner.radius1, 0.0), (inner.radius2, inner.height)
    return [low, high, *((radius + across, z + along) for radius, z in (high, low))]
