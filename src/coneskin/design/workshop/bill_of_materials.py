"""Bill of materials of a design: everything that is bought or cut, with quantities."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

from coneskin.design.sheets.sheet_design import SheetDesign
from coneskin.geometry.drawing.nesting import MaterialBed

from .build_figures import BuildFigures

ADHESIVE = 50e-6  # m; thickness of the tape between the layers
_STRIP_WIDTH = 3e-3  # m; width of the tape in the margins of the isolation
_OFFCUT_FACTOR = 1.15  # of the area of tape; it is trimmed at the borders
_MASKING_LENGTH = 0.5  # m; of masking tape for an end of a sheet
_STRAP_LAP = 80e-3  # m; of a strap: it passes over the collar, and holds on itself
_INSULATION_WIDTH = 10e-3  # m; width of the tape over leads and electrodes


class _BillItem(NamedTuple):
    """One line of the bill."""

    item: str
    quantity: str
    used_for: str


def bill_of_materials(
    designs: Sequence[SheetDesign], figures: Sequence[BuildFigures], beds: Sequence[MaterialBed] = ()
) -> list[_BillItem]:
    """List everything that the sheets of a design need, beside the electronics.

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
        _BillItem(
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
        _BillItem(
            f"double-sided silicone adhesive tape {ADHESIVE * 1e3:g} mm, without carrier",
            f"{1e4 * _OFFCUT_FACTOR * (faces + strips):.0f} cm2",
            "link to part 1, part 1 to 3, part 5 to 7, margins of part 4",
        ),
        _BillItem(
            f"polyimide tape 0.03 mm, {_INSULATION_WIDTH * 1e3:g} mm wide",
            f"{math.ceil(10.0 * covered) / 10.0:.1f} m",
            "over leads and electrodes",
        ),
        *(
            _BillItem(
                f"stranded wire 0.14 mm2, {colour}",
                f"{1e3 * sum(wire.length for wire in wires if wire.electrode == name):.0f} mm",
                f"electrode {name}: " + ", ".join(f"{1e3 * w.length:.0f} mm" for w in wires if w.electrode == name),
            )
            for name, colour in zip("ABCD", ("red", "black", "yellow", "green"), strict=True)
        ),
        _BillItem("4-pin wire-to-wire connector, 2.5 mm, plug and socket with 8 crimp contacts", f"{count}", "cable"),
        _BillItem("copper tape with electrically conductive adhesive, 6 x 12 mm", f"{4 * count}", "wire to tab"),
        _BillItem("heat-shrink tube 6 mm, 20 mm long", f"{4 * count}", "over the joint of wire and tab"),
        _BillItem("self-adhesive cable-tie mount 19 x 19 mm and cable tie 2.5 mm", f"{count}", "strain relief"),
    ]
    items += [
        _BillItem("isopropanol, and a cloth that leaves no lint", "20 ml", "link, before the first layer"),
        _BillItem(
            "masking tape 19 mm wide", f"{math.ceil(2e3 * _MASKING_LENGTH * count) / 1e3:.0f} m", "while adhesives set"
        ),
    ]
    collars = [collar for item in figures for collar in item.collars]
    if collars:
        plastic = sum(part.surface.volume for collar in collars for part in collar.parts)
        around = 2.0 * math.pi * max(design.place.frustum.radius1 for design in designs) + _STRAP_LAP
        items += [
            _BillItem("PLA or PETG, for a 3D printer", f"{1e6 * plastic:.0f} cm3, and its support", "jig"),
            _BillItem(
                "hook-and-loop tape 15 to 20 mm wide",
                f"{len(collars)} pieces of {10.0 * math.ceil(1e2 * around):.0f} mm",
                "around the collars",
            ),
        ]
    return items + [
        _BillItem(f"plastic pin with flat head, {size}", f"{number}", "registration holes")
        for size, number in pins.items()
        if number
    ]


def _blank(bed: MaterialBed) -> str:
    width, depth = (1e3 * math.ceil(1e3 * length) / 1e3 for length in bed.used)
    return f"a piece of {width:.0f} x {depth:.0f} mm (`nested/{bed.slug}`, {bed.waste:.0%} waste)"
