"""Round contacts solved exactly: multipole moments on each disc, coupled by the Green function of the rectangle.

For each scene of k discs the moments Q of the current obey (D + K) Q = f: D from `field_disc`, K the Fourier coefficients of
the Green function from circle to circle (the disc's own logarithm removed), f those of the difference that the electrodes
impose. The coefficients are taken from N = 2M + 2 equidistant points on each circle; everything is analytic there, so
truncation and aliasing fall together, geometrically in M.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .field_coupling import Coupling
from .field_disc import bessel_ratios
from .field_green import Points, Strip, direct_features, kernel, mirrored
from .field_sheet import SectorSheet

__all__ = ["Discs", "Moments", "auto_order", "solve_discs"]

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Orders that auto_order chooses from, so that a batch falls into few groups.
LADDER = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 64, 80, 96, 128, 160, 192, 256)


@dataclass(frozen=True, slots=True, eq=False)
class Discs:
    """n scenes of k discs each, checked; every array of shape (n, k).

    Attributes:
        u: slant distance of the centres [m].
        phi: azimuth of the centres [rad].
        radius: [m].
        conductance: per area [S/m^2].
    """

    u: Floats
    phi: Floats
    radius: Floats
    conductance: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Moments:
    """Multipole moments of the current for each unit of h0, hx, hy.

    Attributes:
        order: M.
        values: moments (Q_0, Q_1 cos, Q_1 sin, Q_2 cos, ...) of each disc [S], shape (n, k, 2M+1, 3).
    """

    order: int
    values: Floats


@dataclass(frozen=True, slots=True, eq=False)
class _Circles:
    """The circles in the rectangle, in units of P/pi where lengths."""

    offset: Complex  # x + i y of the points from their centres, (n, k, N)
    slope: Floats  # |d offset / d zeta|, (n, k, N)
    s: Floats  # centre from the near... from s = 0, (n, k)
    s_far: Floats  # from s = Sigma
    p: Floats
    p_far: Floats
    x: Floats  # Fourier coefficients of x/L, (n, k, 2M+1)
    y: Floats


@lru_cache(maxsize=64)
def _circle(order: int) -> tuple[Complex, Floats, Floats]:
    """Points zeta, |zeta - zeta'|^2 with ones on the diagonal, and the matrix that takes Fourier coefficients."""
    n = 2 * order + 2
    angle = 2.0 * math.pi * np.arange(n) / n
    zeta = np.exp(1j * angle)
    squared = 4.0 * np.sin(0.5 * (angle[:, None] - angle[None, :])) ** 2
    np.fill_diagonal(squared, 1.0)
    fourier = np.empty((2 * order + 1, n))
    fourier[0] = 1.0 / n
    m = np.arange(1, order + 1)[:, None]
    fourier[1::2] = np.cos(m * angle) * (2.0 / n)
    fourier[2::2] = np.sin(m * angle) * (2.0 / n)
    for array in (zeta, squared, fourier):
        array.setflags(write=False)
    return zeta, squared, fourier


