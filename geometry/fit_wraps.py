"""The largest region in length and angle where a sheet may lie: for shoulders and wrists that no full wrap fits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["largest_region"]

Region = tuple[int, int, int, int]  #: first row, end row, first column, columns


def largest_region(good: NDArray[np.bool_], rows: int = 1, columns: int = 1, exact: bool = False) -> Region | None:
    """Largest rectangle of good cells on a grid whose columns go round.

    Args:
        good: which cells of the (z, phi) grid are within the tolerance, shape (k, p).
        rows: least number of rows.
        columns: least number of columns.
        exact: take exactly that many columns, and as many rows as there are.

    Returns:
        first row, the one after the last, first column (in [0, p)) and number of columns (p for a full turn); None
        where no rectangle is large enough.
    """
    count, around = good.shape
    if columns > around or rows > count:
        return None
    best: Region | None = None
    area = 0
    height = np.zeros(around, dtype=np.int64)  # good cells in a column, up to this row
    for row in range(count):
        height = np.where(good[row], height + 1, 0)
        if row + 1 < count and np.array_equal(good[row + 1] & good[row], good[row]):
            continue  # the next row reaches no less: whatever ends here ends there
        found = _window(height, columns) if exact else _histogram(height, rows, columns)
        if found is None:
            continue
        tall, first, wide = found
        if tall >= rows and tall * wide > area:
            area, best = tall * wide, (row + 1 - tall, row + 1, first, wide)
    return best


def _window(height: NDArray[np.int64], columns: int) -> tuple[int, int, int] | None:
    """Height, first column and width of the tallest block of just so many columns."""
    twice = np.concatenate([height, height[: columns - 1]])
    least = np.lib.stride_tricks.sliding_window_view(twice, columns).min(axis=1)
    first = int(least.argmax())
    return (int(least[first]), first, columns) if least[first] else None


def _histogram(height: NDArray[np.int64], rows: int, columns: int) -> tuple[int, int, int] | None:
    """Height, first column and width of the largest block under a histogram that goes round."""
    around = len(height)
    start = int(height.argmin())  # no block but a full turn crosses the lowest column without being cut to it
    values = [*np.roll(height, -start).tolist(), -1]
    best, area = None, 0
    if values[0] >= rows:
        best, area = (values[0], 0, around), values[0] * around
    stack: list[tuple[int, int]] = []  # (first column, height), heights rising
    for column, value in enumerate(values):
        first = column
        while stack and stack[-1][1] >= value:
            first, tall = stack.pop()
            wide = column - first
            if tall >= rows and wide >= columns and tall * wide > area:
                best, area = (tall, (first + start) % around, wide), tall * wide
        stack.append((first, value))
    return best
