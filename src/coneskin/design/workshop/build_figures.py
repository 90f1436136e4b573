"""Figures that a workshop needs to build one sheet: its wires and cable, the readings to expect, its place on the link.

The cable runs from the four tabs to one connector beside the rim, with strain relief on the way. The readings are ohms
for a multimeter, and the frame of the untouched sensor. The bill lists everything that is bought or cut for all sheets.
"""

from __future__ import annotations

import math
import tomllib
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from coneskin.core.errors import GeometryError
from coneskin.design.sheets.cable_way import CableWay, tab_foot
from coneskin.design.sheets.sheet_design import SheetDesign
from coneskin.design.sheets.summary import sensor_toml
from coneskin.geometry.drawing.electrode_layout import SheetLayout, SurfaceRectangle
from coneskin.geometry.drawing.nesting import MaterialBed
from coneskin.geometry.drawing.surface_shape import ShapeCorner, ShapeTab, SurfaceShape, drawing_point
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.mesh import Mesh
from coneskin.scene.tables.sensor_tables import build_sensor
from coneskin.skin.diagnosis.measurements import MEASURED, expected_counts
from coneskin.skin.sensor import sheet_resistances

from .jig import Collar, jig_collars
from .placement import DatumFace, SheetPlacement, find_placement

#: wire that lies on the tab, stripped; in the connector's contact; and the loop behind the strain relief [m]
STRIPPED, IN_CONTACT, LOOP = 8e-3, 4e-3, 20e-3
_ROUND_TO = 5e-3  # m; wires are cut to multiples of it


@dataclass(frozen=True, slots=True)
class SheetWire:
    """One wire.

    Attributes:
        electrode: A, B, C or D.
        pin: of the connector, from 1.
        u: of the middle of the tab's foot, or where there is no tab, of the foil at the rim [m].
        phi: the same [rad].
        length: to be cut [m].
    """

    electrode: str
    pin: int
    u: float
    phi: float
    length: float


def _sheet_wires(layout: SheetLayout, way: CableWay) -> tuple[SheetWire, ...]:
    """Return the wires of a sheet, from its tabs along the rim and the way of the cable to the connector."""
    radius = layout.sheet.radius_at(way.u)
    wires = []
    for pin, name in enumerate("ABCD", 1):
        u, phi = tab_foot(layout, name)
        around = abs(math.remainder(phi - way.phi, 2.0 * math.pi)) * radius
        along = around if way.side.startswith("end") else abs(u - way.u)
        length = STRIPPED + along + way.connector_length + LOOP + IN_CONTACT
        wires.append(SheetWire(name, pin, u, phi, math.ceil(length / _ROUND_TO - 1e-9) * _ROUND_TO))
    return tuple(wires)


_LOWER_LAYER, _UPPER_LAYER = 1, 3  # indices of the conductive layers in the stack


class _PairReading(NamedTuple):
    """Reading of a multimeter between the two electrodes of a conductive sheet."""

    pair: str  #: "A-B" or "C-D"
    ohms: float  #: of the sheet as it is drawn, without leads
    squares: float  #: the reading over this is the sheet resistance that the sensor file takes [1]
    sheet_ohms: float  #: of the material, for which the reading holds [ohm per square]


def _pair_readings(design: SheetDesign) -> tuple[_PairReading, _PairReading]:
    """Return what a multimeter should read on a sheet, A-B first.

    The sensor's model ends at the inner edges of all four electrodes. The sheets themselves reach further, up to their
    setback from the rim, and what lies there conducts as well: so both read less than the model, and the sheet
    resistance that the model needs is worked out from the reading.
    """
    layout, field = design.layout, design.layout.field
    phi1, phi2 = _span(layout.upper, 0.5 * (field.u1 + field.u2), along=False)
    u1, u2 = _span(layout.lower, 0.5 * (field.phi1 + field.phi2), along=True)
    upper = _part(design, _UPPER_LAYER, SurfaceRectangle(field.u1, field.u2, phi1, phi2))
    lower = _part(design, _LOWER_LAYER, SurfaceRectangle(u1, u2, field.phi1, field.phi2))
    radial, angular = sheet_resistances(design.active.frustum, 1.0, 1.0)
    upper_ohms, lower_ohms = (sheet.ohms for sheet in design.conductive)
    return (
        _PairReading("A-B", sheet_resistances(upper, upper_ohms, 1.0)[0], radial, upper_ohms),
        _PairReading("C-D", sheet_resistances(lower, 1.0, lower_ohms)[1], angular, lower_ohms),
    )


