"""Command ``coneskin design``: sheets for a link, ready to be cut, and the sensor file for the guard."""

from __future__ import annotations

import argparse
import json
import math
import shlex
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from coneskin.core.errors import GeometryError
from coneskin.design.files import FileOptions, check_target
from coneskin.design.first_scene import arm_link
from coneskin.design.folder import write_design
from coneskin.design.link import LinkMesh, fit_link
from coneskin.design.sheets.seam_strip import cover_seams
from coneskin.design.sheets.sheet_design import SheetDesign, design_sheets
from coneskin.design.sheets.summary import small_active_area
from coneskin.geometry.drawing.layer_stack import PAPER_STACK
from coneskin.geometry.solid import require_step_writer
from coneskin.robot.arm.link_frames import LINK_INDEX
from coneskin.robot.sim.machine.states import DEFAULT_MODEL
from coneskin.skin.electronics import shunt_ohms

from .arguments.design import (
    add_arguments,
    design_options,
    links_from_dimensions,
    package_folders,
    refuse_dimensions,
    requested_wrap,
    seam_direction,
    xacro_arguments,
)
from .terminal.ending_signals import ending_signals
from .terminal.hints import print_hint

if TYPE_CHECKING:
    from coneskin.geometry.fit.cones import LinkFit
    from coneskin.geometry.fit.touch_weights import TouchWeights
    from coneskin.geometry.placed_frustum import PlacedFrustum

__all__ = ["add_arguments", "run"]

_NO_FIT_EXIT_CODE = 3
_SHOWN = 0.0005  # of a sheet that spans holes; less would print as 0.0 %


def run(args: argparse.Namespace) -> int:
    """Run the command and return its exit code: 0, or 3 if no cone fits the mesh.

    Raises:
        ConeSkinError: a wrong argument or mesh; no folder is left.
    """
    with ending_signals() as look:
        return _run(args, look)


def _run(args: argparse.Namespace, look: Callable[[], None]) -> int:
    began = time.perf_counter()

    said = set()

    def say(step: str) -> None:
        look()
        said.add(step)
        print(f"{time.perf_counter() - began:6.2f} s  {step}", file=sys.stderr, flush=True)

    check_target(args.output, args.force)
    options = design_options(args)
    bed = (args.bed_mm[0] * 1e-3, args.bed_mm[1] * 1e-3)
    file_options = FileOptions(
        args.arcs, args.cut_tolerance_mm * 1e-3, args.page, bed, args.bed_gap_mm * 1e-3, args.step
    )
    if args.step:
        require_step_writer()  # before the search, which takes a minute
    source: LinkMesh | None = None
    fit: LinkFit | None = None
    notes: tuple[str, ...] = ()
    links: tuple[PlacedFrustum, ...] = ()
    if args.link is None:
        title, frame = "a link by its dimensions", "the axis of the link (z from end 1, x at phi = 0)"
        links = links_from_dimensions(args)
    else:
        refuse_dimensions(args)
        source, fit = _load_and_fit(args, say)
        if not fit.sheets:
            return _nothing_fits(source, fit)
        title, frame, notes = source.name, source.frame, source.notes
        # a unit that was guessed wrongly should be seen before anything is cut
        for note in (note for note in notes if note not in said):
            print(f"note: {note}", file=sys.stderr, flush=True)
    named = replace(options, link="" if source is None else source.name)
    designs = cover_seams(design_sheets(fit or links, named))
    data = write_design(
        args.output,
        designs,
        fit=fit,
        mesh=source.mesh if source else None,
        title=title,
        source=args.link or title,
        frame=frame,
        notes=notes,
        options=file_options,
        pictures=not args.no_pictures,
        replace=args.force,
        progress=say,
    )
    if args.json:
        print(json.dumps(data))
    else:
        _print(designs, fit)
        folder = shlex.quote(str(args.output))
        sensor = shlex.quote(str(args.output / ("sensor.toml" if len(designs) == 1 else "sheet-1/sensor.toml")))
        print_hint(
            f"real hardware: coneskin firmware {sensor} --to board, then coneskin init {folder} --board uno --help"
        )
        unnamed = source is None or arm_link(source.name) is None
        which = f" --link LINK, with LINK one of {', '.join(LINK_INDEX)}" if unnamed else ""
        if source is not None:
            print_hint(
                f"on another arm than a UR: coneskin init {folder} --simulated --skin-only, which reports touches; "
                "only UR arms are guarded"
            )
        print_hint(f"next: coneskin init {folder} --simulated --arm {DEFAULT_MODEL}{which}, for your model of arm")
    return 0


def _load_and_fit(args: argparse.Namespace, say: Callable[[str], None]) -> tuple[LinkMesh, LinkFit]:
    """Return the first mesh of the link in which cones are found, with its fit; else the first mesh."""
    return fit_link(
        args.link,
        args.unit,
        args.up_axis,
        package_folders(args),
        say,
        xacro_arguments(args),
        tolerance=args.tolerance_mm * 1e-3,
        max_sheets=args.max_sheets,
        wrap=requested_wrap(args),
        min_length=args.min_length_mm * 1e-3,
        min_wrap=math.radians(args.min_wrap_deg),
        max_bridge=args.max_bridge_mm * 1e-3,
        max_wires=args.max_wires,
        min_radius=2e-3 * args.lead_mm,
        min_arc=design_options(args).plan.least_arc,
        thickness=sum(args.thickness_mm) * 1e-3 if args.thickness_mm else PAPER_STACK.thickness,
        gap=args.sheet_gap_mm * 1e-3,
        seam_direction=seam_direction(args),
        weights=_touch_weights(args),
        exposure=args.exposure,
        allow_hull=args.allow_hull,
        round_only=args.round_only,
    )


def _touch_weights(args: argparse.Namespace) -> TouchWeights | None:
    """Return the user's map of what areas count; None without one.

    Raises:
        GeometryError: it cannot be read, or the exposure is asked for too.
    """
    if args.weights is None:
        return None
    if args.exposure:
        raise GeometryError("--weights and --exposure cannot go together: areas count by a map or by their exposure")
    from coneskin.geometry.fit.touch_weights import read_touch_weights

    return read_touch_weights(args.weights)


def _nothing_fits(source: LinkMesh, fit: LinkFit) -> int:
    """Report why there is no sheet and which one comes nearest; return the exit code."""
    print(f"coneskin design: {source.mesh.source}: {fit.reason}", file=sys.stderr)
    nearest = fit.nearest
    if nearest is not None:
        side, wrap = nearest.frustum, math.degrees(nearest.frustum.wrap)
        print(
            f"with --tolerance-mm {fit.needed_tolerance * 1e3:.2f} there is one: radius {side.radius1 * 1e3:.2f} to "
            f"{side.radius2 * 1e3:.2f} mm over {side.height * 1e3:.1f} mm, wrap {wrap:.0f} deg",
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


def _print(designs: tuple[SheetDesign, ...], fit: LinkFit | None) -> None:
    for design in designs:
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
            if design.fit.bridged_share >= _SHOWN:
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
            "(--upper-sheet-ohm and so on change it)"
        )
        if small := small_active_area(design):
            print(f"  warning: {small}")
    if fit is not None and fit.weights:
        share = sum(sheet.touch_share for sheet in fit.sheets)
        print(f"weighed by {fit.weights}, the sheets cover {share:.0%} of the hull")
    for area in fit.bare_areas if fit else ():
        print(f"no sheet: {area.share:.0%} of the hull: {area.reason}")
