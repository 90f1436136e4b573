"""Pictures of the paper beside the model: figures 11, 12, 16 and 17, Table 2, and what hangs on inference."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from paper_experiment import POINT_CONTACT, Experiment, Sensitivity, lead_errors
from paper_tables import TABLE_2_RADIUS_MM, decode_errors

from coneskin.core.arrays import Floats
from coneskin.skin.field.maps import ErrorMap
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.pictures import make_figure, paint_error
from coneskin.skin.field.sheet import SectorSheet

_PAPER, _OURS, _LEFT = "tab:green", "tab:blue", "tab:red"


def draw_point_contacts(path: Path, model: FieldModel) -> None:
    """Draw figure 16: errors of a point contact. The paper gives their bounds, not its points.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    figure, panels = make_figure(9.0, 4.0, columns=2)
    r, theta = np.linspace(104.0, 196.0, 70), np.linspace(4.0, 86.0, 70)
    middle_r, middle_theta = np.full(70, 150.0), np.full(70, 45.0)
    point_r = decode_errors(model, r * 1e-3, np.radians(middle_theta), 1e-3)[0] * 1e3
    point_theta = np.degrees(decode_errors(model, middle_r * 1e-3, np.radians(theta), 1e-3)[1])
    for axes, place, exact, bound, names, which in (
        (panels[0], r, point_r, POINT_CONTACT[0], ("r [mm], at 45 deg", "error of r [mm]"), 0),
        (panels[1], theta, point_theta, POINT_CONTACT[1], ("theta [deg], at 150 mm", "error of theta [deg]"), 1),
    ):
        axes.axhspan(-bound, bound, color=_PAPER, alpha=0.15, lw=0, label=f"paper: all within {bound:g}")
        axes.plot(place, exact, color=_OURS, lw=1.6, label="model: disc of 1 mm, bonded")
        for share, style in ((0.005, "--"), (0.01, ":")):
            across_r, across_theta = (r, middle_theta) if which == 0 else (middle_r, theta)
            off = lead_errors(model, across_r, across_theta, share)[which]
            axes.plot(
                place, off, style, color="gray", lw=1.2, label=f"... with driven leads of {share:.1%} of the sheet"
            )
        axes.set_xlabel(names[0])
        axes.set_ylabel(names[1])
        axes.grid(alpha=0.3)
        axes.legend(fontsize=7, loc="lower left")
    panels[0].set_title("figure 16a", fontsize=10)
    panels[1].set_title("figure 16b", fontsize=10)
    figure.savefig(path, dpi=130)


def draw_places(path: Path, table: Experiment) -> None:
    """Draw figure 17: the contacts of Table 2, where the paper's sensor saw them, and where the model sees them.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    figure, (axes,) = make_figure(6.4, 5.6)
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    paper, ours = table.places + table.paper, table.places + table.ours
    for number, place in enumerate(table.places):
        x, y = _flat(place[None])
        rim = x + TABLE_2_RADIUS_MM * np.cos(turn), y + TABLE_2_RADIUS_MM * np.sin(turn)
        axes.fill(*rim, color="lightgray", label="contact, radius 9.5 mm" if number == 0 else None)
        axes.plot(x, y, "k+", ms=9, label="its middle" if number == 0 else None)
        axes.annotate(str(number + 1), (float(x[0]) + 5.5, float(y[0]) + 5.5), fontsize=9)
    axes.plot(*_flat(paper), "s", color=_PAPER, ms=6, label="seen by the paper's sensor")
    axes.plot(*_flat(ours), "o", color=_OURS, ms=5, mfc="none", label="seen according to the model")
    radii, angles = np.linspace(125.0, 175.0, 3), np.linspace(25.0, 65.0, 5)
    for r in radii:
        axes.plot(*_flat(np.stack([np.full(50, r), np.linspace(25.0, 65.0, 50)], axis=1)), color="gray", lw=0.5)
        axes.annotate(f"{r:g} mm", tuple(float(v[0]) for v in _flat(np.array([[r, 24.0]]))), fontsize=7, va="top")
    for angle in angles:
        axes.plot(*_flat(np.stack([np.linspace(125.0, 175.0, 9), np.full(9, angle)], axis=1)), color="gray", lw=0.5)
        axes.annotate(f"{angle:g}°", tuple(float(v[0]) for v in _flat(np.array([[177.0, angle]]))), fontsize=7)
    axes.set_aspect("equal")
    axes.set_xlabel("x [mm]")
    axes.set_ylabel("y [mm]")
    axes.legend(fontsize=8, loc="lower left")
    axes.set_title("figure 17: contacts of Table 2 and the places decoded for them", fontsize=10)
    figure.savefig(path, dpi=130)


def draw_experiment(path: Path, table: Experiment) -> None:
    """Draw Table 2: the paper's errors, ours, and the residuals with their mean.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    figure, panels = make_figure(9.0, 4.0, columns=2)
    names = [f"{r:g} mm\n{theta:g} deg" for r, theta in table.places]
    at = np.arange(len(names))
    for axis, (axes, unit, name) in enumerate(zip(panels, ("mm", "deg"), ("r", "theta"), strict=True)):
        left = table.residuals[:, axis]
        for shift, values, colour, label in (
            (-0.27, table.paper[:, axis], _PAPER, "paper"),
            (0.0, table.ours[:, axis], _OURS, "model"),
            (0.27, left, _LEFT, "residual"),
        ):
            axes.bar(at + shift, values, 0.25, color=colour, label=label)
        axes.axhline(left.mean(), color=_LEFT, lw=1.0, ls="--", label=f"its mean {left.mean():.2f} {unit}")
        for x, value in zip(at, left, strict=True):
            off = value - left.mean()
            axes.annotate(f"{off:+.2f}", (x + 0.27, 0.5 * value), ha="center", fontsize=7, color="white", rotation=90)
        axes.axhline(0.0, color="black", lw=0.8)
        axes.set_xticks(at, names, fontsize=8)
        axes.set_ylabel(f"error of {name} [{unit}]")
        axes.set_ylim(1.45 * float(min(left.min(), table.paper[:, axis].min())), None)
        axes.legend(fontsize=8, ncols=2, loc="lower center")
        axes.set_title(f"{name}: residuals spread by {np.ptp(left):.2f} {unit}", fontsize=10)
    figure.suptitle("Table 2: numbers at the residuals are their distances from the mean", fontsize=10)
    figure.savefig(path, dpi=130)


