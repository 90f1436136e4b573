"""Pictures of the report, in one list: the link, the layouts, the jigs, and the deviations from the mesh."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from coneskin.core.errors import needed_package
from coneskin.core.picture_file import degree_ticks, picture_style
from coneskin.geometry.displacement_map import heights_by_ray
from coneskin.geometry.fit.bare_areas import BareArea
from coneskin.geometry.fit.touch_weights import TouchWeights
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.ray_casting import RayCaster

from .link_picture import draw_jig, draw_link, draw_robot, draw_weights
from .sheet_pictures import draw_layout, draw_parts, draw_seam, draw_stack
from .sheets.sheet_design import SheetDesign
from .workshop.build_figures import BuildFigures


def draw_pictures(
    folder: Path,
    designs: tuple[SheetDesign, ...],
    figures: Sequence[BuildFigures],
    mesh: Mesh | None,
    tolerance: float,
    progress: Callable[[str], None],
    bare: Sequence[BareArea] = (),
    weights: TouchWeights | None = None,
) -> list[tuple[str, str]]:
    """Draw the link with its sheets, and of each sheet its layout, its stack, and the map of deviations.

    Args:
        folder: output folder; the pictures go into its pictures/.
        designs: the sheets.
        figures: for building each of them.
        mesh: of the link, in the frame of the sheets; None for a link given by its dimensions.
        tolerance: of the fit [m].
        progress: called with the name of each step.
        bare: what no sheet covers, by reason; each has a colour of its own.
        weights: what areas count; None where all count the same.

    Returns:
        caption and path in the folder of each picture.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    (folder / "pictures").mkdir()
    done: list[tuple[str, str]] = []

    def picture(name: str, size: tuple[float, float], caption: str, draw: Callable[..., None], *args: Any) -> None:
        _draw_file(folder / "pictures" / f"{name}.png", size, draw, *args)
        done.append((caption, f"pictures/{name}.png"))

    progress("drawing the link")
    faces = {face.name: face for item in figures for face in item.placement.faces}
    caption = (
        "The link with its sheets from two sides: outer faces in colour, middle lines of the electrodes in orange, "
        "edges black."
        + (" The flat faces F1 and so on, from which places are measured, are outlined." if faces else "")
        + (" What is bare is tinted by its reason." if bare else "")
    )
    picture("link", (13, 7.5), caption, draw_link, designs, mesh, bare, tuple(faces.values()))
    if weights is not None and mesh is not None:
        progress("drawing what counts")
        caption = f"What counts on the link, by {weights.name}, from two sides."
        picture("weights", (10, 6), caption, draw_weights, mesh, designs, weights)
    for design, item in zip(designs, figures, strict=True):
        name, title = design.name.replace(" ", "-"), design.name.capitalize()
        progress(f"{design.name}: drawing the layout")
        caption = f"{title}, flat, seen from outside, and the way of its wires; dimensions in mm."
        x0, y0, x1, y1 = design.cuts[4].bounds
        picture(
            f"{name}-layout", (9, min(7.0, 3.5 + 9.0 * (y1 - y0) / (x1 - x0))), caption, draw_layout, design, item.wires
        )
        progress(f"{design.name}: drawing how it is built")
        caption = f"{title}: its seven parts in the order of assembly, each seen from outside."
        picture(f"{name}-stack", (9, 7), caption, draw_stack, design)
        where = "seam" if design.has_seam else "two edges, which do not meet"
        picture(f"{name}-seam", (9, 3.8), f"{title}: section of its {where}, thickness enlarged.", draw_seam, design)
        picture(f"{name}-parts", (9, 10), f"{title}: its parts as they are cut.", draw_parts, design)
        if item.collars:
            progress(f"{design.name}: drawing the jig")
            caption = f"{title}: parts of its jig as they are printed, a little apart."
            picture(f"{name}-jig", (10, 4.5), caption, draw_jig, item.collars)
        if mesh is not None and not design.above:
            progress(f"{design.name}: measuring deviations")
            caption = (
                f"{title}: height of the mesh above the {design.place.kind}. Grey: holes and grooves deeper than the "
                "tolerance, which the sheet bridges."
            )
            picture(f"{name}-deviation", (8, 4.2), caption, _draw_deviation, design, mesh, tolerance)
    return done


def _draw_deviation(figure: Any, design: SheetDesign, mesh: Mesh, tolerance: float) -> None:
    """Draw the height of the mesh above the side of a sheet over azimuth and slant distance."""
    from matplotlib import colormaps

    side = design.place.frustum
    u = np.asarray(side.slant * (np.arange(180) + 0.5) / 180.0, np.float64)
    phi = np.asarray(side.wrap * (np.arange(360) + 0.5) / 360.0, np.float64)
    heights = heights_by_ray(RayCaster(mesh), design.place, u, phi, tolerance) * 1e3
    axes = figure.add_subplot()
    shown = np.ma.masked_where(heights < -1e3 * tolerance, heights)
    limit = 1e3 * tolerance  # so that pictures can be compared, and white is a good fit
    axes.set_facecolor("#999999")
    extent = (0.0, math.degrees(side.wrap), 0.0, side.slant * 1e3)
    image = axes.imshow(
        shown, origin="lower", aspect="auto", extent=extent, cmap=colormaps["RdBu_r"], vmin=-limit, vmax=limit
    )
    figure.colorbar(image, label=f"height above the {design.place.kind} [mm]")
    axes.set(
        xlabel="azimuth phi [deg]",
        ylabel="slant distance u from end 1 [mm]",
        title=f"{design.name}: deviation of the mesh from the {design.place.kind}, tolerance {1e3 * tolerance:g} mm",
    )
    degree_ticks(axes.xaxis, math.degrees(side.wrap))
    for edge in axes.spines.values():  # the outline of the sheet
        edge.set_visible(True)
    seam = "seam" if design.has_seam else "edge"
    for at in (0.0, 1.0):
        axes.text(at, 1.01, seam, transform=axes.transAxes, fontsize=7, ha="center")


def _draw_file(file: Path, size: tuple[float, float], draw: Callable[..., None], *args: Any) -> None:
    """Write a file with what a function draws on an empty figure of a size [inch]."""
    with needed_package("matplotlib", "drawing pictures (--no-pictures leaves them out)", "design"):
        from matplotlib.figure import Figure
    with picture_style():
        figure = Figure(figsize=size, layout=None if draw in (draw_link, draw_robot) else "constrained")
        draw(figure, *args)
        figure.savefig(file, dpi=130, bbox_inches="tight", pad_inches=0.15)


def draw_curve(figure: Any, steps: Sequence[tuple[int, float]], names: Sequence[str], included: int) -> None:
    """Draw what touchable area [m2] each number of wires allows on a robot.

    Args:
        figure: an empty figure of matplotlib.
        steps: wires and area.
        names: of the sheet that each brings.
        included: how many of them are included.
    """
    points = [(0.0, 0.0), *((float(wires), 1e4 * area) for wires, area in steps)]
    axes = figure.add_subplot()
    axes.step(*zip(*points, strict=True), where="post", color="#2a7fb8")
    axes.plot(*zip(*points[1 : included + 1], strict=True), "o", color="#2a7fb8")
    look: dict[str, Any] = {"fontsize": 7, "rotation": -35, "rotation_mode": "anchor", "va": "top"}  # none on the next
    for at, name in zip(points[1:], names, strict=True):
        axes.annotate(name, at, (6, -4), textcoords="offset points", **look)
    axes.set(xlabel="wires", ylabel="touchable active area [cm2]")
