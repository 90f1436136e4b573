"""report.md: the figures of a design, what to cut, and how to put it together."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from .design import SheetDesign
from .design_files import sheet_folder
from .design_summary import materials, summary

if TYPE_CHECKING:
    from .geometry.cones import Fit

__all__ = ["report"]

_ASSEMBLY = {
    "loose": "Wrap one layer after the other; each is cut for its own radius.",
    "pairs": "Glue each conductive sheet to its substrate while both are flat, then wrap the pairs.",
    "bonded": "Glue all layers together flat, then wrap the sheet once; mind the strains above.",
}


def report(
    designs: tuple[SheetDesign, ...],
    link: str,
    notes: Sequence[str] = (),
    fit: Fit | None = None,
    pictures: Sequence[tuple[str, str]] = (),
) -> str:
    """The report as Markdown.

    Args:
        designs: the sheets.
        link: what the sheets are for.
        notes: what to know of the link.
        fit: how the sheets were found on a mesh; None where their places were given.
        pictures: caption and file of each picture.
    """
    lines = [f"# Sensor for {link}", ""]
    lines += [f"* {note}" for note in notes]
    lines += _bare(fit) if fit else []
    for caption, file in pictures:
        lines += ["", f"![{caption}]({file})", "", caption]
    for index, design in enumerate(designs):
        lines += ["", *_sheet(design, sheet_folder(designs, index).as_posix())]
    lines += [
        "",
        "## Materials",
        "",
        "Areas are net; width and depth are the piece of material that the parts need.",
        "",
    ]
    keys = ("sheet", "layer", "material", "area_cm2", "width_mm", "depth_mm", "cut_length_mm")
    head = ("sheet", "cut sheet", "material", "area cm2", "width mm", "depth mm", "cut mm")
    lines += _table(head, [[_text(row[key]) for key in keys] for row in materials(designs)])
    lines += ["", *_making(designs[0])]
    return "\n".join(lines) + "\n"


def _bare(fit: Fit) -> Iterator[str]:
    covered = sum(sheet.length_share for sheet in fit.sheets)
    yield (
        f"* {len(fit.sheets)} sheet(s) within {fit.tolerance * 1e3:g} mm cover {covered:.0%} of the link's "
        f"{fit.link_length * 1e3:.1f} mm and {sum(sheet.area_share for sheet in fit.sheets):.0%} of its hull"
    )
    for item in fit.bare:
        yield f"* bare from {item.start * 1e3:.1f} to {item.end * 1e3:.1f} mm along the axis: {item.reason}"


def _sheet(design: SheetDesign, folder: str) -> Iterator[str]:
    data, stack = summary(design), design.choices.stack
    cone, active, side = data["link_cone"], data["active_cone"], design.place.frustum
    yield f"## {design.name.capitalize()}"
    yield ""
    rows = [
        ["radius at end 1, end 2", f"{cone['radius1_mm']:.3f}, {cone['radius2_mm']:.3f} mm"],
        ["height, slant", f"{cone['height_mm']:.3f}, {cone['slant_mm']:.3f} mm"],
        ["half angle", f"{cone['half_angle_deg']:z.4f} deg"],
        ["wrap", f"{cone['wrap_deg']:.3f} deg"],
        ["flat sector of the bare link", _sector(cone)],
        ["end 1 in the mesh's frame", _vector(cone["xyz_mm"], "mm")],
        ["axis, as roll, pitch, yaw", _vector(cone["rpy_deg"], "deg")],
    ]
    if "fit" in data:
        fit = data["fit"]
        rows.append(["deviation from the mesh", f"worst {fit['worst_mm']:.3f} mm, rms {fit['rms_mm']:.3f} mm"])
        rows.append(
            ["share of the link", f"{fit['length_share']:.0%} of its length, {fit['area_share']:.0%} of its hull"]
        )
        if fit["bridged_share"] > 0.0:
            bridged = f"{fit['bridged_share']:.1%} of the sheet, {fit['deepest_bridged_mm']:.1f} mm deep"
            rows.append(["bridged holes and grooves", bridged])
    if "gap_to_next_mm" in data:
        gap = data["gap_to_next_mm"]
        rows.append(["gap to the next sheet", f"{gap['inner']:.2f} mm on the link, {gap['outer']:.2f} mm outside"])
    yield from _table(("quantity", "value"), rows)
    yield ""
    yield "### Layers"
    yield ""
    yield f"Assembly: {stack.assembly}. {_ASSEMBLY[stack.assembly]} The patterns differ in radius, not in theta0."
    yield ""
    named = {layer["name"]: layer for layer in data["layers"]}
    table = []
    for i, layer in enumerate(stack.layers):
        cut = named[layer.name]
        inner, outer = stack.strain(side, i)
        table.append(
            [
                layer.name,
                f"{layer.thickness * 1e3:.2f}",
                f"{stack.offset(i) * 1e3:.3f}",
                f"{cut['radius1_mm']:.3f}, {cut['radius2_mm']:.3f}",
                _sector(cut),
                f"{stack.ignored_gap(side, i) * 1e3:.2f}",
                f"{inner:+.1%}, {outer:+.1%}",
            ]
        )
    head = ("layer", "mm", "cut for height mm", "radii mm", "flat sector", "seam gap if ignored mm", "strain in, out")
    yield from _table(head, table)
    yield ""
    yield "### Electrodes"
    yield ""
    plan, patch = design.layout.plan, data["active_patch"]
    share = f"{data['active_area_cm2']:.1f} cm2, {data['active_share']:.1%} of the sheet"
    width = f"{plan.electrode * 1e3:g} mm wide"
    yield f"* Upper sheet: B on the arc of end 1 (supply), A on the arc of end 2 (ground), {width}."
    yield (
        "* Lower sheet: D on the edge phi = 0 (ground), C on the edge phi = wrap (supply), wedges between two rays, "
        f"{width} at the narrow end."
    )
    yield f"* All four wires leave at {plan.wires}."
    if plan.wires == "end2" and design.next_seam is not None:
        yield "* The tabs run into the next sheet there: bend them up, or let the wires leave on another side."
    yield (
        f"* Active: u {patch['u1_mm']:.2f} to {patch['u2_mm']:.2f} mm, phi {patch['phi1_deg']:.2f} to "
        f"{patch['phi2_deg']:.2f} deg of the sheet: {share}."
    )
    yield (
        f"* The decode uses radius {active['radius1_mm']:.3f} to {active['radius2_mm']:.3f} mm, slant "
        f"{active['slant_mm']:.3f} mm, wrap {active['wrap_deg']:.3f} deg (`{_join(folder, 'sensor.toml')}`)."
    )
    yield ""
    converter = design.choices.converter
    yield "### Accuracy forecast"
    yield ""
    yield (
        f"One count of {converter.bits} bits over {converter.range_volts:g} V at a supply of "
        f"{converter.supply_volts:g} V (eq. 25, 26). It is the limit of the converter, without noise, contact area and "
        "material; the paper measured 1.6 mm and 0.5 deg."
    )
    yield ""
    keys = {"u_mm": 1, "along_mm": 4, "around_mm": 4, "azimuth_deg": 4, "theta_deg": 5}
    steps = [[f"{step[key]:.{digits}f}" for key, digits in keys.items()] for step in data["forecast"]]
    yield from _table(("u of the active area mm", "mm along", "mm around", "deg of azimuth", "deg of theta"), steps)


def _making(design: SheetDesign) -> Iterator[str]:
    plan, choices = design.layout.plan, design.choices
    yield "## Cutting and putting together"
    yield ""
    steps = [
        "Red is cut, magenta are holes, blue is marked but not cut, green is folded. Print PDF files at 100 %; the bar "
        "on each page must measure 100 mm. Cut from the files of single parts: `all` nests them across pages.",
        "Every part says which face is up in the drawing. Inside is the face towards the link. A part laid the other "
        "way round has its tabs and its lead on the wrong side.",
        "Lay the electrodes (2, 6) on the backs of the conductive sheets (3, 5) as marked: the lower ones inside, the "
        "upper ones outside, so that foil lies between sheet and substrate. They must touch along their whole length.",
        "Cover leads and the electrodes' free sides with insulating tape.",
        f"{_ASSEMBLY[choices.stack.assembly]} Order from the link: 1, 3 with 2, 4, 5 with 6, 7. Blue outlines on the "
        "substrates show where the conductive sheets go.",
        f"Fold the tabs at {plan.wires} outwards along the green lines." if plan.tab else "There are no tabs.",
    ]
    if plan.hole:
        steps.append(
            f"Three holes of {plan.hole * 1e3:g} mm go through all layers; the fourth corner has none, so that a "
            "mirrored layer does not fit. Use plastic pins: a metal screw joins both sheets."
        )
    if plan.wires.startswith("edge"):
        steps.append("The tabs leave at the seam: bring them out between the ends of the wrap before it is closed.")
    if choices.overlap:
        steps.append(f"The flap of {choices.overlap * 1e3:g} mm on the upper substrate closes the seam over edge 0.")
    yield from (f"{i}. {step}" for i, step in enumerate(steps, start=1))


def _sector(shape: dict[str, Any]) -> str:
    if shape["r1_mm"] is None or shape["r1_mm"] > 1e7:  # 10 km: within 1 um of a rectangle
        width = math.radians(shape["wrap_deg"]) * shape["radius1_mm"]
        return f"rectangle {width:.3f} x {shape['slant_mm']:.3f} mm"
    return f"r1 {shape['r1_mm']:.3f} mm, r2 {shape['r2_mm']:.3f} mm, theta0 {shape['theta0_deg']:.4f} deg"


def _vector(values: list[float], unit: str) -> str:
    return ", ".join(f"{value:z.3f}" for value in values) + f" {unit}"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    yield "| " + " | ".join(head) + " |"
    yield "|" + "---|" * len(head)
    for row in rows:
        yield "| " + " | ".join(row) + " |"


def _text(value: object) -> str:
    return f"{value:.1f}" if isinstance(value, float) else str(value)


def _join(folder: str, name: str) -> str:
    return name if folder == "." else f"{folder}/{name}"
