"""Build guide of one sheet: every step with the face that is up, what it is fixed with, and what is then measured."""

from __future__ import annotations

import math
from collections.abc import Iterator

from coneskin.design.sheets import SheetDesign
from coneskin.geometry.drawing.cut_sheet import CutSheet

from .bill_of_materials import ADHESIVE
from .build_figures import BuildFigures
from .wiring import STRIPPED

__all__ = ["guide_lines"]

_SPREAD = 0.2  # of the expected ohms: conductive sheets vary by as much
_TAPE = "double-sided tape"


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
        "you: the inside faces the link later. Every part carries the name of the link, of the sheet and of the part, "
        "its material, the face that is up, and the names of its four sides. End 1 is where B is, end 2 where A is, "
        "edge 0 where D is, the other edge where C is."
    )
    steps = [*_flat_steps(design, figures), *_wrap_steps(design), *_cable_steps(design, figures)]
    steps += _test_steps(figures)
    yield ""
    yield from (f"{number}. {step}" for number, step in enumerate(steps, 1))
    yield ""
    yield f"### Place of {design.name} on the link"
    yield ""
    yield from _placement(design, figures)
    yield ""
    yield f"### Wires of {design.name}"
    yield ""
    yield "| pin | electrode | wire | tab at u | tab at phi | cut to |"
    yield "|---|---|---|---|---|---|"
    colours = dict(zip("ABCD", ("red", "black", "yellow", "green"), strict=True))
    for wire in figures.cable.wires:
        yield (
            f"| {wire.pin} | {wire.electrode} | {colours[wire.electrode]} | {_mm(wire.u)} | "
            f"{math.degrees(wire.phi):.2f} deg | {1e3 * wire.length:.0f} mm |"
        )
    yield ""
    yield f"### Readings of {design.name} that is built"
    yield ""
    yield from _readings(figures)
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
        yield f"| hole {number}, diameter {_mm(design.layout.plan.hole)} | {1e3 * u:.2f} | {math.degrees(phi):.3f} |"
    box, width = design.layout.field, design.layout.plan.electrode
    turn = math.degrees(width / min(design.place.frustum.radius1, design.place.frustum.radius2))
    phi1, phi2 = math.degrees(box.phi1), math.degrees(box.phi2)
    yield f"| electrode B | {1e3 * (box.u1 - width):.2f} to {1e3 * box.u1:.2f} | along end 1 |"
    yield f"| electrode A | {1e3 * box.u2:.2f} to {1e3 * (box.u2 + width):.2f} | along end 2 |"
    yield f"| electrode D | along edge 0 | {phi1 - turn:.3f} to {phi1:.3f} |"
    yield f"| electrode C | along the other edge | {phi2:.3f} to {phi2 + turn:.3f} |"


