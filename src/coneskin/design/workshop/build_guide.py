"""Build guide of one sheet: every step with the face that is up, what it is fixed with, and what is then measured.

First the steps on the bench (cut, foils, insulation, wires), then those on the link (clean, wrap, close the seam), the
jig, the cable, and the tests of the finished sheet.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from coneskin.design.sheets.sheet_design import SheetDesign
from coneskin.geometry.drawing.cut_sheet import TEST_HOLE, TEST_SQUARE, CutSheet
from coneskin.geometry.drawing.touch_marks import marks_on_link

from .bill_of_materials import ADHESIVE
from .build_figures import (
    ROLLING,
    SETTING,
    SPREAD,
    STRIPPED,
    TAPE,
    WIRE_COLOURS,
    BuildFigures,
    in_mm,
    section_head,
    side_name,
    table_head,
)
from .placement_text import placement_lines


def _flat_steps(design: SheetDesign, figures: BuildFigures) -> Iterator[str]:
    """Yield the steps that are done while everything is flat."""
    cuts, plan, kerf = design.cuts, design.layout.plan, 1e3 * design.options.kerf
    one = cuts[0]
    side = one.surface
    yield (
        "Test each material before any part is cut. The test piece (`cut/0-test-piece`, and on every nested bed) is a "
        f"square of {TEST_SQUARE * 1e3:g} mm with a square hole of {TEST_HOLE * 1e3:g} mm, drawn without a kerf. Foam, "
        "mesh, conductive sheet and foil are cut by a knife: a drag knife, an oscillating knife for foam, or a scalpel "
        "along the printed PDF. Use no laser unless the maker of the material permits it: polyethylene melts and burns "
        "in it, and any sheet with chlorine (PVC) gives off a gas that harms people and the machine. Begin with the "
        "least pressure and the middle speed that the machine's manual gives for paper; press harder until the square "
        "falls out, and not further. Marks (blue) are drawn by pen, or by the same knife at a pressure that scratches. "
        "*Check:* measure the test piece with a caliper: the width of the cut is half of (hole - square + "
        f"{1e3 * (TEST_SQUARE - TEST_HOLE):g} mm). These files have {kerf:g} mm in their outlines; if yours differs by "
        "more than 0.2 mm, design again with `--set drawings.kerf_mm=WIDTH`. A scalpel has 0."
    )
    ohms = " and ".join(f"{sheet.ohms:g}" for sheet in dict.fromkeys(reversed(design.conductive)))
    yield (
        "Measure the conductive sheet before it is cut: a strip of 20 x 120 mm, copper tape with conductive adhesive "
        "over 10 mm at both ends. *Check:* the multimeter's reading divided by 5 is its resistance per square; this "
        f"design wants {ohms} ohm per square (lower, upper), within {SPREAD:.0%}. Otherwise design again with "
        "`--set electronics.lower_sheet_ohm=OHM` and `--set electronics.upper_sheet_ohm=OHM`: the electronics then "
        "match what you have. Which face conducts? "
        "Printed and coated films conduct on one face only: try both with the probes. It must be the face that the "
        "labels call up (part 3 its outside, part 5 its inside): it carries the foils, and the two face each other "
        "through the isolation."
    )
    yield (
        "Cut the seven parts: red lines and magenta holes are cut, blue ones are marks, green ones are folds, black is "
        "text for pen or printer. Print PDF files at 100 %: the bar on each page must measure 100 mm. *Check* part 1 "
        f"with a steel rule: {in_mm(side.slant)} from end 1 to end 2 along an edge, and "
        f"{in_mm(math.dist(*_ends(one)))} straight from corner to corner along end 1; the other parts by the picture "
        "of the parts, within 0.5 mm. Write its number on every part that came without letters."
    )
    yield f"Lay part 3 on the bench, {cuts[2].face} up. Its blue lines show the places of C and D (part 2)."
    yield (
        f"Lay foils C and D on them, {cuts[1].face} up, the conductive adhesive towards part 3, and roll them down. C "
        "belongs to the edge labelled (C), D to edge 0. A foil is one piece with its lead and its tab, so these lie "
        f"where they belong. The tabs stand out over {side_name(plan.wires)}. Rolling, here and below: {ROLLING} "
        "*Check:* no bubble, no wrinkle, and no corner that lifts when the sheet is bent to the radius of the link."
    )
    yield (
        f"Lay part 5 on the bench, {cuts[4].face} up. Lay foils A and B (part 6) on its blue lines, {cuts[5].face} up, "
        "the conductive adhesive towards part 5, and roll them down: B along end 1, A along end 2. *Check* as before."
    )
    yield (
        "Cover the bare faces of all four foils, leads included, with polyimide tape that stands 1 mm over the foil on "
        "each side: they will face the other conductive sheet. The lead of "
        f"{plan.led_across} lies where its sheet is cut away: cover its adhesive too. Only the tabs stay bare. "
        "*Check:* a probe slid along the tape finds no contact with the foil below."
    )
    ab, cd = figures.pairs
    yield (
        f"Measure with a multimeter, a probe on each tab: A-B {_in_ohms(ab.ohms)}, C-D {_in_ohms(cd.ohms)}, each "
        f"within {SPREAD:.0%}. More: a foil does not touch its sheet over its whole length; roll it again. *Check:* "
        "the reading stays within 5 % while a finger moves along each foil."
    )
    yield (
        f"Wires to the tabs, in the colours and lengths of the table below: strip {in_mm(STRIPPED)} of each wire, lay "
        f"the strands along the outer half of the tab, fold that half ({in_mm(0.5 * plan.tab)}) over them, wrap copper "
        "tape with conductive adhesive around it, press it flat with pliers, and shrink a tube over it (heat gun at "
        "its lowest setting, a metal ruler under "
        "the tab). *Check:* below 1 ohm from the free end of the wire to the foil, also while you pull the wire "
        "as hard as a full cup hangs on it (3 N). "
        "Until the cable tie is there, masking tape holds the wires to the part, so that nothing pulls at a tab."
        if plan.tab
        else "This sheet has no tabs: lay the strands of each wire (table below) flat on its foil at the rim, and "
        "copper tape with conductive adhesive over them. *Check:* below 1 ohm from the free end of the wire to the "
        "foil."
    )
    yield (
        f"Prick the centres of the nine crosses of part 7 ({cuts[6].face} up) through with a needle, and write their "
        "numbers on the outside: `coneskin calibrate` asks for them. *Check:* on the outside, "
        "end 1 down, numbers 1, 2, 3 run along end 1 from edge 0 at the left, 4 to 6 come back above them, and 7 to 9 "
        "go on along end 2; the table of coordinates below has their places."
    )


def _in_ohms(ohms: float) -> str:
    """Return a resistance with its unit."""
    return f"{ohms / 1e3:.3g} kohm" if ohms >= 1e3 else f"{ohms:.3g} ohm"


def _ends(cut: CutSheet) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the two corners of end 1 of the flat pattern [m]."""
    surface = cut.surface
    return surface.flat_point(0.0, -0.5 * surface.wrap), surface.flat_point(0.0, 0.5 * surface.wrap)


