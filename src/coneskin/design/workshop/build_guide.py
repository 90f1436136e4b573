"""Build guide of one sheet: every step with the face that is up, what it is fixed with, and what is then measured."""

from __future__ import annotations

import math
from collections.abc import Iterator

from coneskin.design.sheets.sheet_design import SheetDesign
from coneskin.geometry.drawing.touch_marks import marks_on_link

from .build_figures import BuildFigures
from .closing_steps import cable_steps, reading_lines, test_steps
from .flat_steps import flat_steps
from .guide_words import WIRE_COLOURS, in_mm
from .jig_text import jig_lines
from .placement_text import placement_lines
from .wrap_steps import wrap_steps

__all__ = ["guide_lines"]


def guide_lines(design: SheetDesign, figures: BuildFigures, folder: str) -> Iterator[str]:
    """Yield the guide as Markdown.

    Args:
        design: the sheet.
        figures: for building it.
        folder: of its files, as a path in the folder of the design; "." for that folder itself.
    """
    files = "cut/" if folder == "." else f"{folder}/cut/"
    yield f"## Building {design.name}"
    yield ""
    yield (
        f"Files: `{files}`. Wherever a step says *outside up* or *inside up*, that face of the sensor looks at "
        "you: the inside faces the link later. Every part carries the names of the link and of the sheet and the face "
        "that is up; a foil its letter beside them, any other part its number, its name, its material and the names "
        "of its four sides. End 1 is where B is, end 2 where A is, "
        "edge 0 where D is, the other edge where C is."
    )
    steps = [*flat_steps(design, figures), *wrap_steps(design, figures), *cable_steps(design, figures)]
    steps += test_steps(figures, folder)
    yield ""
    yield from (f"{number}. {step}" for number, step in enumerate(steps, 1))
    yield ""
    yield f"### Place of {design.name} on the link"
    yield ""
    yield from placement_lines(design, figures)
    yield ""
    yield f"### Jig of {design.name}"
    yield ""
    yield from jig_lines(design, figures, folder)
    yield ""
    yield f"### Wires of {design.name}"
    yield ""
    yield "| pin | electrode | wire | tab at u | tab at phi | cut to |"
    yield "|---|---|---|---|---|---|"
    for wire in figures.cable.wires:
        yield (
            f"| {wire.pin} | {wire.electrode} | {WIRE_COLOURS[wire.electrode]} | {in_mm(wire.u)} | "
            f"{math.degrees(wire.phi):.2f} deg | {1e3 * wire.length:.0f} mm |"
        )
    yield ""
    yield f"### Readings of {design.name} that is built"
    yield ""
    yield from reading_lines(figures)
    yield ""
    yield f"### Coordinates of {design.name}"
    yield ""
    yield (
        "u runs along the slant from end 1, phi around from edge 0. x and y are those of the drawing seen from "
        "outside; "
        "where the inside is up, x changes its sign. `design.json` has every corner of every electrode."
    )
    yield ""
    yield "| what | u [mm] | phi [deg] |"
    yield "|---|---|---|"
    for number, (u, phi) in enumerate(design.layout.holes, 1):
        yield f"| hole {number}, diameter {in_mm(design.layout.plan.hole)} | {1e3 * u:.2f} | {math.degrees(phi):.3f} |"
    box, width = design.layout.field, design.layout.plan.electrode
    turn = math.degrees(width / min(design.place.frustum.radius1, design.place.frustum.radius2))
    phi1, phi2 = math.degrees(box.phi1), math.degrees(box.phi2)
    yield f"| electrode B | {1e3 * (box.u1 - width):.2f} to {1e3 * box.u1:.2f} | along end 1 |"
    yield f"| electrode A | {1e3 * box.u2:.2f} to {1e3 * (box.u2 + width):.2f} | along end 2 |"
    yield f"| electrode D | along edge 0 | {phi1 - turn:.3f} to {phi1:.3f} |"
    yield f"| electrode C | along the other edge | {phi2:.3f} to {phi2 + turn:.3f} |"
    for number, (u, phi) in enumerate(marks_on_link(design.layout, design.options.stack, design.place), 1):
        yield f"| mark {number} to touch | {1e3 * u:.2f} | {math.degrees(phi):.3f} |"
