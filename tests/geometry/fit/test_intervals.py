"""The intervals against brute force: the least deviation, the longest runs, the best cover."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from coneskin.geometry.fit.side import _least_deviation, balance_borders, choose_intervals, longest_intervals

from ..synthetic import Floats

RADII = st.lists(st.tuples(st.floats(0.02, 0.06), st.floats(0.0, 0.004)), min_size=1, max_size=12)


def bounds(cells: list[tuple[float, float]], step: float = 0.005) -> tuple[Floats, Floats, Floats]:
    middle, spread = np.array(cells).T
    return np.asarray(step * np.arange(len(cells)), float), middle + spread, middle - spread


@pytest.mark.long
@settings(max_examples=200)
@given(RADII)
def test_least_deviation_is_the_linear_programme(cells: list[tuple[float, float]]) -> None:
    z, high, low = bounds(cells)
    deviation, start, slope = _least_deviation(z, high, low)
    one = np.ones_like(z)
    # least t with high - t <= a + b z <= low + t
    above = np.stack([-one, -z, -one], axis=1)
    below = np.stack([one, z, -one], axis=1)
    answer = linprog(
        [0.0, 0.0, 1.0], np.concatenate([above, below]), np.concatenate([-high, low]), bounds=[(None, None)] * 3
    )
    # the solver's feasibility tolerance is 1e-7 on radii of 0.05
    assert deviation * np.hypot(1.0, slope) == pytest.approx(answer.fun, abs=2e-7)
    line = start + slope * z
    assert max((high - line).max(), (line - low).max()) == pytest.approx(deviation * np.hypot(1.0, slope), abs=1e-12)


def test_least_deviation_of_a_straight_side_is_its_spread_across_it() -> None:
    z = np.linspace(-0.1, 0.2, 50)
    radius = 0.07 + np.tan(np.radians(60.0)) * z
    deviation, start, slope = _least_deviation(z, radius + 0.002, radius - 0.002)
    assert deviation == pytest.approx(0.002 * np.cos(np.radians(60.0)), abs=1e-12)
    assert start == pytest.approx(0.07, abs=1e-12)
    assert slope == pytest.approx(np.tan(np.radians(60.0)), abs=1e-12)


def test_least_deviation_of_an_arc_is_half_its_sagitta() -> None:
    z = np.linspace(0.0, 0.1, 101)
    arc = 0.003 * (1.0 - ((z - 0.05) / 0.05) ** 2)
    deviation, _, slope = _least_deviation(z, 0.05 + arc, 0.05 + arc)
    assert deviation == pytest.approx(0.0015, abs=1e-12)
    assert slope == pytest.approx(0.0, abs=1e-12)


def heights(count: int, step: float = 0.001) -> Floats:
    return np.asarray(step * (np.arange(count) + 0.5), float)


def brute_cover(z: Floats, high: Floats, low: Floats, tolerance: float, most: int, shortest: int) -> int:
    """Most slices that any choice of intervals covers."""
    count = len(z)
    good = [
        (i, j)
        for i in range(count)
        for j in range(i + shortest, count + 1)
        if low[i:j].min() > 0.0 and _least_deviation(z[i:j], high[i:j], low[i:j])[0] <= tolerance
    ]
    best = 0
    for n in range(1, most + 1):
        for group in itertools.combinations(good, n):
            ordered = sorted(group)
            if all(a[1] <= b[0] for a, b in itertools.pairwise(ordered)):
                best = max(best, sum(j - i for i, j in ordered))
    return best


@settings(max_examples=60)
@given(
    st.lists(
        st.tuples(st.sampled_from([0.03, 0.031, 0.032, 0.036, 0.04]), st.sampled_from([0.0, 0.0005, 0.002, 0.1])),
        min_size=2,
        max_size=9,
    ),
    st.integers(1, 3),
    st.integers(2, 3),
)
def test_the_cover_is_the_best_there_is(cells: list[tuple[float, float]], most: int, shortest: int) -> None:
    z, high, low = bounds(cells, 0.05)  # slight slopes, where deviations across the axis and the side are alike
    low = np.maximum(low, 0.0)
    chosen = choose_intervals(longest_intervals(z, high, low, 0.001, shortest), most, shortest)
    assert len(chosen) <= most
    assert all(a[1] <= b[0] for a, b in itertools.pairwise(chosen))
    for i, j in chosen:
        assert j - i >= shortest
        assert _least_deviation(z[i:j], high[i:j], low[i:j])[0] <= 0.001
    assert sum(j - i for i, j in chosen) == brute_cover(z, high, low, 0.001, most, shortest)


def test_longest_from_stops_at_holes_and_steps() -> None:
    z = heights(8, 0.01)
    high = np.array([50, 50, 50, 50, 50, 60, 60, 60.0]) * 1e-3
    low = high.copy()
    low[1] = 0.0
    assert longest_intervals(z, high, low, 0.001) == [0, 1, 5, 5, 6, 8, 8, 7]


def test_no_interval_with_a_bend_is_a_slice_shorter_than_it_need_be() -> None:
    """A longer interval may have a steeper side, and slices that deviate too much along the radii not square to it."""
    z, shorter = heights(24, 0.003), []
    for seed in range(50):
        rng = np.random.default_rng(seed)
        radius = 0.06 + rng.normal(0.0, 3e-4, 24)
        for bend in rng.choice(z, 3):
            radius += rng.uniform(-1.0, 1.0) * np.maximum(0.0, z - bend)
        high, low = (radius + sign * np.abs(rng.normal(0.0, 0.0015, 24)) for sign in (1.0, -1.0))
        for first, end in enumerate(longest_intervals(z, high, low, 0.002, 3)):
            longer = slice(first, end + 1)
            if first + 3 <= end < len(z) and _least_deviation(z[longer], high[longer], low[longer])[0] <= 0.002:
                shorter.append((seed, first, end))
    assert shorter == []


def double_cone(z: Floats, belt: float) -> Floats:
    return np.where(z < belt, 0.04 + 0.2 * z, 0.04 + 0.2 * belt - 0.15 * (z - belt))


def test_a_double_cone_is_parted_at_its_belt() -> None:
    z = heights(300)
    radius = double_cone(z, 0.17)
    ends = longest_intervals(z, radius, radius, 0.001, 20)
    assert len(choose_intervals(ends, 3, 20)) == 2  # a third sheet would add nothing
    chosen = balance_borders(z, radius, radius, choose_intervals(ends, 2, 20), 20)
    (first, border), (after, end) = chosen
    assert (first, end) == (0, 300)
    assert border == after
    assert abs(border - 170) <= 1


def test_borders_between_unlike_halves_balance() -> None:
    z = heights(200)
    radius = 0.05 + 0.02 * np.sin(0.5 * np.pi * (z / 0.2) ** 2)
    chosen = balance_borders(z, radius, radius, [(0, 40), (40, 200)], 2)

    def worst(border: int) -> float:
        halves = ((0, border), (border, 200))
        return max(_least_deviation(z[i:j], radius[i:j], radius[i:j])[0] for i, j in halves)

    border = chosen[0][1]
    assert worst(border) <= min(worst(b) for b in range(10, 190)) * (1.0 + 1e-9)


def test_nothing_fits() -> None:
    z = heights(20)
    assert choose_intervals(longest_intervals(z, np.full(20, 0.06), np.full(20, 0.05), 0.001), 2) == []
    assert choose_intervals(longest_intervals(z, np.full(20, 0.06), np.zeros(20), 1.0), 2) == []


def test_slices_that_are_worth_more_are_covered_first() -> None:
    ends = [4, 4, 4, 4, 10, 10, 10, 10, 10, 10]  # two good stretches, of 4 and of 6 slices
    assert choose_intervals(ends, 1) == [(4, 10)]
    worth = np.array([2.0] * 4 + [1.0] * 6)
    assert choose_intervals(ends, 1, worth=worth) == [(0, 4)]
