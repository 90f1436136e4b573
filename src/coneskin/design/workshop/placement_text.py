"""Section of the build guide that says where a sheet belongs on its link."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from coneskin.design.sheets.sheet_design import SheetDesign

from .build_figures import BuildFigures, in_mm, table_head
from .placement import LinkFeature, SheetPlacement, sharpest_bends

_AT_END = 3e-3  # m; a sheet so near to the end of a link is placed by eye
_MAX_RULER = 0.2  # m; a ruler through the air
_AROUND_END = "from edge 0, around end 1, in the direction of the wrap"


def placement_lines(design: SheetDesign, figures: BuildFigures) -> Iterator[str]:
    """Yield the distances by which a sheet is placed."""
    place, side = figures.placement, design.place.frustum
    if design.above:
        yield from _strip_placement(design)
        return
    far = design.place.link_frustum.rotate((0.0, 0.0, 1.0))
    ahead = ", ".join(f"{value:z.3f}" for value in far)
    yield (
        "The picture of the link shows the sheet from two sides, with its ends"
        f"{' and the flat faces of the link' if place.faces else ''}. End 2 lies from end 1 along ({ahead}) of the "
        "frame above. Anticlockwise, the direction of the wrap, is as seen from end 2."
    )
    yield ""
    yield from table_head("from", "to", "distance")
    if place.before is not None and place.beyond is not None:
        if not place.tilted or place.before < _AT_END:
            yield (
                "| outermost place of the link on the side of end 1: a plate held square to the axis touches it there "
                f"| line of end 1 | {in_mm(place.before)} along the axis |"
            )
        if not place.tilted or place.beyond < _AT_END:
            yield f"| line of end 2 | outermost place of the link on its side | {in_mm(place.beyond)} along the axis |"
    else:
        height = in_mm(design.place.link_frustum.translation[2])
        yield f"| where you choose z = 0 of the frame above, once for all sheets | line of end 1 | {height} along z |"
    yield f"| line of end 1 | line of end 2 | {in_mm(side.slant)} along the surface |"
    word = "once around the link" if side.wrap > 6.28 else "edge 0, around the link, to the other edge"
    yield f"| {word} | at end 1 | {in_mm(place.around1)} by tape measure |"
    yield f"| {word} | at end 2 | {in_mm(place.around2)} by tape measure |"
    if place.feature is not None and not place.around_fixed and (way := _feature_way(design, place.feature)):
        yield f"| line of edge 0 | {way} |"
    yield ""
    yield from _height_lines(design, place)
    yield from _facing(design, place)
    if place.before is not None and not place.heights and max(map(abs, far)) < 0.9998:  # a degree
        yield "**No face of the link shows this axis, which leans.** Lay part 1 dry, slide it until it lies close"
        yield "everywhere, at these distances, and draw its rim.\n"
    if place.before is None:
        pose = design.active.link_frustum
        yield (
            "There is no mesh, so the link shows no datum: choose where z = 0 and x of the frame lie, and draw them. "
            "The link has to go on as its side does, as far as collars and cable reach. In the sensor file, `xyz_mm` "
            "and `rpy_deg` place the active area in the frame of your arm's link. Its end 1 is at z = "
            f"{in_mm(pose.translation[2])}, and its x points {math.degrees(pose.rpy[2]):.1f} deg past edge 0, in the "
            "direction of the wrap. Its z runs from end 1 to end 2."
        )
    elif found := [(collar.play, collar.end) for collar in figures.collars if collar.play is not None]:
        play, end = min(found)
        yield (
            f"What stands out from the link holds the collar of end {end} within {math.degrees(play):.0f} deg: take "
            f"edge 0 from it{', and check it by the bold distances' if place.around_fixed else ''}."
        )
    elif place.around_fixed:
        yield "Edge 0 is where the bold distances say."
    elif design.place.bends:
        yield from _bend_lines(design)
    elif place.feature is None:
        yield (
            "Nothing stands out from the link by which edge 0 could be found. Any one will do: choose it, and if it "
            "does not face as above, design again with `--seam X Y Z`, the direction in which yours faces. To find a "
            "direction on the link, hold the picture of the link beside it: it shows the axes of the frame."
        )
    yield (
        "`coneskin commission` shows whether it is right: a sheet that is turned by 10 mm or more reads its marks at "
        "other places than it has them."
    )


def _feature_way(design: SheetDesign, part: LinkFeature) -> str:
    """Return the way from edge 0 to what stands out, around the sheet, or straight where that is not on the sheet.

    It is empty where that would be too far for a ruler.
    """
    side = design.place.frustum
    what = f"middle of the part of the link that stands out furthest, {in_mm(part.radius)} from the axis"
    if part.azimuth <= side.wrap:
        way = f"{in_mm(part.arc)} around end {part.end}, in the direction of the wrap"
    else:  # no tape follows the link there
        radius, height = (side.radius1, 0.0) if part.end == 1 else (side.radius2, side.height)
        x, y = part.radius * math.cos(part.azimuth), part.radius * math.sin(part.azimuth)
        straight = math.dist((x, y, part.height), (radius, 0.0, height))
        if straight > _MAX_RULER:
            return ""
        way = f"{in_mm(straight)} straight through the air, from edge 0 at end {part.end}"
    return f"{what} | {way} ({math.degrees(part.azimuth):.1f} deg)"


def _height_lines(design: SheetDesign, place: SheetPlacement) -> Iterator[str]:
    """Yield the distances of places of a sheet from the flat faces of the link."""
    if not place.heights:
        return
    side = design.place.frustum
    for face in place.faces:
        size = " x ".join(f"{1e3 * length:.0f}" for length in face.size) + " mm"
        yield f"* {face.name}: a flat face of the link, {size}, outlined in the picture of the link."
    yield ""
    bold = " Bold ones change most when the sheet is turned." if place.around_fixed else ""
    ends = "" if place.tilted else " Where the distances along the axis are easier to measure, take end 1 from those."
    yield (
        "Lay part 1 dry on the link, and slide it until these places of its inner face are as far from the faces, "
        "square to them; then draw along its end 1 and its edge 0. Measure with the face on a flat table, by a ruler "
        "that stands on it; on an arm that is assembled, from the gap beside the face, which shows its plane, or from "
        f"a straight bar that is held against it.{bold}{ends} *Check:* every distance within 1 mm."
    )
    yield ""
    yield from table_head("place of the sheet", *(f"from {face.name}" for face in place.faces))
    for row in place.heights:
        end = 1 if row.u < 0.5 * side.slant else 2
        arc = row.phi * side.radius_at(row.u)
        where = "edge 0" if row.phi == 0.0 else f"{in_mm(arc)} from edge 0, in the direction of the wrap"
        if row.phi == side.wrap:
            where = "the other edge"
        told = (f"**{in_mm(h)}**" if s else in_mm(h) for h, s in zip(row.heights, row.steep, strict=True))
        yield f"| end {end}, {where} | " + " | ".join(told) + " |"
    yield ""


def _facing(design: SheetDesign, place: SheetPlacement) -> Iterator[str]:
    """Yield where edge 0 faces, and which places of the sheet face along the axes of the link's frame."""
    x, y, z = (f"{value:z.3f}" for value in place.seam)
    yield f"Edge 0 faces the direction ({x}, {y}, {z}) of the frame above."
    yield ""
    facing = list(_axes_around(design))
    if not facing:
        return
    yield from table_head("place that faces along an axis of the frame", _AROUND_END)
    for name, phi in facing:
        yield f"| {name} | {in_mm(phi * design.place.frustum.radius1)} ({math.degrees(phi):.1f} deg) |"
    yield ""


