"""Build guide: the steps that every sheet takes, once, and the pages of each sheet with what is its own.

First the steps on the bench, then those on the link, the cable, and the tests of the finished sheet. A word in italics
in a step is a row of the sheet's own table.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from coneskin.design.sheets.sheet_design import SheetDesign
from coneskin.geometry.drawing.cut_sheet import TEST_HOLE, TEST_SQUARE
from coneskin.geometry.drawing.touch_marks import marks_on_link

from .build_figures import (
    ADHESIVE,
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

_FLAT_AND_WRAPPED = {
    "loose": "On the bench you make part 3 and part 5 of every sheet, with foils and wires. On the link you wrap one "
    "part after another",
    "pairs": "On the bench you make two pairs of every sheet: parts 1 and 3, and parts 5 and 7, with foils and wires. "
    "On the link you wrap one pair, the isolation, and the other pair",
    "bonded": "On the bench you make every sheet whole, with foils and wires. On the link you wrap it; check the "
    "strains of its layers first",
}


def _flat_steps(designs: Sequence[SheetDesign]) -> Iterator[str]:
    """Yield the steps that are done while everything is flat."""
    first = designs[0]
    cuts, kerf, tab = first.cuts, 1e3 * first.options.kerf, first.layout.plan.tab
    yield (
        "Test each material before any part is cut. The test piece (`cut/0-test-piece`, and on each first bed) is a "
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
    yield (
        "Measure the *conductive sheet* before it is cut: a strip of 20 x 120 mm, copper tape with conductive adhesive "
        "over 10 mm at both ends. *Check:* the multimeter's reading divided by 5 is its resistance per square, within "
        f"{SPREAD:.0%} of the table's. Otherwise design again with `--set electronics.lower_sheet_ohm=OHM` and `--set "
        "electronics.upper_sheet_ohm=OHM`: the electronics then match what you have. Which face conducts? "
        "Printed and coated films conduct on one face only: try both with the probes. It must be the face that the "
        "labels call up (part 3 its outside, part 5 its inside): it carries the foils, and the two face each other "
        "through the isolation."
    )
    yield (
        "Cut the seven parts: red lines and magenta holes are cut, blue ones are marks, green ones are folds, black is "
        "text for pen or printer. Print PDF files at 100 %: the bar on each page must measure 100 mm. *Check* *part 1* "
        "with a steel rule; the other parts by the picture of the parts, within 0.5 mm. Write sheet and number on "
        "every part that came without letters: the parts of two sheets may look alike."
    )
    yield f"Lay part 3 on the bench, {cuts[2].face} up. Its blue lines show the places of C and D (part 2)."
    yield (
        f"Lay foils C and D on them, {cuts[1].face} up, the conductive adhesive towards part 3, and roll them down. C "
        "belongs to the edge labelled (C), D to edge 0. A foil is one piece with its lead and its tab, so these lie "
        f"where they belong. The *tabs* stand out beyond the rim. Rolling, here and below: {ROLLING} "
        "*Check:* no bubble, no wrinkle, and no corner that lifts when the sheet is bent to the radius of the link."
    )
    yield (
        f"Lay part 5 on the bench, {cuts[4].face} up. Lay foils A and B (part 6) on its blue lines, {cuts[5].face} up, "
        "the conductive adhesive towards part 5, and roll them down: B along end 1, A along end 2. *Check* as before."
    )
    yield (
        "Cover the bare faces of all four foils, leads included, with polyimide tape, slit to stand 1 mm over the foil "
        "on each side: they will face the other conductive sheet. The *lead* lies where its sheet is cut away: cover "
        "its adhesive too. Only the tabs stay bare. *Check:* a probe slid along the tape finds no contact with the "
        "foil below."
    )
    yield (
        "Measure with a multimeter, a probe on each tab: *A-B* and *C-D*, each within "
        f"{SPREAD:.0%}. More: a foil does not touch its sheet over its whole length; roll it again. *Check:* "
        "the reading stays within 5 % while a finger moves along each foil."
    )
    yield (
        f"Wires to the tabs, in the colours and lengths of the sheet's table: strip {in_mm(STRIPPED)} of each wire, "
        f"lay the strands along the outer half of the tab, fold that half ({in_mm(0.5 * tab)}) over them, wrap copper "
        "tape with conductive adhesive around it, press it flat with pliers, and shrink a tube over it (heat gun at "
        "its lowest setting, a metal ruler under the tab). *Check:* below 1 ohm from the free end of the wire to the "
        "foil, also while you pull the wire as hard as a full cup hangs on it (3 N). "
        "Until the cable tie is there, masking tape holds the wires to the part, so that nothing pulls at a tab."
        if tab
        else "This design has no tabs: lay the strands of each wire flat on its foil at the rim, and copper tape with "
        "conductive adhesive over them. *Check:* below 1 ohm from the free end of the wire to the foil."
    )
    crosses = "Its nine numbered crosses are the marks that `coneskin calibrate` asks for. "
    if cuts[6].face == "inside":
        crosses = (
            "Prick the centres of the nine crosses of part 7 (inside up) through with a needle, and write their "
            "numbers on the outside: `coneskin calibrate` asks for them. Write sheet, ends and joints there too. "
        )
    yield (
        f"Part 7 is the face that you see on the link. {crosses}*Check:* on the outside, end 1 down, numbers 1, 2, 3 "
        "run along end 1 from edge 0 at the left, 4 to 6 come back above them, and 7 to 9 go on along end 2."
    )


def _wrap_steps(designs: Sequence[SheetDesign], collars: bool) -> Iterator[str]:
    """Yield the steps from the clean link to the sheet that holds on it."""
    stack, options = designs[0].options.stack, designs[0].options
    marks = "the blue outline on part 1"
    yield (
        "Clean *what it lies on* with isopropanol and a cloth that leaves no lint, and let it dry for a minute. Draw "
        "lines on it with a soft pencil, by the sheet's *Place* below: where its ends lie, around it, and where edge 0 "
        f"{'(of a strip: the seam below) ' if any(design.above for design in designs) else ''}lies, along it. "
        "*Check:* the sizes around the link there, by tape measure, within 1 mm for each 100 mm. If they differ, this "
        "is another link than the design's: stop here."
    )
    if collars:
        yield (
            "Fit the printed *collars* on the bare link, without tape, and strap them. *Check:* no part rocks, the "
            "slots between the parts are open all along, and the pencil line of its end is at the step of each collar, "
            "within 1 mm. Draw edge 0 now where *Place* takes it from a collar. Then take them off again."
        )
    holes = any(design.layout.holes for design in designs)
    pins = (
        " Before that, put the flat-headed *pins* into its holes from the inside, their heads flush in the foam; "
        "every further part is pushed over them. The corner at the tabs has no hole: a mirrored part does not fit."
        if holes
        else ""
    )
    if not all(design.layout.holes for design in designs):
        pins += (
            " Nothing but your eye stops a mirrored part of a sheet without *pins*: lay each part dry on the one "
            "before it. *Check:* sides of one name lie over each other, and it wears the face up that its letters say."
        )
    seen = "anticlockwise as seen when you look from end 2 towards end 1"
    strips = f"strips of {TAPE} 3 mm wide on both of its faces, along its rim"
    isolation = (
        f"Wrap part 4, outside up, its rim flush with part 1's. Fix it with {strips}, also over covered foils, but "
        "never on the active area, where adhesive would glue the conductive sheets apart."
    )
    if stack.assembly == "loose":
        yield (
            f"Wrap part 1, outside up (labels towards you), on {TAPE}, here and below edge to edge under the whole "
            f"part: end 1 and edge 0 on the pencil lines, {seen}.{pins}"
        )
        yield f"Wrap part 3, inside towards the link, on {TAPE}, within {marks}; its foils face you."
        yield isolation
        yield "Wrap part 5, its foils towards the isolation, fixed by the same strips."
        yield f"Wrap part 7, inside towards the link, on {TAPE} to the outside of part 5, its rim flush with part 4's."
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
    closing = options.seam_gap * 1e3
    if any(design.has_seam for design in designs):
        yield (
            f"The *seam*: the edges of every part meet{f' up to {closing:g} mm' if closing else ''}. Each layer of "
            "tape under a part opens it more; that is meant to be so."
        )
    yield (
        "*Check* after each wrapped part: both edges are straight, the rim (of parts 3 and 5 their outline) stands "
        "within 0.5 mm of its line all around, and there is no fold; a part is peeled off and laid again within a "
        "minute, later it tears. After part 5, measure again from wire to wire: A-B and C-D as before, and A to C "
        "above 10 Mohm. Roll part 1, and the margins of part 7, as above; on the isolation and above the active area "
        "only smooth by hand, for the roller would press the two conductive sheets together."
    )
    if options.overlap:
        yield f"Fold the flap of part 7, {in_mm(options.overlap)} wide, over edge 0 and fix it with {TAPE}."
    if holes:
        yield "Cut the pins flush. Use no metal: it would short-circuit the two conductive sheets."
    put = (
        "Put the *collars* on again: push the sheet against the step, its seam in the middle of the slot between the "
        "parts (two edges apart: flush with the outer sides of the parts), and strap the parts with hook-and-loop tape "
        "around the link, on their flat seats. An end without a collar: wind masking tape around it."
    )
    yield f"{put if collars else 'Wind masking tape around both rims.'} {SETTING} Take all off."


def _cable_steps(tab: float) -> Iterator[str]:
    """Yield the steps from the tabs to the connector."""
    if tab:
        yield "Fold the *tabs* outwards along the green lines, away from the link."
    yield (
        "Once every sheet and collar is on, lead the four wires together by the *cable*'s way. Glue the cable-tie "
        "mount at its place. Lay the wires flat, leave a loop of 20 mm so that no pull reaches a tab, and tie them "
        "down. Crimp the connector: pin 1 A (red), pin 2 B (black), pin 3 C (yellow), pin 4 D (green). Write the "
        "sensor's number on both halves of the connector. *Check:* pull each wire as hard as 3 N behind the tie: "
        "nothing moves before it; and move the joint of the arm through its whole range by hand (freedrive): nothing "
        "is pinched or stretched."
    )


def _test_steps(several: bool) -> Iterator[str]:
    """Yield the steps that test the sheet that is built."""
    yield (
        "Measure at the connector: pins 1-2 as *A-B*, pins 3-4 as *C-D*; pins 1-3 above 10 Mohm "
        "while nothing touches the sensor, and far less while a thumb presses its middle; again above 10 Mohm once it "
        "is lifted."
    )
    yield (
        "Write the measured sheets into the sheet's `sensor.toml`: *upper_sheet_ohm* and *lower_sheet_ohm*. *Check:* "
        "yours differ from the table's as the strips did, and by "
        f"{SPREAD:.0%} at most. They are less than a sheet's own, for what lies beside the active area conducts too."
    )
    yield (
        "Plug it into the board (`coneskin firmware` writes sketch, wiring, parts, and the steps in board.md) and "
        "run `coneskin monitor PORT --baud RATE`, both as board.md has them: the untouched frame must read as board.md "
        "says, or with a board of your own as in the sheet's table, within 3 % once the measured sheets are in the "
        "sensor file."
    )
    if several:
        yield (
            "Sheets of one shape have the same ohms, so exchanged plugs show in the touch alone: press each sheet in "
            "turn. *Check:* the monitor shows the touch at its *sensor number*, and at no other."
        )
    yield (
        "Write the scene: on a UR arm `coneskin init FOLDER --arm MODEL --host ADDRESS --port PORT`, on any other "
        "maker's `coneskin init FOLDER --skin-only --port PORT`, which reports touches to your program (a package "
        "guards such an arm: docs/extend/arm.md). Then let `coneskin commission` read where a person touches the "
        "marks that it asks for: it finds a turned, mirrored or exchanged sheet. Until then the arm only stops at a "
        "touch, and does not retreat."
    )


def common_lines(designs: Sequence[SheetDesign], figures: Sequence[BuildFigures]) -> Iterator[str]:
    """Yield the steps that all sheets of a design take, as Markdown.

    Args:
        designs: the sheets.
        figures: for building each of them.
    """
    yield "## Building a sheet"
    yield ""
    order = "" if len(designs) == 1 else ", sheet after sheet in the order of their numbers"
    yield (
        f"{_FLAT_AND_WRAPPED[designs[0].options.stack.assembly]}{order}. A word in *italics* is a row of the sheet's "
        "own table. Wherever a step says *outside up* or *inside up*, that face of the sensor looks at you: the inside "
        "faces the link later. Every part carries the names of link and sheet and the face that is up, as far as it "
        "has room; a foil its letter, any other part its number, name, material and the names of its four sides. End 1 "
        "is where B is, end 2 where A is, edge 0 where D is, the other edge where C is. Where two sheets meet, both "
        "ends carry the number of their joint."
    )
    collars = any(item.collars for item in figures)
    if collars:
        plan = designs[0].options.jig
        yield ""
        yield (
            f"Print the collars as they stand in their files (millimetres), with support under the step: PLA or PETG, "
            f"layers of 0.2 mm, walls of {in_mm(plan.wall)} solid. A part has as many grooves on its outside as its "
            "number says; part 1 begins at edge 0, the others follow anticlockwise as seen from end 2. The step inside "
            "lies against the end of the sheet, the longer zone with the flat seat over the sheet, the lip on the "
            f"link; the gap to both is {in_mm(plan.clearance)} (`jig.clearance_mm`)."
        )
    count = 0
    for title, steps in (
        ("On the bench", _flat_steps(designs)),
        ("On the link", _wrap_steps(designs, collars)),
        ("The cable", _cable_steps(designs[0].layout.plan.tab)),
        ("Tests", _test_steps(len(designs) > 1)),
    ):
        yield from section_head(title)
        for step in steps:
            count += 1
            yield f"{count}. {step}"


def _in_ohms(ohms: float) -> str:
    """Return a resistance with its unit."""
    return f"{ohms / 1e3:.3g} kohm" if ohms >= 1e3 else f"{ohms:.3g} ohm"


def _way_text(design: SheetDesign) -> str:
    """Return where the cable leaves a sheet, and where its tie and its connector lie, as a ruler finds them."""
    way, side = design.way, design.place.frustum

    def beyond(u: float) -> str:
        """Return where a place lies along the sheet, from the end nearer to it."""
        end, off = ("end 1", -u) if u < 0.5 * side.slant else ("end 2", u - side.slant)
        return f"{in_mm(off)} beyond {end}" if off >= 0.0 else f"{in_mm(-off)} inwards of the line of {end}"

    if way.side.startswith("edge"):
        where = beyond(way.u)
    else:
        arc, around = way.phi * side.radius_at(way.u), 2.0 * math.pi * side.radius_at(way.u)
        back = arc > 0.5 * around
        way_on = "against" if back else "in"
        where = f"{in_mm(around - arc if back else arc)} from edge 0, {way_on} the direction of the wrap"
    parts = [f"from {side_name(way.side)}, {where}"]
    for what, index, length in (("tie", way.tie, way.tie_length), ("connector", -1, way.connector_length)):
        u, phi = way.surface[index]
        turn = math.remainder(phi - way.phi, 2.0 * math.pi) * side.radius_at(min(max(u, 0.0), side.slant))
        aside = f", {in_mm(abs(turn))} {'on' if turn > 0.0 else 'back'} around" if abs(turn) > 2e-3 else ""
        parts.append(f"the {what} lies {beyond(u)}{aside}, {in_mm(length)} along the cable")
    if way.on_sheet:
        parts.append("all of it on part 7, over the seam, where no touch is located")
    if way.hangs:
        parts.append(
            "the link ends before that: tie and connector lie on what is bolted to the link there and moves with it, "
            "such as a flange or a cover; never on the far side of a joint. If nothing does, glue the mount on part 7, "
            "over its margin, and let the connector hang from it"
        )
    return "; ".join(parts)


def _tabs_text(design: SheetDesign, figures: BuildFigures) -> str:
    """Return where the tabs of a sheet lie, and its wires beside them."""
    side, slope = design.layout.plan.wires, design.apron.slope
    if design.way.on_sheet:
        return f"{side_name(side)}: they stand up between the two edges of the seam; lay their wires on part 7 along it"
    where = f"over {side_name(side)}"
    if side.startswith("edge"):
        where += "; lead the wires out on the bare link beside that edge"
    else:
        rim = figures.placement.before if side == "end1" else figures.placement.beyond
        if rim is not None and rim < design.layout.plan.tab and not design.way.hangs:
            where += (
                f"; only {in_mm(max(rim, 0.0))} of the link lie beyond its line: fold the tabs up as soon as their "
                "wires are on, and lay no wire beyond the rim of the link"
            )
        bare = 0.5 * (design.place.frustum.wrap + math.tau)  # middle of the side without a sheet
        at = (design.way.phi - bare) % math.tau
        around = [w.electrode for w in figures.wires if abs((w.phi - bare) % math.tau - at) > math.pi]
        if around and not design.has_seam:
            where += (
                f"; led around the bare side of the link, taped to it in line with {side_name(side)}: the wire of "
                f"{' and of '.join(around)}"
            )
    if slope:
        rise = math.degrees(math.atan(slope))
        where += f"; the link stands out there: bend the tabs up by {rise:.0f} deg, so that none lies on it"
    return where


def _own_rows(design: SheetDesign, figures: BuildFigures, folder: str, number: int) -> Iterator[tuple[str, str]]:
    """Yield the figures of a sheet that the steps name."""
    plan, side = design.layout.plan, design.place.frustum
    place = "" if folder == "." else f"{folder}/"
    upper, lower = design.conductive
    yield "files", f"`{place}cut/`, `{place}sensor.toml`"
    yield "sensor number", f"{number}"
    yield "conductive sheet", f"{lower.ohms:g} ohm per square (part 3), {upper.ohms:g} ohm per square (part 5)"
    one = design.cuts[0].surface
    chord = in_mm(math.dist(*(one.flat_point(0.0, half * one.wrap) for half in (-0.5, 0.5))))
    yield (
        "part 1",
        f"{in_mm(one.slant)} from end 1 to end 2 along an edge, {chord} straight between the corners of end 1",
    )
    yield "tabs", _tabs_text(design, figures)
    yield "lead", f"of {plan.led_across}"
    for pair in figures.pairs:
        yield pair.pair, f"{_in_ohms(pair.ohms)} for {pair.sheet_ohms:g} ohm per square"
    yield "what it lies on", f"the outside of {design.above}" if design.above else "the link"
    for end, met in design.joints.items():
        yield end, " and ".join(f"joint {joint}: meets {other}" for joint, other in met.items())
    if design.layout.holes:
        yield "pins", f"{len(design.layout.holes)} of {in_mm(plan.hole)} less 0.1 mm"
    if figures.collars:
        yield "collars", " and ".join(f"end {collar.end}" for collar in figures.collars)
    if design.has_seam:
        gap = side.wrap * side.cos_half_angle * ADHESIVE
        yield "seam", f"opens by {in_mm(gap)} for each layer of tape, at most {in_mm(5.0 * gap)} at part 7"
    yield "cable", _way_text(design)
    for name, pins, pair in zip(("upper_sheet_ohm", "lower_sheet_ohm"), ("1-2", "3-4"), figures.pairs, strict=True):
        yield name, f"reading {pins} divided by {pair.squares:.4f}, nominally {pair.ohms / pair.squares:.4g}"


def _jig_lines(design: SheetDesign, figures: BuildFigures, folder: str) -> Iterator[str]:
    """Yield the section about the collars; ``folder`` as in ``sheet_lines``."""
    plan, wires = design.options.jig, design.layout.plan.wires
    if plan.surface == "none":
        yield "No jig was asked for (`jig.surface` is none)."
        return
    if figures.collars:
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


def sheet_lines(
    design: SheetDesign, figures: BuildFigures, folder: str, number: int = 0, pictures: Sequence[str] = ()
) -> Iterator[str]:
    """Yield the pages of one sheet as Markdown.

    Args:
        design: the sheet.
        figures: for building it.
        folder: of its files, as a path in the folder of the design; "." for that folder itself.
        number: of its sensor in the wire format.
        pictures: lines that show them.
    """
    yield f"## {design.name.capitalize()}"
    yield from pictures
    yield from section_head(f"Figures of {design.name}")
    yield from table_head("row", "value")
    yield from (f"| {name} | {value} |" for name, value in _own_rows(design, figures, folder, number))
    yield ""
    yield from table_head("pin", "electrode", "wire", "tab at u", "tab at phi", "cut to")
    for wire in figures.wires:
        yield (
            f"| {wire.pin} | {wire.electrode} | {WIRE_COLOURS[wire.electrode]} | {in_mm(wire.u)} | "
            f"{math.degrees(wire.phi):.2f} deg | {1e3 * wire.length:.0f} mm |"
        )
    yield ""
    ab, cd = figures.pairs
    radial, angular = (pair.ohms / (pair.squares * pair.sheet_ohms) for pair in (ab, cd))
    counts = ", ".join(f"{name} {count}" for name, count in figures.frame.items() if count)
    yield (
        f"Untouched frame, in counts, of a board with the electronics of the sensor file: {counts}, all others 0. "
        "Other boards count otherwise: see board.md. The model of the sensor ends at "
        "its electrodes, the sheets do not: until the measured sheets are in the file, radial_current reads "
        f"{1.0 / radial:.0%} and angular_current {1.0 / angular:.0%} of these."
    )
    yield from section_head(f"Place of {design.name} on the link")
    yield from placement_lines(design, figures)
    yield from section_head(f"Jig of {design.name}")
    yield from _jig_lines(design, figures, folder)
    yield from section_head(f"Marks to touch on {design.name}")
    yield "u runs along the slant from end 1, phi around from edge 0. `design.json` has holes and electrodes, too."
    yield ""
    yield from table_head("mark", "u [mm]", "phi [deg]")
    for mark, (u, phi) in enumerate(marks_on_link(design.layout, design.options.stack, design.place), 1):
        yield f"| mark {mark} to touch | {1e3 * u:.2f} | {math.degrees(phi):.3f} |"