def _circles(sheet: SectorSheet, strip: Strip, discs: Discs, order: int) -> _Circles:
    zeta, _, _ = _circle(order)
    stretch = sheet.stretch(discs.u)
    local = discs.radius / stretch  # a/h, the radius in the rectangle
    bend = (sheet.curvature * local)[:, :, None]  # q = a/r_c, signed
    if sheet.curvature == 0.0:
        offset = local[:, :, None] * zeta
        slope = np.broadcast_to(local[:, :, None], offset.shape) * strip.scale
    else:
        cos, sin = zeta.real, zeta.imag
        offset = np.empty((*local.shape, zeta.size), dtype=np.complex128)
        over = local[:, :, None] / bend
        # numpy's complex log1p loses digits near zero; the two real ones do not.
        np.multiply(0.5 * np.log1p(bend * (2.0 * cos + bend)), over, out=offset.real)
        np.multiply(np.arctan2(bend * sin, 1.0 + bend * cos), over, out=offset.imag)
        slope = local[:, :, None] * strip.scale / np.sqrt(1.0 + bend * (2.0 * cos + bend))
    x, x_far = sheet.along(discs.u)
    y, y_far = sheet.across(discs.phi)
    m = np.arange(1, order + 1)
    series = local[:, :, None] * (-bend) ** (m - 1) / m
    fx = np.zeros((*local.shape, 2 * order + 1))
    fy = np.zeros_like(fx)
    fx[:, :, 0] = x / sheet.length
    fx[:, :, 1::2] = series / sheet.length
    fy[:, :, 0] = y / sheet.breadth
    fy[:, :, 2::2] = series / sheet.breadth
    k = strip.scale
    s, s_far, p, p_far = (x, x_far, y, y_far) if strip.along_x else (y, y_far, x, x_far)
    return _Circles(offset * k, slope, s * k, s_far * k, p * k, p_far * k, fx, fy)


def _features(
    strip: Strip, circles: _Circles, i: int, j: int, equal: bool
) -> tuple[Points, Points, Floats, Floats, Floats]:
    """Points of disc i and of disc j, mirrored to the near corner; and the linear part's s_lo, s_hi, Sigma - s_hi."""
    flip_s = circles.s[:, i] + circles.s[:, j] > circles.s_far[:, i] + circles.s_far[:, j]
    flip_p = circles.p[:, i] + circles.p[:, j] > circles.p_far[:, i] + circles.p_far[:, j]
    s = [np.where(flip_s, circles.s_far[:, d], circles.s[:, d]) for d in (i, j)]
    rest = [np.where(flip_s, circles.s[:, d], circles.s_far[:, d]) for d in (i, j)]
    p = [np.where(flip_p, circles.p_far[:, d], circles.p[:, d]) for d in (i, j)]
    i_is_high = s[0] >= s[1]
    high = np.where(i_is_high, s[0], s[1])
    p_ref = np.where(i_is_high, p[0], p[1])
    made = []
    for place, d in enumerate((i, j)):
        if place == 1 and i == j:
            made.append(made[0])
            continue
        offset = mirrored(circles.offset[:, d], strip.along_x, flip_s, flip_p)
        made.append(direct_features(strip, offset, s[place], p[place], high, p_ref, equal))
    low = np.where(i_is_high, s[1], s[0])
    return made[0], made[1], low, high, np.where(i_is_high, rest[0], rest[1])


def _block(
    strip: Strip, circles: _Circles, i: int, j: int, order: int, resistance_a: float, resistance_b: float
) -> Floats:
    """Fourier coefficients of the Green function from disc j to disc i, shape (n, 2M+1, 2M+1)."""
    _, squared, fourier = _circle(order)
    first, second, low, high, rest = _features(strip, circles, i, j, resistance_a == resistance_b)
    if i == j:
        slope = circles.slope[:, i] * np.abs(1.0 + first.direct)
        values = kernel(strip, first, second, resistance_a, resistance_b, squared, slope * slope)
    else:
        values = kernel(strip, first, second, resistance_a, resistance_b)
    # The linear part: its value at the centres goes in exactly, so that long strips lose nothing by it.
    first_is_high = (circles.s[:, i] >= circles.s[:, j]) if i != j else np.ones(len(low), dtype=bool)
    if i != j:
        flipped = circles.s[:, i] + circles.s[:, j] > circles.s_far[:, i] + circles.s_far[:, j]
        first_is_high = np.where(flipped, circles.s_far[:, i] >= circles.s_far[:, j], first_is_high)
    weight_high = 1.0 - low / strip.sigma
    weight_low = rest / strip.sigma
    w1 = np.where(first_is_high, weight_high, weight_low)[:, None]
    w2 = np.where(first_is_high, weight_low, weight_high)[:, None]
    b = resistance_b / math.pi
    values += (b * (w1 * first.s))[:, :, None] + (b * (w2 * second.s - 0.0))[:, None, :]
    values -= (b / strip.sigma) * (first.s[:, :, None] * second.s[:, None, :])
    half = values.reshape(-1, values.shape[2]) @ fourier.T
    half = half.reshape(values.shape[0], values.shape[1], -1).transpose(0, 2, 1)
    out = half.reshape(-1, values.shape[1]) @ fourier.T
    block = out.reshape(values.shape[0], fourier.shape[0], -1).transpose(0, 2, 1)
    block[:, 0, 0] += b * low * rest / strip.sigma
    return block


