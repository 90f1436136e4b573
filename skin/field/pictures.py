"""Pictures of the field on the flat sheet: potentials with their lines, and error maps. Needs matplotlib."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from coneskin.core.arrays import Floats
from coneskin.core.errors import needed_package

from .maps import FieldMap
from .sheet import SectorSheet

_GRID_COUNT, _LINE_STEPS = 121, 160  # points along a side of a map; steps of a field line
_MIN_ANGLE = 0.1  # rad of the sector; one of less is drawn as the rectangle that it nearly is


def make_figure(width: float, height: float, columns: int = 1) -> tuple[Any, list[Any]]:
    """Make a figure [inch] and its axes side by side, without any window; the only place that imports matplotlib.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    with needed_package("matplotlib", "drawing the field", "pictures"):
        from matplotlib.figure import Figure
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, [figure.add_subplot(1, columns, number + 1) for number in range(columns)]


def _plane(sheet: SectorSheet, u: Floats, phi: Floats) -> tuple[Floats, Floats]:
    """Return flat coordinates [mm] from the apex; from the middle of end 1 where the sheet is nearly a rectangle."""
    if sheet.angle < _MIN_ANGLE:
        flat = sheet.flat(u, phi, (0.0, 0.5 * sheet.wrap))
        return flat.imag * 1e3, flat.real * 1e3
    r, theta = sheet.polar(u, phi)
    return r * np.cos(theta) * 1e3, r * np.sin(theta) * 1e3


def _outline(axes: Any, sheet: SectorSheet, names: dict[str, str]) -> None:
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
            near = np.array([0.0, 1e-3])  # on the edge, and a little inside of it
            x, y = _plane(sheet, middle_u - inside[1] * near * sheet.width, middle_phi - inside[0] * near * sheet.wrap)
            gap = 0.09 * sheet.width * 1e3 / math.hypot(x[1] - x[0], y[1] - y[0])
            at = float(x[0] + gap * (x[0] - x[1])), float(y[0] + gap * (y[0] - y[1]))
            axes.text(*at, names[name], ha="center", va="center", fontsize=9)
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
        names: electrode letter -> text, for the electrodes of this sheet.
        filled: colour the potential; otherwise only lines, as the paper's figures 4 and 6.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    sheet = field.model.sheet
    along, around = np.linspace(0.0, sheet.width, _GRID_COUNT), np.linspace(0.0, sheet.wrap, _GRID_COUNT)
    u, phi = np.meshgrid(along, around, indexing="ij")
    volts = field.potentials(u, phi)[0 if upper else 1]
    x, y = _plane(sheet, u, phi)
    figure, (axes,) = make_figure(5.6, 4.9)
    if filled:
        picture = axes.contourf(x, y, volts, np.linspace(volts.min(), volts.max(), 41), cmap="viridis")
        ticks = np.linspace(volts.min(), volts.max(), 6).round(9) + 0.0
        figure.colorbar(picture, ax=axes, label="potential [V]", shrink=0.85, ticks=ticks, format="%.3g")
    levels = np.linspace(volts.min(), volts.max(), 11)[1:-1]  # the outer ones are the electrodes
    lines = axes.contour(x, y, volts, levels, colors="white" if filled else "tab:blue", linewidths=0.9)
    axes.clabel(lines, fontsize=7, fmt="%.3g")
    _field_lines(axes, field, upper)
    turn = np.linspace(0.0, 2.0 * np.pi, 73)
    for disc in field.discs:
        middle = _plane(sheet, np.asarray(disc.u), np.asarray(disc.phi))
        rim = 1e3 * disc.radius * np.cos(turn), 1e3 * disc.radius * np.sin(turn)
        axes.plot(middle[0] + rim[0], middle[1] + rim[1], color="tab:red", linewidth=1.4)
    _outline(axes, sheet, names)
    axes.set_title(title, fontsize=10)
    figure.savefig(path, dpi=130)


def _field_lines(axes: Any, field: FieldMap, upper: bool) -> None:
    """Follow lines of current through the rectangle by the midpoint rule, from one driven electrode to the other."""
    sheet = field.model.sheet
    steps = _LINE_STEPS
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


def paint_error(
    sheet: SectorSheet, u: Floats, phi: Floats, error: Floats, label: str, reach: float = 0.0
) -> tuple[Any, Any, Any]:
    """Paint an error map on the flat sheet; blank where it is NaN.

    Args:
        u: slant distances of the grid [m], increasing, shape (n,).
        phi: azimuths of the grid [rad], increasing, shape (m,).
        error: values, shape (n, m).
        reach: value that the scale reaches at least, in the unit of the error.

    Returns:
        figure, axes and scale, to add to and to save.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    figure, (axes,) = make_figure(5.6, 4.9)
    reach = max(float(np.nanmax(np.abs(error))), reach)  # as far below 0 as above
    edges = np.meshgrid(_cell_edges(u), _cell_edges(phi), indexing="ij")
    picture = axes.pcolormesh(*_plane(sheet, *edges), error, cmap="RdBu_r", vmin=-reach, vmax=reach)
    scale = figure.colorbar(picture, ax=axes, label=label, shrink=0.85)
    _outline(axes, sheet, {})
    return figure, axes, scale
