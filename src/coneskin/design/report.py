"""Report of a design (report.md): what to buy, the guide by which it is built, and how it was designed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from coneskin.geometry.drawing.nesting import MaterialBed
from coneskin.skin.electronics import SENSE_GAIN, shunt_ohms

from .sheets.sheet_design import SheetDesign
from .sheets.summary import design_summary, sector_text, sheet_folder, small_active_area
from .workshop.build_figures import BuildFigures, bill_of_materials, section_head, table_head
from .workshop.build_guide import common_lines, sheet_lines

if TYPE_CHECKING:
    from coneskin.geometry.fit.cones import LinkFit

_TOOL_LIST = (
    "Tools: what cuts (a plotter with knives, or a scalpel and a cutting mat), caliper, steel rule, tape measure, try "
    "square, soft pencil, needle, hand roller of rubber, kitchen scales, multimeter, wire stripper, crimping tool for "
    "the contacts, flat pliers, side cutters, heat gun; a 3D printer where there is a jig."
)
_LAYER_HEAD = (
    "layer",
    "thickness [mm]",
    "neutral surface above the link [mm]",
    "radii [mm]",
    "flat sector",
    "seam gap if cut for the bare link [mm]",
    "strain of inner, outer face",
)


def report_text(
    designs: tuple[SheetDesign, ...],
    figures: Sequence[BuildFigures],
    link: str,
    notes: Sequence[str] = (),
    fit: LinkFit | None = None,
    pictures: Sequence[tuple[str, str]] = (),
    beds: Sequence[MaterialBed] = (),
    first_sensor: int = 0,
) -> str:
    """Return the report as Markdown.

    Args:
        designs: the sheets.
        figures: for building each of them.
        link: name of the link.
        notes: notes on the link.
        fit: fit of the sheets to a mesh; None for a link given by its dimensions.
        pictures: caption and file of each picture.
        beds: parts of each material, nested.
        first_sensor: number of the first sensor in the wire format.
    """
    lines = [f"# Sensor for {link}", ""]
    lines += [f"* {note}" for note in notes]
    lines += _coverage(fit, designs) if fit else []
    lines += [f"* **Warning: {small}**" for small in map(small_active_area, designs) if small]
    shown = {
        name: [line for caption, file in pictures if f"/{name}" in file for line in ("", f"![{caption}]({file})")]
        for name in ("link", "weights", *(f"{design.name.replace(' ', '-')}-" for design in designs))
    }
    lines += [*shown["link"], *shown["weights"], "", "## Everything to buy or to cut", ""]
    lines += _table(("item", "quantity", "for"), bill_of_materials(designs, figures, beds))
    lines += ["", f"`materials.csv` has the size of each part. {_TOOL_LIST}", ""]
    lines += common_lines(designs, figures)
    for index, (design, item) in enumerate(zip(designs, figures, strict=True)):
        folder, drawn = sheet_folder(designs, index).as_posix(), shown[f"{design.name.replace(' ', '-')}-"]
        lines += ["", *sheet_lines(design, item, folder, first_sensor + index, drawn)]
    for index, design in enumerate(designs):
        lines += ["", *_sheet_section(design, sheet_folder(designs, index).as_posix())]
    return "\n".join(lines) + "\n"


def _coverage(fit: LinkFit, designs: Sequence[SheetDesign]) -> Iterator[str]:
    built = [design.fit for design in designs if design.fit is not None]
    axes = len({sheet.axis for sheet in built})
    count = "1 sheet covers" if len(built) == 1 else f"{len(built)} sheets cover"
    share = sum(sheet.area_share for sheet in built)
    yield (
        f"* {count}, within {fit.tolerance * 1e3:g} mm of the mesh and about {axes} ax{'i' if axes == 1 else 'e'}s, "
        f"{share:.0%} of the hull of the link"
    )
    if fit.touch_weights:
        share = sum(sheet.touch_share for sheet in built)
        most = "the sheets are those that cover most of what counts"
        yield f"* Weighed by {fit.touch_weights.name}, that is {share:.0%} of it: {most}"
    for area in fit.bare_areas:
        yield f"* No sheet on {area.share:.0%} of the hull: {area.reason}"


def _sheet_section(design: SheetDesign, folder: str) -> Iterator[str]:
    data, stack = design_summary(design), design.options.stack
    side, active = design.place.frustum, design.active.frustum
    sensor = "sensor.toml" if folder == "." else f"{folder}/sensor.toml"
    yield f"## How {design.name} was designed"
    yield ""
    rows = [
        ["radius at end 1, end 2", f"{side.radius1 * 1e3:.3f}, {side.radius2 * 1e3:.3f} mm"],
        ["height, slant", f"{side.height * 1e3:.3f}, {side.slant * 1e3:.3f} mm"],
        ["half angle", f"{math.degrees(side.half_angle):z.4f} deg"],
        ["wrap", f"{math.degrees(side.wrap):.3f} deg"],
        ["flat sector of the bare link", sector_text(side)],
        ["position of end 1 (frame above)", _vector(data["link_cone"]["xyz_mm"], "mm")],
        ["roll, pitch, yaw of the axis", _vector(data["link_cone"]["rpy_deg"], "deg")],
    ]
    if design.place.bends:
        rows.insert(0, ["side", f"{design.place.kind}: the radii are arc over wrap, the half angle that of the sector"])
        sharpest = 1e3 * min(side.radius1, side.radius2) / design.place.sharpest_bend
        rows.append(["sharpest bend of the link", f"radius {sharpest:.2f} mm"])
        rows.append(["layers beside their flat sector", f"{data['sector_error_mm']:.3f} mm at most"])
        if data["closing_gap_mm"] is not None:
            rows.append(["gap with which the bends close", f"{data['closing_gap_mm']:.4f} mm"])
    if "fit" in data:
        fit = data["fit"]
        deviation = f"{fit['max_deviation_mm']:.3f} mm at most, {fit['rms_deviation_mm']:.3f} mm rms"
        rows.append(["deviation from the mesh", deviation])
        if fit["facet_height_mm"] > 0.0:
            facets = f"up to {fit['facet_height_mm']:.3f} mm inside the link's surface, as part of that deviation"
            rows.append(["facets of the mesh", facets])
        rows.append(
            ["share of the link", f"{fit['length_share']:.0%} of its length, {fit['area_share']:.0%} of its hull"]
        )
        if fit["bridged_share"] > 0.0:
            bridged = f"{fit['bridged_share']:.1%} of the sheet, {fit['bridged_depth_mm']:.1f} mm deep"
            rows.append(["bridged holes and grooves", bridged])
    plan, patch = design.layout.plan, data["active_patch"]
    rows.append(["electrodes", f"{1e3 * plan.electrode:g} mm wide; C and D wedges between rays, at their narrow end"])
    share = f"{data['active_area_cm2']:.1f} cm2, {data['active_share']:.1%} of the sheet"
    where = (
        f"u {patch['u1_mm']:.2f} to {patch['u2_mm']:.2f} mm, phi {patch['phi1_deg']:.2f} to {patch['phi2_deg']:.2f} deg"
    )
    rows.append(["active area", f"{share}: {where}"])
    rows.append(["no touch located around the link", f"{360.0 - patch['phi2_deg'] + patch['phi1_deg']:.1f} deg"])
    cone = f"radius {active.radius1 * 1e3:.3f} to {active.radius2 * 1e3:.3f} mm, slant {active.slant * 1e3:.3f} mm, "
    rows.append([f"cone of the decoder (`{sensor}`)", f"{cone}wrap {math.degrees(active.wrap):.3f} deg"])
    rows += [[f"least gap to {other}", f"{gap:.2f} mm"] for other, gap in data["gaps_mm"].items()]
    yield from _table(("quantity", "value"), rows)
    yield from section_head("Layers")
    yield f"Assembly: {stack.assembly}. The patterns differ in radius, but not in theta0."
    yield ""
    surfaces = {cut.name: cut.surface for cut in design.cuts}
    rows = []
    for i, layer in enumerate(stack.layers):
        surface = surfaces[layer.name]
        inner, outer = stack.strain(design.place, i)
        heights = f"{layer.thickness * 1e3:.2f}", f"{stack.offset(i) * 1e3:.3f}"
        flat = f"{surface.radius1 * 1e3:.3f}, {surface.radius2 * 1e3:.3f}", sector_text(surface)
        seam = f"{stack.ignored_gap(design.place, i) * 1e3:.2f}"
        rows.append([layer.name, *heights, *flat, seam, f"{inner:+.1%}, {outer:+.1%}"])
    yield from _table(_LAYER_HEAD, rows)
    parts = design.electronics
    radial, angular = (1e3 * amperes for amperes in design.drive_currents)
    full_scale = 1e3 * parts.current_full_scale
    count = full_scale / parts.full_count
    yield from section_head("Electronics")
    upper, lower = design.conductive
    yield "What was not given was chosen for the shape of this sheet (docs/do/electronics.md); options change it."
    yield ""
    yield from _table(
        ("quantity", "value"),
        [
            ["upper conductive sheet", f"{upper.ohms:g} ohm per square: {upper.name}"],
            ["lower conductive sheet", f"{lower.ohms:g} ohm per square: {lower.name}"],
            ["supply", f"{parts.supply_volts:g} V"],
            ["converter", f"{parts.adc_bits} bits over {parts.adc_volts:g} V"],
            ["drive current, radial phase", f"{radial:.3f} mA, {radial / count:.0f} counts"],
            ["drive current, angular phase", f"{angular:.3f} mA, {angular / count:.0f} counts"],
            ["full scale of the current", f"{full_scale:.3f} mA"],
            ["shunt", f"{shunt_ohms(parts):.3g} ohm, with an amplifier of {SENSE_GAIN:g} V/V; measure strips first"],
            ["pull-downs of C and D", f"{parts.pulldown_ohms / 1e3:g} kohm"],
        ],
    )
    yield from section_head("Accuracy forecast")
    along, around, turn = (max(s[key] for s in data["forecast"]) for key in ("along_mm", "around_mm", "azimuth_deg"))
    yield (
        f"One count of {parts.adc_bits} bits over {parts.adc_volts:g} V at a supply of "
        f"{parts.supply_volts:g} V (eq. 25, 26). This is the limit of the A/D converter; noise, the area of the "
        f"contact and uneven material add to it: {along:.3f} mm along, {around:.3f} mm around and {turn:.3f} deg at "
        "most (`design.json` has it at five places). The paper measured 1.6 mm and 0.5 deg."
    )


def _vector(values: list[float], unit: str) -> str:
    return ", ".join(f"{value:z.3f}" for value in values) + f" {unit}"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    yield from table_head(*head)
    for row in rows:
        yield "| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |"