def _flat_steps(design: SheetDesign, figures: BuildFigures) -> Iterator[str]:
    cuts, plan = design.cuts, design.layout.plan
    one = cuts[0]
    side = one.surface
    yield (
        "Cut the seven parts: red lines and magenta holes are cut, blue ones are marks (pen or low power), green ones "
        "are folds. Print PDF files at 100 %: the bar on each page must measure 100 mm. Check part 1 with a steel "
        "rule: "
        f"{_mm(side.slant)} from end 1 to end 2 along an edge, and {_mm(math.dist(*_ends(one)))} straight from corner "
        "to corner along end 1."
    )
    yield f"Lay part 3 on the bench, {cuts[2].face} up. Its blue lines show the places of C and D (part 2)."
    yield (
        f"Lay foils C and D on them, {cuts[1].face} up, the conductive adhesive towards part 3, and roll them down. C "
        "belongs to the edge whose label has the degrees, D to edge 0. The tabs stand out over "
        f"{_side(plan.wires)}."
    )
    yield (
        f"Lay part 5 on the bench, {cuts[4].face} up. Lay foils A and B (part 6) on its blue lines, {cuts[5].face} up, "
        "the conductive adhesive towards part 5, and roll them down: B along end 1, A along end 2."
    )
    yield (
        "Cover the bare faces of all four foils, leads included, with polyimide tape, and trim it at the foil. Only "
        "the "
        "tabs stay bare."
    )
    ab, cd = figures.pairs
    yield (
        f"Measure with a multimeter, a probe on each tab: A-B {_ohms(ab.ohms)}, C-D {_ohms(cd.ohms)}, each within "
        f"{_SPREAD:.0%}. More: a foil does not touch its sheet over its whole length. The same within 5 % with a "
        "finger "
        "moving along each foil: the contact is good."
    )
    yield (
        f"Wires to the tabs: strip {_mm(STRIPPED)} of each wire of the table below, lay the strands on the tab, fold "
        "the "
        "tab once over them, wrap copper tape with conductive adhesive around it, press it flat with pliers, and "
        "shrink a "
        "tube over it. Below 1 ohm from the free end of the wire to the foil."
        if plan.tab
        else "This sheet has no tabs: lay the strands of each wire flat on its foil at the rim, and copper tape with "
        "conductive adhesive over them. Below 1 ohm from the free end of the wire to the foil."
    )
    yield (
        f"Prick the centres of the nine crosses of part 7 ({cuts[6].face} up) through with a needle, and write their "
        "numbers on the outside: `coneskin calibrate` and `coneskin commission` ask for them."
    )


def _wrap_steps(design: SheetDesign) -> Iterator[str]:
    stack, options = design.options.stack, design.options
    marks = "the blue outline on part 1"
    ground = f"the outside of {design.above}" if design.above else "the link"
    yield (
        f"Clean {ground} with isopropanol. Draw two lines on it with a soft pencil, by the table below: where end 1 "
        "lies, around it, and where edge 0 lies, along it."
    )
    pins = (
        " Put the flat-headed pins into its three holes from the inside; every further part is pushed over them. The "
        "corner beside the lead has no hole: a mirrored part does not fit."
        if design.layout.holes
        else ""
    )
    seen = "anticlockwise as seen when you look from end 2 towards end 1"
    if stack.assembly == "loose":
        yield (
            f"Wrap part 1, outside up (labels towards you), on {_TAPE}: end 1 and edge 0 on the pencil lines, "
            f"{seen}.{pins}"
        )
        yield f"Wrap part 3 with its foils, inside towards the link, on {_TAPE}, within {marks}."
        yield (
            f"Wrap part 4, outside up. Fix it with strips of {_TAPE} 3 mm wide in its margins only: adhesive on the "
            "active area would glue the conductive sheets apart."
        )
        yield "Wrap part 5 with its foils, outside up, fixed by the same strips; its foils face you."
        yield f"Wrap part 7, inside towards the link, on {_TAPE} to the outside of part 5, within its blue outline."
    elif stack.assembly == "pairs":
        yield (
            f"Glue part 3 with its foils on part 1 (outside up), inside down, within {marks}, with {_TAPE}, both flat."
        )
        yield f"Glue part 5 with its foils on part 7 (inside up), outside down, within its blue outline, with {_TAPE}."
        yield f"Wrap the pair 1 and 3 on {_TAPE}: end 1 and edge 0 on the pencil lines, {seen}.{pins}"
        yield (
            f"Wrap part 4, outside up. Fix it with strips of {_TAPE} 3 mm wide in its margins only: adhesive on the "
            "active area would glue the conductive sheets apart."
        )
        yield "Wrap the pair 5 and 7, fixed by the same strips, part 7 outermost."
    else:
        yield (
            f"Lay part 1 on the bench, outside up.{pins} Glue part 3 with its foils on it, inside down, within {marks}."
        )
        yield (
            f"Lay part 4 on it, outside up, with strips of {_TAPE} 3 mm wide in its margins only; then part 5 with its "
            "foils, outside up, on the same strips; then part 7, inside down, with tape, within its blue outline."
        )
        yield f"Wrap the whole on {_TAPE}: end 1 and edge 0 on the pencil lines, {seen}."
    side = design.place.frustum
    gap = side.wrap * side.cos_half_angle * ADHESIVE
    if side.wrap > 2.0 * math.pi - 0.5:
        closing = options.seam_gap * 1e3
        yield (
            f"The seam: the edges of every part meet{f' up to {closing:g} mm' if closing else ''}. Each layer of tape "
            f"under a part opens its seam by {_mm(gap)} more, at most {_mm(3.0 * gap)} at part 7; that is meant to be "
            "so."
        )
    if options.overlap:
        yield f"Fold the flap of part 7, {_mm(options.overlap)} wide, over edge 0 and fix it with {_TAPE}."
    if design.layout.holes:
        yield "Cut the pins flush. Use no metal: it would short-circuit the two conductive sheets."


