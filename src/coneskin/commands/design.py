"""Command ``coneskin design``: sheets for a link, ready to be cut, and the sensor file for the guard.

examples:
  coneskin design upperarm.stl -o skin                 find the cones in a mesh (STL, OBJ, DAE, PLY)
  coneskin design ur10.urdf#upper_arm_link -o skin     the same for a link of a URDF
  coneskin design arm.urdf --wires 24 -o skins         all links of a robot: the sheets that 24 wires allow
  coneskin design arm.urdf --share-percent 90 -o skins      the fewest sheets with 90 % of what can be touched
  coneskin design --radius1-mm 54 --height-mm 400 -o skin                                   a cylinder
  coneskin design --radius1-mm 40 --radius2-mm 70 --height-mm 150 --wrap-deg 270 -o skin    a partial wrap of a cone
  coneskin design --radius1-mm 40 --radius2-mm 70 --height-mm 150 --radius3-mm 40 --height2-mm 150 -o skin
                                                                                            a rugby ball: two sheets
  coneskin design --write-options design.toml          layers, electrodes, wires, drawings, jig, electronics: all keys
  coneskin design upperarm.stl -o skin --options design.toml
  coneskin design upperarm.stl -o skin --set drawings.kerf_mm=0.2 --set sheet.wires=end2

Dimensions are those of the sheets. The link must go on beyond both of their ends, for tie, connector and jig; report.md
says how far.

The folder then holds report.md, sensor.toml, materials.csv, design.json, and cut/ with a DXF, SVG and PDF file for
every layer. If the command fails, no folder is left. Exit code: 0 written; 3 no cone fits the mesh; 1 another failure;
2 wrong usage.
"""

from __future__ import annotations

import argparse
import json
import math
import shlex
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from coneskin.core.errors import GeometryError
from coneskin.design.design_toml import DESIGN_TABLES, read_settings, settings_text
from coneskin.design.first_scene import arm_link
from coneskin.design.link_design import LinkDesign, NothingFits, design_link
from coneskin.design.sheets.sheet_design import SheetDesign
from coneskin.design.sheets.summary import small_active_area
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum, double_cone
from coneskin.robot.arm.kinematics import LINK_INDEX
from coneskin.robot.arm.models import MODEL_NAMES
from coneskin.robot.sim.machine.states import DEFAULT_MODEL
from coneskin.scene.tables.sensor_keys import DOUBLE_CONE_KEYS
from coneskin.skin.electronics import shunt_ohms

from .dimensions import add_key_options, given_keys, option_name
from .terminal import add_urdf_options, ending_signals, print_hint, urdf_options

_NO_FIT_EXIT_CODE = 3
_LEAST_BRIDGED_SHARE = 0.0005  # of a sheet that spans holes; less would print as 0.0 %
#: keys of design.toml that have an option of their own
_SHORT_KEYS = tuple(key for key in DESIGN_TABLES["search"][1] if key.name in ("tolerance_mm", "max_sheets"))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    parser.usage = "coneskin design [LINK] -o DIR [options]"
    add = parser.add_argument
    add("link", metavar="LINK", nargs="?", help="mesh file or FILE.urdf#LINK; leave it out and give radii instead")
    add("-o", "--output", metavar="DIR", required=True, type=Path, help="folder to create; --force replaces one")
    add("--force", action="store_true", help="replace an earlier design in that folder")
    robot = parser.add_mutually_exclusive_group().add_argument
    robot("--wires", type=int, metavar="N", help="of a whole robot (FILE.urdf): the sheets that N wires allow, 4 each")
    share_help = "of a whole robot: as few sheets as reach P %% of the area that can be touched on all of them"
    robot("--share-percent", type=float, metavar="P", help=share_help)
    add("--json", action="store_true", help="print the design as JSON")
    add("--no-pictures", action="store_true", help="write the report without pictures")
    add("--options", type=Path, metavar="FILE", help="options of the design in a TOML file")
    add("--write-options", action=_WriteOptions, metavar="FILE", help="write such a file with all its keys, and end")
    many: dict[str, Any] = {"action": "append", "default": []}
    add("--set", metavar="TABLE.KEY=VALUE", help="one key of such a file, before the file; may be repeated", **many)

    add = parser.add_argument_group("finding sheets in a mesh").add_argument
    add("--unit", choices=("m", "cm", "mm", "inch"), help="unit of the mesh (default: guessed and reported)")
    add_key_options(add, _SHORT_KEYS, defaults={"tolerance": "1", "max_sheets": "2"})
    seam_help = "direction in which the seam faces, as the cable (default: where the link shields it most)"
    add("--seam", type=float, nargs=3, metavar=("X", "Y", "Z"), help=seam_help)
    add_urdf_options(add)

    add = parser.add_argument_group("a link by its dimensions").add_argument
    defaults = {"radius2": "radius 1, a cylinder", "wrap": "360, or the widest that fits the mesh"}
    add_key_options(add, DOUBLE_CONE_KEYS, defaults=defaults)


