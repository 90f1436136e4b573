"""Figures that a workshop needs to build one sheet: cable, readings, place on the link."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from coneskin.design.sheets.sheet_design import SheetDesign
from coneskin.geometry.drawing.surface_shape import ShapeTab, SurfaceShape, drawing_point
from coneskin.geometry.frustum import Frustum

from .datum_faces import DatumFace
from .expected_readings import PairReading, expected_frame, pair_readings
from .jig import Collar, jig_collars
from .placement import SheetPlacement, find_placement
from .wiring import CableExit, cable_exit

if TYPE_CHECKING:
    from coneskin.geometry.mesh import Mesh

__all__ = ["BuildFigures", "measure_build"]


@dataclass(frozen=True, slots=True)
class BuildFigures:
    """Figures for building one sheet.

    Attributes:
        cable: its wires and where they leave.
        pairs: what a multimeter should read between A and B, and between C and D.
        frame: counts of the untouched sensor, by field of a frame.
        placement: where it belongs on the link.
        collars: of its jig.
        no_collar: a sentence for each end that has none.
    """

    cable: CableExit
    pairs: tuple[PairReading, PairReading]
    frame: dict[str, int]
    placement: SheetPlacement
    collars: tuple[Collar, ...] = ()
    no_collar: tuple[str, ...] = ()

    def as_data(self, design: SheetDesign) -> dict[str, Any]:
        """Return the figures and the coordinates of holes and electrodes as plain data, in mm and degrees."""
        cable, placement, feature = self.cable, self.placement, self.placement.feature
        layout, surfaces = design.layout, {"CD": design.cuts[1].surface, "AB": design.cuts[5].surface}
        return {
            "holes": [_point(u, phi) for u, phi in layout.holes],
            "hole_diameter_mm": _mm(layout.plan.hole),
            "electrodes": {
                name: _outline(foil, surfaces["AB" if name in "AB" else "CD"]) for name, foil in layout.foils.items()
            },
            "cable": {
                "side": cable.side,
                **_point(cable.u, cable.phi),
                "tie_mm": _mm(cable.tie),
                "connector_mm": _mm(cable.connector),
                "wires": [
                    {"electrode": w.electrode, "pin": w.pin, **_point(w.u, w.phi), "length_mm": _mm(w.length)}
                    for w in cable.wires
                ],
            },
            "multimeter_ohm": {pair.pair: round(pair.ohms, 2) for pair in self.pairs},
            "squares": {pair.pair: round(pair.squares, 5) for pair in self.pairs},
            "untouched_frame": self.frame,
            "placement": {
                "around_end1_mm": _mm(placement.around1),
                "around_end2_mm": _mm(placement.around2),
                "before_end1_mm": None if placement.before is None else _mm(placement.before),
                "beyond_end2_mm": None if placement.beyond is None else _mm(placement.beyond),
                "seam_direction": [round(value, 5) + 0.0 for value in placement.seam],
                "feature": None
                if feature is None
                else {
                    "radius_mm": _mm(feature.radius),
                    "azimuth_deg": round(math.degrees(feature.azimuth), 3),
                    "from_end1_mm": _mm(feature.height),
                    "arc_mm": _mm(feature.arc),
                    "at_end": feature.end,
                },
                "faces": [
                    {
                        "name": face.name,
                        "normal": [round(value, 6) + 0.0 for value in face.normal],
                        "offset_mm": _mm(face.offset),
                        "size_mm": [_mm(length) for length in face.size],
                    }
                    for face in placement.faces
                ],
                "heights": [
                    {**_point(place.u, place.phi), "from_faces_mm": [_mm(height) for height in place.heights]}
                    for place in placement.heights
                ],
            },
            "jig": [
                {
                    "end": collar.end,
                    "lip_mm": _mm(collar.lip),
                    "flush": collar.flush,
                    "stopped": collar.stopped,
                    "play_deg": None if collar.play is None else round(math.degrees(collar.play), 1),
                    "parts": [
                        {
                            "file": f"jig/{collar.slug(part)}.stl",
                            "from_deg": round(math.degrees(part.start), 3) + 0.0,
                            "to_deg": round(math.degrees(part.end), 3) + 0.0,
                            "size_mm": [_mm(length) for length in part.surface.size],
                            "volume_cm3": round(1e6 * part.surface.volume, 2),
                        }
                        for part in collar.parts
                    ],
                }
                for collar in self.collars
            ],
        }


def measure_build(
    design: SheetDesign,
    index: int,
    frame: str = "mesh",
    mesh: Mesh | None = None,
    others: Sequence[SheetDesign] = (),
    faces: Sequence[DatumFace] = (),
) -> BuildFigures:
    """Work out the figures for building one sheet.

    Args:
        design: the sheet.
        index: its sensor number in the wire format.
        frame: frame of the poses, in words.
        mesh: of the link; None where it is known by its dimensions only.
        others: sheets that are on the link already when this one is put on.
        faces: flat faces of the link, from which its place is measured.

    Raises:
        GeometryError: a scene would refuse its sensor, or the connector is out of range.
    """
    return BuildFigures(
        cable_exit(design.layout, design.options.connector),
        pair_readings(design),
        expected_frame(design, index, frame),
        find_placement(design.place, mesh, () if design.above else faces),
        *jig_collars(design, mesh, others),
    )


def _outline(foil: SurfaceShape, surface: Frustum) -> list[dict[str, float | str]]:
    """Return the corners of a foil on the sheet, and on the flat pattern seen from outside."""
    corners: list[dict[str, float | str]] = []
    for step in foil:
        x, y = drawing_point(surface, step.u, step.phi)
        corner: dict[str, float | str] = {**_point(step.u, step.phi), "x_mm": _mm(x), "y_mm": _mm(y)}
        if isinstance(step, ShapeTab):
            corner |= {"tab_width_mm": _mm(step.width), "tab_length_mm": _mm(step.length), "side": step.side}
        corners.append(corner)
    return corners


def _point(u: float, phi: float) -> dict[str, float]:
    return {"u_mm": _mm(u), "phi_deg": round(math.degrees(phi), 4) + 0.0}


def _mm(metres: float) -> float:
    return round(1e3 * metres, 3) + 0.0
