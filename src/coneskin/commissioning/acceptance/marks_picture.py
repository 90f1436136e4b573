"""Picture of the marks: on the unrolled sheets, and on the arm as it stands."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from coneskin.commissioning.sheet_picture import draw_sheet
from coneskin.core.arrays import Floats
from coneskin.core.errors import SceneError
from coneskin.core.picture_file import write_picture
from coneskin.scene.build import SensorOnArm, place_on_frusta
from coneskin.scene.values.scene import Scene

from .procedure import Procedure, SensorMarks

_MARK_COLOR = "#c0392b"
_CURVE_POINTS = 61  # of a curve


def draw_marks(scene: Scene, procedure: Procedure, q: Sequence[float] | None, path: Path) -> None:
    """Draw the marks of a commissioning into a file, in the format of its suffix (png, svg, pdf).

    Args:
        scene: whose sensors are commissioned.
        q: joint positions of the arm [rad]; None without an arm.

    Raises:
        MissingExtra: matplotlib is not installed.
        SceneError: the file cannot be written, or its suffix is another.
    """
    draw, refuse = lambda figure: _compose(figure, scene, procedure, q), lambda why: SceneError([why], scene.name)
    write_picture(path, "the picture of the marks", draw, refuse, dpi=110)


def _compose(figure: Any, scene: Scene, procedure: Procedure, q: Sequence[float] | None) -> None:
    sensors = procedure.sensors
    figure.set_size_inches(13.0, 5.4 * len(sensors))
    grid = figure.add_gridspec(len(sensors), 2, width_ratios=(1.25, 1.0))
    number = 1
    for row, (item, placed) in enumerate(zip(sensors, place_on_frusta(scene), strict=True)):
        _draw_sheet(figure.add_subplot(grid[row, 0]), item, number)
        if q is not None:
            _draw_arm(figure.add_subplot(grid[row, 1], projection="3d"), item, placed, q, number)
        number += len(item.plan)


def _draw_sheet(axes: Any, item: SensorMarks, first: int) -> None:
    """Draw the flat sheet as it is seen from outside the link, end 2 up."""
    cone = item.sensor.frustum
    draw_sheet(axes, cone)
    for number, mark in enumerate(item.plan, first):
        x, y = cone.flat_point(mark.u, mark.phi)
        axes.plot([1e3 * x], [1e3 * y], "o", ms=17, mfc="white", mec=_MARK_COLOR, mew=1.6)
        axes.text(1e3 * x, 1e3 * y, str(number), color=_MARK_COLOR, ha="center", va="center", fontsize=10)
    axes.set_title(f"{item.sensor.name}: the flat sheet, seen from outside the link", fontsize=10)


def _draw_arm(axes: Any, item: SensorMarks, placed: SensorOnArm, q: Sequence[float], first: int) -> None:
    """Draw the sensor's link as it stands in the base frame, with the marks and their normals."""
    from coneskin.robot.arm.kinematics import link_pose
    from coneskin.robot.arm.workspace import skeleton

    assert placed.model is not None
    cone, base_link = item.sensor.frustum, link_pose(placed.model, q, placed.link)
    turns = [cone.wrap * k / (_CURVE_POINTS - 1) for k in range(_CURVE_POINTS)]
    for part in (0.0, 0.5, 1.0):
        ring = [base_link.apply(placed.frustum.point(part * cone.slant, phi)) for phi in turns]
        axes.plot(*zip(*ring, strict=True), lw=1.0, color="tab:green")
    length = 1.2 * max(cone.radius1, cone.radius2)
    for number, mark in enumerate(item.plan, first):
        point, normal = placed.place_in_base(mark.u, mark.phi, q)
        outside = [p + length * n for p, n in zip(point, normal, strict=True)]
        axes.quiver(*outside, *(-n for n in normal), length=length, color=_MARK_COLOR, lw=1.4)  # as the finger comes
        tip = [p + 1.35 * length * n for p, n in zip(point, normal, strict=True)]
        axes.text(*tip, str(number), color=_MARK_COLOR, fontsize=11, ha="center", va="center")
    middle = base_link.apply(placed.frustum.centre(0.5 * cone.slant))
    reach = 0.5 * cone.slant + 2.0 * length
    corners = skeleton(placed.model, q)
    for start, end in itertools.pairwise(corners):
        axes.plot(*_inside(start, end, middle, reach).T, "-", lw=4, color="0.8")
    for centre, setter in zip(middle, (axes.set_xlim, axes.set_ylim, axes.set_zlim), strict=True):
        setter(centre - reach, centre + reach)
    axes.set_box_aspect((1, 1, 1), zoom=0.9)
    axes.locator_params(nbins=4)
    near = base_link.apply(placed.frustum.point(0.0, 0.0))
    axes.text(*near, "end 1", fontsize=8, color="tab:green", va="top")
    axes.set_xlabel("base x [m]", labelpad=9.0)
    axes.set_ylabel("base y [m]", labelpad=9.0)
    axes.set_zlabel("base z, up [m]", labelpad=9.0)
    axes.view_init(elev=25.0, azim=math.degrees(math.atan2(middle[1], middle[0])) + 35.0)
    axes.set_title(f"{placed.link_name} as the arm stands; arrows: fingers, green: sensor, grey: arm", fontsize=10)


def _inside(start: Sequence[float], end: Sequence[float], middle: Sequence[float], reach: float) -> Floats:
    """Return the points of a line that lie in the drawn box: what is beyond would run over the labels of its axes."""
    import numpy as np

    points: Floats = np.linspace(start, end, _CURVE_POINTS)
    points[np.abs(points - middle).max(axis=1) > reach] = np.nan
    return points