def _wrap_steps(design: SheetDesign, figures: BuildFigures) -> Iterator[str]:
    """Yield the steps from the clean link to the sheet that holds on it."""
    stack, options = design.options.stack, design.options
    marks = "the blue outline on part 1"
    ground = f"the outside of {design.above}" if design.above else "the link"
    seams = "seam of the sheet below" if design.above else "edge 0"
    yield (
        f"Clean {ground} with isopropanol and a cloth that leaves no lint, and let it dry for a minute. Draw two lines "
        f"on it with a soft pencil, by *Place of {design.name}* below: where end 1 lies, around it, and where {seams} "
        "lies, along it. "
        f"*Check:* the sizes around the link there, by tape measure, within 1 mm for each 100 mm. If they "
        "differ, this is another link than the design's: stop here."
    )
    if figures.collars:
        line = any(collar.end == 1 for collar in figures.collars)
        at_line = ", and the pencil line of end 1 is at the step of its collar, within 1 mm" if line else ""
        yield (
            "Fit the printed collars (below) on the bare link, without tape, and strap them. *Check:* no part rocks, "
            f"the slots between the parts are open all along{at_line}. Then take them off again."
        )
    pins = (
        " Before that, put the flat-headed pins into its three holes from the inside, their heads flush in the foam; "
        "every further part is pushed over them. The corner beside the lead has no hole: a mirrored part does not fit."
        if design.layout.holes
        else ""
    )
    seen = "anticlockwise as seen when you look from end 2 towards end 1"
    strips = f"strips of {TAPE} 3 mm wide on both of its faces, along its rim and outside the foils only"
    isolation = (
        f"Wrap part 4, outside up. Fix it with {strips}: adhesive on the active area would glue the conductive sheets "
        "apart."
    )
    if stack.assembly == "loose":
        yield (
            f"Wrap part 1, outside up (labels towards you), on {TAPE}, here and below edge to edge under the whole "
            f"part: end 1 and edge 0 on the pencil lines, {seen}.{pins}"
        )
        yield f"Wrap part 3, inside towards the link, on {TAPE}, within {marks}; its foils face you."
        yield isolation
        yield "Wrap part 5, its foils towards the isolation, fixed by the same strips."
        yield f"Wrap part 7, inside towards the link, on {TAPE} to the outside of part 5, within its blue outline."
    elif stack.assembly == "pairs":
        yield (f"Glue part 3 on part 1 (outside up), its foils up, within {marks}, with {TAPE}, both flat.")
        yield f"Glue part 5 on part 7 (inside up), its foils up, within its blue outline, with {TAPE}."
        yield f"Wrap the pair 1 and 3 on {TAPE}: end 1 and edge 0 on the pencil lines, {seen}.{pins}"
        yield isolation
        yield "Wrap the pair 5 and 7, fixed by the same strips, part 7 outermost."
    else:
        yield (f"Lay part 1 on the bench, outside up.{pins} Glue part 3 on it, its foils up, within {marks}.")
        yield (
            f"Lay part 4 on it, outside up, with {strips}; then part 5, its foils down, on the same strips; then part "
            "7, inside down, with tape, within its blue outline."
        )
        yield f"Wrap the whole on {TAPE}: end 1 and edge 0 on the pencil lines, {seen}."
    side = design.place.frustum
    gap = side.wrap * side.cos_half_angle * ADHESIVE
    if design.has_seam:
        closing = options.seam_gap * 1e3
        yield (
            f"The seam: the edges of every part meet{f' up to {closing:g} mm' if closing else ''}. Each layer of tape "
            f"under a part opens its seam by {in_mm(gap)} more, at most {in_mm(3.0 * gap)} at part 7; that is meant to "
            "be so."
        )
    yield (
        "*Check* after each wrapped part: both edges are straight, the rim stands within 0.5 mm of the pencil line all "
        "around, and there is no fold; a part is peeled off and laid again within a minute, later it tears. After part "
        "5, measure again from wire to wire: A-B and C-D as before, and A to C above 10 Mohm. Roll part 1, and "
        "the margins of part 7, as above; on the isolation and above the active area only smooth by hand, for the "
        "roller would press the two conductive sheets together."
    )
    if options.overlap:
        yield f"Fold the flap of part 7, {in_mm(options.overlap)} wide, over edge 0 and fix it with {TAPE}."
    if design.layout.holes:
        yield "Cut the pins flush. Use no metal: it would short-circuit the two conductive sheets."
    if figures.collars:
        ends = [collar.end for collar in figures.collars]
        first = f"the collars on again, first the one of end {ends[0]}" if len(ends) == 2 else "the collar on again"
        other = "" if len(ends) == 2 else ", and hold the other end with masking tape"
        middle = (
            "its seam in the middle of the slot between the parts"
            if design.has_seam
            else "its two edges flush with the outer sides of the parts"
        )
        yield (
            f"Put {first}: push the sheet against its step, {middle}, and strap the parts with hook-and-loop tape "
            f"around the link, on their flat seats{other}. {SETTING} Take them off."
        )
    else:
        yield f"Wind masking tape around both rims. {SETTING}"


