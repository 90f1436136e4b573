"""Reference of another kind for discs: a boundary-integral solution on points that crowd where the rim needs them.

No multipoles, no closed-form images and no Bessel functions' ratios: the unknown is a layer of charge on each rim, at
points that crowd towards the apex, an edge or another disc by as many octaves as the gap needs. The logarithms are
integrated by Kress's rule (Boundary integral equations in time-harmonic acoustic scattering, 1991); the inside of a
disc, lap d = k^2 d, is a layer of K_0. The Green functions are written as sums of images of a strip, not as theta
functions. So neither truncation nor aliasing is shared with `coneskin.skin.field`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from coneskin.skin.field.disc import Disc
from coneskin.skin.field.sheet import SectorSheet

Floats = NDArray[np.float64]

_OCTAVE = 4.0  # ratio of the scales at which points crowd


def solve_rims(
    sheet: SectorSheet, upper: float, lower: float, discs: Sequence[Disc], points: int = 24
) -> NDArray[np.float64]:
    """Solve one scene of discs, bonded or of ka up to about 12.

    Args:
        sheet: the sheet.
        upper: resistance of the sheet with A and B [ohm per square].
        lower: resistance of the sheet with C and D [ohm per square].
        discs: the contacts.
        points: on a rim for each scale of each place where they crowd; even.

    Returns:
        the matrix W of `Coupling` [S], shape (3, 3).
    """
    rs = upper + lower
    rims = [_Rim(sheet, discs, i, points) for i in range(len(discs))]
    size = sum(rim.theta.size for rim in rims)
    matrix, charge, wanted = np.zeros((size, size)), np.zeros((size, size)), np.empty((size, 3))
    start = np.cumsum([0, *(rim.theta.size for rim in rims)])
    for i, one in enumerate(rims):
        rows = slice(start[i], start[i + 1])
        inside, sigma = _inside(one, discs[i], rs)
        charge[rows, rows] = sigma
        matrix[rows, rows] += inside
        wanted[rows, 0] = 1.0
        wanted[rows, 1], wanted[rows, 2] = one.x / sheet.length, one.y / sheet.breadth
        for j, other in enumerate(rims):
            columns = slice(start[j], start[j + 1])
            matrix[rows, columns] += _green(sheet, upper, lower, one, other) @ (
                sigma if i == j else _inside(other, discs[j], rs)[1]
            )
    solved = np.linalg.solve(matrix, wanted)
    w = wanted.T @ (charge @ solved)
    return np.asarray(0.5 * (w + w.T))


def guide_volts(sheet: SectorSheet, upper: float, lower: float, w: Floats) -> Floats:
    """Return the guides C, D of the radial phase and A, B of the angular one at 1 V, shape (4,), from W."""
    g = w[0, 0]
    x, y = w[0, 1] / g, w[0, 2] / g
    xx, xy, yy = w[1, 1] - g * x * x, w[1, 2] - g * x * y, w[2, 2] - g * y * y
    first = -xy / (sheet.length / (lower * sheet.breadth) + yy)
    second = xy / (sheet.breadth / (upper * sheet.length) + xx)
    d, b = 1.0 - x - first * y, y - second * x
    return np.array([d + first, d, b + second, b])


class _Rim:
    """Points of one rim: t equidistant, theta(t) crowding towards what is near."""

    def __init__(self, sheet: SectorSheet, discs: Sequence[Disc], index: int, points: int) -> None:
        disc = discs[index]
        self.radius = a = disc.radius
        kappa, h = sheet.curvature, float(sheet.stretch(disc.u))
        q = kappa * a / h
        spots: list[tuple[float, float]] = [(disc.u / a - 1.0, math.pi), ((sheet.width - disc.u) / a - 1.0, 0.0)]
        if q:
            spots.append((1.0 / abs(q) - 1.0, math.pi if q > 0.0 else 0.0))
        for y, side in ((sheet.arc * disc.phi / sheet.wrap, -1.0), (sheet.arc * (1 - disc.phi / sheet.wrap), 1.0)):
            if abs(kappa * y) < 0.5 * math.pi:
                room = math.sin(kappa * y) * h / kappa if kappa else y
                spots.append((room / a - 1.0, side * (0.5 * math.pi + kappa * y)))
        for other in (d for i, d in enumerate(discs) if i != index):
            to = complex(sheet.flat(np.array(other.u), np.array(other.phi), (disc.u, disc.phi)))
            spots.append(((abs(to) - a - other.radius) / a, math.atan2(to.imag, to.real)))
        maps: list[tuple[float, float]] = []
        for gap, at in spots:
            scale = 0.5
            while gap < 2.0 * scale and scale > 1e-9:
                maps.append((1.0 - scale, at))
                scale /= _OCTAVE
        n = points * (2 + len(maps))
        self.t = 2.0 * math.pi * np.arange(n) / n
        self.theta, self.speed = _crowd(self.t, maps)
        z = a * np.exp(1j * self.theta)
        w = z / h if kappa == 0.0 else _log1p(q * np.exp(1j * self.theta)) / kappa
        self.offset = np.asarray(w)
        self.slope = a / np.abs(h + kappa * z) * self.speed  # |dw/dt|
        # From the centre's two distances each, so that a point near an edge keeps its digits.
        x, x_far = (float(v) for v in sheet.along(disc.u))
        y, y_far = (float(v) for v in sheet.across(disc.phi))
        self.x, self.x_far = x + self.offset.real, x_far - self.offset.real
        self.y, self.y_far = y + self.offset.imag, y_far - self.offset.imag


def _log1p(z: NDArray[np.complex128]) -> NDArray[np.complex128]:
    return np.asarray(0.5 * np.log1p(2.0 * z.real + np.abs(z) ** 2) + 1j * np.arctan2(z.imag, 1.0 + z.real))


def _crowd(t: Floats, maps: Sequence[tuple[float, float]]) -> tuple[Floats, Floats]:
    """Return theta and dtheta/dt where t is the mean of theta and of its images under maps of the disc to itself."""
    share = 1.0 / (2 + len(maps))

    def forward(theta: Floats) -> tuple[Floats, Floats]:
        total, slope = 2.0 * share * theta, np.full_like(theta, 2.0 * share)
        for rho, at in maps:
            angle = np.remainder(theta - at + math.pi, 2.0 * math.pi) - math.pi
            turns = theta - at - angle
            total = total + share * (turns + at + 2.0 * np.arctan((1.0 + rho) / (1.0 - rho) * np.tan(0.5 * angle)))
            slope = slope + share * (1.0 - rho**2) / ((1.0 - rho) ** 2 + 4.0 * rho * np.sin(0.5 * angle) ** 2)
        return total, slope

    low, high = np.full_like(t, -3.0 * math.pi), np.full_like(t, 5.0 * math.pi)
    theta = t.copy()
    for step in range(200):
        got, slope = forward(theta)
        high, low = np.where(got > t, np.minimum(high, theta), high), np.where(got <= t, np.maximum(low, theta), low)
        new = theta - (got - t) / slope
        bad = (new <= low) | (new >= high)
        new = np.where(bad, 0.5 * (low + high), new)
        if np.abs(new - theta).max() < 1e-16 * (1 + step):
            break
        theta = new
    return theta, 1.0 / forward(theta)[1]


def _kress(n: int) -> Floats:
    """Return the weights R of the integral of ln(4 sin^2((t - t')/2)) f(t') dt' on n equidistant points, (n, n)."""
    lag = 2.0 * math.pi * np.arange(n) / n
    m = np.arange(1, n // 2)
    row = -(4.0 * math.pi / n) * (np.cos(np.outer(lag, m)) / m).sum(axis=1)
    row -= (4.0 * math.pi / n**2) * np.cos(n // 2 * lag)
    return np.asarray(row[(np.arange(n)[:, None] - np.arange(n)[None, :]) % n])


def _inside(rim: _Rim, disc: Disc, rs: float) -> tuple[Floats, Floats]:
    """Return what the unknown layer means: d on the rim, and the charge dt, times rs, that the outside feels."""
    n = rim.theta.size
    if math.isinf(disc.conductance):
        return np.zeros((n, n)), np.eye(n)
    weight, even = _kress(n), 2.0 * math.pi / n
    k = math.sqrt(disc.conductance * rs)
    a = rim.radius
    half = np.sin(0.5 * (rim.theta[:, None] - rim.theta[None, :]))
    np.fill_diagonal(half, 0.5)  # its functions' diagonals are put in below
    chord = 2.0 * a * np.abs(half)
    lag = np.abs(2.0 * np.sin(0.5 * (rim.t[:, None] - rim.t[None, :])))
    np.fill_diagonal(lag, 1.0)
    ln = 2.0 * np.log(lag)
    kr = k * chord
    i0, i1 = special.i0(kr), special.i1(kr)
    smooth = special.k0(kr) + 0.5 * i0 * ln
    layer, slope = -0.5 * i0, 0.5 * kr * i1
    rest = kr * special.k1(kr) - slope * ln
    diagonal = np.arange(n)
    smooth[diagonal, diagonal] = -np.log(0.5 * k * a * rim.speed) - np.euler_gamma
    layer[diagonal, diagonal], slope[diagonal, diagonal], rest[diagonal, diagonal] = -0.5, 0.0, 1.0
    arc = a * rim.speed
    single = (weight * layer + even * smooth) * arc / (2.0 * math.pi)
    normal = -(weight * slope + even * rest) * arc / (4.0 * math.pi * a) + 0.5 * np.eye(n)
    # Harmonic inside: d = -1/2pi int ln|2 sin| s0 + c with no net s0; its slope is s0/2.
    ratio = np.log(2.0 * np.abs(half) / lag)
    ratio[diagonal, diagonal] = np.log(rim.speed)
    system = np.zeros((n + 1, n + 1))
    system[:n, :n] = -(0.5 * weight + even * ratio) * arc / (2.0 * math.pi)
    system[:n, n] = 1.0
    system[n, :n] = arc
    harmonic = np.linalg.solve(system, np.vstack([single, np.zeros(n)]))[:n]
    # With the trapezoid's weight 2 pi/n and the arc length in, the charge of each point.
    return single, (normal - 0.5 * harmonic) * (arc * even)[:, None] / rs


def _green(sheet: SectorSheet, upper: float, lower: float, one: _Rim, other: _Rim) -> Floats:
    """Return Ru G_u + Rl G_l from the charge of each point of the other rim to each of one."""
    length, breadth = sheet.length, sheet.breadth
    along_x = breadth <= length
    k = math.pi / min(length, breadth)
    sigma = k * max(length, breadth)
    ra, rb = (lower, upper) if along_x else (upper, lower)

    def place(rim: _Rim) -> tuple[Any, ...]:
        both = (rim.x, rim.x_far), (rim.y, rim.y_far)
        (s, s_far), (p, p_far) = both if along_x else both[::-1]
        return k * s, k * s_far, k * p, k * p_far

    s1, f1, p1, e1 = (v[:, None] for v in place(one))
    s2, f2, p2, e2 = (v[None, :] for v in place(other))
    offset = np.asarray(k * (one.offset[:, None] - other.offset[None, :])) if one is other else None
    ds = s1 - s2 if offset is None else (offset.real if along_x else offset.imag)
    dp = p1 - p2 if offset is None else (offset.imag if along_x else offset.real)
    minus = np.sin(0.5 * dp) ** 2
    # p + p' from whichever edge is nearer.
    plus = np.sin(0.5 * np.where(p1 + p2 < math.pi, p1 + p2, e1 + e2)) ** 2

    def f(s: Any, sine: Any) -> Any:
        e = np.exp(-np.abs(s))
        return np.log(np.expm1(-np.abs(s)) ** 2 + 4.0 * e * sine)

    n = one.theta.size
    if one is other:
        index = np.arange(n)
        minus[index, index] = 0.25  # replaced below
        direct = f(ds, minus)
        lag = np.abs(2.0 * np.sin(0.5 * (one.t[:, None] - one.t[None, :])))
        lag[index, index] = 1.0
        direct -= 2.0 * np.log(lag)
        direct[index, index] = 2.0 * np.log(k * one.slope)
        minus[index, index] = 0.0
    else:
        direct = f(ds, minus)
    g_minus, g_plus = direct, f(ds, plus)  # images along s with the same sign (Neumann ends)
    total_a = g_minus - g_plus
    total_b = g_minus + g_plus
    count = next(i for i in range(1, 20) if (2 * i - 1) * sigma > 40.0)
    for turn in range(0, count + 1):
        for image, sign in ((2 * turn * sigma + s1 + s2, -1.0), (2 * turn * sigma + f1 + f2, -1.0)):
            a, b = f(image, minus), f(image, plus)
            total_a = total_a + (a - b)
            total_b = total_b + sign * (a + b)
        if turn:
            for image in (2 * turn * sigma + ds, 2 * turn * sigma - ds):
                a, b = f(image, minus), f(image, plus)
                total_a = total_a + (a - b)
                total_b = total_b + (a + b)
    linear = np.where(s1 < s2, s1 * f2, s2 * f1) / (math.pi * sigma)
    out = -(ra * total_a + rb * total_b) / (4.0 * math.pi) + rb * linear
    if one is other:
        out -= (ra + rb) / (4.0 * math.pi) * _kress(n) * (n / (2.0 * math.pi))
    return np.asarray(out)
