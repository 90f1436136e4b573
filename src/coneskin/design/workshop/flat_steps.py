"""Steps of the build guide on the bench: cut, foils, insulation, wires."""

from __future__ import annotations

import math
from collections.abc import Iterator

from coneskin.design.sheets.sheet_design import SheetDesign
from coneskin.geometry.drawing.cut_sheet import CutSheet
from coneskin.geometry.drawing.test_piece import TEST_HOLE, TEST_SQUARE

from .build_figures import BuildFigures
from .guide_words import ROLLING, SPREAD, in_mm, in_ohms, side_name
from .wiring import STRIPPED

__all__ = ["flat_steps"]


def flat_steps(design: SheetDesign, figures: BuildFigures) -> Iterator[str]:
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
        "more than 0.2 mm, design again with `--kerf-mm`. A scalpel has 0."
    )
    ohms = " and ".join(f"{sheet.ohms:g}" for sheet in dict.fromkeys(reversed(design.conductive)))
    yield (
        "Measure the conductive sheet before it is cut: a strip of 20 x 120 mm, copper tape with conductive adhesive "
        "over 10 mm at both ends. *Check:* the multimeter's reading divided by 5 is its resistance per square; this "
        f"design wants {ohms} ohm per square (lower, upper), within {SPREAD:.0%}. Otherwise design again with "
        "`--lower-sheet-ohm` and `--upper-sheet-ohm`: the electronics then match what you have. Which face conducts? "
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
        f"Measure with a multimeter, a probe on each tab: A-B {in_ohms(ab.ohms)}, C-D {in_ohms(cd.ohms)}, each within "
        f"{SPREAD:.0%}. More: a foil does not touch its sheet over its whole length; roll it again. *Check:* the "
        "reading stays within 5 % while a finger moves along each foil."
    )
    yield (
        f"Wires to the tabs, in the colours and lengths of the table below: strip {in_mm(STRIPPED)} of each wire, lay "
        f"the courses along the outer half of the tab, fold that half ({in_mm(0.5 * plan.tab)}) over them, wrap copper "
        "tape with conductive adhesive around it, press it flat with pliers, and shrink a tube over it (heat gun at "
        "its lowest setting, a metal ruler under "
        "the tab). *Check:* below 1 ohm from the free end of the wire to the foil, also while you pull the wire "
        "as hard as a full cup hangs on it (3 N). "
        "Until the cable tie is there, masking tape holds the wires to the part, so that nothing pulls at a tab."
        if plan.tab
        else "This sheet has no tabs: lay the courses of each wire (table below) flat on its foil at the rim, and "
        "copper tape with conductive adhesive over them. *Check:* below 1 ohm from the free end of the wire to the "
        "foil."
    )
    yield (
        f"Prick the centres of the nine crosses of part 7 ({cuts[6].face} up) through with a needle, and write their "
        "numbers on the outside: `coneskin calibrate` asks for them. *Check:* on the outside, "
        "end 1 down, numbers 1, 2, 3 run along end 1 from edge 0 at the left, 4 to 6 come back above them, and 7 to 9 "
        "go on along end 2; the table of coordinates below has their places."
    )


def _ends(cut: CutSheet) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the two corners of end 1 of the flat pattern [m]."""
    surface = cut.surface
    return surface.flat_point(0.0, -0.5 * surface.wrap), surface.flat_point(0.0, 0.5 * surface.wrap)