def _cable_steps(design: SheetDesign) -> Iterator[str]:
    """Yield the steps from the tabs to the connector."""
    way, plan = design.way, design.layout.plan
    if way.on_sheet:
        yield "The tabs stand up between the two edges of the seam: lay their wires down on part 7 along it."
    elif plan.tab:
        yield f"Fold the tabs over {side_name(plan.wires)} outwards along the green lines, away from the link."
    if design.apron.slope and not way.on_sheet:
        rise = math.degrees(math.atan(design.apron.slope))
        yield f"The link stands out beyond that rim: bend the tabs up by {rise:.0f} deg, so that none lies on it."
    if plan.wires.startswith("edge") and not way.on_sheet:
        yield f"The tabs leave at {side_name(plan.wires)}: lead them out on the bare link beside that edge."
    ground = "on part 7, over the seam, where no touch is located," if way.on_sheet else "on the link"
    if way.hangs:
        ground = "on what is bolted to the link there and moves with it, such as a flange or a cover"
        yield (
            f"The link ends less than {in_mm(way.connector_length)} beyond the tabs: tie and connector lie {ground}; "
            "never on the far side of a joint. If nothing does, glue the mount on part 7, over its margin, and let the "
            "connector hang from it."
        )
    yield (
        f"Lead the four wires together: {_way_text(design)}. Glue the cable-tie mount {ground} there, "
        f"{in_mm(way.tie_length)} along the cable from the rim. Lay the wires flat, leave a loop of 20 mm so that no "
        f"pull reaches a tab, and tie them down. Crimp the connector {in_mm(way.connector_length)} from the rim: pin 1 "
        "A (red), pin 2 B (black), pin 3 C (yellow), pin 4 D (green). *Check:* pull each wire as hard as 3 N behind "
        "the tie: nothing moves before it; and move the joint of the arm through its whole range by hand (freedrive): "
        "nothing is pinched or stretched."
    )