def draw_sensitivities(path: Path, found: Sequence[Sensitivity]) -> None:
    """Draw what each assumption makes of figures 11b and 12b and of Table 2's residuals.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    figure, panels = make_figure(12.0, 4.4, columns=4)
    at = np.arange(len(found))[::-1]
    columns: tuple[tuple[str, list[float], list[float] | None, float | None], ...] = (
        ("fig. 11b: largest r error [mm]", [s.fig_11b_mm for s in found], None, 3.5),
        ("fig. 12b: largest theta error [deg]", [s.fig_12b_deg for s in found], None, 1.9),
        ("Table 2: residual of r [mm]", [s.mean[0] for s in found], [s.spread[0] for s in found], None),
        ("Table 2: residual of theta [deg]", [s.mean[1] for s in found], [s.spread[1] for s in found], None),
    )
    for number, (axes, (title, values, spread, paper)) in enumerate(zip(panels, columns, strict=True)):
        if spread is None:
            axes.barh(at, values, color=_OURS)
        else:
            axes.errorbar(values, at, xerr=0.5 * np.array(spread), fmt="o", color=_LEFT, capsize=3, ms=4)
            axes.axvline(0.0, color="black", lw=0.8)
        if paper is not None:
            axes.axvline(paper, color=_PAPER, lw=2.0, label=f"paper: {paper:g}")
            axes.legend(fontsize=8, loc="lower right")
        axes.set_yticks(at, [s.assumption.name for s in found] if number == 0 else [], fontsize=8)
        axes.set_title(title, fontsize=9)
        axes.grid(alpha=0.3, axis="x")
    figure.suptitle(
        "What hangs on inference; Table 2: mean of the residuals, the bar is their whole spread", fontsize=10
    )
    figure.savefig(path, dpi=130)


def _flat(places: Floats) -> tuple[Any, Any]:
    """Return (x, y) [mm] of places (r [mm], theta [deg]), shape (n, 2)."""
    r, theta = places[:, 0], np.radians(places[:, 1])
    return r * np.cos(theta), r * np.sin(theta)


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
    path: Path, sheet: SectorSheet, grid: ErrorMap, radial: bool, title: str, areas: Sequence[PlotArea], paper: float
) -> None:
    """Draw figure 11 or 12: an error map, the areas of the table, and the paper's largest error.

    Args:
        path: of the PNG.
        sheet: the paper's sector.
        grid: what to draw.
        radial: the error of r [mm]; otherwise that of theta [deg].
        title: of the picture; the largest error that is drawn is put after it.
        areas: parts of the sheet to frame.
        paper: largest error in the paper: marked on the scale, and a line where the map has it; NaN for none.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    error = grid.u_error * 1e3 if radial else np.degrees(grid.phi_error)
    limit, unit = float(np.nanmax(np.abs(error))), "mm" if radial else "deg"
    label = "decoded minus true " + ("r [mm]" if radial else "theta [deg]")
    marked = math.isfinite(paper)
    figure, axes, scale = paint_error(sheet, grid.u, grid.phi, error, label, 1.03 * paper if marked else 0.0)
    if marked:
        for level in (-paper, paper):
            scale.ax.axhline(level, color="tab:green", lw=2.0)
        if limit > paper:
            r, theta = sheet.polar(*np.meshgrid(grid.u, grid.phi, indexing="ij"))
            flat, levels = (r * np.cos(theta) * 1e3, r * np.sin(theta) * 1e3), [-paper, paper]
            axes.contour(*flat, np.nan_to_num(error), levels, colors="tab:green", linewidths=1.6, linestyles="-")
        axes.plot([], [], color="tab:green", lw=1.6, label=f"the paper's largest error: {paper:g} {unit}")
    for area, style in zip(areas, ("-", "--", ":"), strict=False):
        frame = _frame(sheet, area)
        axes.plot(*frame, style, color="black", lw=1.0, label=f"{area.label}: largest {area.largest:.4f} {unit}")
    figure.legend(loc="outside lower center", fontsize=8, frameon=False)
    axes.set_title(f"{title}: largest {limit:.3g} {unit}", fontsize=10)
    figure.savefig(path, dpi=130)


def draw_curves(path: Path, radii: Floats, curves: Sequence[tuple[str, Floats, str]], what: str, title: str) -> None:
    """Draw curves over the contact radius.

    Args:
        path: of the PNG.
        radii: of the contact [mm].
        curves: as (label, ordinate, matplotlib format).
        what: is drawn, with its unit.
        title: of the picture.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    figure, (axes,) = make_figure(5.6, 4.0)
    for label, y, style in curves:
        axes.plot(radii, y, style, label=label, lw=1.4)
    axes.set(xlabel="contact radius [mm]", ylabel=what, xlim=(0.0, radii[-1]))
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
    axes.set_title(title, fontsize=10)
    figure.savefig(path, dpi=130)
