"""Section of the build guide on the printed jig."""

from __future__ import annotations

import math
from collections.abc import Iterator

from coneskin.design.sheets.sheet_design import SheetDesign

from .build_figures import BuildFigures
from .guide_words import in_mm

__all__ = ["jig_lines"]


def jig_lines(design: SheetDesign, figures: BuildFigures, folder: str) -> Iterator[str]:
    """Yield the section.

    Args:
        design: the sheet.
        figures: for building it.
        folder: of its files, as a path in the folder of the design; "." for that folder itself.
    """
    plan, wires = design.options.jig, design.layout.plan.wires
    if plan.surface == "none":
        yield "No jig was asked for (`--jig none`)."
        return
    if figures.collars:
        yield (
            f"Print the parts as they stand in their files (millimetres), with support under the step: PLA or PETG, "
            f"layers of 0.2 mm, walls of {in_mm(plan.wall)} solid. A part has as many grooves on its outside as its "
            "number says; part 1 begins at edge 0, the others follow anticlockwise as seen from end 2. The step inside "
            "lies against the end of the sheet, the longer zone with the flat seat over the sheet, the lip on the "
            f"link; the gap to both is {in_mm(plan.clearance)} (`--jig-clearance-mm`)."
        )
        yield ""
        yield "| file | for | printed size [mm] | volume |"
        yield "|---|---|---|---|"
        place = "jig/" if folder == "." else f"{folder}/jig/"
        for collar in figures.collars:
            for part in collar.parts:
                size = " x ".join(f"{1e3 * length:.0f}" for length in part.surface.size)
                volume = f"{1e6 * part.surface.volume:.0f} cm3"
                yield f"| `{place}{collar.slug(part)}.stl` | end {collar.end}, part {part.number} | {size} | {volume} |"
        yield ""
    for collar in figures.collars:
        how = f"* End {collar.end}: the lip reaches {in_mm(collar.lip)} on the link"
        if collar.flush:
            how += " and ends flush with its outermost face: that is its place along the axis"
        elif collar.stopped:
            how += "; where a part of the link stands out, its edge lies against that: this is its place along the axis"
        elif collar.before is not None:
            how += f"; its edge is {in_mm(collar.before)} from the outermost face of the link, along the axis"
        else:
            how += "; its step is on the pencil line of this end"
        if collar.play is not None:
            radius = design.place.frustum.radius1 if collar.end == 1 else design.place.frustum.radius2
            how += (
                f". What stands out lets it be turned by {math.degrees(collar.play):.0f} deg "
                f"({in_mm(collar.play * radius)}) at most: put it in the middle"
            )
        if wires == f"end{collar.end}":
            how += ". Under its lip is a way out for tabs and wires, above their places: lead them through it"
        yield how + "."
    for sentence in figures.no_collar:
        yield f"* No collar: {sentence}."
