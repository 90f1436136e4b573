"""Largest region of a profile whose columns run straight along rulings, whatever its section is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from coneskin.geometry.fit.profile import RadialProfile

__all__ = ["RuledRegion", "columns_of", "ruled_region"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class RuledRegion:
    """Cells of a profile: rows from ``first`` to before ``end``, and ``columns`` columns from ``column`` on."""

    first: int
    end: int
    column: int
    columns: int


def columns_of(region: RuledRegion, around: int) -> NDArray[np.int64]:
    """Return the columns of a region on a profile of so many columns, in order."""
    return np.arange(region.column, region.column + region.columns) % around


def ruled_region(
    profile: RadialProfile,
    apex: float | None,
    tolerance: float,
    rows: int,
    least: Floats,
    least_columns: int,
    full_only: bool = False,
) -> RuledRegion | None:
    """Return the region of largest area in which every column is straight within a tolerance.

    Args:
        profile: the hull about a line.
        apex: height at which the rulings meet, in the frame of the profile [m]; None where they are parallel to it.
        tolerance: largest distance from the ruling, across it [m].
        rows: least number of rows.
        least: smallest radius a sheet may have in each row [m], shape (k,).
        least_columns: least number of columns.
        full_only: True for full wraps only.
    """
    scale = np.ones(len(profile.z)) if apex is None else 1.0 - profile.z / apex
    usable = scale > 0.05
    scale = np.where(usable, scale, 1.0)[:, None]
    around = len(profile.phi)
    top, low = profile.radius / scale, profile.floor(tolerance) / scale
    good = profile.free() & usable[:, None] & (low > 0.0) & (profile.floor(tolerance) >= least[:, None])
    oblique = _obliquity(top, good)
    limit = 2.0 * tolerance * oblique / scale  # shape (k, p)
    best: RuledRegion | None = None
    worth = 0.0
    count = len(profile.z)
    for first in range(count - rows + 1):
        if (count - first) * around <= worth:
            break
        if not good[first].any():
            continue
        high, floor, tight = top[first].copy(), low[first].copy(), limit[first].copy()
        alive = good[first].copy()
        for end in range(first + 1, count + 1):
            if end - first > 1:
                row = end - 1
                np.maximum(high, top[row], out=high)
                np.minimum(floor, low[row], out=floor)
                np.minimum(tight, limit[row], out=tight)
                alive &= good[row] & (high - floor <= tight)
            kept = int(alive.sum())
            if kept < least_columns or kept * (count - first) <= worth:
                break
            if end - first < rows or kept * (end - first) <= worth:
                continue
            if kept == around:
                best, worth = RuledRegion(first, end, 0, around), float(around * (end - first))
                continue
            if full_only:
                break
            column, run = _longest_run(alive)
            if run >= least_columns and run * (end - first) > worth:
                best, worth = RuledRegion(first, end, column, run), float(run * (end - first))
    return best


def _obliquity(radius: Floats, good: NDArray[np.bool_]) -> Floats:
    """Return by how much a distance along a ray exceeds that square to the surface, for each column, shape (p,)."""
    shown = np.where(good & (radius > 0.0), radius, np.nan)  # a hole that is spanned may have no surface
    around = radius.shape[1]
    section = np.ones(around)
    for column in range(around):
        values = shown[:, column][np.isfinite(shown[:, column])]
        section[column] = float(np.median(values)) if len(values) else np.nan
    if not np.isfinite(section).any():
        return np.ones(around)
    section = np.where(np.isfinite(section), section, np.nanmedian(section))
    slope = (np.roll(section, -1) - np.roll(section, 1)) / (4.0 * np.pi / around * section)
    return np.asarray(np.minimum(np.hypot(1.0, slope), 2.0))


def _longest_run(alive: NDArray[np.bool_]) -> tuple[int, int]:
    """Return the first column and the length of the longest run of a ring."""
    gaps = np.flatnonzero(~alive)
    if len(gaps) == 0:
        return 0, len(alive)
    lengths = np.diff(np.concatenate([gaps, [gaps[0] + len(alive)]])) - 1
    longest = int(lengths.argmax())
    return int((gaps[longest] + 1) % len(alive)), int(lengths[longest])