class _WriteOptions(argparse.Action):
    """Write the file with every option, and end the command."""

    def __call__(
        self, parser: argparse.ArgumentParser, _: argparse.Namespace, values: Any, __: str | None = None
    ) -> None:
        try:
            with Path(values).open("x", encoding="utf-8") as file:
                file.write(settings_text())
        except FileExistsError:
            parser.error(f"{values} exists already: choose another name")
        except OSError as exc:
            parser.error(f"{values} cannot be written: {exc.strerror or exc}")
        parser.exit(message=f"{values} written: change it, then coneskin design LINK -o DIR --options {values}\n")


def run(args: argparse.Namespace) -> int:
    """Run the command and return its exit code: 0, or 3 if no cone fits the mesh.

    Raises:
        ConeSkinError: a wrong argument or mesh; no folder is left.
    """
    with ending_signals() as look:
        return _run(args, look)


def _run(args: argparse.Namespace, look: Callable[[], None]) -> int:
    began = time.perf_counter()

    def say(step: str) -> None:
        look()
        print(f"{time.perf_counter() - began:6.2f} s  {step}", file=sys.stderr, flush=True)

    settings = read_settings(args.options, args.set)
    search = {**settings.search, **given_keys(args, _SHORT_KEYS)}
    common: dict[str, Any] = {
        "options": settings.options,
        **urdf_options(args),
        "files": settings.files,
        "pictures": not args.no_pictures,
        "replace": args.force,
        "progress": say,
    }
    if args.wires is not None or args.share_percent is not None:
        return _design_robot(args, common | search)
    link: str | Sequence[PlacedFrustum]
    if args.link is None:
        link = _links_from_dimensions(args, search)
        search = {}
    else:
        link = args.link
        for key in DOUBLE_CONE_KEYS:
            if key.plain != "wrap" and getattr(args, key.name) is not None:
                raise GeometryError(
                    f"a mesh and {option_name(key)} cannot go together: the radii are found in the mesh"
                )
        search |= given_keys(args, [key for key in DOUBLE_CONE_KEYS if key.plain == "wrap"])
        if args.seam is not None:
            search["seam_direction"] = _seam(args.seam, search)
    try:
        design = design_link(link, args.output, unit=args.unit, **common, **search)
    except NothingFits as nothing:
        return _report_nothing(nothing)
    if args.json:
        print(json.dumps(design.data))
    else:
        _print(design)
        _print_next(design, args.output)
    return 0


