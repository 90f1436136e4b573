"""Radii over a grid of heights and azimuths, from which the shell of a printed part is made."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["widest_nearby", "without_undercut"]

Floats = NDArray[np.float64]


def widest_nearby(values: Floats, rows: int, columns: int) -> Floats:
    """Return the greatest value among neighbours up to a number of rows and columns away."""
    grown = values.copy()
    for axis, count in ((0, rows), (1, columns)):
        wide = grown.copy()
        for step in range(1, count + 1):
            here, there = [slice(None)] * 2, [slice(None)] * 2
            here[axis], there[axis] = slice(step, None), slice(None, -step)
            wide[tuple(here)] = np.maximum(wide[tuple(here)], grown[tuple(there)])
            wide[tuple(there)] = np.maximum(wide[tuple(there)], grown[tuple(here)])
        grown = wide
    return grown


def without_undercut(radius: Floats, phi: Floats) -> Floats:
    """Return radii that only grow seen from the middle of a part outwards, so that it can be pulled off that way."""
    away = phi - 0.5 * (phi[0] + phi[-1])
    half = np.sin(np.minimum(np.abs(away), 0.5 * math.pi))
    opened = radius.copy()
    for columns in (np.flatnonzero(away >= 0.0), np.flatnonzero(away <= 0.0)[::-1]):
        width = np.maximum.accumulate(radius[:, columns] * half[columns], axis=1)
        opened[:, columns] = np.maximum(radius[:, columns], width / np.maximum(half[columns], 1e-9))
    return opened
