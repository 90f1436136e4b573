"""Holes and grooves bridged: the closing of a height grid, against its definition."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from coneskin.geometry.displacement_map import bridge_holes

Floats = NDArray[np.float64]


def by_definition(height: Floats, tall: int, wide: int, around: bool) -> Floats:
    """Closing: the lowest of the tops of all windows that hold the cell."""
    rows, columns = height.shape

    def cell(i: int, j: int) -> float:
        if not 0 <= i < rows or (not around and not 0 <= j < columns):
            return 0.0
        return float(height[i, j % columns])

    closed = np.empty_like(height)
    for i in range(rows):
        for j in range(columns):
            closed[i, j] = min(
                max(cell(a + k, b + m) for k in range(tall) for m in range(wide))
                for a in range(i - tall + 1, i + 1)
                for b in range(j - wide + 1, j + 1)
            )
    return closed


@settings(max_examples=40)
@given(arrays(float, (6, 8), elements=st.floats(0.0, 1.0, width=16)), st.booleans())
def test_bridging_is_a_closing(height: Floats, around: bool) -> None:
    # a bridge of 3 rows and 3 columns of 1 m
    np.testing.assert_array_equal(bridge_holes(height, 1.0, 1.0, 2.0, around), by_definition(height, 3, 3, around))


@pytest.mark.long
@settings(max_examples=10)
@given(arrays(float, (6, 8), elements=st.floats(0.0, 1.0, width=16)))
def test_a_bridge_of_kilometres_spans_everything_at_the_cost_of_the_grid(height: Floats) -> None:
    closed = by_definition(height, 25, 7, around=True)
    for bridge in (100.0, 1e3, 1e300):
        np.testing.assert_array_equal(bridge_holes(height, 1.0, 1.0, bridge), closed)


def test_a_bridge_shorter_than_a_step_changes_nothing() -> None:
    height = np.random.default_rng(1).random((5, 6))
    np.testing.assert_array_equal(bridge_holes(height, 0.01, 0.01, 0.005), height)
    wider = bridge_holes(height, 0.01, 0.01, 0.03)  # a bridge of 3 rows and 3 columns, to see the difference
    assert (wider >= height).all()
    assert (wider > height).any()
