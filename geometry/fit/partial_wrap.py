"""Largest region in length and angle for a partial wrap, on shoulders and wrists that no full wrap fits."""

from __future__ import annotations

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
    whole = np.cumsum(np.concatenate([good, good], axis=1), axis=1, dtype=np.int32)
    whole = np.concatenate([np.zeros((count, 1), np.int32), whole], axis=1)
    row = np.arange(1, count + 1, dtype=np.int32)[:, None]
    sums = None if worth is None else np.zeros((count + 1, 2 * around + 1))
    if worth is not None and sums is not None:
        sums[1:, 1:] = np.concatenate([worth, worth], axis=1).cumsum(axis=0).cumsum(axis=1)
    best: Region | None = None
    area = 0.0
    for wide in (columns,) if exact else range(columns, around + 1):
        block = whole[:, wide : wide + around] - whole[:, :around] == wide
        run = row - np.maximum.accumulate(np.where(block, 0, row), axis=0)  # rows in a block, up to this one
        if sums is not None:
            if int(run.max()) < rows:
                break
            across = sums[:, wide : wide + around] - sums[:, :around]
            values = np.where(run >= rows, across[1:] - np.take_along_axis(across, row - run, axis=0), 0.0)
            at = int(values.argmax())
            if values.flat[at] > area:
                end, first = divmod(at, around)
                area, best = float(values.flat[at]), (end + 1 - int(run.flat[at]), end + 1, first, wide)
            continue
        at = int(run.argmax())
        tall = int(run.flat[at])
        if tall < rows or tall * around <= area:  # a wider block is not taller
            break
        if tall * wide > area:
            end, first = divmod(at, around)
            area, best = tall * wide, (end + 1 - tall, end + 1, first, wide)
    return best
