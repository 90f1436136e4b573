"""STEP file of the layers of a sheet, wrapped. The only importer of OCP (cadquery-ocp), Open CASCADE's kernel."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from coneskin.core.errors import GeometryError, MissingExtra
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.pose import Pose

__all__ = ["WrappedLayer", "require_step_writer", "write_step"]

_MM = 1e3


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
    try:
        import OCP  # noqa: F401
    except ImportError as exc:
        raise _missing() from exc


def write_step(path: Path, layers: Sequence[WrappedLayer]) -> None:
    """Write the layers as named solids into a STEP file (AP214), in millimetres.

    Their faces are exact cones, cylinders and planes, so a CAD program measures radii and distances on them.

    Args:
        path: the file.
        layers: at least one.

    Raises:
        GeometryError: the kernel refuses a shape, or the file cannot be written.
        MissingExtra: cadquery-ocp is not installed.
    """
    try:
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
    except ImportError as exc:
        raise _missing() from exc
    Message.DefaultMessenger_s().ChangePrinters().Clear()  # it would write to standard output
    document = TDocStd_Document(TCollection_ExtendedString("coneskin"))
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    for layer in layers:
        polygon = BRepBuilderAPI_MakePolygon()
        for radius, z in _section(layer.inner, layer.thickness):
            polygon.Add(gp_Pnt(_MM * radius, 0.0, _MM * z))
        polygon.Close()
        axis = gp_Ax1(gp_Pnt(0.0, 0.0, 0.0), gp_Dir(0.0, 0.0, 1.0))
        face = BRepBuilderAPI_MakeFace(polygon.Wire()).Face()
        turned = BRepPrimAPI_MakeRevol(face, axis, layer.inner.wrap)
        if not turned.IsDone():
            raise GeometryError(f"{layer.name}: the CAD kernel makes no solid of it")
        move = gp_Trsf()
        rows = zip(layer.pose.rotation, layer.pose.translation, strict=True)
        move.SetValues(*(value for row, shift in rows for value in (*row, _MM * shift)))
        label = shapes.AddShape(turned.Shape().Moved(TopLoc_Location(move)), False)
        TDataStd_Name.Set_s(label, TCollection_ExtendedString(layer.name))
    writer = STEPCAFControl_Writer()
    writer.Transfer(document)
    if writer.Write(str(path)) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise GeometryError(f"{path}: the CAD kernel cannot write it")


def _missing() -> MissingExtra:
    return MissingExtra("cadquery-ocp-novtk", "writing a STEP file", "cad")


def _section(inner: Frustum, thickness: float) -> list[tuple[float, float]]:
    """Return radius and z of the four corners of a section along the axis [m]."""
    across, along = thickness * inner.cos_half_angle, -thickness * inner.sin_half_angle
    low, high = (inner.radius1, 0.0), (inner.radius2, inner.height)
    return [low, high, *((radius + across, z + along) for radius, z in (high, low))]
