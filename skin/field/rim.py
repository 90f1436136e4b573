"""Discs whose rims all but touch the apex, solved on points of the rims instead of by multipoles.

Outside, a disc acts like a layer of charge (L_k - L_0) d / (Ru + Rl) on its rim, with L_k the map from the potential
on the rim to its normal derivative where lap d = k^2 d inside. Inside, d is the potential of a layer mu of
K_0(k r) / 2 pi. Both Green functions' logarithms are integrated by `_log_weights`. What L_k and L_0 have in
common is taken out by hand, so that a weak contact keeps its digits. Beside an edge or another disc, which lie along
the rim and are no point as the apex is, the multipoles' exact images do better.

The points crowd where a rim comes near the apex, an edge or another disc. Multipoles resolve every part of a rim alike,
so a gap of 1e-4 radii asks for 1e4 of them. Here t runs evenly, and is the mean of theta and of its images under maps
of the disc to itself, theta -> arg of (zeta - rho e^(i at)) / (1 - rho e^(-i at) zeta): each crowds its share of the
points at `at` on the scale 1 - rho. One map for every factor of 4 from the radius down to the gap resolves all scales;
all is analytic, so the error falls geometrically.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coneskin.core.arrays import Complex, Floats

from .circles import Centres, offsets_of, pair_points
from .disc import Discs
from .fourport import Coupling
from .green import Strip, kernel
from .one_scene import solution_change
from .sheet import SectorSheet

_SCALE_FACTOR = 4.0  # from one scale to the next
_MIN_SCALE = 1e-9  # scale, in radii; nearer than that a rim counts as touching


@dataclass(frozen=True, slots=True, eq=False)
class _RimPoints:
    """N points on each rim of one scene of k discs; lengths in the rectangle in units of (shorter side)/pi.

    Attributes:
        t: equidistant from 0 to 2 pi, shape (N,).
        theta: polar angle on the disc [rad], shape (k, N).
        speed: dtheta/dt, shape (k, N).
        offset: x + i y of the points from their centres, shape (1, k, N).
        slope: |d offset / dt|, shape (1, k, N).
        centres: of the rims.
    """

    t: Floats
    theta: Floats
    speed: Floats
    offset: Complex
    slope: Floats
    centres: Centres

    @classmethod
    def of(cls, sheet: SectorSheet, strip: Strip, discs: Discs, density: int) -> _RimPoints:
        """Make them for one scene, `density` (even) for each scale."""
        k = discs.u.shape[1]
        maps = [_maps(sheet, discs, i) for i in range(k)]
        n = density * (2 + max(len(m) for m in maps))
        t = 2.0 * math.pi * np.arange(n) / n
        theta, speed = (np.array(v) for v in zip(*(_crowd(t, m) for m in maps), strict=True))
        offset, slope = offsets_of(sheet, discs, np.exp(1j * theta)[None])
        return cls(t, theta, speed, offset * strip.scale, slope * strip.scale * speed, Centres.of(sheet, strip, discs))


def _maps(sheet: SectorSheet, discs: Discs, i: int) -> list[tuple[float, float]]:
    """Return (rho, at) of the maps that disc i needs."""
    u, phi, a = (float(v[0, i]) for v in (discs.u, discs.phi, discs.radius))
    kappa, h = sheet.curvature, float(sheet.stretch(u))
    near = [(u / a - 1.0, math.pi), ((sheet.width - u) / a - 1.0, 0.0)]
    if kappa != 0.0:
        near.append((h / (abs(kappa) * a) - 1.0, math.pi if kappa > 0.0 else 0.0))
    for y, side in ((sheet.arc * phi / sheet.wrap, -1.0), (sheet.arc * ((sheet.wrap - phi) / sheet.wrap), 1.0)):
        if abs(kappa * y) < 0.5 * math.pi:
            near.append((h * y * float(np.sinc(kappa * y / math.pi)) / a - 1.0, side * (0.5 * math.pi + kappa * y)))
    for j in range(discs.u.shape[1]):
        if j != i:
            to = complex(sheet.flat(discs.u[0, j], discs.phi[0, j], (u, phi)))
            near.append(((abs(to) - float(discs.radius[0, j])) / a - 1.0, math.atan2(to.imag, to.real)))
    out = []
    for gap, at in near:
        scale = 0.5
        while gap < 2.0 * scale and scale > _MIN_SCALE:
            out.append((1.0 - scale, at))
            scale /= _SCALE_FACTOR
    return out


def _crowd(t: Floats, maps: Sequence[tuple[float, float]]) -> tuple[Floats, Floats]:
    """Return theta(t) and dtheta/dt: Newton's method, kept within a bracket."""
    share = 1.0 / (2 + len(maps))

    def forward(theta: Floats) -> tuple[Floats, Floats]:
        total, slope = 2.0 * share * theta, np.full_like(theta, 2.0 * share)
        for rho, at in maps:
            angle = np.remainder(theta - at + math.pi, 2.0 * math.pi) - math.pi
            image = 2.0 * np.arctan((1.0 + rho) / (1.0 - rho) * np.tan(0.5 * angle))
            total += share * (theta - angle + image)
            slope += share * (1.0 - rho**2) / ((1.0 - rho) ** 2 + 4.0 * rho * np.sin(0.5 * angle) ** 2)
        return total, slope

    low, high, theta = np.full_like(t, -3.0 * math.pi), np.full_like(t, 5.0 * math.pi), t.copy()
    for _ in range(100):
        got, slope = forward(theta)
        above = got > t
        high, low = np.where(above, np.minimum(high, theta), high), np.where(above, low, np.maximum(low, theta))
        new = theta - (got - t) / slope
        new = np.where((new <= low) | (new >= high), 0.5 * (low + high), new)
        moved = float(np.abs(new - theta).max())
        theta = new
        if moved < 1e-15:
            break
    return theta, 1.0 / forward(theta)[1]