def _design_robot(args: argparse.Namespace, common: dict[str, Any]) -> int:
    from coneskin.design.robot_design import design_robot

    if not (args.link or "").lower().endswith((".urdf", ".xacro")):
        option = "--share-percent" if args.wires is None else "--wires"
        raise GeometryError(f"{option} is for a whole robot: name its FILE.urdf, without #LINK")
    share = None if args.share_percent is None else 0.01 * args.share_percent
    design = design_robot(args.link, args.output, args.wires, share=share, **common)
    for count, one in enumerate(design.offered, 1):
        included = "" if count <= design.included else ", not included"
        area = f"{1e4 * one.area:.1f} of {1e4 * one.active:.1f} cm2 touchable"
        print(f"{one.wires:3d} wires  {1e4 * one.total:7.1f} cm2  {one.link} {one.number}, {area}{included}")
    lengths = [f"{design.cables.length(sensor):.2f}" for sensor, cable in enumerate(design.cables.cables) if cable]
    cables = [f"ways of the cables to the box at the foot: {', '.join(lengths)} m"] if lengths else []
    print("\n".join((*cables, *design.cables.reasons, *design.reasons)))
    said = {Path(args.link).name.partition(".")[0].lower(), *(word.lower() for word in common["arguments"].values())}
    model = next((name for name in MODEL_NAMES if name.lower() in said), None)
    init = f"next: coneskin init {shlex.quote(str(args.output))} --simulated"
    alone = f"{init} --skin-only; if it is an arm of UR's: --arm {DEFAULT_MODEL}, or another model"
    print_hint(f"{init} --arm {model}" if model else alone)
    return 0


def _links_from_dimensions(args: argparse.Namespace, search: dict[str, Any]) -> tuple[PlacedFrustum, ...]:
    """Return the one or two places on a link that its radii and heights describe, in order along the axis.

    Raises:
        GeometryError: a dimension is missing or out of range, or an option is for a mesh.
    """
    values = given_keys(args, DOUBLE_CONE_KEYS)
    for key in _SHORT_KEYS:
        if getattr(args, key.name) is not None:
            raise GeometryError(f"{option_name(key)} is for a mesh, in which sheets are searched: leave it out")
    if args.seam is not None or "seam_direction" in search:
        option = "--seam" if args.seam is not None else "search.seam or search.touch_side"
        raise GeometryError(
            f"{option} is for a mesh: by its dimensions a link has no directions, and its seam is at phi = 0"
        )
    for name in ("exposure", "weights"):
        if search.get(name):
            raise GeometryError(f"search.{name} is for a mesh: a link by its dimensions is covered whole")
    if not {"radius1", "height"} <= values.keys():
        raise GeometryError("name a mesh file, or give --radius1-mm and --height-mm")
    if ("radius3" in values) != ("height2" in values):
        raise GeometryError("a second cone needs both --radius3-mm and --height2-mm")
    values = {"radius2": values["radius1"], **values}
    if "radius3" not in values:
        return (PlacedFrustum(Frustum(**values)),)
    wrap = values.get("wrap", 2.0 * math.pi)
    return double_cone(
        values["radius1"], values["radius2"], values["radius3"], values["height"], values["height2"], wrap
    )


def _seam(way: Sequence[float], search: dict[str, Any]) -> tuple[float, ...]:
    """Return the direction in which the seam of a full wrap faces."""
    if "seam_direction" in search:
        raise GeometryError("--seam cannot go together with search.seam or search.touch_side: the seam is given twice")
    if not 0.0 < math.hypot(*way) < math.inf:
        raise GeometryError(f"--seam takes a direction X Y Z, finite and not 0 0 0, got {' '.join(map(str, way))}")
    return tuple(way)


def _report_nothing(nothing: NothingFits) -> int:
    """Report why there is no sheet and which one comes nearest; return the exit code."""
    print(f"coneskin design: {nothing.source}: {nothing.fit.reason}", file=sys.stderr)
    nearest = nothing.fit.nearest
    if nearest is not None:
        side, wrap = nearest.frustum, math.degrees(nearest.frustum.wrap)
        print(
            f"with --tolerance-mm {nothing.fit.needed_tolerance * 1e3:.2f} there is one: radius "
            f"{side.radius1 * 1e3:.2f} to {side.radius2 * 1e3:.2f} mm over {side.height * 1e3:.1f} mm, wrap "
            f"{wrap:.0f} deg",
            file=sys.stderr,
        )
    return _NO_FIT_EXIT_CODE