def _cable_steps(design: SheetDesign, figures: BuildFigures) -> Iterator[str]:
    cable, plan = figures.cable, design.layout.plan
    if plan.tab:
        yield f"Fold the tabs over {_side(plan.wires)} outwards along the green lines, away from the link."
    if plan.wires == "end2" and design.next_joint is not None:
        yield "The tabs would run into the next sheet there: bend them up before that sheet is wrapped."
    if plan.wires.startswith("edge"):
        yield "The tabs leave at the seam: lead them out between the edges before you close the wrap."
    yield (
        f"Glue the cable-tie mount on the link {_mm(cable.tie)} beyond {_side(cable.side)}, at "
        f"{_where(design, figures)}. "
        "Lead the four wires to it flat on the link, leave a loop of 20 mm so that no pull reaches a tab, and tie them "
        f"down. Crimp the connector {_mm(cable.connector)} beyond the rim: pin 1 A, pin 2 B, pin 3 C, pin 4 D."
    )


def _test_steps(figures: BuildFigures) -> Iterator[str]:
    ab, cd = figures.pairs
    yield (
        f"Measure at the connector: pins 1-2 {_ohms(ab.ohms)}, pins 3-4 {_ohms(cd.ohms)}; pins 1-3 above 10 Mohm while "
        "nothing touches the sensor, and far less while a thumb presses its middle; again above 10 Mohm once it is "
        "lifted."
    )
    yield (
        "Write the measured sheets into `sensor.toml`: `upper_sheet_ohm` = reading 1-2 divided by "
        f"{ab.squares:.4f}, `lower_sheet_ohm` = reading 3-4 divided by {cd.squares:.4f}."
    )
    yield (
        "Plug it into the board (`coneskin firmware` writes sketch, wiring and parts) and run `coneskin monitor "
        "PORT`: the "
        "untouched frame must read as in the table below, within 3 % once the measured sheets are in the sensor file."
    )


def _placement(design: SheetDesign, figures: BuildFigures) -> Iterator[str]:
    place, side = figures.placement, design.place.frustum
    if design.above:
        yield from _strip_placement(design)
        return
    yield "| from | to | distance |"
    yield "|---|---|---|"
    if place.before is not None and place.beyond is not None:
        yield (
            "| outermost face of the link on the side of end 1, square to the axis | line of end 1 | "
            f"{_mm(place.before)} along the axis |"
        )
        yield f"| line of end 2 | outermost face of the link on its side | {_mm(place.beyond)} along the axis |"
    else:
        yield "| the face of your link that you measured its height from | line of end 1 | 0 mm: choose it |"
    yield f"| line of end 1 | line of end 2 | {_mm(side.slant)} along the surface |"
    word = "once around the link" if side.wrap > 6.28 else "edge 0, around the link, to the other edge"
    yield f"| {word} | at end 1 | {_mm(place.around1)} by tape measure |"
    yield f"| {word} | at end 2 | {_mm(place.around2)} by tape measure |"
    if place.feature is not None:
        part = place.feature
        yield (
            f"| line of edge 0 | middle of the part of the link that stands out furthest, {_mm(part.radius)} from the "
            f"axis | {_mm(part.arc)} around end {part.end}, in the direction of the wrap "
            f"({math.degrees(part.azimuth):.1f} "
            "deg) |"
        )
    yield ""
    x, y, z = (f"{value:z.3f}" for value in place.seam)
    if place.feature is None:
        yield (
            f"Edge 0 faces the direction ({x}, {y}, {z}) of the frame above. Nothing stands out from the link by which "
            "it could be found: draw that direction on the link from the arm's own frame. If edge 0 has to face "
            "elsewhere, design again with `--seam X Y Z`. `coneskin commission` shows whether it is right."
        )
    else:
        yield (
            f"Edge 0 faces the direction ({x}, {y}, {z}) of the frame above; `coneskin commission` shows whether it "
            "does."
        )


