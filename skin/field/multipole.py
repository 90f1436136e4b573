"""Exact solution of round contacts: multipole moments on each disc, coupled by the Green function of the rectangle.

For each scene of k discs the moments Q of the current obey (D + K) Q = f: D from `disc`, K the Fourier
coefficients of the Green function from circle to circle (the disc's own logarithm removed), f those of the
difference that the electrodes impose. Scaled from both sides by D^(-1/2) the matrix is well conditioned for every
conductance. The number of multipoles that a contact needs for a tolerance is found here too.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from coneskin.core.arrays import Floats
from coneskin.core.errors import FieldError

from .circles import Circles, green_block, make_circles
from .disc import Discs, bessel_ratios, centre_distance
from .fourport import Coupling
from .green import Strip
from .sheet import SectorSheet

#: Orders to choose from, so that a batch falls into few groups.
LADDER = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 64, 80, 96, 128, 192, 288, 432)

_MIN_ORDER = 4  # orders, or nothing tells how they die away

_MAX_FIRST = 128  # order up to which the first choice goes


def resolution(
    sheet: SectorSheet, discs: Discs, contrast: float, tolerance: float, order: int | None = None
) -> NDArray[np.int64]:
    """Return the order to begin with for each scene, shape (n,); `FieldModel` raises it where the solution asks for it.

    A multipole falls like exp(-2 rate m). The rate is acosh(distance/radius) for the images that act: in the
    corners, in the edges unless the sheets are equal, across the shorter side; half the bispherical distance for a
    second disc; and ln(r/radius) for the apex. Near edges and other discs are exact (`circles`), so what they cost
    depends on the contact too, and is left to the solution's own estimate.

    Args:
        contrast: |Ru - Rl| / (Ru + Rl), the strength of the images in edges.
        tolerance: of the supply, above 0.
        order: M, if it is given.
    """
    a = discs.radius
    stretch = sheet.stretch(discs.u)
    # The four corners in one go; a flat distance beyond half a turn is none, but large.
    w = np.array([0.0, 0.0, sheet.length, sheet.length]) + 1j * np.array([0.0, sheet.breadth, 0.0, sheet.breadth])
    w = w - (sheet.along(discs.u)[0] + 1j * sheet.across(discs.phi)[0])[..., None]
    kappa = sheet.curvature
    corners = np.abs(w) if kappa == 0.0 else stretch[..., None] * np.abs(np.expm1(kappa * w) / kappa)
    reach = np.minimum(corners.min(axis=-1), min(sheet.length, sheet.breadth) * stretch) / a
    rate = np.arccosh(np.maximum(reach, 1.0))
    if kappa != 0.0:
        rate = np.minimum(rate, np.log(np.maximum(stretch / (abs(kappa) * a), 1.0)))
    if contrast > 0.0:
        room = sheet.edge_distances(discs.u, discs.phi).min(axis=-1)
        # Taken out exactly, an edge costs about half of the orders, and a touching one no more than a near one.
        rate = np.minimum(rate, 1.75 * np.arccosh(np.maximum(room / a, 1.15)))
    slowest = rate.min(axis=1)
    k = a.shape[1]
    for i in range(k):
        for j in range(i):
            d = centre_distance(sheet, discs.u[:, i], discs.phi[:, i], discs.u[:, j], discs.phi[:, j])
            cosh = (d * d - a[:, i] ** 2 - a[:, j] ** 2) / (2.0 * a[:, i] * a[:, j])
            slowest = np.minimum(slowest, 1.75 * 0.5 * np.arccosh(np.maximum(cosh, 1.65)))
    if order is None:
        wanted = 0.56 * math.log(1.0 / tolerance) / np.maximum(slowest, 1e-3)
        ladder = np.array(LADDER)
        orders = ladder[np.searchsorted(ladder, np.clip(1.0 + np.ceil(wanted), _MIN_ORDER, _MAX_FIRST))]
    else:
        orders = np.full(slowest.shape, order)
    return np.asarray(orders, dtype=np.int64)


def higher(order: int, error: float = math.inf, tolerance: float = 0.0) -> int:
    """Return the order to try next: what a geometric decay to that error needs, 1.1 to 1.6 times this one."""
    known = 0.0 < error < 0.1 and tolerance > 0.0
    more = math.log(0.3 * tolerance) / math.log(error) if known else 1.45
    return min((m for m in LADDER if m >= min(max(more, 1.1), 1.6) * order), default=LADDER[-1])


def _truncation(order: int, from_half: Floats, from_last: Floats) -> Floats:
    """Estimate the error of order M from what its last multipoles still changed, shape (n,).

    Args:
        order: M.
        from_half: change by the upper half of the orders, of numbers of order 1 that the electrodes see, shape (n,).
        from_last: change by the upper quarter, shape (n,).

    Returns:
        ten times the rest of a geometric series (Aitken). Where the decay is only algebraic, as beside an edge that all
        but touches, that rest is a third to a half of the true one.
    """
    if order < 4:  # too few for a rate
        return from_last
    before = np.maximum(from_half - from_last, 0.0)
    ratio = np.minimum(from_last / np.maximum(before, 1e-300), 0.9)
    return np.asarray(np.maximum(10.0 * from_last * ratio / (1.0 - ratio), 1e-3 * from_last))


def solve_discs(
    sheet: SectorSheet,
    upper_resistance: float,
    lower_resistance: float,
    discs: Discs,
    order: int,
    points: int | None = None,
) -> tuple[Coupling, Floats]:
    """Solve n scenes of k discs at one order; sheet and resistances as of `FieldModel`.

    Args:
        discs: the scenes, checked.
        order: M, at least 1.
        points: N on each circle, above 2M; None takes 2M + 2.

    Returns:
        the coupling, its `error` from how fast the last multipoles die away, and the moments: of each disc
            (Q_0, Q_1 cos, Q_1 sin, Q_2 cos, ...) for each unit of h0, hx and hy [S], shape (n, k, 2M+1, 3).

    Raises:
        LinAlgError: a system that far too low an order has made singular.
    """
    strip = Strip.of(sheet.length, sheet.breadth)
    n, k = discs.u.shape
    size = 2 * order + 1
    rs = upper_resistance + lower_resistance
    # The upper sheet has its electrodes across x.
    a, b = (lower_resistance, upper_resistance) if strip.along_x else (upper_resistance, lower_resistance)
    circles = make_circles(sheet, strip, discs, order, points or 2 * order + 2, with_images=a != b)
    ka = np.sqrt(discs.conductance) * (math.sqrt(rs) * discs.radius)
    ratios = bessel_ratios(ka, order + 1)
    with np.errstate(divide="ignore"):
        d0 = 1.0 / (2.0 * math.pi * ka * ratios[:, :, 0])  # I_0/(ka I_1) / 2 pi, in units of rs
    root = np.sqrt(2.0 * math.pi * np.arange(1, order + 1) * ratios[:, :, :-1] * ratios[:, :, 1:])  # D_m^-1/2
    # Resistances of the bare sheets in units of rs: they set what a change of the polarisability means.
    aspects = (
        upper_resistance / rs * sheet.length / sheet.breadth,
        lower_resistance / rs * sheet.breadth / sheet.length,
    )
    if k == 1:
        block, aliased = green_block(strip, circles, 0, 0, a / rs, b / rs)
        return _solve_single(block, aliased, d0[:, 0], root[:, 0], circles, rs, order, aspects)
    scale = np.zeros((n, k, size))
    scale[:, :, 1::2] = root
    scale[:, :, 2::2] = root
    # Unknowns run over the orders first and the discs within: the last multipoles are the last unknowns.
    matrix, aliasing = np.empty((n, size, k, size, k)), np.zeros(n)
    for i in range(k):
        for j in range(i + 1):
            block, aliased = green_block(strip, circles, i, j, a / rs, b / rs)
            if i == j:
                scale[:, i, 0] = 1.0 / np.sqrt(d0[:, i] + block[:, 0, 0])
            # Between two discs it acts on the charges of both.
            felt = (scale[:, [i, j], 0] ** 2 + root[:, [i, j], 0] ** 2).min(axis=1)
            aliasing = np.maximum(aliasing, aliased * felt)
            matrix[:, :, i, :, j] = block
            matrix[:, :, j, :, i] = block.transpose(0, 2, 1)
    scale = np.ascontiguousarray(scale.transpose(0, 2, 1))
    matrix *= scale[:, :, :, None, None]
    matrix *= scale[:, None, None, :, :]
    flat = matrix.reshape(n, size * k, size * k)
    index = np.arange(k, size * k)
    flat[:, index, index] += 1.0
    index = np.arange(k)
    flat[:, index, index] = 1.0
    right = np.zeros((n, size, k, 3))
    right[:, 0, :, 0] = 1.0
    right[..., 1] = circles.x.transpose(0, 2, 1)
    right[..., 2] = circles.y.transpose(0, 2, 1)
    right *= scale[..., None]
    right_flat = right.reshape(n, size * k, 3)
    solved: Floats = np.asarray(np.linalg.solve(flat, right_flat), dtype=np.float64)
    w = right_flat.transpose(0, 2, 1) @ solved / rs
    w = 0.5 * (w + w.transpose(0, 2, 1))
    centre = np.stack([circles.x[:, :, 0].mean(axis=1), circles.y[:, :, 0].mean(axis=1)], axis=-1)
    g = np.maximum(w[:, 0, 0] * rs, 1e-300)
    reach = np.stack([1.0 / np.sqrt(g), np.full(n, aspects[0] ** 0.5), np.full(n, aspects[1] ** 0.5)], axis=1)
    norm = reach[:, :, None] * reach[:, None, :]
    norm[:, 0, 1:] = norm[:, 1:, 0] = np.maximum(1.0 / g, 0.0)[:, None]
    tails = [_tail(flat, solved, k * (2 * kept + 1), norm) for kept in _kept(order)]
    coupling = Coupling.of_matrix(w, centre, np.maximum(_truncation(order, *tails), aliasing))
    return coupling, (solved.reshape(n, size, k, 3) * scale[..., None] / rs).transpose(0, 2, 1, 3)


def _kept(order: int) -> tuple[int, int]:
    """Return the two lower orders with which the last multipoles are judged."""
    step = max(order // 4, min(2, order // 2), 1)
    return max(order - 2 * step, 0), order - step


def _tail(matrix: Floats, solved: Floats, first: int, norm: Floats) -> Floats:
    """Return what the unknowns from `first` on add to the numbers that the electrodes see, at most, shape (n,).

    The change is x^T S x with the Schur complement S of the unknowns before, which is at most the matrix itself.
    """
    last = solved[:, first:]
    change = last.transpose(0, 2, 1) @ (matrix[:, first:, first:] @ last)
    own = np.sqrt(np.abs(change[:, [0, 1, 2], [0, 1, 2]]))
    return np.asarray((own[:, :, None] * own[:, None, :] * norm).max(axis=(1, 2)))


def _solve_single(
    block: Floats,
    aliased: Floats,
    d0: Floats,
    root: Floats,
    circles: Circles,
    rs: float,
    order: int,
    aspects: tuple[float, float],
) -> tuple[Coupling, Floats]:
    """Solve one disc in each scene; eliminating the total current first keeps even a weak contact exact."""
    n, size = block.shape[0], 2 * order
    scale = np.repeat(root, 2, axis=1)
    inner = block[:, 1:, 1:] * scale[:, :, None] * scale[:, None, :]
    index = np.arange(size)
    inner[:, index, index] += 1.0
    right = np.empty((n, size, 3))
    right[:, :, 0] = block[:, 1:, 0]
    right[:, :, 1] = circles.x[:, 0, 1:]
    right[:, :, 2] = circles.y[:, 0, 1:]
    right *= scale[:, :, None]
    solved: Floats = np.asarray(np.linalg.solve(inner, right), dtype=np.float64)
    gram = right.transpose(0, 2, 1) @ solved
    spread = d0 + (block[:, 0, 0] - gram[:, 0, 0])
    x = circles.x[:, 0, 0] - gram[:, 0, 1]
    y = circles.y[:, 0, 0] - gram[:, 0, 2]
    reach = np.empty((n, 3))
    reach[:, 0], reach[:, 1:] = 1.0 / np.sqrt(np.abs(spread)), np.sqrt(aspects)
    norm = reach[:, :, None] * reach[:, None, :]
    # X and Y themselves, and the rest relative to the conductances beside it.
    norm[:, 0, 1:] = norm[:, 1:, 0] = 1.0
    error = _truncation(order, *(_tail(inner, solved, 2 * kept, norm) for kept in _kept(order)))
    error = np.maximum(error, aliased * (1.0 / np.abs(spread) + root[:, 0] ** 2))
    coupling = Coupling(1.0 / (rs * spread), x, y, gram[:, 1, 1] / rs, gram[:, 1, 2] / rs, gram[:, 2, 2] / rs, error)
    values = np.empty((n, 1, size + 1, 3))
    total = coupling.conductance[:, None] * np.stack([np.ones(n), x, y], axis=-1)
    values[:, 0, 0] = total
    rest = -solved[:, :, :1] * total[:, None, :] * rs
    rest[:, :, 1:] += solved[:, :, 1:]
    values[:, 0, 1:] = rest * scale[:, :, None] / rs
    return coupling, values


def solve_to_tolerance(
    sheet: SectorSheet, upper_resistance: float, lower_resistance: float, discs: Discs, order: int, tolerance: float
) -> tuple[Coupling, Floats]:
    """Solve one scene by multipoles at the first order from `order` on whose error is within the tolerance.

    Returns:
        the coupling and the moments, as of `solve_discs`.

    Raises:
        FieldError: even the highest order misses it.
    """
    while True:
        coupling, moments = solve_discs(sheet, upper_resistance, lower_resistance, discs, order)
        if coupling.error[0] <= tolerance:
            return coupling, moments
        if order == LADDER[-1]:
            raise FieldError(
                f"{order} multipoles leave an error of {coupling.error[0]:.1g} of the supply, above the tolerance"
                f" {tolerance:g}: a disc all but touches the apex, an edge or another disc; make it smaller, or raise"
                " the model's tolerance"
            )
        order = higher(order, float(coupling.error[0]), tolerance)