def auto_order(sheet: SectorSheet, discs: Discs, contrast: float, tolerance: float) -> NDArray[np.int64]:
    """Order M that leaves about `tolerance` of the supply, for each scene, shape (n,).

    Args:
        sheet: the sheet.
        discs: the scenes.
        contrast: |Ru - Rl| / (Ru + Rl), the strength of the images in edges.
        tolerance: of the supply, above 0.
    """
    return np.full(discs.u.shape[0], 6)


def solve_discs(
    sheet: SectorSheet,
    upper_resistance: float,
    lower_resistance: float,
    discs: Discs,
    order: int,
    with_moments: bool = False,
) -> tuple[Coupling, Moments | None]:
    """Solve n scenes of k discs at one order.

    Args:
        sheet: the sheet.
        upper_resistance: of the sheet with the electrodes A and B [ohm per square].
        lower_resistance: of the sheet with the electrodes C and D [ohm per square].
        discs: the scenes, checked.
        order: M, at least 1.
        with_moments: return the moments too (they take memory).
    """
    strip = Strip.of(sheet.length, sheet.breadth)
    circles = _circles(sheet, strip, discs, order)
    n, k = discs.u.shape
    size = 2 * order + 1
    rs = upper_resistance + lower_resistance
    # The upper sheet has its electrodes across x.
    a, b = (lower_resistance, upper_resistance) if strip.along_x else (upper_resistance, lower_resistance)
    ka = np.sqrt(discs.conductance) * (math.sqrt(rs) * discs.radius)
    ratios = bessel_ratios(ka, order + 1)
    with np.errstate(divide="ignore"):
        d0 = 1.0 / (2.0 * math.pi * ka * ratios[:, :, 0])  # I_0/(ka I_1) / 2 pi, in units of rs
    root = np.sqrt(2.0 * math.pi * np.arange(1, order + 1) * ratios[:, :, :-1] * ratios[:, :, 1:])  # D_m^-1/2
    if k == 1:
        block = _block(strip, circles, 0, 0, order, a / rs, b / rs)
        return _solve_single(block, d0[:, 0], root[:, 0], circles, rs, order, with_moments)
    scale = np.zeros((n, k, size))
    scale[:, :, 1::2] = root
    scale[:, :, 2::2] = root
    matrix = np.empty((n, k, size, k, size))
    for i in range(k):
        for j in range(i + 1):
            block = _block(strip, circles, i, j, order, a / rs, b / rs)
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
    if not with_moments:
        return coupling, None
    return coupling, Moments(order, solved.reshape(n, k, size, 3) * scale[..., None] / rs)


def _solve_single(
    block: Floats, d0: Floats, root: Floats, circles: _Circles, rs: float, order: int, with_moments: bool
) -> tuple[Coupling, Moments | None]:
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
    if not with_moments:
        return coupling, None
    values = np.empty((n, 1, size + 1, 3))
    total = coupling.conductance[:, None] * np.stack([np.ones(n), x, y], axis=-1)
    values[:, 0, 0] = total
    rest = -solved[:, :, :1] * total[:, None, :] * rs
    rest[:, :, 1:] += solved[:, :, 1:]
    values[:, 0, 1:] = rest * scale[:, :, None] / rs
    return coupling, Moments(order, values)