def _way_text(design: SheetDesign) -> str:
    """Return where the cable leaves a sheet, and where its tie and its connector lie, as a ruler finds them."""
    way, side = design.way, design.place.frustum
    if way.side.startswith("edge"):
        where = f"{in_mm(way.u)} from end 1"
    else:
        arc, around = way.phi * side.radius_at(way.u), 2.0 * math.pi * side.radius_at(way.u)
        back = arc > 0.5 * around
        way_on = "against" if back else "in"
        where = f"{in_mm(around - arc if back else arc)} from edge 0, {way_on} the direction of the wrap"
    parts = [f"they leave {side_name(way.side)} {where}"]
    for what, index in (("tie", way.tie), ("connector", -1)):
        u, phi = way.surface[index]
        end = "end 1" if abs(u) < abs(u - side.slant) else "end 2"
        off = -u if end == "end 1" else u - side.slant
        turn = math.remainder(phi - way.phi, 2.0 * math.pi) * side.radius_at(min(max(u, 0.0), side.slant))
        beyond = f"{in_mm(off)} beyond {end}" if off >= 0.0 else f"{in_mm(-off)} inwards of the line of {end}"
        aside = f", {in_mm(abs(turn))} {'on' if turn > 0.0 else 'back'} around" if abs(turn) > 2e-3 else ""
        parts.append(f"the {what} lies {beyond}{aside}")
    return "; ".join(parts)


def _test_steps(figures: BuildFigures, folder: str) -> Iterator[str]:
    """Yield the steps that test the sheet that is built."""
    sensor = "sensor.toml" if folder == "." else f"{folder}/sensor.toml"
    ab, cd = figures.pairs
    yield (
        f"Measure at the connector: pins 1-2 {_in_ohms(ab.ohms)}, pins 3-4 {_in_ohms(cd.ohms)}; pins 1-3 above 10 Mohm "
        "while nothing touches the sensor, and far less while a thumb presses its middle; again above 10 Mohm once it "
        "is lifted."
    )
    yield (
        f"Write the measured sheets into `{sensor}`: `upper_sheet_ohm` = reading 1-2 divided by "
        f"{ab.squares:.4f}, `lower_sheet_ohm` = reading 3-4 divided by {cd.squares:.4f}. *Check:* a sheet of exactly "
        f"{ab.sheet_ohms:g} and {cd.sheet_ohms:g} ohm per square gives {ab.ohms / ab.squares:.4g} and "
        f"{cd.ohms / cd.squares:.4g}, less than its own, for what lies beside the active area conducts too; yours "
        f"differ from these as the strips did, and by {SPREAD:.0%} at most."
    )
    yield (
        "Plug it into the board (`coneskin firmware` writes sketch, wiring and parts) and run `coneskin monitor "
        "PORT`: the "
        "untouched frame must read as in the table below, within 3 % once the measured sheets are in the sensor file."
    )
    yield (
        "Write the scene (`coneskin init`), and let `coneskin commission` read where a person touches the marks that "
        "it asks for: it finds a turned, mirrored or exchanged sheet. Until then the arm only stops at a touch, and "
        "does not retreat."
    )


