"""The largest region on a grid that goes round, against brute force."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from numpy.typing import NDArray

from coneskin.geometry.fit.axis_plan import AxisPlan, Region, _largest_region

Grid = NDArray[np.bool_]
GRIDS = arrays(bool, array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=7), elements=st.booleans())


def holds(good: Grid, region: Region) -> bool:
    first, end, column, columns = region
    return bool(good[first:end][:, (column + np.arange(columns)) % good.shape[1]].all())


def brute(good: Grid, rows: int, columns: int, exact: bool) -> int:
    count, around = good.shape
    widths = [columns] if exact else range(columns, around + 1)
    return max(
        (
            (end - first) * wide
            for first in range(count)
            for end in range(first + rows, count + 1)
            for column in range(around)
            for wide in widths
            if wide <= around and holds(good, (first, end, column, wide))
        ),
        default=0,
    )


@settings(max_examples=80)
@given(GRIDS, st.integers(1, 3), st.integers(1, 3), st.booleans(), st.integers(0, 9))
def test_the_weighed_region_counts_most(good: Grid, rows: int, columns: int, exact: bool, seed: int) -> None:
    worth = np.random.default_rng(seed).integers(0, 5, good.shape).astype(float)
    count, around = good.shape

    def value(region: Region) -> float:
        first, end, column, wide = region
        return float(worth[first:end][:, (column + np.arange(wide)) % around].sum())

    most = max(
        (
            value((first, end, column, wide))
            for first in range(count)
            for end in range(first + rows, count + 1)
            for column in range(around)
            for wide in ([columns] if exact else range(columns, around + 1))
            if wide <= around and holds(good, (first, end, column, wide))
        ),
        default=0.0,
    )
    region = _largest_region(good, rows, columns, exact, worth)
    assert (value(region) if region else 0.0) == most
    if region:
        assert holds(good, region)
        assert region[1] - region[0] >= rows


@settings(max_examples=150)
@given(GRIDS, st.integers(1, 3), st.integers(1, 3), st.booleans())
def test_largest_region_is_the_largest(good: Grid, rows: int, columns: int, exact: bool) -> None:
    region = _largest_region(good, rows, columns, exact)
    best = brute(good, rows, columns, exact)
    if region is None:
        assert best == 0
        return
    first, end, column, wide = region
    assert holds(good, region)
    assert (end - first) * wide == best
    assert end - first >= rows
    assert wide == columns if exact else wide >= columns
    assert 0 <= column < good.shape[1]


def test_a_region_goes_round_the_seam() -> None:
    good = np.zeros((6, 10), bool)
    good[1:5, [8, 9, 0, 1]] = True
    assert _largest_region(good) == (1, 5, 8, 4)


def test_a_full_turn_is_one_region() -> None:
    good = np.ones((6, 10), bool)
    good[0, ::2] = False
    region = _largest_region(good)
    assert region is not None
    assert region[:2] == (1, 6)
    assert region[3] == 10


@pytest.mark.parametrize(("rows", "columns"), [(7, 1), (1, 11)])
def test_more_than_the_grid_is_none(rows: int, columns: int) -> None:
    assert _largest_region(np.ones((6, 10), bool), rows, columns) is None


def test_a_plan_counts_its_full_and_its_partial_wraps() -> None:
    sides = [SimpleNamespace(columns=columns) for columns in (72, 40, 30)]
    assert AxisPlan(SimpleNamespace(phi=range(72)), sides).kinds == (1, 2)  # type: ignore[arg-type]