def _strip_placement(design: SheetDesign) -> Iterator[str]:
    side = design.place.frustum
    half1, half2 = 0.5 * side.wrap * side.radius1, 0.5 * side.wrap * side.radius2
    yield (
        f"It lies on the outside of {design.above}, over its seam, its ends flush with the ends of that sheet. Its "
        "edge 0 "
        "lies beside the edge of C of that sheet, its other edge beyond the seam."
    )
    middle, seam = 0.5 * side.wrap, design.seam_offset
    yield ""
    yield "| from | to | distance |"
    yield "|---|---|---|"
    yield f"| edge 0 of the strip | its other edge | {_mm(2.0 * half1)} at end 1, {_mm(2.0 * half2)} at end 2 |"
    yield (
        f"| seam of {design.above} | edge 0 of the strip, against the direction of the wrap | "
        f"{_mm(seam * side.radius1)} at end 1, {_mm(seam * side.radius2)} at end 2 |"
    )
    yield f"| seam of {design.above} | middle of the strip | {_mm((middle - seam) * side.radius1)} at end 1 |"


def _readings(figures: BuildFigures) -> Iterator[str]:
    yield "| between | multimeter | for a material of |"
    yield "|---|---|---|"
    for pair in figures.pairs:
        yield f"| {pair.pair} | {_ohms(pair.ohms)} | {pair.sheet_ohms:g} ohm per square |"
    yield "| A or B to C or D | above 10 Mohm, untouched | |"
    yield ""
    yield "Untouched frame, in counts, as `coneskin monitor` shows it with the sensor file of this design:"
    yield ""
    yield "| phase | " + " | ".join(name for name in figures.frame) + " |"
    yield "|---" * (len(figures.frame) + 1) + "|"
    yield "| counts | " + " | ".join(str(count) for count in figures.frame.values()) + " |"
    ab, cd = figures.pairs
    radial, angular = ab.ohms / (ab.squares * ab.sheet_ohms), cd.ohms / (cd.squares * cd.sheet_ohms)
    yield ""
    yield (
        "The model of the sensor ends at its electrodes, the sheets do not: until the measured sheets are in the file, "
        f"radial_current reads {1.0 / radial - 1.0:+.0%} and angular_current {1.0 / angular - 1.0:+.0%} of these."
    )


def _where(design: SheetDesign, figures: BuildFigures) -> str:
    cable, side = figures.cable, design.place.frustum
    if cable.side.startswith("edge"):
        return f"{_mm(cable.u)} from end 1"
    radius = side.radius_at(cable.u)
    arc = cable.phi * radius
    if arc > math.pi * radius:
        return f"{_mm(2.0 * math.pi * radius - arc)} from edge 0, against the direction of the wrap"
    return f"{_mm(arc)} from edge 0, in the direction of the wrap"


def _ends(cut: CutSheet) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the two corners of end 1 of the flat pattern [m]."""
    surface = cut.surface
    return surface.flat_point(0.0, -0.5 * surface.wrap), surface.flat_point(0.0, 0.5 * surface.wrap)


def _side(name: str) -> str:
    return {"end1": "end 1", "end2": "end 2", "edge0": "edge 0", "edge1": "the edge of C"}[name]


def _ohms(ohms: float) -> str:
    return f"{ohms / 1e3:.3g} kohm" if ohms >= 1e3 else f"{ohms:.3g} ohm"


def _mm(metres: float) -> str:
    return f"{1e3 * metres:.1f} mm"