def _reading_lines(figures: BuildFigures) -> Iterator[str]:
    """Yield the tables of what a multimeter and ``coneskin monitor`` should read."""
    yield from table_head("between", "multimeter", "for a material of")
    for pair in figures.pairs:
        yield f"| {pair.pair} | {_in_ohms(pair.ohms)} | {pair.sheet_ohms:g} ohm per square |"
    yield "| A or B to C or D | above 10 Mohm, untouched | |"
    yield ""
    yield "Untouched frame, in counts, as `coneskin monitor` shows it with the sensor file of this design:"
    yield ""
    yield from table_head("phase", *figures.frame)
    yield "| counts | " + " | ".join(str(count) for count in figures.frame.values()) + " |"
    ab, cd = figures.pairs
    radial, angular = ab.ohms / (ab.squares * ab.sheet_ohms), cd.ohms / (cd.squares * cd.sheet_ohms)
    yield ""
    yield (
        "The model of the sensor ends at its electrodes, the sheets do not: until the measured sheets are in the file, "
        f"radial_current reads {1.0 / radial:.0%} and angular_current {1.0 / angular:.0%} of these."
    )


def _jig_lines(design: SheetDesign, figures: BuildFigures, folder: str) -> Iterator[str]:
    """Yield the section about the collars; ``folder`` as in ``guide_lines``."""
    plan, wires = design.options.jig, design.layout.plan.wires
    if plan.surface == "none":
        yield "No jig was asked for (`jig.surface` is none)."
        return
    if figures.collars:
        yield (
            f"Print the parts as they stand in their files (millimetres), with support under the step: PLA or PETG, "
            f"layers of 0.2 mm, walls of {in_mm(plan.wall)} solid. A part has as many grooves on its outside as its "
            "number says; part 1 begins at edge 0, the others follow anticlockwise as seen from end 2. The step inside "
            "lies against the end of the sheet, the longer zone with the flat seat over the sheet, the lip on the "
            f"link; the gap to both is {in_mm(plan.clearance)} (`jig.clearance_mm`)."
        )
        yield ""
        yield from table_head("file", "for", "printed size [mm]", "volume")
        place = "jig/" if folder == "." else f"{folder}/jig/"
        for collar in figures.collars:
            for part in collar.parts:
                size = " x ".join(f"{1e3 * length:.0f}" for length in part.surface.extents)
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
    steps = [*_flat_steps(design, figures), *_wrap_steps(design, figures), *_cable_steps(design)]
    steps += _test_steps(figures, folder)
    yield ""
    yield from (f"{number}. {step}" for number, step in enumerate(steps, 1))
    yield from section_head(f"Place of {design.name} on the link")
    yield from placement_lines(design, figures)
    yield from section_head(f"Jig of {design.name}")
    yield from _jig_lines(design, figures, folder)
    yield from section_head(f"Wires of {design.name}")
    yield from table_head("pin", "electrode", "wire", "tab at u", "tab at phi", "cut to")
    for wire in figures.wires:
        yield (
            f"| {wire.pin} | {wire.electrode} | {WIRE_COLOURS[wire.electrode]} | {in_mm(wire.u)} | "
            f"{math.degrees(wire.phi):.2f} deg | {1e3 * wire.length:.0f} mm |"
        )
    yield from section_head(f"Readings of {design.name} that is built")
    yield from _reading_lines(figures)
    yield from section_head(f"Coordinates of {design.name}")
    yield (
        "u runs along the slant from end 1, phi around from edge 0. x and y are those of the drawing seen from "
        "outside; "
        "where the inside is up, x changes its sign. `design.json` has every corner of every electrode."
    )
    yield ""
    yield from table_head("what", "u [mm]", "phi [deg]")
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
