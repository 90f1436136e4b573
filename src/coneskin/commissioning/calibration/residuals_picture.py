"""Picture of a calibration: on the flat sheet, by how much each touch is read off its mark, before and after."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from coneskin.commissioning.misreadings import miss
from coneskin.commissioning.sheet_picture import OUTLINE, draw_sheet
from coneskin.core.errors import SceneError
from coneskin.core.picture_file import write_picture

from .calibrate import CalibrationResult
from .fit import KnownTouch

_BEFORE_COLOR, _AFTER_COLOR = "#888888", "#c0392b"
_ARROW_PART = 0.12  # of the slant, of the longest arrow
_ARROW_SCALES = (1, 2, 5, 10, 20, 50, 100, 200, 500)


def draw_residuals(results: Sequence[CalibrationResult], path: Path) -> None:
    """Draw the residuals of all sensors into a file, in the format of its suffix (png, svg, pdf).

    Raises:
        MissingExtra: matplotlib is not installed.
        SceneError: the file cannot be written, or its suffix is another.
    """
    draw, refuse = lambda figure: _compose(figure, results), lambda why: SceneError([why], path.name)
    write_picture(path, "the picture of the residuals", draw, refuse, dpi=110)


def _compose(figure: Any, results: Sequence[CalibrationResult]) -> None:
    figure.set_size_inches(8.0, 5.6 * len(results))
    for number, result in enumerate(results, 1):
        _draw(figure.add_subplot(len(results), 1, number), result)


def _draw(axes: Any, result: CalibrationResult) -> None:
    item, fit = result.touches, result.fit
    cone = item.sensor.frustum
    draw_sheet(axes, cone)
    touches = [item.touches[number] for number in item.valid]
    before = [miss(item.sensor, *touch) for touch in touches]
    largest = max(math.hypot(*step) for step in before)
    scale = max((value for value in _ARROW_SCALES if value * largest <= _ARROW_PART * cone.slant), default=1)
    for number, (touch, step) in enumerate(zip(touches, before, strict=True)):
        left = None if fit is None else tuple(-value for value in fit.left[number])
        used = fit is None or fit.used[number]
        first = number == 0
        _arrow(axes, cone, touch, step, scale, _BEFORE_COLOR, "read, without a map" if first else "_")
        if left is not None:
            label = "with a map fitted without this touch" if first else "_"
            _arrow(axes, cone, touch, left, scale, _AFTER_COLOR, label)
        x, y = cone.flat_point(*touch.mark)
        axes.plot([1e3 * x], [1e3 * y], "o" if used else "x", ms=3, mfc="white", mec=OUTLINE)
    said = "refused" if fit is None else f"{1e3 * fit.before.rms:.2f} mm became {1e3 * fit.after.rms:.2f} mm (rms)"
    axes.set_title(f"{item.sensor.name}: {said}; arrows {scale} times as long as the errors", fontsize=10)
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.1), ncols=2, fontsize=8, frameon=False)


def _arrow(axes: Any, cone: Any, touch: KnownTouch, step: Sequence[float], scale: int, color: str, label: str) -> None:
    u, phi = touch.mark
    x, y = cone.flat_point(u, phi)
    along, around = scale * step[0], scale * step[1] / cone.radius_at(u)
    tip_x, tip_y = cone.flat_point(u + along, phi + around)
    axes.plot([1e3 * x, 1e3 * tip_x], [1e3 * y, 1e3 * tip_y], color=color, lw=1.6, label=label)
