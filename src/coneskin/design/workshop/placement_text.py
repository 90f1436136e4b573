"""Section of the build guide that says where a sheet belongs on its link."""

from __future__ import annotations

import math
from collections.abc import Iterator

from coneskin.design.sheets import SheetDesign

from .build_figures import BuildFigures
from .guide_words import in_mm

__all__ = ["placement_lines"]


def placement_lines(design: SheetDesign, figures: BuildFigures) -> Iterator[str]:
    """Yield the distances by which a sheet is placed."""
    place, side = figures.placement, design.place.frustum
    if design.above:
        yield from _strip_placement(design)
        return
    far = design.place.link_frustum.rotate((0.0, 0.0, 1.0))
    ahead = ", ".join(f"{value:z.3f}" for value in far)
    yield (
        f"End 1 is where the axis of the sheet begins, and end 2 lies from there along ({ahead}) of the frame above; "
        "the picture of the link shows both. Anticlockwise, the direction of the wrap, is as seen from end 2."
    )
    yield ""
    yield "| from | to | distance |"
    yield "|---|---|---|"
    if place.before is not None and place.beyond is not None:
        yield (
            "| outermost face of the link on the side of end 1, square to the axis | line of end 1 | "
            f"{in_mm(place.before)} along the axis |"
        )
        yield f"| line of end 2 | outermost face of the link on its side | {in_mm(place.beyond)} along the axis |"
    else:
        yield "| the face of your link that you measured its height from | line of end 1 | 0 mm: choose it |"
    yield f"| line of end 1 | line of end 2 | {in_mm(side.slant)} along the surface |"
    word = "once around the link" if side.wrap > 6.28 else "edge 0, around the link, to the other edge"
    yield f"| {word} | at end 1 | {in_mm(place.around1)} by tape measure |"
    yield f"| {word} | at end 2 | {in_mm(place.around2)} by tape measure |"
    if place.feature is not None:
        part = place.feature
        yield (
            f"| line of edge 0 | middle of the part of the link that stands out furthest, {in_mm(part.radius)} from "
            f"the axis | {in_mm(part.arc)} around end {part.end}, in the direction of the wrap "
            f"({math.degrees(part.azimuth):.1f} "
            "deg) |"
        )
    yield ""
    x, y, z = (f"{value:z.3f}" for value in place.seam)
    yield f"Edge 0 faces the direction ({x}, {y}, {z}) of the frame above. Around end 1, from edge 0:"
    yield ""
    yield "| to where the frame's axis points | around end 1, in the direction of the wrap |"
    yield "|---|---|"
    for name, turn in _axes_around(design):
        yield f"| {name} | {in_mm(turn * side.radius1)} ({math.degrees(turn):.1f} deg) |"
    yield ""
    keyed = any(collar.keyed for collar in figures.collars)
    if place.before is None:
        yield (
            "There is no mesh, so the link shows no datum: choose where end 1 and edge 0 lie, draw them, and write "
            "where they are in the frame of your arm's link into `xyz_mm` and `rpy_deg` of the sensor file: x of the "
            "sheet points at edge 0, z from end 1 to end 2."
        )
    elif place.feature is None and not keyed:
        yield (
            "Nothing stands out from the link by which edge 0 could be found. Any one will do: choose it, and if it "
            "does not face as above, design again with `--seam X Y Z`, the direction in which yours faces. To find a "
            "direction on the link, hold the picture of the link beside it: it shows the axes of the frame."
        )
    elif keyed:
        yield "The lip of a collar keeps clear of what stands out from the link: it fits in one position only."
    yield (
        "`coneskin commission` shows whether it is right: a sheet that is turned by 10 mm or more reads its marks at "
        "other places than it has them."
    )


def _axes_around(design: SheetDesign) -> Iterator[tuple[str, float]]:
    """Yield the axes of the link's frame that point away from the axis of a sheet, with their azimuths [rad]."""
    back = design.place.link_frustum.inverse()
    for name, axis in (("x", (1.0, 0.0, 0.0)), ("y", (0.0, 1.0, 0.0)), ("z", (0.0, 0.0, 1.0))):
        across, up, _ = back.rotate(axis)
        if math.hypot(across, up) > 0.5:
            yield f"+{name}", round(math.atan2(up, across), 9) % (2.0 * math.pi)


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
    yield f"| edge 0 of the strip | its other edge | {in_mm(2.0 * half1)} at end 1, {in_mm(2.0 * half2)} at end 2 |"
    yield (
        f"| seam of {design.above} | edge 0 of the strip, against the direction of the wrap | "
        f"{in_mm(seam * side.radius1)} at end 1, {in_mm(seam * side.radius2)} at end 2 |"
    )
    yield f"| seam of {design.above} | middle of the strip | {in_mm((middle - seam) * side.radius1)} at end 1 |"
