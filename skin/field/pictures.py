"""Pictures of the field: potentials with their lines, error maps, error over contact size. Needs matplotlib."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from coneskin.core.arrays import Floats
from coneskin.core.errors import MissingExtra

from .maps import FieldMap
from .paper_tables import ErrorMap
from .sheet import SectorSheet

__all__ = ["PlotArea", "draw_curves", "draw_error", "draw_potential", "make_figure"]


class PlotArea(NamedTuple):
    """A part of a sheet in an error map.

    Attributes:
        label: what it is.
        margin_mm: its distance from the arcs [mm].
        margin_deg: its distance from the straight edges [deg].
        largest: error in it, in the unit of the map.
    """

    label: str
    margin_mm: float
    margin_deg: float
    largest: float


def make_figure(width: float, height: float, columns: int = 1) -> tuple[Any, list[Any]]:
    """Make a figure [inch] and its axes side by side, without any window; the only place that imports matplotlib.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingExtra("matplotlib", "drawing the field", "pictures") from error
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, [figure.add_subplot(1, columns, number + 1) for number in range(columns)]


def _plane(sheet: SectorSheet, u: Floats, phi: Floats) -> tuple[Floats, Floats]:
    """Return flat coordinates with the apex at the origin [mm]."""
    r, theta = sheet.polar(u, phi)
    return r * np.cos(theta) * 1e3, r * np.sin(theta) * 1e3