def _expected_frame(design: SheetDesign, index: int, frame: str = "mesh") -> dict[str, int]:
    """Return the counts of the untouched sensor, by field of a frame, as ``coneskin monitor`` expects them."""
    problems: list[str] = []
    built = build_sensor(tomllib.loads(sensor_toml(design, index, frame)), "sensor.toml", problems)
    if built is None or problems:
        raise GeometryError("; ".join(problems) + " (set by the options of the group electronics)")
    return dict(zip(MEASURED, expected_counts(built[0]), strict=True))


def _part(design: SheetDesign, index: int, box: SurfaceRectangle) -> Frustum:
    """Return a part of a layer as a cone of its own, on the middle surface of the wrapped layer."""
    side = design.place.parallel(design.options.stack.middle(index)).frustum
    rise = (box.u2 - box.u1) * side.cos_half_angle
    return Frustum(side.radius_at(box.u1), side.radius_at(box.u2), rise, box.phi2 - box.phi1)


def _span(shape: SurfaceShape, at: float, along: bool) -> tuple[float, float]:
    """Return where a line at phi [rad] along, or at u [m] around, enters and leaves a closed shape of corners."""
    corners = [corner for corner in shape if isinstance(corner, ShapeCorner)]
    found = []
    for one, two in zip(corners, corners[1:] + corners[:1], strict=True):
        (a, p), (b, q) = ((one.phi, one.u), (two.phi, two.u)) if along else ((one.u, one.phi), (two.u, two.phi))
        if min(a, b) <= at < max(a, b):
            found.append(0.5 * (p + q))
    return min(found), max(found)


