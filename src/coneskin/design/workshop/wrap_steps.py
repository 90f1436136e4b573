"""Steps of the build guide on the link: clean, wrap, close the seam."""

from __future__ import annotations

from collections.abc import Iterator

from coneskin.design.sheets.sheet_design import SheetDesign

from .bill_of_materials import ADHESIVE
from .build_figures import BuildFigures
from .guide_words import SETTING, TAPE, in_mm

__all__ = ["wrap_steps"]


def wrap_steps(design: SheetDesign, figures: BuildFigures) -> Iterator[str]:
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