def _outline(axes: Any, sheet: SectorSheet, names: dict[str, str]) -> None:
    """Draw the four edges with the electrodes' names."""
    one = np.linspace(0.0, 1.0, 100)
    edges = {
        "B": (0.0 * one, one * sheet.wrap),
        "A": (0.0 * one + sheet.width, one * sheet.wrap),
        "D": (one * sheet.width, 0.0 * one),
        "C": (one * sheet.width, 0.0 * one + sheet.wrap),
    }
    for name, (u, phi) in edges.items():
        x, y = _plane(sheet, u, phi)
        live = name in names
        axes.plot(x, y, color="black", lw=2.6 if live else 0.8, solid_capstyle="round", zorder=4)
        if live:
            inside = {"B": (0.0, -1.0), "A": (0.0, 1.0), "D": (-1.0, 0.0), "C": (1.0, 0.0)}[name]
            middle_u = sheet.width * 0.5 * (1.0 + inside[1])
            middle_phi = sheet.wrap * 0.5 * (1.0 + inside[0])
            r, theta = (float(v) for v in sheet.polar(middle_u, middle_phi))
            gap = 0.05 * (float(sheet.polar(sheet.width, 0.0)[0]))
            r, along = r + inside[1] * gap, inside[0] * gap
            x0 = (r * math.cos(theta) - along * math.sin(theta)) * 1e3
            y0 = (r * math.sin(theta) + along * math.cos(theta)) * 1e3
            axes.text(x0, y0, names[name], ha="center", va="center", fontsize=9)
    axes.set_aspect("equal")
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")
    x, y = (np.concatenate([_plane(sheet, *edge)[i] for edge in edges.values()]) for i in (0, 1))
    pad = 0.1 * max(float(np.ptp(x)), float(np.ptp(y)))
    axes.set_xlim(float(x.min()) - pad, float(x.max()) + pad)
    axes.set_ylim(float(y.min()) - pad, float(y.max()) + pad)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def draw_potential(
    path: Path, field: FieldMap, upper: bool, title: str, names: dict[str, str], filled: bool = True
) -> None:
    """Draw one sheet's potential, its equipotential lines and the field lines through them.

    Args:
        path: of the PNG.
        field: what to draw; a sector, not a cylinder.
        upper: the upper sheet; otherwise the lower one.
        title: of the picture.
        names: electrode letter -> text, for the electrodes of this sheet.
        filled: colour the potential; otherwise only lines, as the paper's figures 4 and 6.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    sheet = field.model.sheet
    u, phi = np.meshgrid(np.linspace(0.0, sheet.width, 121), np.linspace(0.0, sheet.wrap, 121), indexing="ij")
    volts = field.potentials(u, phi)[0 if upper else 1]
    x, y = _plane(sheet, u, phi)
    figure, (axes,) = make_figure(5.6, 4.9)
    if filled:
        picture = axes.contourf(x, y, volts, 40, cmap="viridis")
        figure.colorbar(picture, ax=axes, label="potential [V]", shrink=0.85)
    lines = axes.contour(x, y, volts, 11, colors="white" if filled else "tab:blue", linewidths=0.9)
    axes.clabel(lines, fontsize=7, fmt="%.2g")
    _field_lines(axes, field, upper)
    _outline(axes, sheet, names)
    axes.set_title(title, fontsize=10)
    figure.savefig(path, dpi=130)


def _field_lines(axes: Any, field: FieldMap, upper: bool) -> None:
    """Follow lines of current through the rectangle by the midpoint rule, from one driven electrode to the other."""
    sheet = field.model.sheet
    steps = 160
    start = np.asarray((np.arange(13) + 0.5) / 13.0, dtype=np.float64)
    length, breadth = sheet.length, sheet.breadth
    x: Floats
    y: Floats
    x, y = (0.0 * start + 1e-3 * length, start * breadth) if upper else (start * length, 0.0 * start + 1e-3 * breadth)
    step = (length if upper else breadth) / steps
    track: list[tuple[Floats, Floats]] = [(x.copy(), y.copy())]

    def direction(x: Floats, y: Floats) -> tuple[Floats, Floats]:
        u, phi = sheet.locate(np.clip(x, 0.0, length), np.clip(y, 0.0, breadth))
        j = field.currents(np.clip(u, 0.0, sheet.width), np.clip(phi, 0.0, sheet.wrap))
        east, north = (j[0], j[1]) if upper else (j[2], j[3])
        size = np.maximum(np.hypot(east, north), 1e-300)
        sense = np.sign(east if upper else north)
        return sense * east / size, sense * north / size

    for _ in range(steps + steps // 4):
        east, north = direction(x, y)
        east, north = direction(x + 0.5 * step * east, y + 0.5 * step * north)
        x, y = np.clip(x + step * east, 0.0, length), np.clip(y + step * north, 0.0, breadth)
        track.append((x.copy(), y.copy()))
    xs, ys = np.stack([t[0] for t in track]), np.stack([t[1] for t in track])
    u, phi = sheet.locate(xs, ys)
    px, py = _plane(sheet, np.clip(u, 0.0, sheet.width), np.clip(phi, 0.0, sheet.wrap))
    axes.plot(px, py, color="black", lw=0.7, zorder=3)


def _cell_edges(middles: Floats) -> Floats:
    """Return the edges of the cells around increasing middles; the outermost middles are edges too."""
    return np.concatenate([middles[:1], 0.5 * (middles[1:] + middles[:-1]), middles[-1:]])


def _frame(sheet: SectorSheet, area: PlotArea) -> tuple[Floats, Floats]:
    """Return the line around an area, in flat coordinates [mm]."""
    r = np.array([float(sheet.polar(u, 0.0)[0]) * 1e3 for u in (0.0, sheet.width)])
    inner, outer = float(r.min()) + area.margin_mm, float(r.max()) - area.margin_mm
    start, end = math.radians(area.margin_deg), sheet.angle - math.radians(area.margin_deg)
    along = np.linspace(start, end, 100)
    theta = np.concatenate([along, along[::-1], along[:1]])
    radius = np.concatenate([np.full(100, inner), np.full(100, outer), [inner]])
    return radius * np.cos(theta), radius * np.sin(theta)


def draw_error(
    path: Path,
    model_sheet: SectorSheet,
    grid: ErrorMap,
    radial: bool,
    title: str,
    areas: Sequence[PlotArea] = (),
    paper: float = math.nan,
) -> None:
    """Draw an error map on the sector; blank where the disc would not fit.

    Args:
        path: of the PNG.
        model_sheet: the sheet.
        grid: what to draw.
        radial: the error of r; otherwise that of theta.
        title: of the picture; the largest error that is drawn is put after it.
        areas: parts of the sheet to frame.
        paper: largest error in the paper, in the unit of the map: marked on the scale, and a line where the map has it.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    theta, r = np.meshgrid(np.radians(_cell_edges(grid.theta_deg)), _cell_edges(grid.r_mm))
    error = grid.r_error_mm if radial else grid.theta_error_deg
    figure, (axes,) = make_figure(5.6, 4.9)
    limit = float(np.nanmax(np.abs(error)))
    x, y = r * np.cos(theta), r * np.sin(theta)
    reach = max(limit, 1.03 * paper) if math.isfinite(paper) else limit
    picture = axes.pcolormesh(x, y, error, cmap="RdBu_r", vmin=-reach, vmax=reach)
    label = "decoded minus true " + ("r [mm]" if radial else "theta [deg]")
    scale = figure.colorbar(picture, ax=axes, label=label, shrink=0.85)
    _outline(axes, model_sheet, {})
    unit = "mm" if radial else "deg"
    if math.isfinite(paper):
        for level in (-paper, paper):
            scale.ax.axhline(level, color="tab:green", lw=2.0)
        middle = np.meshgrid(np.radians(grid.theta_deg), grid.r_mm)
        flat = middle[1] * np.cos(middle[0]), middle[1] * np.sin(middle[0])
        if limit > paper:
            axes.contour(
                *flat, np.nan_to_num(error), [-paper, paper], colors="tab:green", linewidths=1.6, linestyles="-"
            )
        axes.plot([], [], color="tab:green", lw=1.6, label=f"the paper's largest error: {paper:g} {unit}")
    for area, style in zip(areas, ("-", "--", ":"), strict=False):
        frame = _frame(model_sheet, area)
        axes.plot(*frame, style, color="black", lw=1.0, label=f"{area.label}: largest {area.largest:.4f} {unit}")
    if areas:
        figure.legend(loc="outside lower center", fontsize=8, frameon=False)
    axes.set_title(f"{title}: largest {limit:.3g} {unit}", fontsize=10)
    figure.savefig(path, dpi=130)


def draw_curves(
    path: Path, x: Floats, panels: Sequence[Sequence[tuple[str, Floats, str]]], labels: tuple[str, str], title: str
) -> None:
    """Draw curves over one axis.

    Args:
        path: of the PNG.
        x: abscissa.
        panels: one above the other, each with a scale of its own; their curves as (label, ordinate, matplotlib format).
        labels: of the axes.
        title: of the picture.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    figure, (axes,) = make_figure(5.6, 4.0 if len(panels) == 1 else 2.7 * len(panels))
    axes.remove()
    for number, curves in enumerate(panels):
        axes = figure.add_subplot(len(panels), 1, number + 1)
        for label, y, style in curves:
            axes.plot(x, y, style, label=label, lw=1.4)
        axes.set_ylabel(labels[1])
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8)
        if number == 0:
            axes.set_title(title, fontsize=10)
    axes.set_xlabel(labels[0])
    figure.savefig(path, dpi=130)
