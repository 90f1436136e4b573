"""Round contacts solved exactly: multipole moments on each disc, coupled by the Green function of the rectangle.

For each scene of k discs the moments Q of the current obey (D + K) Q = f: D from `field_disc`, K the Fourier
coefficients of the Green function from circle to circle (the disc's own logarithm removed), f those of the
difference that the electrodes impose. Scaled from both sides by D^(-1/2) the matrix is well conditioned for every
conductance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .field_circles import Circles, green_block, make_circles
from .field_coupling import Coupling
from .field_disc import Discs, bessel_ratios
from .field_green import Strip
from .field_sheet import SectorSheet

__all__ = ["Moments", "solve_discs"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Moments:
    """Multipole moments of the current for each unit of h0, hx, hy.

    Attributes:
        order: M.
        values: moments (Q_0, Q_1 cos, Q_1 sin, Q_2 cos, ...) of each disc [S], shape (n, k, 2M+1, 3).
    """

    order: int
    values: Floats


def solve_discs(
    sheet: SectorSheet,
    upper_resistance: float,
    lower_resistance: float,
    discs: Discs,
    order: int,
    points: int | None = None,
    with_moments: bool = False,
    estimate: bool = False,
) -> tuple[Coupling, Moments | None, Floats]:
    """Solve n scenes of k discs at one order.

    Args:
        sheet: the sheet.
        upper_resistance: of the sheet with the electrodes A and B [ohm per square].
        lower_resistance: of the sheet with the electrodes C and D [ohm per square].
        discs: the scenes, checked.
        order: M, at least 1.
        points: N on each circle, above 2M; None takes 2M + 2.
        with_moments: return the moments too (they take memory).
        estimate: estimate the error, from the change since half the order.

    Returns:
        the coupling, the moments if wanted, and an estimate of what the orders above M would still change: of X and Y,
        and of the rest relative to the conductances beside it, shape (n,); 0 where none is wanted.
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
    aspect_u = upper_resistance / rs * sheet.length / sheet.breadth
    aspect_l = lower_resistance / rs * sheet.breadth / sheet.length
    if k == 1:
        block = green_block(strip, circles, 0, 0, a / rs, b / rs)
        return _solve_single(
            block, d0[:, 0], root[:, 0], circles, rs, order, (aspect_u, aspect_l), with_moments, estimate
        )
    scale = np.zeros((n, k, size))
    scale[:, :, 1::2] = root
    scale[:, :, 2::2] = root
    matrix = np.empty((n, k, size, k, size))
    for i in range(k):
        for j in range(i + 1):
            block = green_block(strip, circles, i, j, a / rs, b / rs)
            if i == j:
                scale[:, i, 0] = 1.0 / np.sqrt(d0[:, i] + block[:, 0, 0])
            matrix[:, i, :, j, :] = block
            matrix[:, j, :, i, :] = block.transpose(0, 2, 1)
    matrix *= scale[:, :, :, None, None]
    matrix *= scale[:, None, None, :, :]
    flat = matrix.reshape(n, k * size, k * size)
    for i in range(k):
        matrix[:, i, 0, i, 0] = 1.0
        index = i * size + np.arange(1, size)
        flat[:, index, index] += 1.0
    right = np.zeros((n, k, size, 3))
    right[:, :, 0, 0] = 1.0
    right[..., 1] = circles.x
    right[..., 2] = circles.y
    right *= scale[..., None]
    right_flat = right.reshape(n, k * size, 3)
    solved = np.linalg.solve(flat, right_flat)
    w = right_flat.transpose(0, 2, 1) @ solved / rs
    w = 0.5 * (w + w.transpose(0, 2, 1))
    centre = np.stack([circles.x[:, :, 0].mean(axis=1), circles.y[:, :, 0].mean(axis=1)], axis=-1)
    coupling = Coupling.of_matrix(w, centre)
    shaped = solved.reshape(n, k, size, 3)
    left = np.zeros(n)
    if estimate:
        few = (np.arange(k)[:, None] * size + np.arange(order // 2 * 2 + 1)).ravel()
        part = right_flat[:, few]
        w_half = part.transpose(0, 2, 1) @ np.linalg.solve(flat[:, few[:, None], few[None, :]], part) / rs
        reach = np.sqrt([1.0, aspect_u, aspect_l])
        size_w = np.maximum(np.stack([w[:, 0, 0] * rs] * 3, axis=1), np.array([0.0, 1.0, 1.0])) ** 0.5
        reach = np.where(np.arange(3) == 0, 1.0 / np.maximum(size_w, 1e-150), reach)
        norm = reach[:, :, None] * reach[:, None, :]
        left = _left((w * rs * norm).reshape(n, 9), (w_half * rs * norm).reshape(n, 9))
    if not with_moments:
        return coupling, None, left
    return coupling, Moments(order, shaped * scale[..., None] / rs), left


def _left(full: Floats, half: Floats) -> Floats:
    """Estimate of the error of order M from the change since order M/2: geometric decay would square it, shape (n,).

    Args:
        full: numbers of order 1 that the electrodes see, shape (n, numbers).
        half: the same at half the order.
    """
    change = np.abs(full - half).max(axis=1)
    return np.asarray(1000.0 * change**1.8)


def _solve_single(
    block: Floats,
    d0: Floats,
    root: Floats,
    circles: Circles,
    rs: float,
    order: int,
    aspects: tuple[float, float],
    with_moments: bool,
    estimate: bool,
) -> tuple[Coupling, Moments | None, Floats]:
    """One disc in each scene: the total current is eliminated first, so nothing cancels however weak the contact."""
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
    solved = np.linalg.solve(inner, right)
    gram = right.transpose(0, 2, 1) @ solved
    spread = d0 + (block[:, 0, 0] - gram[:, 0, 0])
    x = circles.x[:, 0, 0] - gram[:, 0, 1]
    y = circles.y[:, 0, 0] - gram[:, 0, 2]
    coupling = Coupling(1.0 / (rs * spread), x, y, gram[:, 1, 1] / rs, gram[:, 1, 2] / rs, gram[:, 2, 2] / rs)
    left = np.zeros(n)
    if estimate:
        few = order // 2 * 2
        part = right[:, :few]
        half = part.transpose(0, 2, 1) @ np.linalg.solve(inner[:, :few, :few], part)
        reach = np.ones((n, 3))
        reach[:, 0], reach[:, 1:] = 1.0 / np.sqrt(spread), np.sqrt(aspects)
        norm = reach[:, :, None] * reach[:, None, :]
        # X and Y themselves, and the rest relative to the conductances beside it.
        norm[:, 0, 1:] = norm[:, 1:, 0] = 1.0
        left = _left((gram * norm).reshape(n, 9), (half * norm).reshape(n, 9))
    if not with_moments:
        return coupling, None, left
    values = np.empty((n, 1, size + 1, 3))
    total = coupling.conductance[:, None] * np.stack([np.ones(n), x, y], axis=-1)
    values[:, 0, 0] = total
    rest = -solved[:, :, :1] * total[:, None, :] * rs
    rest[:, :, 1:] += solved[:, :, 1:]
    values[:, 0, 1:] = rest * scale[:, :, None] / rs
    return coupling, Moments(order, values), left