def _count_size(design: SheetDesign) -> str:
    """Return the size of one count on the active area at its worst place."""
    steps = design.forecasts()
    along, around = (_two_digits(1e3 * max(sizes)) for sizes in zip(*((s.along, s.around) for s in steps), strict=True))
    return f"{along} mm along, {around} mm around"


def _two_digits(value: float) -> str:
    """Return a positive number with two significant digits, and no exponent."""
    rounded = float(f"{value:.1e}")
    return f"{rounded:.{max(0, 1 - math.floor(math.log10(rounded)))}f}"


def _print(found: LinkDesign) -> None:
    for design in found.sheets:
        side, share = design.place.frustum, design.layout.active_share
        line = (
            f"{design.name}: radius {side.radius1 * 1e3:.3f} to {side.radius2 * 1e3:.3f} mm, height "
            f"{side.height * 1e3:.2f} mm, half angle {math.degrees(side.half_angle):z.3f} deg, wrap "
            f"{math.degrees(side.wrap):.1f} deg, active {share:.1%}"
        )
        if design.place.bends:
            line += f", bent as a {design.place.kind} (radius: arc over wrap)"
        if design.fit is not None:
            worst, rms = design.fit.max_deviation, design.fit.rms_deviation
            line += f", deviation {worst * 1e3:.3f} mm at most, {rms * 1e3:.3f} mm rms"
            if design.fit.facet_height > 0.0:
                line += f", of which the facets of the mesh are up to {design.fit.facet_height * 1e3:.3f} mm"
            if design.fit.bridged_share >= _LEAST_BRIDGED_SHARE:
                line += (
                    f", but {design.fit.bridged_share:.1%} of it spans holes and grooves, down to "
                    f"{design.fit.bridged_depth * 1e3:.2f} mm"
                )
        if design.above:
            line += f", over the seam of {design.above}"
        print(line)
        parts, (upper, lower) = design.electronics, design.conductive
        print(
            f"  sheets of {upper.ohms:g} and {lower.ohms:g} ohm per square, {parts.supply_volts:g} V, shunt "
            f"{shunt_ohms(parts):.3g} ohm, {parts.adc_bits} bits: a count is {_count_size(design)} "
            "(electronics.upper_sheet_ohm and so on change it)"
        )
        if small := small_active_area(design):
            print(f"  warning: {small}")
    fit = found.fit
    if fit is not None:
        print(f"the sheets cover {sum(sheet.area_share for sheet in fit.sheets):.0%} of the hull")
        if fit.touch_weights:
            print(f"weighed by {fit.touch_weights.name}, that is {sum(s.touch_share for s in fit.sheets):.0%} of it")
    for area in fit.bare_areas if fit else ():
        print(f"no sheet: {area.share:.0%} of the hull: {area.reason}")


def _print_next(design: LinkDesign, output: Path) -> None:
    """Print the commands that can follow."""
    folder = shlex.quote(str(output))
    count = len(design.sheets)
    sensor = shlex.quote(str(output / ("sensor.toml" if count == 1 else "sheet-N/sensor.toml")))
    board = "board" if count == 1 else f"board-N, a board for each N from 1 to {count}"
    print_hint(f"real hardware: coneskin firmware {sensor} -o {board}, then coneskin init {folder} --board uno --help")
    unnamed = design.mesh is None or arm_link(design.name) is None
    which = f" --link LINK, with LINK one of {', '.join(LINK_INDEX)}" if unnamed else ""
    guarded = f"coneskin init {folder} --simulated --arm {DEFAULT_MODEL}{which}, for your model of arm"
    alone = f"coneskin init {folder} --simulated --skin-only"
    if design.mesh is None:
        print_hint(f"next: {guarded}")
    elif unnamed:  # the mesh is not named as a link of a UR arm, and init writes scenes of those only
        print_hint(f"on a UR arm: {guarded}")
        print_hint(f"next: {alone}, which reports touches")
    else:
        print_hint(f"on another arm than a UR: {alone}, which reports touches; a package guards it: docs/extend/arm.md")
        print_hint(f"next: {guarded}")