def _bend_lines(design: SheetDesign) -> Iterator[str]:
    """Yield where a link that is not round is bent most, by which edge 0 is found."""
    yield (
        "The link is not round, so its bends show where edge 0 is. A strip of paper that is laid around the link and "
        "marked at these places must lie with each mark in the middle of its bend:"
        if (bends := sharpest_bends(design.place))
        else "No bend of this side can be felt: find edge 0 by the picture of the link, which shows the frame's axes."
    )
    yield ""
    if bends:
        yield from table_head("bend", "radius of the link there, at end 1", _AROUND_END)
    for number, (radius, arc) in enumerate(bends, 1):
        yield f"| {number} | {in_mm(radius)} | {in_mm(arc)} |"
    yield ""


def _axes_around(design: SheetDesign) -> Iterator[tuple[str, float]]:
    """Yield the axes of the link's frame along which a place of the sheet faces, with its azimuth [rad]."""
    wrap, back = design.place.frustum.wrap, design.place.link_frustum.inverse()
    phi = np.linspace(0.0, wrap, 3601)
    _, normals = design.place.place(0.0, phi)
    for name, axis in (("x", (1.0, 0.0, 0.0)), ("y", (0.0, 1.0, 0.0)), ("z", (0.0, 0.0, 1.0))):
        across, up, _ = back.rotate(axis)
        if math.hypot(across, up) < 0.5:
            continue
        for sign in (1.0, -1.0):
            if design.place.bends:
                facing = sign * (normals @ np.array(axis))
                found = float(np.median(phi[facing > facing.max() - 1e-9])) if facing.max() > 0.9 else None
            else:
                turn = math.atan2(sign * up, sign * across) % (2.0 * math.pi)
                turn = 0.0 if turn > 2.0 * math.pi - 1e-4 else turn  # edge 0 itself, but for rounding
                found = turn if turn <= wrap else None
            if found is not None:
                yield f"{'+' if sign > 0.0 else '-'}{name}", found


def _strip_placement(design: SheetDesign) -> Iterator[str]:
    side = design.place.frustum
    half1, half2 = 0.5 * side.wrap * side.radius1, 0.5 * side.wrap * side.radius2
    yield (
        f"It lies on the outside of {design.above}, over its seam, its ends flush with the ends of that sheet. Its "
        "edge 0 lies beside the edge of C of that sheet, its other edge beyond the seam."
    )
    middle, seam = 0.5 * side.wrap, design.seam_offset
    yield ""
    yield from table_head("from", "to", "distance")
    yield f"| edge 0 of the strip | its other edge | {in_mm(2.0 * half1)} at end 1, {in_mm(2.0 * half2)} at end 2 |"
    yield (
        f"| seam of {design.above} | edge 0 of the strip, against the direction of the wrap | "
        f"{in_mm(seam * side.radius1)} at end 1, {in_mm(seam * side.radius2)} at end 2 |"
    )
    yield f"| seam of {design.above} | middle of the strip | {in_mm((middle - seam) * side.radius1)} at end 1 |"
