"""Damped least squares: joint speeds that move a point as nearly as wanted as the arm can. Plain floats.

    minimise |J qd - v|^2 + damping^2 |qd|^2

All three rows of the point's Jacobian J count, not only the one along v: where the arm cannot follow v, the point then
moves in the possible direction nearest to it, and never faster than |v|. With the one row alone the least-norm joint
speeds drift sideways by more than they retreat (bench `retreat` prints both).

The damping is a floor of 1 mm, plus up to 50 mm as the smallest singular value of J falls below 100 mm; joint speeds
then stay below about 14 rad/s per m/s wanted (measured: 12.4), at the price of a slower point.

Source: Nakamura, Hanafusa, "Inverse kinematic solutions with singularity robustness", ASME J. Dyn. Sys. 1986; the
singular value is bounded by 1 / trace((J J^T)^-1), which is between a third of its square and its square.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from coneskin.geometry.pose import Vector

from .vectors import dot

#: damping at every position [m^2]; keeps the equations regular for a link that one or two joints move
DAMPING_FLOOR = 1e-3**2
#: further damping at a singularity [m^2]
SINGULAR_DAMPING = 0.05**2
#: square of the smallest singular value below which the further damping sets in [m^2]
SINGULAR_BELOW = 0.1**2


def _damping_squared(columns: Sequence[Vector]) -> float:
    """Return the square of the damping for a point with these Jacobian columns [m^2]."""
    if len(columns) == 1:
        smallest = dot(columns[0], columns[0]) + DAMPING_FLOOR
    elif len(columns) == 2:
        a, b = dot(columns[0], columns[0]) + DAMPING_FLOOR, dot(columns[1], columns[1]) + DAMPING_FLOOR
        smallest = (a * b - dot(columns[0], columns[1]) ** 2) / (a + b)
    else:
        xx, yy, zz = (sum(c[i] * c[i] for c in columns) + DAMPING_FLOOR for i in range(3))
        xy, xz, yz = (sum(c[i] * c[j] for c in columns) for i, j in ((0, 1), (0, 2), (1, 2)))
        kx, ky, kz = yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy
        smallest = (xx * kx - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)) / (kx + ky + kz)
    if smallest >= SINGULAR_BELOW:
        return DAMPING_FLOOR
    return DAMPING_FLOOR + SINGULAR_DAMPING * (1.0 - smallest / SINGULAR_BELOW) ** 2


def damped_speeds(points: Sequence[tuple[Sequence[Vector], Vector]]) -> tuple[list[float], float]:
    """Return the joint speeds [rad/s] that move points at once, none against its own wanted velocity.

    Minimises the sum of |J_k qd - v_k|^2, damped, under v_k . J_k qd >= 0 for each k.

    Args:
        points: for each point its Jacobian columns for the joints that may move (the same joints for all, zero columns
            where a joint does not move the point) [m/rad], and its wanted velocity [m/s].

    Returns:
        the joint speeds, zeros where no motion respects all points; and the square of the damping [m^2].
    """
    joints = range(len(points[0][0]))
    if not joints:
        return [], DAMPING_FLOOR
    damping = max(_damping_squared([c for c in columns if any(c)] or [(0.0, 0.0, 0.0)]) for columns, _ in points)
    normal = [[sum(dot(c[i], c[j]) for c, _ in points) + damping * (i == j) for j in joints] for i in joints]
    along = [[dot(column, v) for column in columns] for columns, v in points]
    wanted = [sum(row[i] for row in along) for i in joints]
    free = speeds = _solve(normal, wanted)
    held: list[list[float]] = []  # rows along which a point is held, because it would move backwards
    for _ in points:
        back = [row for row in along if row not in held and _inner(row, speeds) < -_tiny(row, speeds)]
        if not back:
            break
        held.append(min(back, key=lambda row: _inner(row, speeds)))
        pulls = [_solve(normal, row) for row in held]
        forces = _solve([[_inner(pull, row) for row in held] for pull in pulls], [_inner(row, free) for row in held])
        speeds = [free[i] - sum(f * pull[i] for f, pull in zip(forces, pulls, strict=True)) for i in joints]
    if any(_inner(row, speeds) < -_tiny(row, speeds) for row in along):
        return [0.0 for _ in joints], damping
    return speeds, damping


def _tiny(row: Sequence[float], speeds: Sequence[float]) -> float:
    """Return what rounding may leave of an inner product that is zero; below 1 pm/s nothing moves."""
    return 1e-12 + 1e-9 * sum(abs(a * b) for a, b in zip(row, speeds, strict=True))


def _solve(matrix: Sequence[Sequence[float]], right: Sequence[float]) -> list[float]:
    """Solve a small symmetric positive definite system (Cholesky); a pivot lost to rounding is kept above zero."""
    size = range(len(right))
    lower = [[0.0] * len(right) for _ in size]
    for i in size:
        for j in range(i):
            lower[i][j] = (matrix[i][j] - _inner(lower[i][:j], lower[j][:j])) / lower[j][j]
        pivot = matrix[i][i] - _inner(lower[i][:i], lower[i][:i])
        lower[i][i] = math.sqrt(max(pivot, 1e-14 * matrix[i][i]))
    y = [0.0] * len(right)
    for i in size:
        y[i] = (right[i] - _inner(lower[i][:i], y[:i])) / lower[i][i]
    for i in reversed(size):
        y[i] = (y[i] - sum(lower[j][i] * y[j] for j in range(i + 1, len(right)))) / lower[i][i]
    return y


def _inner(a: Sequence[float], b: Sequence[float]) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))