@dataclass(frozen=True, slots=True)
class BuildFigures:
    """Figures for building one sheet.

    Attributes:
        wires: one for each electrode, in the order of the pins.
        pairs: what a multimeter should read between A and B, and between C and D.
        frame: counts of the untouched sensor, by field of a frame.
        placement: where it belongs on the link.
        collars: of its jig.
        no_collar: a sentence for each end that has none.
    """

    wires: tuple[SheetWire, ...]
    pairs: tuple[_PairReading, _PairReading]
    frame: dict[str, int]
    placement: SheetPlacement
    collars: tuple[Collar, ...] = ()
    no_collar: tuple[str, ...] = ()

    def as_data(self, design: SheetDesign) -> dict[str, Any]:
        """Return the figures and the coordinates of holes and electrodes as plain data, in mm and degrees."""
        way, placement, feature = design.way, self.placement, self.placement.feature
        layout, surfaces = design.layout, {"CD": design.cuts[1].surface, "AB": design.cuts[5].surface}
        return {
            "holes": [_point(u, phi) for u, phi in layout.holes],
            "hole_diameter_mm": _mm(layout.plan.hole),
            "electrodes": {
                name: _outline(foil, surfaces["AB" if name in "AB" else "CD"]) for name, foil in layout.foils.items()
            },
            "cable": {
                "side": way.side,
                **_point(way.u, way.phi),
                "tie_mm": _mm(way.tie_length),
                "connector_mm": _mm(way.connector_length),
                "on_link": not (way.hangs or way.on_sheet),
                "tab_rise_deg": round(math.degrees(math.atan(design.apron.slope)), 1),
                "way": [
                    {"xyz_mm": [_mm(x) for x in point], "normal": [round(x, 5) + 0.0 for x in normal]}
                    for point, normal in zip(way.points.tolist(), way.normals.tolist(), strict=True)
                ],
                "tie_at": way.tie,
                "wires": [
                    {"electrode": w.electrode, "pin": w.pin, **_point(w.u, w.phi), "length_mm": _mm(w.length)}
                    for w in self.wires
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
                            "size_mm": [_mm(length) for length in part.surface.extents],
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
    neighbors: Sequence[SheetDesign] = (),
) -> BuildFigures:
    """Work out the figures for building one sheet.

    Args:
        design: the sheet.
        index: its sensor number in the wire format.
        frame: frame of the poses, in words.
        mesh: of the link; None where it is known by its dimensions only.
        others: sheets that are on the link already when this one is put on.
        faces: flat faces of the link, from which its place is measured.
        neighbors: all sheets of the link.

    Raises:
        GeometryError: a scene would refuse its sensor.
    """
    return BuildFigures(
        _sheet_wires(design.layout, design.way),
        _pair_readings(design),
        _expected_frame(design, index, frame),
        find_placement(design.place, mesh, () if design.above else faces),
        *jig_collars(design, mesh, others, neighbors),
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


#: of the insulation, by electrode
WIRE_COLOURS = {"A": "red", "B": "black", "C": "yellow", "D": "green"}


SPREAD = 0.2  # of the expected ohms: conductive sheets vary by as much


TAPE = "double-sided tape"


#: the roller is that of the peel test of ASTM D3330: 2 kg on a width of 45 mm
ROLLING = (
    "a hand roller with a rubber face, pressed as hard as a weight of 2 kg presses (test it on kitchen scales), once "
    "forth and once back, from the middle outwards, at the speed of a slow step of the hand (5 mm in a second)."
)


#: makers of silicone adhesives test their bonds after three days; their strength grows until then
SETTING = "Leave it for 72 hours at room temperature (18 to 25 degrees Celsius) before anybody presses it hard."


def table_head(*names: str) -> tuple[str, str]:
    """Return the head of a table in Markdown."""
    return f"| {' | '.join(names)} |", "|" + "---|" * len(names)


def section_head(title: str) -> tuple[str, str, str]:
    """Return the head of a section in Markdown, after the one before."""
    return "", f"### {title}", ""


def in_mm(metres: float) -> str:
    """Return a length with its unit."""
    return f"{1e3 * metres:.1f} mm"


def side_name(side: str) -> str:
    """Return the name of a side of a sheet as the guide has it."""
    return {"end1": "end 1", "end2": "end 2", "edge0": "edge 0", "edge1": "the edge of C"}[side]


ADHESIVE = 50e-6  # m; thickness of the tape between the layers
_STRIP_WIDTH = 3e-3  # m; width of the tape in the margins of the isolation
_OFFCUT_FACTOR = 1.15  # of the area of tape; it is trimmed at the borders
_MASKING_LENGTH = 0.5  # m; of masking tape for an end of a sheet
_STRAP_LAP = 80e-3  # m; of a strap: it passes over the collar, and holds on itself
_INSULATION_WIDTH = 10e-3  # m; width of the tape over leads and electrodes


def bill_of_materials(
    designs: Sequence[SheetDesign], figures: Sequence[BuildFigures], beds: Sequence[MaterialBed] = ()
) -> list[tuple[str, str, str]]:
    """List everything that the sheets of a design need, beside the electronics: item, quantity, what it is for.

    Args:
        designs: the sheets.
        figures: those of each sheet.
        beds: parts of each material, nested.
    """
    net: dict[str, float] = defaultdict(float)
    parts: dict[str, list[str]] = defaultdict(list)
    for design in designs:
        for cut in design.cuts:
            net[cut.material] += sum(part.area for part in cut.parts)
            parts[cut.material].append(f"{design.name} part {cut.number}")
    strip = " and a strip of 20 x 120 mm to measure"  # in step 2; it is not built in
    items = [
        (
            material if "foil" not in material else f"{material}, 0.05 mm, with electrically conductive adhesive",
            f"{1e4 * net[material]:.0f} cm2 net{strip if material.startswith('conductive sheet') else ''}; "
            + ("; ".join(_blank(bed) for bed in beds if bed.material == material) or "larger than the bed"),
            ", ".join(parts[material]),
        )
        for material in net
    ]
    faces = strips = covered = 0.0
    for design in designs:
        area = {cut.number: sum(part.area for part in cut.parts) for cut in design.cuts}
        faces += area[1] + area[3] + area[5]
        side = design.place.frustum
        strips += _STRIP_WIDTH * (2.0 * side.slant + side.wrap * (side.radius1 + side.radius2)) * 2.0
        covered += 0.5 * sum(s.outline.length for k in (1, 5) for part in design.cuts[k].parts for s in part.strokes)
    wires = [wire for item in figures for wire in item.wires]
    count = len(designs)
    pins: dict[str, int] = defaultdict(int)
    for design in designs:
        size = f"{design.layout.plan.hole * 1e3 - 0.1:.1f} x {design.options.stack.thickness * 1e3 + 2.0:.0f} mm"
        pins[size] += len(design.layout.holes)
    items += [
        (
            f"double-sided silicone adhesive tape {ADHESIVE * 1e3:g} mm, without carrier",
            f"{1e4 * _OFFCUT_FACTOR * (faces + strips):.0f} cm2",
            "link to part 1, part 1 to 3, part 5 to 7, margins of part 4",
        ),
        (
            f"polyimide tape 0.03 mm, {_INSULATION_WIDTH * 1e3:g} mm wide",
            f"{math.ceil(10.0 * covered) / 10.0:.1f} m",
            "over leads and electrodes",
        ),
        *(
            (
                f"stranded wire 0.14 mm2, {colour}",
                f"{1e3 * sum(wire.length for wire in wires if wire.electrode == name):.0f} mm",
                f"electrode {name}: " + ", ".join(f"{1e3 * w.length:.0f} mm" for w in wires if w.electrode == name),
            )
            for name, colour in WIRE_COLOURS.items()
        ),
        ("4-pin wire-to-wire connector, 2.5 mm, plug and socket with 8 crimp contacts", f"{count}", "cable"),
        ("copper tape with electrically conductive adhesive, 6 x 12 mm", f"{4 * count}", "wire to tab"),
        ("heat-shrink tube 6 mm, 20 mm long", f"{4 * count}", "over the joint of wire and tab"),
        ("self-adhesive cable-tie mount 19 x 19 mm and cable tie 2.5 mm", f"{count}", "strain relief"),
    ]
    items += [
        ("isopropanol, and a cloth that leaves no lint", "20 ml", "link, before the first layer"),
        ("masking tape 19 mm wide", f"{math.ceil(2e3 * _MASKING_LENGTH * count) / 1e3:.0f} m", "while adhesives set"),
    ]
    collars = [collar for item in figures for collar in item.collars]
    if collars:
        plastic = sum(part.surface.volume for collar in collars for part in collar.parts)
        around = 2.0 * math.pi * max(design.place.frustum.radius1 for design in designs) + _STRAP_LAP
        items += [
            ("PLA or PETG, for a 3D printer", f"{1e6 * plastic:.0f} cm3, and its support", "jig"),
            (
                "hook-and-loop tape 15 to 20 mm wide",
                f"{len(collars)} piece{'s' * (len(collars) > 1)} of {10.0 * math.ceil(1e2 * around):.0f} mm",
                "around the collars",
            ),
        ]
    return items + [
        (f"plastic pin with flat head, {size}", f"{number}", "registration holes")
        for size, number in pins.items()
        if number
    ]


def _blank(bed: MaterialBed) -> str:
    width, depth = (1e3 * math.ceil(1e3 * length) / 1e3 for length in bed.used)
    return f"a piece of {width:.0f} x {depth:.0f} mm (`nested/{bed.slug}`, {bed.waste:.0%} waste)"
