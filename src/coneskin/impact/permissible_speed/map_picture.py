"""Picture of permissible speeds: over each flat sheet, over the lever, and the force of the fastest contact in time."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

from coneskin.core.errors import SceneError
from coneskin.core.picture_file import degree_ticks, write_picture
from coneskin.robot.arm.kinematics import LINK_INDEX
from coneskin.scene.values.scene import Scene
from coneskin.skin.materials import Padding

from .limits_file import LimitsFile
from .speed_map import LEVERS, SpeedMap, contact_at
from .taylor_integrator import integrate

_LEVER_INDEX = 4  # of LEVERS: 0.32 m/rad, about that of a forearm
_MAX_SHEETS = 6  # sheets that are drawn


def draw_map(scene: Scene, limits: LimitsFile, found: SpeedMap, path: Path) -> None:
    """Draw a map into a file, in the format of its suffix (png, svg, pdf).

    Raises:
        MissingExtra: matplotlib is not installed.
        SceneError: the file cannot be written, or its suffix is another.
    """
    draw, refuse = lambda figure: _compose(figure, scene, limits, found), lambda why: SceneError([why], path.name)
    write_picture(path, "the picture of the speeds", draw, refuse)


def _compose(figure: Any, scene: Scene, limits: LimitsFile, found: SpeedMap) -> None:
    sheets = list(dict.fromkeys(patch.sensor for patch in found.patches))[:_MAX_SHEETS]
    figure.set_size_inches(12.0, 3.4 * max(2, len(sheets)))
    left, right = figure.subfigures(1, 2, squeeze=False)[0]
    highest = max(curve.speeds[_LEVER_INDEX] for curve in found.curves)
    rows = left.subplots(len(sheets), 1, squeeze=False)[:, 0]
    for axes, name in zip(rows, sheets, strict=True):
        drawn = _draw_sheet(axes, scene, found, name, highest)
    label = f"permissible speed along the normal at a lever of {LEVERS[_LEVER_INDEX]:g} m/rad [m/s]"
    left.colorbar(drawn, ax=list(rows), label=label)
    curves, forces = right.subplots(2, 1)
    _draw_curves(curves, found)
    _draw_forces(forces, scene, limits, found)
    figure.suptitle(f"Permissible speeds by {limits.edition}; a model, no safety assessment", fontsize=10)


def _draw_sheet(axes: Any, scene: Scene, found: SpeedMap, name: str, highest: float) -> Any:
    side = next(item.sensor.frustum for item in scene.sensors if item.sensor.name == name)
    wrap = side.wrap
    rows = [(patch, row) for patch, row in zip(found.patches, found.table.patches, strict=True) if patch.sensor == name]
    along = sorted({patch.u for patch, _ in rows})
    around = sorted({patch.phi for patch, _ in rows})
    speeds = {(patch.u, patch.phi): found.curves[row.curve].speeds[_LEVER_INDEX] for patch, row in rows}
    columns = around if around[-1] > wrap - 1e-6 else [*around, wrap]  # a full wrap ends where it begins
    grid = [[speeds[u, around[n % len(around)]] for n in range(len(columns))] for u in along]
    drawn = axes.pcolormesh(
        [math.degrees(phi) for phi in columns],
        [1e3 * u for u in along],
        grid,
        shading="nearest",
        vmin=0.0,
        vmax=highest,
        cmap="viridis",
    )
    link = next((word for word, index in LINK_INDEX.items() if index == rows[0][0].link), "")
    axes.set(title=f"{name}, {link}", xlabel="phi [deg]", ylabel="u [mm]")
    axes.set(xlim=(0.0, math.degrees(wrap)), ylim=(0.0, 1e3 * side.slant))  # a cell of the mesh is wider than its sheet
    degree_ticks(axes.xaxis, math.degrees(wrap))
    for edge in axes.spines.values():  # the outline of the sheet; its two upright edges meet at the seam
        edge.set_visible(True)
    axes.text(0.0, 1.02, "seam", transform=axes.transAxes, fontsize=7, ha="center")
    return drawn


def _draw_curves(axes: Any, found: SpeedMap) -> None:
    """Draw all curves, and name the slowest and the fastest of the motion and of any position."""
    own, anywhere = ({getattr(row, name) for row in found.table.patches} for name in ("curve", "any_curve"))
    named: dict[int, str] = {}
    for what, numbers in (("any position", anywhere), *([("motion", own)] if found.table.lowest else [])):
        ranked = sorted(numbers, key=lambda number: found.curves[number].speeds[_LEVER_INDEX])
        for word, number in {ranked[-1]: ("fastest", ranked[-1]), ranked[0]: ("slowest", ranked[0])}.values():
            named[number] = f"{what}, {word}" if len(ranked) > 1 else what
    for number, curve in enumerate(found.curves):
        if number not in named:
            axes.plot(LEVERS, curve.speeds, color="0.75", linewidth=0.7)
    for number, name in named.items():
        curve = found.curves[number]
        mass = "any mass" if math.isinf(curve.mass) else f"up to {curve.mass:g} kg"
        axes.plot(LEVERS, curve.speeds, "o-", markersize=3, label=f"{name}: {curve.region}, {mass}")
    axes.set(
        xlabel="lever: speed of the surface over that of the leading joint [m/rad]", ylabel="permissible speed [m/s]"
    )
    axes.set(xlim=(0.0, LEVERS[-1]), ylim=(0.0, None))
    axes.legend(fontsize=7)
    axes.grid()


def _draw_forces(axes: Any, scene: Scene, limits: LimitsFile, found: SpeedMap) -> None:
    """Draw the force over time at the permissible speed, for each region that limits one."""
    padding, measured = scene.padding or Padding(), replace(limits.measured, deceleration=found.table.deceleration)
    times = [0.3 * n / 1500 for n in range(1501)]
    axes.set_xlim(0.0, 1e3 * times[-1])
    for region in limits.regions:
        curve = next((item for item in found.curves if item.region == region.name), None)
        if curve is None:
            continue
        speed = curve.speeds[_LEVER_INDEX]
        contact = contact_at(speed, LEVERS[_LEVER_INDEX], curve.mass, region, measured, padding, curve.extra)
        course = integrate(contact)
        forces = [course.force(t) for t in times]
        (line,) = axes.plot([1e3 * t for t in times], forces, label=f"{region.name} at {speed:.2f} m/s")
        axes.axhline(region.limits.transient, color=line.get_color(), linestyle="--", linewidth=0.8)
        axes.axhline(region.limits.lasting, color=line.get_color(), linestyle=":", linewidth=0.8)
        if math.isfinite(course.braked):
            axes.axvline(1e3 * course.braked, color=line.get_color(), linewidth=0.5)
    axes.set(
        xlabel="time since the contact [ms]; the arm brakes from the thin line on",
        ylabel="force [N]; limits dashed, dotted",
    )
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize=7)
    axes.grid()