def _log_weights(n: int) -> Floats:
    """Return the weights of f at n points t' (even) in the integral of ln(4 sin^2((t - t')/2)) f(t') dt', shape (n, n).

    Kress, Linear integral equations, section 12.3: exact for trigonometric polynomials below n/2.
    """
    spectrum = np.zeros(n // 2 + 1)
    spectrum[1:] = -2.0 * math.pi / np.arange(1, n // 2 + 1)
    row = np.fft.irfft(spectrum, n)
    return np.asarray(row[(np.arange(n)[:, None] - np.arange(n)[None, :]) % n])


_POINT_DENSITIES = (16, 24, 36, 54)  # points for each scale; from change to change the error's rest is estimated
_MAX_POINTS = 2400  # unknowns, beyond which a solution takes more than seconds
_SERIES_BELOW = 2.0  # kr below which the Bessel functions' small parts come from their series
_LOGARITHM_WINDOW = 8.0  # kr beyond which the logarithm of K_0 is not split off: K_0 is smooth there, and I_0 large


def solve_rims(
    sheet: SectorSheet, upper_resistance: float, lower_resistance: float, discs: Discs, tolerance: float
) -> Coupling:
    """Solve one scene of k discs; sheet and resistances as of `FieldModel`.

    Args:
        discs: one scene, checked.
        tolerance: of the supply, at which to stop.

    Returns:
        the coupling; its error is above the tolerance, or not finite, where that could not be met.
    """
    units = (
        upper_resistance * sheet.length / sheet.breadth,
        math.sqrt(upper_resistance * lower_resistance),
        lower_resistance * sheet.breadth / sheet.length,
    )
    middle = sheet.along(discs.u)[0].mean() / sheet.length, (discs.phi / sheet.wrap).mean()
    best: tuple[float, ...] = ()
    before = error = math.inf
    for density in _POINT_DENSITIES:
        w = _solve(sheet, upper_resistance, lower_resistance, discs, density)
        if w is None:
            break
        g, x, y, *tensor = (float(v) for v in Coupling.of_matrix(w[None], np.zeros((1, 2))).numbers())
        got = g, x + float(middle[0]), y + float(middle[1]), *tensor
        if best:
            change = solution_change(got, best, units)
            # The rest of a geometric series, once it is known to be one.
            error = change if change > 0.1 * before or math.isinf(before) else 10.0 * change * change / before
            before = change
        best = got
        if error <= tolerance:
            break
    return Coupling(*np.array([*(best or (math.nan,) * 6), error]).reshape(7, 1))


def _solve(sheet: SectorSheet, upper: float, lower: float, discs: Discs, density: int) -> Floats | None:
    """Return W about the middle of the centres [S], shape (3, 3), or None where it would take too many points."""
    strip = Strip.of(sheet.length, sheet.breadth)
    rs = upper + lower
    k = discs.u.shape[1]
    decay = np.where(np.isfinite(discs.conductance), np.sqrt(discs.conductance * rs) * discs.radius, 0.0)[0]
    density *= math.ceil(max(1.0, float(decay.max()) / 3.0))
    points = _RimPoints.of(sheet, strip, discs, density)
    n = points.t.size
    if n * k > _MAX_POINTS:
        return None
    weights = _log_weights(n)
    matrix, charges, wanted = np.zeros((k, n, k, n)), [], np.empty((k, n, 3))
    x, y = sheet.along(discs.u)[0][0] / sheet.length, sheet.across(discs.phi)[0][0] / sheet.breadth
    offset = points.offset[0] / strip.scale
    for i in range(k):
        touching = float(discs.conductance[0, i])
        layer, charge = _inside(points, i, float(discs.radius[0, i]), math.sqrt(touching * rs), weights)
        charges.append(charge)
        wanted[i, :, 0] = 1.0
        wanted[i, :, 1] = x[i] - x.mean() + offset[i].real / sheet.length
        wanted[i, :, 2] = y[i] - y.mean() + offset[i].imag / sheet.breadth
        matrix[i, :, i, :] = layer
    a, b = (lower, upper) if strip.along_x else (upper, lower)
    for i in range(k):
        for j in range(k):
            matrix[i, :, j, :] += _green(strip, points, i, j, a / rs, b / rs, weights) @ charges[j]
    try:
        solved = np.linalg.solve(matrix.reshape(k * n, k * n), wanted.reshape(k * n, 3)).reshape(k, n, 3)
    except np.linalg.LinAlgError:
        return None
    w = sum(wanted[i].T @ (charges[i] @ solved[i]) for i in range(k)) / rs
    return np.asarray(0.5 * (w + w.T)) if np.isfinite(w).all() else None


def _green(strip: Strip, points: _RimPoints, i: int, j: int, a: float, b: float, weights: Floats) -> Floats:
    """Return Ra G_a + Rb G_b from the charge of each point of disc j to each point of disc i, shape (N, N)."""
    n = points.t.size
    first, second, weight_i, weight_j, centre = pair_points(
        strip, points.centres, points.offset.swapaxes(0, 1), i, j, a == b
    )
    if i == j:
        slope = points.slope[:, i] * np.abs(1.0 + first.direct)
        lag = _lag(points.t)
        values = kernel(strip, first, second, a, b, lag * lag, slope * slope)
        values -= (a + b) / (4.0 * math.pi) * (n / (2.0 * math.pi)) * weights
    else:
        values = kernel(strip, first, second, a, b)
    values += (b / math.pi) * (
        (weight_i[:, None] * first.s)[:, :, None]
        + (weight_j[:, None] * second.s)[:, None, :]
        - first.s[:, :, None] * second.s[:, None, :] / strip.sigma
        + centre[:, None, None]
    )
    return np.asarray(values[0])


def _lag(t: Floats) -> Floats:
    """Return |2 sin((t - t')/2)|, ones on the diagonal."""
    lag = np.abs(2.0 * np.sin(0.5 * (t[:, None] - t[None, :])))
    np.fill_diagonal(lag, 1.0)
    return lag


def _inside(points: _RimPoints, i: int, a: float, k: float, weights: Floats) -> tuple[Floats, Floats]:
    """Return d on the rim and the charge of each point times Ru + Rl, for each unit of the unknown layer.

    Args:
        points: the rims.
        i: the disc.
        a: its radius [m].
        k: of lap d = k^2 d inside [1/m]; inf is a perfect bond, where d = 0 and the charge itself is the unknown.
        weights: of `_log_weights`.
    """
    n = points.t.size
    if math.isinf(k):
        return np.zeros((n, n)), np.eye(n)
    theta, speed = points.theta[i], points.speed[i]
    step = 2.0 * math.pi / n
    chord = 2.0 * np.abs(np.sin(0.5 * (theta[:, None] - theta[None, :])))
    np.fill_diagonal(chord, 1.0)
    log_lag = 2.0 * np.log(_lag(points.t))
    ka = k * a
    i0, i1, r0, r1 = _small_parts(ka * chord)
    index = np.arange(n)
    # Each function of kr is (coefficient) ln(4 sin^2((t-t')/2)) + (smooth); on the diagonal both vanish.
    rest0, rest1 = r0 + 0.5 * i0 * log_lag, r1 - 0.5 * i1 * log_lag
    log = 2.0 * np.log(chord) - log_lag
    log[index, index] = 2.0 * np.log(speed)
    for array in (i0, i1, rest0, rest1):
        array[index, index] = 0.0
    # Arc lengths in units of the radius. K_0(kr) = -ln(kr/2) - gamma + r0, k r K_1(kr) = 1 + r1.
    harmonic = (-0.5 * weights - step * 0.5 * log) * speed / (2.0 * math.pi)
    grown = (-0.5 * weights * i0 + step * rest0) * speed / (2.0 * math.pi)
    slope = -(0.5 * weights * i1 + step * rest1) * speed / (4.0 * math.pi)
    mean = step * speed / (2.0 * math.pi)
    single = harmonic + grown - (math.log(0.5 * ka) + np.euler_gamma) * mean
    # L_0 of the part that the harmonic layer does not share with mu: no net charge, and a constant c.
    system = np.zeros((n + 1, n + 1))
    system[:n, :n], system[:n, n], system[n, :n] = harmonic, 1.0, mean
    apart = np.linalg.solve(system, np.vstack([grown, np.zeros(n)]))[:n]
    return single, (slope - 0.5 * apart) * (step * speed)[:, None]


def _small_parts(x: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return I_0(x) - 1 and x I_1(x), damped beyond the window, K_0 + ln(x/2) + gamma, and x K_1 - 1."""
    from scipy import special  # few touches are so near the apex, and its import takes longer than all the rest

    log = np.log(0.5 * x) + np.euler_gamma
    quarter = 0.25 * np.minimum(x, _SERIES_BELOW) ** 2
    term, harmonic = np.ones_like(x), 0.0
    i0, i1, p0, p1 = np.zeros_like(x), np.zeros_like(x), np.zeros_like(x), np.zeros_like(x)
    for j in range(1, 17):
        # term = (x/2)^(2j-2) / ((j-1)!)^2
        i1 += term / j
        p1 += term / j * (2.0 * harmonic + 1.0 / j)
        term = term * quarter / (j * j)
        harmonic += 1.0 / j
        i0 += term
        p0 += term * harmonic
    i1, p1 = 2.0 * quarter * i1, quarter * p1
    r0, r1 = p0 - log * i0, log * i1 - p1
    large = x > _SERIES_BELOW
    if large.any():
        far = x[large]
        r0[large] = special.k0(far) + log[large]
        r1[large] = far * special.k1(far) - 1.0
        window = np.exp(-((far / _LOGARITHM_WINDOW) ** 12)) if float(far.max()) > 2.0 * _LOGARITHM_WINDOW else 1.0
        i0[large] = special.ive(0, far) * np.exp(np.minimum(far, 600.0)) * window - 1.0
        i1[large] = far * special.ive(1, far) * np.exp(np.minimum(far, 600.0)) * window
    return i0, i1, r0, r1
