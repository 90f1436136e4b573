"""``coneskin design``: from a link to sheets that can be cut, and the sensor file for the guard."""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
import tomllib
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from .design import SheetDesign, design_sheets
from .design_arguments import add_arguments, choices_of, links_by_numbers, refuse_numbers, wrap_of
from .design_files import FileOptions, check_target, new_folder, write_sheets
from .design_link import LinkMesh, load_link
from .design_report import report
from .design_summary import sensor_toml, summary
from .errors import GeometryError
from .sensor_table import build_sensor

if TYPE_CHECKING:
    from .geometry.cones import Fit

__all__ = ["add_arguments", "run"]

_NOTHING_FITS = 3


def run(args: argparse.Namespace) -> int:
    """Run the command; the exit code: 0, or 3 where no cone fits the mesh.

    Raises:
        ConeSkinError: a mistake of the user, in one line; no folder is left.
    """
    began = time.perf_counter()

    def say(step: str) -> None:
        print(f"{time.perf_counter() - began:6.2f} s  {step}", file=sys.stderr, flush=True)

    check_target(args.output, args.force)
    choices = choices_of(args)
    options = FileOptions(args.arcs, args.cut_tolerance_mm * 1e-3, args.page)
    source: LinkMesh | None = None
    fit: Fit | None = None
    notes: tuple[str, ...] = ()
    if args.link is None:
        title, frame = "a link by numbers", "the link's axis: z from end 1, x at phi = 0"
        links = links_by_numbers(args)
    else:
        refuse_numbers(args)
        source, fit = _found(args, say)
        if not fit.sheets:
            return _nothing_fits(source, fit)
        title, frame, notes = source.name, source.frame, source.notes
        links = tuple(sheet.placed for sheet in fit.sheets)
    designs = design_sheets(links, choices, fit.sheets if fit else ())
    data: dict[str, Any] = {"link": args.link or title, "frame": frame, "notes": list(notes)}
    data["sheets"] = [summary(design) for design in designs]
    if fit is not None:
        data["bare"] = [{"start_mm": 1e3 * b.start, "end_mm": 1e3 * b.end, "reason": b.reason} for b in fit.bare]
    _check_sensors(designs, frame)
    with new_folder(args.output, args.force) as folder:
        pictures: list[tuple[str, str]] = []
        if not args.no_pictures:
            from .design_pictures import draw_pictures

            mesh, tolerance = (source.mesh if source else None), args.tolerance_mm * 1e-3
            pictures = draw_pictures(folder, designs, mesh, tolerance, say)
        text = report(designs, title, (*notes, f"Poses are in the frame of {frame}"), fit, pictures)
        (folder / "report.md").write_text(text, encoding="utf-8")
        files = write_sheets(folder, designs, data, options, say)
    if args.json:
        print(json.dumps(data))
    else:
        _print(designs, fit)
        say(f"{len(files) + 1 + len(pictures)} files in {args.output}")
    return 0


def _check_sensors(designs: tuple[SheetDesign, ...], frame: str) -> None:
    """Refuse a design whose sensor file a scene would refuse."""
    problems: list[str] = []
    for index, design in enumerate(designs):
        build_sensor(tomllib.loads(sensor_toml(design, index, frame)), "sensor.toml", problems)
    if problems:
        raise GeometryError("; ".join(problems) + " (the options of the group electronics set these)")


def _found(args: argparse.Namespace, say: Callable[[str], None]) -> tuple[LinkMesh, Fit]:
    """The first mesh of the link in which cones are found, or else the first of all."""
    from .geometry.cones import find_cones

    tries: list[tuple[LinkMesh, Fit]] = []
    say(f"reading {args.link}")
    for source in load_link(args.link, args.unit, args.up_axis):
        say(f"{source.name}: {len(source.mesh.faces)} faces")
        fit = find_cones(
            source.mesh,
            tolerance=args.tolerance_mm * 1e-3,
            max_sheets=args.max_sheets,
            wrap=wrap_of(args),
            shortest=args.shortest_mm * 1e-3,
            narrowest=math.radians(args.narrowest_deg),
            bridge=args.bridge_mm * 1e-3,
            seam=tuple(args.seam),
            progress=say,
        )
        if fit.sheets:
            return source, fit
        tries.append((source, fit))
    return tries[0]


def _nothing_fits(source: LinkMesh, fit: Fit) -> int:
    """Say why there is no sheet, and what would come nearest."""
    print(f"coneskin design: {source.mesh.source}: {fit.reason}", file=sys.stderr)
    if fit.best is not None:
        side, wrap = fit.best.frustum, math.degrees(fit.best.frustum.wrap)
        print(
            f"the nearest: radius {side.radius1 * 1e3:.2f} to {side.radius2 * 1e3:.2f} mm over "
            f"{side.height * 1e3:.1f} mm, wrap {wrap:.0f} deg, with --tolerance-mm {fit.best.worst * 1e3:.2f}",
            file=sys.stderr,
        )
    return _NOTHING_FITS


def _print(designs: tuple[SheetDesign, ...], fit: Fit | None) -> None:
    for design in designs:
        side, share = design.place.frustum, design.layout.active_share
        line = (
            f"{design.name}: radius {side.radius1 * 1e3:.3f} to {side.radius2 * 1e3:.3f} mm, height "
            f"{side.height * 1e3:.2f} mm, half angle {math.degrees(side.half_angle):z.3f} deg, wrap "
            f"{math.degrees(side.wrap):.1f} deg, active {share:.1%}"
        )
        if design.fit is not None:
            line += f", worst {design.fit.worst * 1e3:.3f} mm, rms {design.fit.rms * 1e3:.3f} mm"
        print(line)
    for item in fit.bare if fit else ():
        print(f"bare: {item.start * 1e3:.1f} to {item.end * 1e3:.1f} mm along the axis: {item.reason}")
