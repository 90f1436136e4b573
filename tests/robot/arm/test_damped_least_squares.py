from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.robot.arm.damped_least_squares import (
    DAMPING_FLOOR,
    SINGULAR_BELOW,
    SINGULAR_DAMPING,
    _damping_squared,
    damped_speeds,
)
from coneskin.robot.reaction.retreat import MIN_PROGRESS

from ..arms import units

Vector = tuple[float, float, float]
COLUMN = st.tuples(*[st.floats(-1.5, 1.5)] * 3)
COLUMNS = st.lists(COLUMN, min_size=1, max_size=6)


@given(COLUMNS, units())
def test_it_is_the_damped_least_squares_of_numpy(columns: list[Vector], v: Vector) -> None:
    jacobian = np.array(columns).T
    n = len(columns)
    damping = math.sqrt(_damping_squared(columns))
    stacked = np.vstack([jacobian, damping * np.eye(n)])
    wanted = np.linalg.lstsq(stacked, np.array([*v, *[0.0] * n]), rcond=None)[0]
    # normal equations: the condition number squared, at most 1e7 here
    np.testing.assert_allclose(damped_speeds([(columns, v)])[0], wanted, rtol=1e-8, atol=1e-8)


@given(COLUMNS, units())
def test_the_point_moves_along_the_wish_and_never_faster(columns: list[Vector], v: Vector) -> None:
    moved = np.array(columns).T @ damped_speeds([(columns, v)])[0]
    assert moved @ v >= -1e-12
    assert np.linalg.norm(moved) <= 1.0 + 1e-9


@given(COLUMNS, units())
def test_joint_speeds_stay_bounded_near_any_singularity(columns: list[Vector], v: Vector) -> None:
    # sigma / (sigma^2 + damping) at the most, by the docstring, for each of up to three singular directions
    assert max(map(abs, damped_speeds([(columns, v)])[0])) <= 14.0 * math.sqrt(3.0)


@given(COLUMNS)
def test_damping_rises_exactly_where_the_smallest_singular_value_falls(columns: list[Vector]) -> None:
    n = min(len(columns), 3)
    smallest = np.linalg.svd(np.array(columns).T, compute_uv=False)[n - 1] ** 2
    damping = _damping_squared(columns)
    assert DAMPING_FLOOR <= damping <= DAMPING_FLOOR + SINGULAR_DAMPING
    if smallest > 3.0 * SINGULAR_BELOW:
        assert damping == DAMPING_FLOOR
    if smallest + DAMPING_FLOOR < 0.999 * SINGULAR_BELOW:
        assert damping > DAMPING_FLOOR


def test_with_one_joint_the_rate_is_exact() -> None:
    assert damped_speeds([([(0.0, 0.5, 0.0)], (0.0, 1.0, 0.0))])[0] == pytest.approx([0.5 / (0.25 + DAMPING_FLOOR)])


def test_no_joint_no_speed() -> None:
    assert damped_speeds([([], (0.0, 0.0, 1.0))]) == ([], DAMPING_FLOOR)


@pytest.mark.long
@settings(max_examples=300)
@given(st.lists(st.tuples(st.lists(COLUMN, min_size=6, max_size=6), units()), min_size=2, max_size=4))
def test_no_point_of_several_moves_back(points: list[tuple[list[Vector], Vector]]) -> None:
    speeds, _ = damped_speeds(points)
    for columns, v in points:
        size = sum(abs(w) * math.hypot(*c) for w, c in zip(speeds, columns, strict=True))
        assert np.array(columns).T @ speeds @ v >= -1e-8 * size - 1e-12


def test_several_points_do_as_well_as_the_quadratic_program() -> None:
    """The same problem solved exactly, through its dual by scipy's nnls, for points that nearly block each other."""
    nnls = pytest.importorskip("scipy.optimize", reason="solves the dual").nnls
    source = np.random.default_rng(7)
    stood = begun = 0
    for _ in range(500):
        joints, count = int(source.integers(1, 7)), int(source.integers(2, 5))
        base = source.uniform(-1.0, 1.0, (joints, 3))
        points: list[tuple[list[Vector], Vector]] = []
        for k in range(count):
            columns = base * source.choice([1.0, 0.3]) + source.choice([0.0, 1e-9, 0.2]) * source.normal(
                size=(joints, 3)
            )
            v = source.normal(size=3)
            if k and source.random() < 0.3:
                v = -np.array(points[0][1])  # opposite to the first
            v /= np.linalg.norm(v)
            points.append(([(float(x), float(y), float(z)) for x, y, z in columns], (v[0], v[1], v[2])))
        speeds, damping = damped_speeds(points)
        along = np.array([np.array(columns) @ v for columns, v in points])
        normal = sum(np.array(c) @ np.array(c).T for c, _ in points) + damping * np.eye(joints)
        root = np.linalg.cholesky(normal)
        free = np.linalg.solve(root, along.sum(axis=0))
        forces, _ = nnls(np.linalg.solve(root, along.T), -free)
        best = np.linalg.solve(root.T, np.linalg.solve(root, along.T) @ forces + free)
        # Touches are held one by one and none is let go: a little slower than the best, where the best is fast enough
        # for a retreat to be begun at all.
        if np.mean(along @ best) >= MIN_PROGRESS:
            assert np.mean(along @ speeds) >= np.mean(along @ best) - 0.05
            begun += 1
        assert np.min(along @ speeds) >= -1e-7  # 1e-9 of terms that sum to some 10 m/s
        stood += not any(speeds)
    assert stood > 20  # clamped
    assert begun > 100


def test_two_points_that_both_can_get_away_do() -> None:
    columns = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    turned = (math.cos(2.0), math.sin(2.0), 0.0)
    speeds, _ = damped_speeds([(columns, (1.0, 0.0, 0.0)), (columns, turned)])
    # the mean of the two directions, which is 1 rad off each
    assert speeds[:2] == pytest.approx([0.5 * (1.0 + turned[0]), 0.5 * turned[1]], abs=1e-5)


def test_a_point_that_would_go_back_is_held_while_the_other_goes() -> None:
    """Levers of 1 m and 0.2 m on the same two joints: the long one alone would push the short one back."""
    long = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
    short = [(0.2, 0.0, 0.0), (0.0, 0.2, 0.0)]
    away, other = (1.0, 0.0, 0.0), (-math.sqrt(0.5), math.sqrt(0.5), 0.0)
    speeds, _ = damped_speeds([(long, away), (short, other)])
    assert speeds[0] > 0.1
    assert speeds[1] == pytest.approx(speeds[0], rel=1e-9)  # the short one slides along its obstacle


def test_between_two_opposite_obstacles_nothing_moves() -> None:
    columns = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    speeds, _ = damped_speeds([(columns, (0.0, 0.6, 0.8)), (columns, (0.0, -0.6, -0.8))])
    assert speeds == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
