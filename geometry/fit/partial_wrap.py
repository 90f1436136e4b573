"""Largest region in length and angle for a partial wrap, on shoulders and wrists that no full wrap fits."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["largest_region"]

Region = tuple[int, int, int, int]  #: first row, end row, first column, columns


def largest_region(
    good: NDArray[np.bool_],
    rows: int = 1,
    columns: int = 1,
    exact: bool = False,
    worth: NDArray[np.float64] | None = None,
) -> Region | None:
    """Return the largest rectangle of good cells on a grid whose columns go round.

    Args:
        good: True for the cells of the (z, phi) grid that are within the tolerance, shape (k, p).
        rows: smallest number of rows.
        columns: smallest number of columns.
        exact: True to take exactly that many columns.
        worth: what each cell counts, not negative, shape (k, p); 1 by default.

    Returns:
        first row, row after the last, first column (in [0, p)) and number of columns (p for a full turn); None
        where no rectangle is large enough.
    """
    count, around = good.shape
    if columns > around or rows > count:
        return None
    filled = good.sum(axis=1)
    wide_enough = np.flatnonzero(filled >= columns)
    if len(wide_enough) < rows:
        return None
    lowest, end = int(wide_enough[0]), int(wide_enough[-1]) + 1
    good, count = good[lowest:end], end - lowest
    whole = np.cumsum(np.concatenate([good, good], axis=1), axis=1, dtype=np.int32)
    whole = np.concatenate([np.zeros((count, 1), np.int32), whole], axis=1)
    row = np.arange(1, count + 1, dtype=np.int32)[:, None]

    def runs(wide: int) -> NDArray[np.int32]:
        """Return how many rows of a block of so many columns end in each row, by its first column, shape (k, p)."""
        block = whole[:, wide : wide + around] - whole[:, :around] == wide
        return np.asarray(row - np.maximum.accumulate(np.where(block, 0, row), axis=0))

    most = columns if exact else int(filled.max())
    if worth is None:
        found = _largest(runs, rows, columns, most)
    else:
        found = _worthiest(runs, rows, columns, most, worth[lowest:end])
    return found and (found[0] + lowest, found[1] + lowest, *found[2:])


def _largest(runs: Callable[[int], NDArray[np.int32]], rows: int, columns: int, most: int) -> Region | None:
    """Return the region of most cells. A wider block is not taller, so only the widest of each height is looked for."""
    tallest: dict[int, tuple[int, int, int]] = {}

    def look(wide: int) -> int:
        if wide not in tallest:
            run = runs(wide)
            at = int(run.argmax())
            tallest[wide] = (int(run.flat[at]), *divmod(at, run.shape[1]))
        return tallest[wide][0]

    best: Region | None = None
    area, wide = 0, columns
    while wide <= most:
        tall = look(wide)
        if tall < rows or tall * most <= area:
            break
        beyond, step = most + 1, 1
        while beyond - wide > 1:
            middle = min(wide + step, (wide + beyond) // 2)
            if look(middle) == tall:
                wide, step = middle, 2 * step
            else:
                beyond, step = middle, most
        if tall * wide > area:
            _, end, first = tallest[wide]
            area, best = tall * wide, (end + 1 - tall, end + 1, first, wide)
        wide = max(wide, area // max(tall - 1, 1)) + 1
    return best


def _worthiest(
    runs: Callable[[int], NDArray[np.int32]], rows: int, columns: int, most: int, worth: NDArray[np.float64]
) -> Region | None:
    """Return the region of the cells that count most, each of them as much as ``worth`` says."""
    count, around = worth.shape
    row = np.arange(1, count + 1, dtype=np.int32)[:, None]
    sums = np.zeros((count + 1, 2 * around + 1))
    sums[1:, 1:] = np.concatenate([worth, worth], axis=1).cumsum(axis=0).cumsum(axis=1)
    best: Region | None = None
    area = 0.0
    for wide in range(columns, most + 1):
        run = runs(wide)
        if int(run.max()) < rows:
            break
        across = sums[:, wide : wide + around] - sums[:, :around]
        values = np.where(run >= rows, across[1:] - np.take_along_axis(across, row - run, axis=0), 0.0)
        at = int(values.argmax())
        if values.flat[at] > area:
            end, first = divmod(at, around)
            area, best = float(values.flat[at]), (end + 1 - int(run.flat[at]), end + 1, first, wide)
    return best
