"""Tiling of a drawing over pages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .cut_sheet import CutSheet

__all__ = ["PageTiling", "tile_pages"]

_SIDE = 14.0  # mm; left and right margin of a page, for crop marks
_TOP = 14.0  # mm; top margin of a page, for crop marks
_BOTTOM = 24.0  # mm; bottom margin of a page, for crop marks and the scale bar
_SAMPLE_STEP = 0.5e-3  # m; distance of points along strokes by which used pages are found


@dataclass(frozen=True, slots=True)
class PageTiling:
    """Pages of a drawing, each with a window on it; all lengths in mm.

    Attributes:
        width: of a page.
        height: of a page.
        counts: columns and rows of windows.
        origin: lower left corner of the first window in the drawing.
        extent: smallest x, smallest y, largest x and largest y of the drawing.
        cells: (column, row) of the windows that are not empty, in reading order from the top left.
    """

    width: float
    height: float
    counts: tuple[int, int]
    origin: tuple[float, float]
    extent: tuple[float, float, float, float]
    cells: tuple[tuple[int, int], ...]

    @property
    def corner(self) -> tuple[float, float]:
        """Lower left corner of the window on its page."""
        return _SIDE, _BOTTOM

    @property
    def window(self) -> tuple[float, float]:
        """Width and height of a window."""
        return self.width - 2.0 * _SIDE, self.height - _TOP - _BOTTOM


def tile_pages(sheets: Sequence[CutSheet], width: float, height: float) -> PageTiling:
    """Spread sheets over pages of a size [mm], in portrait or landscape, whichever needs fewer pages."""
    boxes = [sheet.bounds for sheet in sheets]
    extent = (
        min(box[0] for box in boxes) * 1e3,
        min(box[1] for box in boxes) * 1e3,
        max(box[2] for box in boxes) * 1e3,
        max(box[3] for box in boxes) * 1e3,
    )
    strokes = (stroke for sheet in sheets for part in sheet.parts for stroke in part.strokes)
    segments = (segment for stroke in strokes for segment in stroke.outline.segments())
    points = 1e3 * np.concatenate([one.along(math.ceil(one.length / _SAMPLE_STEP)) for one in segments])
    options = [_spread(points, extent, *size) for size in ((width, height), (height, width))]
    return min(options, key=lambda option: len(option.cells))


def _spread(
    points: NDArray[np.float64], extent: tuple[float, float, float, float], width: float, height: float
) -> PageTiling:
    x0, y0, x1, y1 = extent
    window_x, window_y = width - 2.0 * _SIDE, height - _TOP - _BOTTOM
    columns, rows = max(1, math.ceil((x1 - x0) / window_x)), max(1, math.ceil((y1 - y0) / window_y))
    left = 0.5 * (x0 + x1 - columns * window_x)
    bottom = 0.5 * (y0 + y1 - rows * window_y)
    places = (points - (left, bottom)) / (window_x, window_y)
    column, row = np.minimum(places.astype(int), (columns - 1, rows - 1)).T
    seen = {divmod(int(cell), rows) for cell in np.unique(column * rows + row)}
    cells = tuple(sorted(seen, key=lambda cell: (-cell[1], cell[0])))
    return PageTiling(width, height, (columns, rows), (left, bottom), extent, cells)
